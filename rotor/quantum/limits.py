"""What a model of rotation leaves out: each effect that a molecule shows signs of, with its size where one can be estimated.

| sign | effect | size |
|---|---|---|
| a nucleus of spin 1 or more | nuclear quadrupole coupling | 234.96 MHz/barn · |Q|: a field gradient of one atomic unit |
| constants of a geometry alone | error of the geometry, centrifugal distortion | δB/B · 2B(J+1); 4D(J+1)³, D = 4B³/ν² with ν = 500 cm⁻¹ |
| a methyl group beside atoms off its axis | internal rotation | at most F = ħ²/2 I_red, that of a free group |
| a pyramidal nitrogen with two hydrogens | inversion | at most about 24 GHz, that of ammonia |
| an odd number of electrons, an odd electronic state | electron spin | not estimated |
| nuclei with spin | spin-rotation and spin-spin coupling | not estimated |

D = 4B³/ν² holds exactly for a harmonic diatomic molecule (A. Kratzer, Z. Phys. 3 (1920) 289), for others in order of magnitude.
The unit of the field gradient is e/(4π ε0 a0³); gradients at nuclei of bonded atoms are of this order, several times as large at
heavy halogens. I_red = I_m (1 - I_m Σ_g λ_g²/I_g), I_m the moment of the methyl group about its axis and λ_g the cosines of this axis
in the principal frame: the energy F p² of a group that turns freely against the rest, whose levels m = 0 (A) and m = ±1 (E) are F
apart (C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.quantum.effect import EffectSize, QuantumEffect, effect_sizes

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.quantum.effects.hyperfine import NuclearQuadrupole
    from rotor.tops.top import Top

GRADIENT_MHZ_PER_BARN = (
    234.964778  # eQV/h of a field gradient V of one atomic unit; CODATA 2022, checked in tests/test_limits.py
)
VIBRATION_CM = 500.0  # a wavenumber of vibration, for distortion that was not computed
CH_ANGSTROM, NEIGHBOUR_ANGSTROM = 1.3, 1.7  # bonds of hydrogen to carbon or nitrogen, and of nitrogen to heavier atoms
OFF_AXIS = 0.05  # sine of the angle from which an atom is off the axis of a methyl group
ELECTRON_SPIN = "electron spin"
AMMONIA_MHZ = 24_000.0  # the splitting of NH3, see docs/limitations.md
FLAT_DEGREES = 355.0  # sum of the three angles at a nitrogen that is not pyramidal


@dataclass(frozen=True)
class Limit:
    """Something that a calculation leaves out. size_mhz: for a line at the J in question; None: not estimated.

    at_most: whether the size is the largest that it can have, not an estimate.
    """

    name: str
    size_mhz: float | None
    text: str
    at_most: bool = False

    @property
    def sentence(self) -> str:
        """Name, size and what it does, as a report prints them."""
        known = "not estimated" if self.size_mhz is None else f"about {float(f'{self.size_mhz:.1g}'):g} MHz"
        size = f"at most {known}" if self.at_most else known
        return f"{self.name}: {size}; {self.text}"


def populated_j(top: Top, temperature_k: float) -> int:
    """The J with most molecules at a temperature: √(kT/2B) - ½ of a linear top, √(kT/B) - ½ of others, B their mean B, C.

    >>> from rotor.tops.top import Top
    >>> populated_j(Top.from_constants("B=57635.968 MHz"), 300.0)
    7
    """
    _, b, c = top.rotational_constants_mhz
    ratio = temperature_k * units.MHZ_PER_K / ((b + c) / 2)
    return max(1, round(math.sqrt(ratio / 2 if top.kind == "linear" else ratio) - 0.5))


def model_sizes(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[EffectSize]:
    """The sizes of the effects of a calculation and of those that it leaves out, largest first, at one J."""
    return effect_sizes(top, j, effects, absent_effects(top, effects))


def absent_effects(top: Top, effects: Sequence[QuantumEffect]) -> tuple[QuantumEffect, ...]:
    """Effects that the molecule is known to have and the calculation has not, with estimated values."""
    present = {effect.name for effect in effects}
    coupling = None if top.molecule is None else estimated_quadrupole(top.molecule)
    return () if coupling is None or coupling.name in present else (coupling,)


def estimated_quadrupole(molecule: Molecule) -> NuclearQuadrupole | None:
    """Quadrupole coupling with a field gradient of one atomic unit at every nucleus that has a moment; None without any.

    >>> from rotor.molecules.molecule import Molecule
    >>> molecule = Molecule(("H", "C", "N"), [[0, 0, 0], [0, 0, 1.07], [0, 0, 2.22]])
    >>> {name: round(value, 1) for name, value in estimated_quadrupole(molecule).values.items()}
    {'chi_aa(14N)': 4.8}
    """
    moments = {one.label: one for one in molecule.nuclei if one.spin >= 1 and one.quadrupole_barn}
    if not moments:
        return None
    from rotor.quantum.effects.hyperfine import NuclearQuadrupole
    from rotor.quantum.spins import Spin

    values = {
        f"chi_aa({label})": GRADIENT_MHZ_PER_BARN * (one.quadrupole_barn or 0.0) for label, one in moments.items()
    }
    return NuclearQuadrupole(values, tuple(Spin(label, round(2 * one.spin)) for label, one in moments.items()))


def model_limits(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """What a calculation with these effects leaves out, largest first.

    Of what is not estimated, electron spin comes first, since it may be larger than all else, and the coupling of nuclear spins last.

    >>> from rotor.tops.top import Top
    >>> [limit.name for limit in model_limits(Top.from_constants("B=57.6 GHz"), 7, ())]
    ['centrifugal distortion']
    """
    present = {effect.name for effect in effects}
    found = [*_of_constants(top, j), *(_of_nuclei(top, j, effects))]
    if top.molecule is not None:
        found += _of_geometry(top, top.molecule, present)
    return sorted(found, key=_rank)


def _rank(limit: Limit) -> float:
    """Smaller for what comes first."""
    if limit.size_mhz is None:
        return -math.inf if limit.name == ELECTRON_SPIN else 0.0
    return -limit.size_mhz


def limit_facts(top: Top, j: int, effects: Sequence[QuantumEffect]) -> dict[str, Any]:
    """Sizes of effects and what is left out at one J, by the keys of docs/command_line.md."""
    return {
        "sizes_at_j": j,
        "effects": [size._asdict() for size in model_sizes(top, j, effects)],
        "limits": [asdict(limit) for limit in model_limits(top, j, effects)],
    }


def _of_constants(top: Top, j: int) -> list[Limit]:
    """The error of a geometry, and the distortion that rigid constants leave out."""
    found, b = [], _largest(top)
    rigid = not any(name not in "ABC" for name in top.constants.values)
    of_geometry = top.molecule is not None and top.source == top.molecule.source
    if of_geometry and top.molecule is not None and top.molecule.uncertainty:
        relative = top.molecule.uncertainty
        text = f"A, B, C follow from a geometry good to {100 * relative:.2g} %, and all frequencies with them"
        found.append(Limit("error of the geometry", relative * 2 * b * (j + 1), text))
    if rigid and top.kind != "spherical":
        d = 4 * b**3 / (VIBRATION_CM * units.MHZ_PER_CM) ** 2
        text = (
            f"the constants are rigid; with a vibration of {VIBRATION_CM:g} cm-1 a line of J = {j} is lower by so much"
        )
        found.append(Limit("centrifugal distortion", 4 * d * (j + 1) ** 3, text))
    return found


def _largest(top: Top) -> float:
    """B of a linear top, (B + C)/2 of others: what spaces the lines of neighbouring J."""
    _, b, c = top.rotational_constants_mhz
    return (b + c) / 2


def _of_nuclei(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """Couplings of nuclear spins that no effect of the calculation has."""
    if top.molecule is None:
        return []
    found = []
    for size in effect_sizes(top, j, (), absent_effects(top, effects)):
        labels = sorted({one.label for one in top.molecule.nuclei if one.spin >= 1 and one.quadrupole_barn})
        text = f"{', '.join(labels)} split{'s' if len(labels) == 1 else ''} lines of low J; an order of magnitude"
        found.append(Limit(size.name, size.size_mhz, text))
    magnetic = sorted({one.label for one in top.molecule.nuclei if one.spin > 0})
    if magnetic and not {"spin-rotation", "spin-spin"} & {effect.name for effect in effects}:
        found.append(Limit("magnetic coupling of nuclear spins", None, f"{', '.join(magnetic)}: small splittings"))
    return found


def _of_geometry(top: Top, molecule: Molecule, present: set[str]) -> list[Limit]:
    """Motions of large amplitude, and unpaired electrons, that the geometry tells of."""
    found = []
    if tops := _internal_rotors(molecule):
        what = "a methyl group turns" if len(tops) == 1 else f"{len(tops)} methyl groups turn"
        text = f"{what} against the rest: lines of A and of E species are apart, by less the higher the barrier"
        found.append(Limit("internal rotation", max(tops), text, at_most=True))
    if _pyramidal_nitrogens(molecule) and "interacting states" not in present:
        text = "nitrogen is pyramidal: its levels are pairs that this leaves out; the size is ammonia's, heavier groups have less"
        found.append(Limit("inversion", AMMONIA_MHZ, text, at_most=True))
    electrons = sum(one.element_number for one in molecule.nuclei) - molecule.charge
    if (electrons % 2 or molecule.electronic == "odd") and "spin-rotation" not in present:
        found.append(Limit(ELECTRON_SPIN, None, "the molecule has unpaired electrons: levels and lines are multiplets"))
    return found


def _neighbours(molecule: Molecule) -> list[Ints]:
    """Atoms bonded to each atom, by distance alone: hydrogen within 1.3 Å, others within 1.7 Å."""
    x = molecule.positions_angstrom
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    hydrogen = np.array([symbol == "H" for symbol in molecule.symbols])
    reach = np.where(hydrogen[:, None] | hydrogen[None], CH_ANGSTROM, NEIGHBOUR_ANGSTROM)
    return [np.flatnonzero((row < limit) & (row > 0)) for row, limit in zip(apart, reach, strict=True)]


def _internal_rotors(molecule: Molecule) -> list[float]:
    """F in MHz of each methyl group whose turning is not that of the whole: other atoms lie off its axis."""
    found, x, bonds = [], molecule.positions_angstrom, _neighbours(molecule)
    for carbon, near in enumerate(bonds):
        symbols = Counter(molecule.symbols[i] for i in near.tolist())
        if molecule.symbols[carbon] != "C" or symbols["H"] != 3:
            continue
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        rest = [i for i in range(len(x)) if i != carbon and i not in hydrogens]
        axis = x[carbon] - x[hydrogens].mean(axis=0)
        if len(rest) > 1 and (_sines(x[rest] - x[carbon], axis) > OFF_AXIS).any():
            found.append(_free_rotation_mhz(molecule, axis, hydrogens))
    return found


def _free_rotation_mhz(molecule: Molecule, axis: Floats, hydrogens: Sequence[int]) -> float:
    """F = ħ²/2 I_red as a frequency, of a group that turns about an axis."""
    from rotor.geometry.inertia import point_masses, principal_frame

    x, mass = molecule.positions_angstrom, molecule.masses_u
    along = axis / np.linalg.norm(axis)
    off = x[hydrogens] - x[hydrogens].mean(axis=0)
    off -= np.outer(off @ along, along)
    own = float(mass[hydrogens] @ np.sum(off**2, axis=1))
    frame = principal_frame(point_masses(mass, x))
    share = own * float(np.sum((frame.axes @ along) ** 2 / frame.moments))
    return units.ROTATIONAL_MHZ_U_ANGSTROM2 / (own * (1.0 - share))


def _sines(vectors: Floats, axis: Floats) -> Floats:
    """Sines of the angles (n,) of vectors (n, 3) with an axis (3,)."""
    lengths = np.linalg.norm(vectors, axis=1) * np.linalg.norm(axis)
    return np.asarray(np.linalg.norm(np.cross(vectors, axis), axis=1) / lengths)


def _pyramidal_nitrogens(molecule: Molecule) -> int:
    """Nitrogens with three neighbours, two of them hydrogens, that are not flat."""
    count, x = 0, molecule.positions_angstrom
    for atom, near in enumerate(_neighbours(molecule)):
        hydrogens = sum(molecule.symbols[i] == "H" for i in near.tolist())
        if molecule.symbols[atom] != "N" or len(near) != 3 or hydrogens < 2:
            continue
        a, b, c = (v / np.linalg.norm(v) for v in x[near] - x[atom])
        angles = [math.degrees(math.acos(float(np.clip(u @ v, -1, 1)))) for u, v in ((a, b), (b, c), (a, c))]
        count += sum(angles) < FLAT_DEGREES
    return count
