"""Methyl groups of a geometry, their barriers from similar molecules, and the A - E splittings of lines that they lead to.

The barrier V3 follows from the atom that bears the group and its neighbours (`BARRIERS`). Each value is that of one molecule; other
molecules of the same kind agree within a factor of about 2 (unsafe ones: less well). The A - E splitting of lines scales about as
exp(-1.3 √(V3/F)): a barrier that is 50 % too high makes it four to ten times too small. For other groups, the free-rotor value F is
reported as an upper bound.

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

from collections import Counter
from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.molecules.molecule import Molecule
from rotor.units import MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

OFF_AXIS = 0.05  # sine of the angle above which an atom counts as off the axis of a methyl group
FLAT_DEGREES = 355.0  # sum of three angles above which a nitrogen counts as flat, here and for inversion
SIMILAR_ERROR = 0.35  # relative, half of ln 2: other molecules agree within a factor of about 2
UNSAFE_ERROR = 0.7  # of kinds whose barriers vary more
A_SPECIES, E_SPECIES = 0, 1  # σ
_WAVES = 16  # |k| of exp i(3k + σ)α: enough for |ρ| K up to 21 and V3 of a thousand F


@dataclass(frozen=True)
class InternalRotor:
    """One threefold group: F and V3 in MHz, ρ (3,) along a, b, c."""

    f_mhz: float
    barrier_mhz: float
    rho: tuple[float, float, float]


def rotor_of_moments(top_moment: float, cosines: Floats, moments: Floats, barrier_mhz: float) -> InternalRotor:
    """F = ħ²/2rI_α and ρ_g = λ_g I_α/I_g of a group from I_α, the cosines λ_g of its axis, and I_g (3,) of the whole molecule, u Å².

    >>> rotor_of_moments(3.0, np.array([1.0, 0, 0]), np.array([6.0, 50, 50]), 0.0).rho  # half of the molecule turns
    (0.5, 0.0, 0.0)
    """
    rho = cosines * top_moment / moments
    free = ROTATIONAL_MHZ_U_ANGSTROM2 / (top_moment * (1.0 - float(cosines @ rho)))
    return InternalRotor(free, barrier_mhz, (float(rho[0]), float(rho[1]), float(rho[2])))


@dataclass(frozen=True)
class Barrier:
    """V3 (cm⁻¹) of a kind of group, and the molecule of this value. safe: whether other molecules have it within a factor of about 2."""

    v3_cm: float
    molecule: str
    formula: str
    safe: bool = True

    def is_of(self, molecule: Molecule) -> bool:
        """Whether the value is that of this molecule: its formula without isotopes is the same."""
        return self.formula == _formula(molecule.symbols)

    def relative_error(self, molecule: Molecule) -> float:
        """One standard deviation for a molecule, relative to V3: 0 for that of the value, whose error is small beside all others."""
        return 0.0 if self.is_of(molecule) else SIMILAR_ERROR if self.safe else UNSAFE_ERROR

    def text(self, molecule: Molecule) -> str:
        """What the value is for a molecule, behind "V3 = ... is"."""
        if self.is_of(molecule):
            return f"that of {self.molecule}"
        spread = "within a factor of about 2" if self.safe else "unsafe: it varies much among such molecules"
        return f"that of a similar molecule ({self.molecule}), {spread}"


# by kind of group; the comment says where the value was read
BARRIERS = {
    # with ¹⁷O, 2 · 186.94207: Astron. Astrophys. 2024, aa51011-24, table A.1
    "CH3-O-H": Barrier(373.9, "methanol", "CH4O"),
    # Astron. Astrophys. 500 (2009) 1109, table 2
    "CH3-O-C=O": Barrier(370.9, "methyl formate", "C2H4O2"),
    # 2512 cal/mol: J. Mol. Struct. 32 (1976) 191, abstract
    "CH3-O-C": Barrier(879.0, "methyl propargyl ether", "C4H6O"),
    # from 0.653 cm⁻¹, the amplitude over K: Int. Symp. Mol. Spectrosc. 2016, hdl 2142/91207
    "CH3-S-H": Barrier(445.0, "methanethiol", "CH4S"),
    # Astron. Astrophys. 644 (2020) A102, abstract
    "CH3-S-C=O": Barrier(127.5, "S-methyl thioformate", "C2H4OS"),
    # 736.17 in Ar-(CH3)2S is 97.8 % of it: J. Mol. Spectrosc. 257 (2009) 11, abstract
    "CH3-S-C": Barrier(753.0, "dimethyl sulfide", "C2H6S"),
    # abstract of K. Takagi and T. Kojima, J. Phys. Soc. Japan, as paperexplained.cn has it
    "CH3-N": Barrier(691.0, "methylamine", "CH5N"),
    # Astron. Astrophys. 579 (2015) A46, table 1
    "CH3-C(=O)H": Barrier(407.6, "acetaldehyde", "C2H4O"),
    # 138.45 in its monohydrate is 18.7 % less: Int. Symp. Mol. Spectrosc. 63 (2008), abstract p101
    "CH3-C(=O)O": Barrier(170.0, "acetic acid", "C2H4O2"),
    # Phys. Chem. Chem. Phys. 2023, d2cp03897h, abstract
    "CH3-C(=O)C": Barrier(302.0, "2-acetyl-5-methylthiophene", "C7H8OS", safe=False),
    # NIST, Hydrocarbon Spectral Database, C3H6
    "CH3-C=C": Barrier(688.0, "propene", "C3H6"),
    # Astron. Astrophys. 619 (2018), aa33267-18, table A.2
    "CH3-C=C=": Barrier(429.0, "methyl ketene", "C3H4O"),
    # J. Mol. Spectrosc. 267 (2011) 186, abstract
    "CH3-C≡": Barrier(1.0, "2-butynoic acid", "C4H4O2"),
    # V6 = 4.88, 13.94 cal/mol: abstract of H. D. Rudolph et al. 1967
    "CH3- on a ring of 6": Barrier(0.0, "toluene", "C7H8", safe=False),
    # with 35 to 439 of others: scite.ai report on 2-methylthiazole
    "CH3- on a ring of 5": Barrier(248.0, "2,5-dimethylthiophene", "C6H8S", safe=False),
    # NIST, Hydrocarbon Spectral Database, C3H8
    "CH3-C sp3": Barrier(1108.0, "propane", "C3H8"),
}


@dataclass(frozen=True)
class MethylGroup:
    """A methyl group: F and ρ with V3 (0 if unknown), the barrier with its source, and the numbers of its hydrogens."""

    rotor: InternalRotor
    barrier: Barrier | None
    hydrogens: tuple[int, ...]


def methyl_groups(molecule: Molecule, bonds: Sequence[Ints]) -> list[MethylGroup]:
    """CH3 and CD3 with other atoms off their axis, so that they turn against the rest; groups of unlike hydrogens are left out."""
    from rotor.geometry.inertia import point_masses, principal_frame

    x, mass = molecule.positions_angstrom, molecule.masses_u
    frame, groups = principal_frame(point_masses(mass, x)), list[MethylGroup]()
    for carbon, near in enumerate(bonds):
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        if molecule.symbols[carbon] != "C" or len(hydrogens) != 3 or np.ptp(mass[hydrogens]):
            continue
        off = x[hydrogens] - x[hydrogens].mean(axis=0)
        axis = x[carbon] - x[hydrogens].mean(axis=0)
        if len(x) <= len(hydrogens) + 2 or not _any_off_axis(x, [carbon, *hydrogens], axis):
            continue
        axis /= np.linalg.norm(axis)
        off -= np.outer(off @ axis, axis)
        top_moment = float(mass[hydrogens] @ np.sum(off**2, axis=1))
        barrier = barrier_beside(molecule, bonds, carbon)
        height = 0.0 if barrier is None else barrier.v3_cm * MHZ_PER_CM
        rotor = rotor_of_moments(top_moment, frame.axes @ axis, frame.moments, height)
        groups.append(MethylGroup(rotor, barrier, tuple(hydrogens)))
    return groups


def barrier_beside(molecule: Molecule, bonds: Sequence[Ints], carbon: int) -> Barrier | None:
    """The barrier of a similar molecule, by the atom that bears the methyl group of a carbon."""
    symbols = molecule.symbols
    bearers = [i for i in bonds[carbon].tolist() if symbols[i] != "H"]
    if len(bearers) != 1:
        return None
    (bearer,) = bearers
    others = [i for i in bonds[bearer].tolist() if i != carbon]
    if symbols[bearer] == "C":
        return BARRIERS.get(_kind_beside_carbon(symbols, bonds, bearer, others))
    if symbols[bearer] == "N":
        pyramidal = len(others) == 2 and not is_flat(molecule.positions_angstrom, bearer, bonds[bearer])
        return BARRIERS["CH3-N"] if pyramidal else None
    if len(others) != 1:
        return None
    acyl = "=O" if symbols[others[0]] == "C" and _doubly_bonded_oxygen(symbols, bonds, others[0]) else ""
    return BARRIERS.get(f"CH3-{symbols[bearer]}-{symbols[others[0]]}{acyl}")


def _kind_beside_carbon(symbols: Sequence[str], bonds: Sequence[Ints], bearer: int, others: list[int]) -> str:
    """The kind of a methyl group beside a carbon, by the other neighbours of that carbon."""
    if len(others) != 2:
        return {1: "CH3-C≡", 3: "CH3-C sp3"}.get(len(others), "")
    if _doubly_bonded_oxygen(symbols, bonds, bearer):
        third = [symbols[i] for i in others if not (symbols[i] == "O" and len(bonds[i]) == 1)]
        return f"CH3-C(=O){''.join(third)}"
    if (size := _ring(bonds, bearer, others)) >= 5:
        return f"CH3- on a ring of {size}"
    if sorted(symbols[i] for i in others) not in (["C", "H"], ["C", "C"]):
        return ""
    cumulated = any(symbols[i] == "C" and len(bonds[i]) == 2 for i in others)
    return "CH3-C=C=" if cumulated else "CH3-C=C"


def _formula(symbols: Sequence[str]) -> str:
    """Formula without isotopes: C, H, and the others by the alphabet."""
    counts = Counter(symbols)
    order = sorted(counts, key=lambda symbol: ("CH".find(symbol) % 3, symbol))
    return "".join(f"{symbol}{counts[symbol] if counts[symbol] > 1 else ''}" for symbol in order)


def _doubly_bonded_oxygen(symbols: Sequence[str], bonds: Sequence[Ints], carbon: int) -> bool:
    """Whether a carbon with three neighbours has an oxygen with no other bond."""
    return len(bonds[carbon]) == 3 and any(symbols[i] == "O" and len(bonds[i]) == 1 for i in bonds[carbon].tolist())


def _ring(bonds: Sequence[Ints], atom: int, neighbours: list[int]) -> int:
    """Size of the smallest ring (at most six atoms) through an atom and two of its neighbours; 0 if there is none."""
    start, goal = neighbours
    seen, front = {atom, start}, {start}
    for size in range(3, 7):
        front = {j for i in front for j in bonds[i].tolist()} - seen
        if goal in front:
            return size
        seen |= front
    return 0


def is_flat(x: Floats, atom: int, near: Ints) -> bool:
    """Whether the three angles at an atom add up to nearly 360 degrees."""
    a, b, c = (v / np.linalg.norm(v) for v in x[near] - x[atom])
    cosines = np.clip([a @ b, b @ c, a @ c], -1.0, 1.0)
    return bool(np.degrees(np.arccos(cosines)).sum() >= FLAT_DEGREES)


def _any_off_axis(x: Floats, group: list[int], axis: Floats) -> bool:
    """Whether an atom outside the group lies off the axis through its first atom; tested in batches of bounded memory."""
    for start in range(0, len(x), 1000):
        rest = x[np.setdiff1d(np.arange(start, min(start + 1000, len(x))), group)] - x[group[0]]
        across = np.linalg.norm(np.cross(rest, axis), axis=1)
        if (across > OFF_AXIS * np.linalg.norm(rest, axis=1) * np.linalg.norm(axis)).any():
            return True
    return False


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


def line_shifts(constants_mhz: tuple[float, float, float], rotor: InternalRotor, j: int) -> tuple[Floats, Floats]:
    """E - A splittings (2J+1,) in MHz of the lines J+1 ← J with ΔKa = 0, ΔKc = 1, and of those with ΔKa = 1.

    >>> high = InternalRotor(150_000.0, 1e8, (0.1, 0.0, 0.0))
    >>> bool(np.abs(line_shifts((30_000.0, 9_000.0, 8_000.0), high, 3)[0]).max() < 1e-3)
    True
    """
    a, e = (
        [species_levels(constants_mhz, rotor, number, species) for number in (j, j + 1)]
        for species in (A_SPECIES, E_SPECIES)
    )
    lower, upper = e[0] - a[0], e[1] - a[1]
    return upper[: len(lower)] - lower, upper[2:] - lower
