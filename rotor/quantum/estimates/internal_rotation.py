"""Estimated A - E splittings of lines by internal rotation of one threefold group.

A group of C3v symmetry turns by α against the rest. With the moment I_α of the group about its axis, the cosines λ_g of this axis in
the principal frame and the moments I_g of the whole molecule, the kinetic energy ½ ωᵀIω + I_α α' λ·ω + ½ I_α α'² leads to

    H = A P_a² + B P_b² + C P_c² + F (p - ρ·P)² + V3/2 (1 - cos 3α),
    r = 1 - Σ_g λ_g² I_α/I_g,    F = ħ²/(2 r I_α),    ρ_g = λ_g I_α/I_g

(C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841, as cited by the reviews that were read; derived here). The levels are those of
`rotor.quantum.internal_rotation.model` with the lowest torsional state of each K alone. Neglected are excited torsional states, which
change A - E splittings of methyl formate by less than 1e-4 of their size, the dependence of A, B, C on α, and other groups.
docs/validation/estimates.md compares with measured lines.
"""

from __future__ import annotations

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.frozen import dataclass

A_SPECIES, E_SPECIES = 0, 1  # σ
_WAVES = 16  # |k| of exp i(3k + σ)α: enough for |ρ| K up to 21 and V3 of a thousand F


@dataclass(frozen=True)
class InternalRotor:
    """One threefold group: F and V3 in MHz, ρ (3,) along a, b, c."""

    f_mhz: float
    barrier_mhz: float
    rho: tuple[float, float, float]

    @property
    def reduced_barrier(self) -> float:
        """s = 4 V3/9F."""
        return 4 * self.barrier_mhz / (9 * self.f_mhz)


def rotor_of_moments(top_moment: float, cosines: Floats, moments: Floats, barrier_mhz: float) -> InternalRotor:
    """F = ħ²/2rI_α and ρ_g = λ_g I_α/I_g of a group from I_α, the cosines λ_g of its axis, and I_g (3,) of the whole molecule, u Å².

    >>> rotor_of_moments(3.0, np.array([1.0, 0, 0]), np.array([6.0, 50, 50]), 0.0).rho  # half of the molecule turns
    (0.5, 0.0, 0.0)
    """
    rho = cosines * top_moment / moments
    free = units.ROTATIONAL_MHZ_U_ANGSTROM2 / (top_moment * (1.0 - float(cosines @ rho)))
    return InternalRotor(free, barrier_mhz, (float(rho[0]), float(rho[1]), float(rho[2])))


def species_levels(constants_mhz: tuple[float, float, float], rotor: InternalRotor, j: int, species: int) -> Floats:
    """Energies (2J+1,) in MHz of one species of the torsional ground state, above the minimum of the potential.

    They are ordered by Ka, of each pair the lower level first.

    >>> levels = species_levels((9.0, 4.0, 3.0), InternalRotor(150_000.0, 1e7, (1e-9, 0.0, 0.0)), 1, A_SPECIES)
    >>> (levels - levels[0]).round(6).tolist()  # above 1(0,1): B - C of 1(1,1) with A - B
    [0.0, 5.0, 6.0]
    """
    # the package of internal rotation is loaded for tops that have one alone
    from rotor.quantum.internal_rotation.model import RamModel
    from rotor.quantum.internal_rotation.terms import Axes

    rotation = dict(zip("ABC", constants_mhz, strict=True))
    torsion = {"F": rotor.f_mhz, "rho": float(np.linalg.norm(rotor.rho)), "V3": rotor.barrier_mhz}
    model = RamModel(rotation | torsion, frame=Axes.along(rotor.rho))
    levels = model.blocks(species, j, jmin=j, count=1, waves=_WAVES).solve_once(model.coefficients, 0)
    return levels.energies[np.lexsort([-levels.quanta["kc"], levels.quanta["ka"]])]


@dataclass(frozen=True)
class LineShifts:
    """E - A splittings in MHz of lines J+1 ← J. same (2J+1,): ΔKa = 0, ΔKc = 1. other (2J+1,): ΔKa = 1."""

    same: Floats
    other: Floats


def line_shifts(constants_mhz: tuple[float, float, float], rotor: InternalRotor, j: int) -> LineShifts:
    """E - A splittings of the lines J+1 ← J.

    >>> high = InternalRotor(150_000.0, 1e8, (0.1, 0.0, 0.0))
    >>> bool(np.abs(line_shifts((30_000.0, 9_000.0, 8_000.0), high, 3).same).max() < 1e-3)
    True
    """
    same, other = [], []
    for species in (A_SPECIES, E_SPECIES):
        lower, upper = (species_levels(constants_mhz, rotor, number, species) for number in (j, j + 1))
        same.append(upper[: len(lower)] - lower)
        other.append(upper[2:] - lower)
    return LineShifts(same[1] - same[0], other[1] - other[0])
