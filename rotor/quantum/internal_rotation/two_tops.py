"""Two internal rotors in principal axes: products of their torsional functions for each K as a basis of the rotation.

    H = A Pa² + B Pb² + C Pc² + Σ_i [F_i π_i² + ½ V3_i (1 - cos 3α_i)] + F12 (π1 π2 + π2 π1) + ½ V12 (1 - cos 3α1)(1 - cos 3α2)
        + ½ V12s sin 3α1 sin 3α2,                                               π_i = p_i - ρ_i·P

in principal axes, z along a (H. Hartwig and H. Dreizler, Z. Naturforsch. 51a (1996) 923, for one frame of several tops). For each K the
torsion of top i with ρ_iz K is solved, and the products of lowest energy are retained. The components of ρ across z act between them.
Species are pairs (σ1, σ2); (-σ1, -σ2) has the same energies.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.internal_rotation.contracted import ContractedTorsion, Product, Torsion, contracted_torsion
from rotor.quantum.internal_rotation.exchange import TURNS, ExchangedTops, exchange_axis
from rotor.quantum.internal_rotation.frames import axis_of_angles
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.species import SpeciesBlocks
from rotor.quantum.internal_rotation.terms import products_of
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import j_x, j_y, j_z
from rotor.quantum.operators.torsion import cosine, p_alpha, sine
from rotor.quantum.torsion import TorsionalPotential
from rotor.tops.internal_rotation import DEFAULT_FUNCTIONS

AXES = (j_z(), j_x(), j_y())  # P along a, b, c
EACH = 9  # functions of each top from which products are formed
ALIKE = 1e-4  # largest difference of the directions (radian) and constants (relative) of equivalent tops: five digits of a file
IN_PLANE = 1e-12  # a smaller component of ρ across the plane ab is round-off
Pair = tuple[Operator | None, Operator | None]  # operators of both torsions
SPECIES = MappingProxyType({"AA": (0, 0), "AE": (0, 1), "EA": (1, 0), "EE": (1, 1), "EE*": (1, -1)})


@dataclass(frozen=True)
class InternalTop:
    """One of two tops: F, V3 and V6 in MHz, ρ along a, b, c."""

    f_mhz: float
    v3_mhz: float
    rho_abc: tuple[float, float, float]
    v6_mhz: float = 0.0

    @property
    def torsion(self) -> Torsion:
        """The torsional part, which is solved first for each K."""
        return Torsion(self.f_mhz, self.rho_abc[0], TorsionalPotential({3: self.v3_mhz, 6: self.v6_mhz}))


@dataclass(frozen=True, eq=False)
class ProductTorsion:
    """Products of contracted functions of two tops; retained: their pairs (t1, t2)."""

    first: ContractedTorsion
    second: ContractedTorsion
    retained: Ints

    @property
    def sigma(self) -> int:
        """0 where both species are 0, else 1: whether time reversal takes the species to itself."""
        return int(self.first.sigma != 0 or self.second.sigma != 0)

    @property
    def k_max(self) -> int:
        """The largest |K|."""
        return self.first.k_max

    @property
    def count(self) -> int:
        """Products for each K."""
        return len(self.retained)

    @property
    def is_near_free(self) -> bool:
        """Whether one of the tops turns nearly freely."""
        return self.first.is_near_free or self.second.is_near_free

    @cached_property
    def energies(self) -> Floats:
        """Sums of torsional energies (K, products)."""
        return np.asarray(self.first.energies[:, self.retained[:, 0]] + self.second.energies[:, self.retained[:, 1]])

    @cached_property
    def parity(self) -> Ints:
        """Sign of the products at K = 0 under reversal of both tops."""
        return np.asarray(self.first.parity[self.retained[:, 0]] * self.second.parity[self.retained[:, 1]])

    def tables(self, operator: Any, change: int) -> Floats:
        """⟨K + change, t'|o1 o2|K t⟩ as (K, t', t) of a pair of operators."""
        pair: Pair = (None, None) if operator is None else operator
        left, right = self.first.tables(pair[0], change), self.second.tables(pair[1], change)
        t1, t2 = self.retained[:, 0], self.retained[:, 1]
        return np.asarray(left[:, t1[:, None], t1] * right[:, t2[:, None], t2])


@dataclass(frozen=True)
class TwoTops:
    """Constants (MHz) of a molecule with two internal rotors: A, B, C and distortion in principal axes, both tops, and their coupling.

    axis: axis of the C2 rotation that exchanges equivalent tops; "" if they are not equivalent.
    """

    rotation: Mapping[str, float]
    tops: tuple[InternalTop, InternalTop]
    f12: float = 0.0
    v12: float = 0.0
    v12_sine: float = 0.0
    axis: str = ""
    angle: ClassVar[float] = 0.0  # of z from the axis a

    @property
    def species(self) -> Mapping[str, tuple[int, int]]:
        """(σ1, σ2) by name; each stands for (-σ1, -σ2) too, and AE for EA if the tops are equivalent."""
        return {name: sigma for name, sigma in SPECIES.items() if name != "EA" or not self.axis}

    @property
    def has_plane(self) -> bool:
        """Whether both ρ lie in the plane ab."""
        return not any(abs(top.rho_abc[2]) > IN_PLANE for top in self.tops)

    def ground_energies(self, species: tuple[int, int], k_max: int) -> Floats:
        """Energies (K,) of the lowest product for K from -k_max to k_max, MHz."""
        first, second = self._torsions(species, k_max, 1, 10)
        return np.asarray(first.energies[:, 0] + second.energies[:, 0])

    def _torsions(
        self, species: tuple[int, int], k_max: int, each: int, waves: int
    ) -> tuple[ContractedTorsion, ContractedTorsion]:
        """Contracted functions of both tops."""
        first, second = (
            contracted_torsion(top.torsion, sigma, k_max, each, waves)
            for top, sigma in zip(self.tops, species, strict=True)
        )
        return first, second

    def blocks(
        self,
        species: tuple[int, int],
        jmax: int,
        *,
        jmin: int = 0,
        count: int = DEFAULT_FUNCTIONS[2],
        each: int = EACH,
        waves: int = 10,
        needed: Ints | None = None,
    ) -> SpeciesBlocks:
        """The blocks of a species.

        Parameters
        ----------
        species : (int, int)
            σ of both tops: 0, 1 or -1.
        jmax, jmin : int
            Range of J.
        count : int, optional
            Products of torsional functions retained for each K, the lowest by energy.
        each : int, optional
            Functions of each top that products are made of.
        waves : int, optional
            k from -waves to waves of each top.
        needed : array of int, optional
            The J that are needed; by default all.

        Returns
        -------
        SpeciesBlocks
        """
        first, second = self._torsions(species, jmax, each, waves)
        exchanged = bool(self.axis) and species[0] == species[1]
        if exchanged:
            second = (
                first
                if self.axis == "a"
                else replace(first, energies=first.energies[::-1], vectors=first.vectors[::-1])
            )
        retained = _lowest(first.energies[jmax][:, None] + second.energies[jmax], count, exchanged)
        product: Any = ProductTorsion(first, second, retained)
        folded = species == (0, 0) and self.has_plane
        if exchanged:
            number = {pair: i for i, pair in enumerate(map(tuple, retained.tolist()))}
            partner = np.array([number[t2, t1] for t1, t2 in retained.tolist()])
            functions: TorsionRotation = ExchangedTops(product, jmin, jmax, folded, self.axis, partner)
        else:
            functions = TorsionRotation(product, jmin, jmax, folded)
        chosen = None if needed is None else np.isin(functions.labels["J"], needed)
        return SpeciesBlocks(functions, self.terms(species), chosen)

    def terms(self, species: tuple[int, int]) -> Mapping[str, tuple[Product, ...]]:
        """Sums of products by coefficient, in the order of `coefficients`."""
        p = [p_alpha(sigma) for sigma in species]
        along = self._along
        terms: dict[str, tuple[Product, ...]] = {name: products_of(name, 0) for name in self.rotation}
        for i, (top, sigma) in enumerate(zip(self.tops, species, strict=True)):
            square = p_alpha(sigma, 2)
            terms[f"F{i + 1}"] = (
                Product(UNIT, _at(i, square)), Product(-2.0 * along[i], _at(i, p[i])), Product(along[i] @ along[i]),
            )  # fmt: skip
            if not any(top.rho_abc):
                terms[f"F{i + 1}"] = (Product(UNIT, _at(i, square)),)
            for n in (3, 6):
                terms[f"V{n}_{i + 1}"] = (Product(UNIT, _at(i, 0.5 * (UNIT - cosine(n // 3)))),)
        hindering = UNIT - cosine(1)
        terms["F12"] = (
            Product(2.0 * UNIT, _both(p[0], p[1])), Product(-2.0 * along[1], _at(0, p[0])), Product(-2.0 * along[0], _at(1, p[1])),
            Product(2.0 * half_anticommutator(along[0], along[1])),
        )  # fmt: skip
        terms["V12"] = (Product(0.5 * UNIT, _both(hindering, hindering)),)
        real_sine = -1j * sine(1)
        terms["V12s"] = (Product(-0.5 * UNIT, _both(real_sine, real_sine)),)
        return terms

    @property
    def _along(self) -> list[Operator]:
        """ρ_i·P of both tops."""
        return [
            _sum([value * axis for value, axis in zip(top.rho_abc, AXES, strict=True) if value]) for top in self.tops
        ]

    def slopes_by_rho(self, species: tuple[int, int]) -> dict[str, list[Product]]:
        """∂H/∂ρ_ig = F_i (-2 p_i P_g + {ρ_i·P, P_g}) + F12 (-2 p_j P_g + {ρ_j·P, P_g}), by the names rho_1a, rho_1b, ...

        With a mirror plane ab the slopes along c vanish and are left out.
        """
        p, along, slopes = [p_alpha(sigma) for sigma in species], self._along, {}
        for i, top in enumerate(self.tops):
            for letter, axis in zip("abc", AXES[: 2 if self.has_plane else 3], strict=False):
                slopes[f"rho_{i + 1}{letter}"] = [
                    product
                    for factor, j in ((top.f_mhz, i), (self.f12, 1 - i))
                    for product in (
                        Product(-2.0 * factor * axis, _at(j, p[j])),
                        Product(2.0 * factor * half_anticommutator(along[j], axis)),
                    )
                ]
        return slopes

    @property
    def coefficients(self) -> Floats:
        """The values of the coefficients, MHz."""
        each = [value for top in self.tops for value in (top.f_mhz, top.v3_mhz, top.v6_mhz)]
        return np.array([*self.rotation.values(), *each, self.f12, self.v12, self.v12_sine])

    @property
    def values(self) -> dict[str, float]:
        """The coefficients by name."""
        return dict(zip(self.terms((0, 0)), self.coefficients.tolist(), strict=True))

    @property
    def jacobian(self) -> Floats:
        """∂(coefficients)/∂(values)."""
        return np.eye(len(self.coefficients))


def two_tops(rotation: Mapping[str, float], constants: Mapping[str, float]) -> TwoTops:
    """Model of two tops from F0, delta, epsilon and the barrier of each.

    With the unit vectors λ_i of the axes, B_g = A, B, C and F0_i = ħ²/2I_αi, eliminating the velocities from T gives

        ρ_i = (λ_ig B_g/F0_i),    F = M⁻¹,    M_ij = δ_ij/F0_i - Σ_g λ_ig λ_jg B_g/(F0_i F0_j),    T = Σ B_g P_g² + Σ_ij F_ij π_i π_j

    (derived from T = ½ω·Iω + Σ I_αi α'_i λ_i·ω + ½Σ I_αi α'_i²; for one top F = F0/(1 - Σ λ_g ρ_g), as `frames` has it).

    Parameters
    ----------
    rotation : mapping
        A, B, C and distortion in principal axes, MHz.
    constants : mapping
        F0_1, delta_1, V3_1, F0_2 ..., named as in `rotor.tops.internal_rotation`.

    Returns
    -------
    TwoTops

    Examples
    --------
    >>> tops = {"F0_1": 150e3, "delta_1": 0.5, "V3_1": 9e6, "F0_2": 150e3, "delta_2": 2.6, "V3_2": 9e6}
    >>> model = two_tops({"A": 9000.0, "B": 5000.0, "C": 3400.0}, tops)
    >>> round(model.tops[0].f_mhz), round(model.f12), round(model.tops[0].rho_abc[0], 6)
    (158782, -6183, 0.052655)
    """
    f, rho = torsional_kinetics(rotation, constants)
    first, second = (
        InternalTop(
            float(f[i, i]), constants[f"V3_{i + 1}"], (float(rho[i, 0]), float(rho[i, 1]), float(rho[i, 2])),
            constants.get(f"V6_{i + 1}", 0.0),
        )
        for i in (0, 1)
    )  # fmt: skip
    axis = _exchanging(first, second)
    if axis:
        turned = np.array(TURNS[axis]) * first.rho_abc
        second = replace(first, rho_abc=(float(turned[0]), float(turned[1]), float(turned[2])))
    between = float(f[0, 1]), constants.get("V12", 0.0), constants.get("V12s", 0.0)
    return TwoTops(rotation, (first, second), *between, axis)


def torsional_kinetics(rotation: Mapping[str, float], constants: Mapping[str, float]) -> tuple[Floats, Floats]:
    """F (2, 2) in MHz and ρ (2, 3) along a, b, c of two tops."""
    abc = np.array([rotation[name] for name in "ABC"])
    axes = np.array([axis_of_angles(constants[f"delta_{i}"], constants.get(f"epsilon_{i}", 0.0)) for i in (1, 2)])
    f0 = np.array([constants[f"F0_{i}"] for i in (1, 2)])
    return np.linalg.inv(np.diag(1 / f0) - (axes * abc) @ axes.T / np.outer(f0, f0)), axes * abc / f0[:, None]


def _exchanging(first: InternalTop, second: InternalTop) -> str:
    """The axis of the C2 rotation that exchanges tops of equal constants; "" if there is none."""
    numbers = [np.array([top.f_mhz, top.v3_mhz, top.v6_mhz]) for top in (first, second)]
    if np.abs(numbers[0] - numbers[1]).max() > ALIKE * np.abs(numbers[0]).max() or abs(
        first.v3_mhz - second.v3_mhz
    ) > ALIKE * abs(first.v3_mhz):
        return ""
    rho = [np.array(top.rho_abc) for top in (first, second)]
    size = float(np.linalg.norm(rho[0]))
    return exchange_axis(rho[0] / size, rho[1] / size, ALIKE) if size else ""


def _lowest(energies: Floats, count: int, exchanged: bool) -> Ints:
    """(t1, t2) of the lowest products (products, 2); equivalent tops retain the partner (t2, t1) of each."""
    pairs = np.column_stack(np.unravel_index(np.argsort(energies, axis=None, kind="stable"), energies.shape))
    retained = pairs[:count]
    if exchanged and tuple(retained[-1][::-1]) not in set(map(tuple, retained.tolist())):
        retained = np.vstack([retained, retained[-1][::-1]])
    return retained


def _sum(operators: list[Operator]) -> Operator:
    """Sum of operators."""
    return reduce(lambda x, y: x + y, operators, Operator())


def _at(top: int, operator: Operator) -> Any:
    """Pair of torsional operators: `operator` for one top, the unit operator for the other."""
    return (operator, None) if top == 0 else (None, operator)


def _both(first: Operator, second: Operator) -> Any:
    """Pair of torsional operators, one for each top."""
    return (first, second)
