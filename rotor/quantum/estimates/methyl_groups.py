"""Methyl groups of a geometry, and their barriers from similar molecules.

The barrier V3 follows from the atom that bears the group and its neighbours. Each value is that of one molecule; other molecules of the
same kind agree within a factor of about 2 (marked ~: less well). The A - E splitting of lines scales about as exp(-1.3 √(V3/F)): a barrier
that is 50 % too high makes it four to ten times too small. For groups missing from the table, the free-rotor value F is reported as an
upper bound.

| group | V3, cm⁻¹ | of | where it was read |
|---|---|---|---|
| CH3-OH | 373.9 | methanol with ¹⁷O | 2 · 186.94207, Astron. Astrophys. 2024, aa51011-24, table A.1 |
| CH3-O-C=O | 370.9 | methyl formate | Astron. Astrophys. 500 (2009) 1109, table 2 |
| CH3-O- other | 879 | methyl propargyl ether | 2512 cal/mol, J. Mol. Struct. 32 (1976) 191, abstract |
| CH3-S-C=O | 127.5 | S-methyl thioformate | Astron. Astrophys. 644 (2020) A102, abstract |
| CH3-S-C other | 753 | dimethyl sulfide | 736.17 in Ar-(CH3)2S is 97.8 % of it, J. Mol. Spectrosc. 257 (2009) 11, abstract |
| CH3-SH | 445 | methanethiol | from 0.653 cm⁻¹, the amplitude over K, Int. Symp. Mol. Spectrosc. 2016, hdl 2142/91207 |
| CH3-NH2, amines | 691 | methylamine | abstract of K. Takagi and T. Kojima, J. Phys. Soc. Japan, as paperexplained.cn has it |
| CH3-CH=O | 407.6 | acetaldehyde | Astron. Astrophys. 579 (2015) A46, table 1 |
| CH3-C(=O)O | 170 | acetic acid | 138.45 in its monohydrate is 18.7 % less, Int. Symp. Mol. Spectrosc. 63 (2008), abstract p101 |
| CH3-C(=O)C ~ | 302 | 2-acetyl-5-methylthiophene | Phys. Chem. Chem. Phys. 2023, d2cp03897h, abstract |
| CH3-C=C | 688 | propene | NIST, Hydrocarbon Spectral Database, C3H6 |
| CH3-CH=C= | 429 | methyl ketene | Astron. Astrophys. 619 (2018), aa33267-18, table A.2 |
| CH3-C≡ | 1.0 | 2-butynoic acid | J. Mol. Spectrosc. 267 (2011) 186, abstract |
| CH3- on a ring of six ~ | 0 | toluene: V6 = 4.88, V3 = 0 | 13.94 cal/mol, abstract of H. D. Rudolph et al. 1967 |
| CH3- on a ring of five ~ | 248 | 2,5-dimethylthiophene | with 35 to 439 of others, scite.ai report on 2-methylthiazole |
| CH3-C sp³ | 1108 | propane | NIST, Hydrocarbon Spectral Database, C3H8 |
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.molecules.molecule import Molecule
from rotor.quantum.estimates.internal_rotation import InternalRotor, rotor_of_moments
from rotor.tops.internal_rotation import MOST_TOPS
from rotor.units import MHZ_PER_CM

OFF_AXIS = 0.05  # sine of the angle above which an atom counts as off the axis of a methyl group
FLAT_DEGREES = 355.0  # sum of three angles above which a nitrogen counts as flat, here and for inversion


SIMILAR_ERROR = 0.35  # relative, half of ln 2: other molecules agree within a factor of about 2
UNSAFE_ERROR = 0.7  # of kinds whose barriers vary more


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


@dataclass(frozen=True)
class MethylGroup:
    """A methyl group: F and ρ with V3 (0 if unknown), the barrier with its source, and the numbers of its hydrogens."""

    rotor: InternalRotor
    barrier: Barrier | None
    hydrogens: tuple[int, ...]


def methyl_groups(molecule: Molecule, bonds: Sequence[Ints]) -> list[MethylGroup]:
    """CH3 and CD3 with other atoms off their axis, so that they turn against the rest; groups of unlike hydrogens are left out."""
    x, mass = molecule.positions_angstrom, molecule.masses_u
    groups: list[tuple[int, list[int], Floats]] = []
    for carbon, near in enumerate(bonds):
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        if molecule.symbols[carbon] != "C" or len(hydrogens) != 3 or np.ptp(mass[hydrogens]):
            continue
        axis = x[carbon] - x[hydrogens].mean(axis=0)
        if len(x) > len(hydrogens) + 2 and _any_off_axis(x, [carbon, *hydrogens], axis):
            groups.append((carbon, hydrogens, axis / np.linalg.norm(axis)))
    return _with_moments(molecule, bonds, groups) if groups else []


def _with_moments(
    molecule: Molecule, bonds: Sequence[Ints], groups: Sequence[tuple[int, list[int], Floats]]
) -> list[MethylGroup]:
    """F, ρ and barrier of groups (carbon, hydrogens, axis)."""
    from rotor.geometry.inertia import point_masses, principal_frame

    x, mass = molecule.positions_angstrom, molecule.masses_u
    frame, methyls = principal_frame(point_masses(mass, x)), []
    for carbon, hydrogens, axis in groups:
        off = x[hydrogens] - x[hydrogens].mean(axis=0)
        off -= np.outer(off @ axis, axis)
        top_moment = float(mass[hydrogens] @ np.sum(off**2, axis=1))
        barrier = barrier_beside(molecule, bonds, carbon)
        height = 0.0 if barrier is None else barrier.v3_cm * MHZ_PER_CM
        methyls.append(
            MethylGroup(
                rotor_of_moments(top_moment, frame.axes @ axis, frame.moments, height), barrier, tuple(hydrogens)
            )
        )
    return methyls


def are_computed(groups: Sequence[MethylGroup]) -> bool:
    """Whether levels can be computed from the geometry: of up to three groups with barriers."""
    return len(groups) <= MOST_TOPS and all(group.rotor.barrier_mhz for group in groups)


def axes_of(groups: Sequence[MethylGroup], moments: Sequence[float]) -> Floats:
    """λ_g I_α (groups, 3) of the axes along a, b, c, from ρ_g = λ_g I_α/I_g and the moments I_g."""
    return np.array([group.rotor.rho for group in groups]) * moments


def barrier_beside(molecule: Molecule, bonds: Sequence[Ints], carbon: int) -> Barrier | None:
    """The barrier of a similar molecule, by the atom that bears the methyl group of a carbon."""
    symbols = molecule.symbols
    bearers = [i for i in bonds[carbon].tolist() if symbols[i] != "H"]
    if len(bearers) != 1:
        return None
    bearer = bearers[0]
    others = [i for i in bonds[bearer].tolist() if i != carbon]
    if symbols[bearer] == "C":
        return _beside_carbon(molecule, bonds, bearer, others)
    if symbols[bearer] in "OS" and len(others) == 1:
        return _beside_chalcogen(symbols, bonds, bearer, others[0])
    if symbols[bearer] == "N" and len(others) == 2 and not is_flat(molecule.positions_angstrom, bearer, bonds[bearer]):
        return Barrier(691.0, "methylamine", "CH5N")
    return None


def _beside_chalcogen(symbols: Sequence[str], bonds: Sequence[Ints], bearer: int, other: int) -> Barrier | None:
    """Barriers of alcohols, esters, ethers, thiols, thioesters and sulfides."""
    acyl = symbols[other] == "C" and _doubly_bonded_oxygen(symbols, bonds, other)
    if symbols[bearer] == "S":
        if symbols[other] != "C":
            return Barrier(445.0, "methanethiol", "CH4S") if symbols[other] == "H" else None
        return Barrier(127.5, "S-methyl thioformate", "C2H4OS") if acyl else Barrier(753.0, "dimethyl sulfide", "C2H6S")
    if symbols[other] == "H":
        return Barrier(373.9, "methanol", "CH4O")
    if symbols[other] != "C":
        return None
    return Barrier(370.9, "methyl formate", "C2H4O2") if acyl else Barrier(879.0, "methyl propargyl ether", "C4H6O")


def _beside_carbon(molecule: Molecule, bonds: Sequence[Ints], bearer: int, others: list[int]) -> Barrier | None:
    """Barriers beside a carbon, by its other neighbours."""
    symbols = molecule.symbols
    if len(others) == 3:
        return Barrier(1108.0, "propane", "C3H8")
    if len(others) == 1:
        return Barrier(1.0, "2-butynoic acid", "C4H4O2")
    if len(others) != 2:
        return None
    if _doubly_bonded_oxygen(symbols, bonds, bearer):
        return _beside_acyl([symbols[i] for i in others if not (symbols[i] == "O" and len(bonds[i]) == 1)])
    size = _ring(bonds, bearer, others)
    if size in (5, 6):
        return (
            Barrier(0.0, "toluene", "C7H8", False)
            if size == 6
            else Barrier(248.0, "2,5-dimethylthiophene", "C6H8S", False)
        )
    if sorted(symbols[i] for i in others) not in (["C", "H"], ["C", "C"]):
        return None
    cumulated = any(symbols[i] == "C" and len(bonds[i]) == 2 for i in others)
    return Barrier(429.0, "methyl ketene", "C3H4O") if cumulated else Barrier(688.0, "propene", "C3H6")


def _beside_acyl(others: list[str]) -> Barrier | None:
    """Barriers beside C=O, by the third neighbour of the carbon."""
    kinds = {"H": Barrier(407.6, "acetaldehyde", "C2H4O"), "O": Barrier(170.0, "acetic acid", "C2H4O2"),
             "C": Barrier(302.0, "2-acetyl-5-methylthiophene", "C7H8OS", False)}  # fmt: skip
    return kinds.get(others[0]) if len(others) == 1 else None


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
        rest = np.setdiff1d(np.arange(start, min(start + 1000, len(x))), group)
        if len(rest) and (_sines(x[rest] - x[group[0]], axis) > OFF_AXIS).any():
            return True
    return False


def _sines(vectors: Floats, axis: Floats) -> Floats:
    """Sines of the angles (n,) of vectors (n, 3) with an axis (3,)."""
    lengths = np.linalg.norm(vectors, axis=1) * np.linalg.norm(axis)
    return np.asarray(np.linalg.norm(np.cross(vectors, axis), axis=1) / lengths)
