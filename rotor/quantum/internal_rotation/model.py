"""Constants of a molecule with one internal rotor: coefficients of the Hamiltonian, among them F, -2Fρ and Fρ², and its blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.internal_rotation.contracted import WAVES, Product, Terms, Torsion, contracted_torsion
from rotor.quantum.internal_rotation.frames import torsional_kinetics
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.species import SpeciesHamiltonian
from rotor.quantum.internal_rotation.terms import PRINCIPAL, Axes, is_real, products_of, torsional_products
from rotor.tops.internal_rotation import BARRIERS

ANGLE_STEP = 1e-3  # radian; terms go with sines and cosines of up to six times the angle, so slopes are good to 1e-5
DEFAULT_COUNT = 9  # n_v; error 1 Hz for v_t = 0 at J = 25 of methanols and methyl formate


@dataclass(frozen=True)
class RamModel:
    """Constants in the rho-axis frame: MHz by name, rho without a unit. See `terms` for the names.

    values: A, B, C, F, rho and any others. frame: the rho-axis frame along the axes a, b, c of A, B, C and
    distortion; these axes themselves if the constants belong to the rho-axis frame.
    """

    values: Mapping[str, float]
    frame: Axes = PRINCIPAL
    # σ; E stands for ±1, of equal energies at ∓K
    species: ClassVar[Mapping[str, int]] = MappingProxyType({"A": 0, "E": 1})

    def __post_init__(self) -> None:
        missing = [name for name in ("A", "B", "C", "F", "rho") if name not in self.values]
        if missing:
            raise ValueError(
                f"internal rotation: {', '.join(missing)} missing; expected A, B, C, F, rho and a barrier V3"
            )
        if not self.values["F"] > 0:
            raise ValueError(f"F = {self.values['F']:g} MHz: expected a number above 0")
        object.__setattr__(
            self, "values", MappingProxyType({name: float(value) for name, value in self.values.items()})
        )

    @property
    def torsion(self) -> Torsion:
        """The torsional part, which is solved first for each K."""
        barriers = {int(name[1:]): value for name, value in self.values.items() if name in BARRIERS}
        return Torsion(self.values["F"], self.values["rho"], barriers)

    @property
    def linear_names(self) -> tuple[str, ...]:
        """The constants that are themselves coefficients of the Hamiltonian."""
        return tuple(name for name in self.values if name not in ("F", "rho"))

    def terms(self, sigma: int) -> Terms:
        """Operators by coefficient: the linear constants, then F, -2Fρ and Fρ²."""
        terms = {name: products_of(name, sigma, self.frame) for name in self.linear_names}
        return terms | torsional_products(sigma)

    def slope_by_tilt(self, towards: str, sigma: int) -> list[Product]:
        """∂H/∂angle of a turn of ρ towards x or y, at fixed F and |ρ|, as products, by central differences."""
        products = []
        for step in (ANGLE_STEP, -ANGLE_STEP):
            frame = self.frame.turned(towards, step)
            for name in self.linear_names:
                factor = self.values[name] / (2 * step)
                products += [
                    Product(factor * product.rotation, product.torsion) for product in products_of(name, sigma, frame)
                ]
        return products

    @property
    def coefficients(self) -> Floats:
        """The values of the coefficients, MHz."""
        f, rho = self.values["F"], self.values["rho"]
        return np.array([*(self.values[name] for name in self.linear_names), f, f * rho, f * rho**2])

    @property
    def jacobian(self) -> Floats:
        """∂(coefficients)/∂(constants), constants in the order of `values`."""
        f, rho, count = self.values["F"], self.values["rho"], len(self.linear_names)
        names = list(self.values)
        matrix = np.zeros((count + 3, len(names)))
        for row, name in enumerate(self.linear_names):
            matrix[row, names.index(name)] = 1.0
        matrix[count:, names.index("F")] = [1.0, rho, rho**2]
        matrix[count:, names.index("rho")] = [0.0, f, 2 * f * rho]
        return matrix

    def ground_energies(self, sigma: int, k_max: int) -> Floats:
        """Energies (K,) of the lowest torsional state for K from -k_max to k_max, MHz."""
        return np.asarray(contracted_torsion(self.torsion, sigma, k_max, 1).energies[:, 0])

    @property
    def has_plane(self) -> bool:
        """Whether H is real in |J K⟩|K t⟩: a plane that contains ρ is one of its symmetries, though perhaps no mirror of the molecule."""
        return bool(self.frame.normal) and all(
            is_real(name, self.frame) for name in self.linear_names if self.values[name]
        )

    @property
    def by_energy(self) -> bool:
        """Whether Ka and Kc are counted by energy because K along ρ cannot stand for Ka.

        ρ is then normal to a, or ⟨J K|H_rot|J K⟩ = ½(tr D - D_zz) J(J+1) + (3 D_zz - tr D) K²/2 does not rise with |K|.
        """
        abc = np.array([self.values[name] for name in "ABC"])
        along = float(self.frame.matrix[0] ** 2 @ abc)
        return not self.frame.rows[0][0] or 3 * along <= abc.sum()

    def blocks(
        self,
        sigma: int,
        jmax: int,
        *,
        jmin: int = 0,
        count: int = DEFAULT_COUNT,
        waves: int = WAVES,
        needed: Ints | None = None,
    ) -> SpeciesHamiltonian:
        """The blocks of one species, 0 for A and 1 for E, with J from `jmin` to `jmax` or, of these, the `needed` ones.

        count: n_v, torsional functions retained for each K. waves: k of the free functions runs from -waves to waves.
        """
        torsion = contracted_torsion(self.torsion, sigma, jmax, count, waves)
        functions = TorsionRotation(torsion, jmin, jmax, folded=sigma == 0 and self.has_plane)
        chosen: NDArray[np.bool_] | None = None if needed is None else np.isin(functions.labels["J"], needed)
        return SpeciesHamiltonian(functions, self.terms(sigma), chosen, self.frame.normal, self.by_energy)


def model_of_principal_axes(values: Mapping[str, float]) -> RamModel:
    """The model from A, B, C, distortion, F0, delta, epsilon (0 if missing), V3 ... in principal axes (PAM).

    >>> model = model_of_principal_axes({"A": 9e3, "B": 5e3, "C": 4e3, "F0": 157e3, "delta": 0.5, "V3": 1e7})
    >>> round(model.values["F"], 3), round(model.values["rho"], 8), np.arccos(model.frame.matrix[0, 0]).round(8).item()
    (165519.071, 0.05257323, 0.29466597)
    """
    others = {name: value for name, value in values.items() if name not in ("F0", "delta", "epsilon")}
    f, (rho,) = torsional_kinetics(values, values)
    return RamModel({**others, "F": f[0, 0], "rho": float(np.linalg.norm(rho))}, frame=Axes.along(rho))
