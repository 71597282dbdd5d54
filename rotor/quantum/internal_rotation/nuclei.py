"""Constants of nuclear spins beside internal rotation, each as a tensor of the rotation along the axes of ρ.

    H = Σ_i χ_i T²(u_i)·T²(I, I)/(2I(2I-1)) + Σ_i C_i Σ_gh (u_i)_gh ½{Φ_g, N_h}·I

with the matrix u_i that a constant multiplies, such as (aa) or (bb) - (cc), in the axes of A, B, C: those of ρ in the RAM, principal
axes, from which ρ lies at an angle, in the PAM. The torsional functions multiply each tensor by their overlaps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.basis.elements import Elements
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.levels import REPRESENTATION, turned_by
from rotor.quantum.operators.algebra import Operator, half_anticommutator
from rotor.quantum.operators.rotation import body_tensor, j_x, j_y, j_z
from rotor.quantum.spins.operators import Cosines, CosinesWithN
from rotor.quantum.spins.scheme import Spin, SpinTerm
from rotor.quantum.tensors import spherical_components

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

BY_ANGLE = "angle {}"  # name of the derivative of all tensors of a nucleus by the angle of ρ
# derivative of the turn from a towards b at angle 0
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


@dataclass(frozen=True, eq=False)
class NuclearConstant:
    """A constant of a nucleus: its name, the number of the nucleus in the order of coupling, and the matrix (3, 3) that it multiplies.

    rank: 2 of quadrupole coupling, 1 of spin-rotation. body: along the axes of A, B, C.
    """

    name: str
    nucleus: int
    rank: int
    body: Floats

    @property
    def spin_tensor(self) -> str:
        """Name of the spin's tensor: I, or Q = [I × I]² / 2I(2I-1)."""
        return "Q" if self.rank == 2 else "I"

    @property
    def leaves_plane(self) -> bool:
        """Whether a mirror ab changes the sign of the tensor."""
        return bool(self.body[:2, 2].any() or self.body[2, :2].any())

    def elements(self, functions: TorsionRotation, angle: float) -> Elements:
        """Reduced elements of the tensor; ρ lies at an angle (radians) from a towards b."""
        matrix = turned_by(self.body, angle)
        if self.rank == 2:
            parts = real_components(spherical_components(matrix, 2, REPRESENTATION))
            return functions.elements([[Product(body_tensor(parts))]], 2)
        return functions.elements([[Product(_spin_rotation(matrix))]], 1, time_odd=True)


@dataclass(frozen=True, eq=False)
class Nuclei:
    """Spins in the order of coupling, their constants, and the values of these in MHz."""

    spins: tuple[Spin, ...]
    constants: tuple[NuclearConstant, ...]
    values: Mapping[str, float]

    @property
    def sums(self) -> tuple[str, ...]:
        """The sums of angular momenta: f1, f2 ... f."""
        return (*(f"f{i}" for i in range(1, len(self.spins))), "f")

    @property
    def halves(self) -> frozenset[str]:
        """The sums that are half-integers."""
        twice = np.cumsum([spin.twice for spin in self.spins])
        return frozenset(name for name, total in zip(self.sums, twice.tolist(), strict=True) if total % 2)

    @property
    def twice_total(self) -> int:
        """Twice the sum of all spins."""
        return sum(spin.twice for spin in self.spins)

    def with_values(self, values: Mapping[str, float]) -> Nuclei:
        """These nuclei with other values of their constants."""
        return replace(self, values={name: values[name] for name in self.values})

    def with_slope_by_angle(self) -> Nuclei:
        """These nuclei with a further constant of value 0 for each tensor: its derivative by the angle of ρ."""
        sums: dict[tuple[int, int], Floats] = {}
        for constant in self.constants:
            key, body = (constant.nucleus, constant.rank), self.values[constant.name] * constant.body
            sums[key] = sums.get(key, np.zeros((3, 3))) + TURN @ body + body @ TURN.T
        slopes = [NuclearConstant(BY_ANGLE.format(key), *key, body) for key, body in sums.items() if body.any()]
        return replace(
            self,
            constants=(*self.constants, *slopes),
            values={**self.values, **{slope.name: 0.0 for slope in slopes}},
        )

    def in_plane(self) -> Nuclei:
        """These nuclei without constants that a mirror ab excludes; ValueError if such a constant has a value."""
        mirrored = tuple(constant for constant in self.constants if not constant.leaves_plane)
        for constant in self.constants:
            if constant.leaves_plane and self.values[constant.name]:
                raise ValueError(
                    f"{constant.name} beside internal rotation: the molecule has the plane ab as a mirror, which leaves components along "
                    "aa, bb, cc and ab; leave it out"
                )
        return replace(
            self, constants=mirrored, values={constant.name: self.values[constant.name] for constant in mirrored}
        )

    @classmethod
    def of(cls, top: Top, effects: Sequence[QuantumEffect]) -> Nuclei:
        """Nuclei and constants that the effects of nuclear spins declare.

        Raises ValueError for electron spins, total spins of like nuclei, and constants with powers of N.
        """
        spins: dict[str, Spin] = {}
        values: dict[str, float] = {}
        terms: list[SpinTerm] = []
        for effect in effects:
            spins |= {spin.name: spin for spin in effect.spins(top) if spin.name not in spins}
            terms += effect.spin_terms(top)
            values |= effect.parameters(top)
        for spin in spins.values():
            if spin.electron or spin.total:
                raise ValueError(
                    f"spin {spin.name} beside internal rotation: electrons and total spins are not supported; give single nuclei"
                )
        constants = tuple(_constant(term, list(spins)) for term in terms)
        return cls(tuple(spins.values()), constants, {constant.name: values[constant.name] for constant in constants})


def _constant(term: SpinTerm, spins: Sequence[str]) -> NuclearConstant:
    """Constant of a term of one nucleus; ValueError for any other term."""
    powers = term.n2 or term.nz2 or term.ns
    if not isinstance(term.rotor, Cosines | CosinesWithN) or powers or len(set(term.spins)) != 1:
        raise ValueError(
            f"{term.name} beside internal rotation: only quadrupole and spin-rotation tensors of one nucleus are supported"
        )
    body = term.factor * np.array(term.rotor.components, dtype=float)
    return NuclearConstant(term.name, spins.index(term.spins[0]), 2 if isinstance(term.rotor, Cosines) else 1, body)


def _spin_rotation(matrix: Floats) -> Operator:
    """Σ_ij C_ij ½{Φ_i, N_j} along a, b, c."""
    along = (j_z(), j_x(), j_y())
    unit = np.eye(3)
    terms = [
        float(matrix[i, k])
        * half_anticommutator(body_tensor(real_components(spherical_components(unit[i], 1, REPRESENTATION))), along[k])
        for i in range(3)
        for k in range(3)
        if matrix[i, k]
    ]
    return reduce(lambda x, y: x + y, terms, Operator())


def real_components(components: NDArray[Any]) -> NDArray[Any]:
    """Components as a real array if none has an imaginary part."""
    return components if np.abs(components.imag).max() else components.real
