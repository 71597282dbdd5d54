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
apart. tests/test_limits.py has I_red from the kinetic energy of the atoms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.molecules.molecule import FEW_ATOMS
from rotor.quantum.effect import EffectSize, QuantumEffect, effect_sizes
from rotor.quantum.estimates.beyond import Limit, known_couplings, next_order
from rotor.quantum.spins.splittings import Splitting, splitting_nuclei

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.quantum.effects.hyperfine import NuclearQuadrupole
    from rotor.tops.top import Top

VIBRATION_CM = 500.0  # a wavenumber of vibration, for distortion that was not computed
COMPUTE = "its constants are known, add the effects of spins"  # the command line names its option in place of this
CH_ANGSTROM, NEIGHBOUR_ANGSTROM = 1.3, 1.7  # bonds of hydrogen to carbon or nitrogen, and of nitrogen to heavier atoms
OFF_AXIS = 0.05  # sine of the angle from which an atom is off the axis of a methyl group
ELECTRON_SPIN = "electron spin"
OF_SPINS = frozenset({"nuclear quadrupole", "magnetic coupling of nuclear spins", ELECTRON_SPIN})
AMMONIA_MHZ = 24_000.0  # the splitting of NH3, see docs/limitations.md
FLAT_DEGREES = 355.0  # sum of the three angles at a nitrogen that is not pyramidal


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
    coupling = _quadrupole(splitting_nuclei(top))
    return () if coupling is None or coupling.name in {effect.name for effect in effects} else (coupling,)


def _quadrupole(nuclei: Sequence[Splitting]) -> NuclearQuadrupole | None:
    if not nuclei:
        return None
    from rotor.quantum.effects.hyperfine import NuclearQuadrupole
    from rotor.quantum.spins.terms import Spin

    values = {f"chi_aa({one.nucleus})": one.chi_mhz for one in nuclei}
    return NuclearQuadrupole(values, tuple(Spin(one.nucleus, round(2 * one.spin)) for one in nuclei))


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
    return largest_first(found)


def every_limit(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """`model_limits` with what the constants themselves say, however small it is (`rotor.quantum.estimates.beyond`).

    Known couplings of spins take the place of estimated ones.
    """
    couplings, further = known_couplings(top, j, effects), next_order(top, j, effects)
    known = {one.name for one in couplings}
    found = [*couplings, *(one for one in model_limits(top, j, effects) if one.name not in known)]
    return largest_first(found if further is None else [*found, further])


def largest_first(limits: Sequence[Limit]) -> list[Limit]:
    """Limits by their size; those not estimated last, but electron spin first."""
    return sorted(limits, key=_rank)


def _rank(limit: Limit) -> float:
    """Smaller for what comes first."""
    if limit.size_mhz is None:
        return -math.inf if limit.name == ELECTRON_SPIN else 0.0
    return -limit.size_mhz


def limit_facts(top: Top, j: int, effects: Sequence[QuantumEffect], further: Sequence[Limit] = ()) -> dict[str, Any]:
    """Sizes of effects and what is left out at one J, by the keys of docs/command_line.md.

    Parameters
    ----------
    top : Top
    j : int
        At which sizes are estimated.
    effects : sequence of QuantumEffect
        Those of the calculation.
    further : sequence of Limit
        What else it leaves out.

    Returns
    -------
    dict
    """
    return {
        "sizes_at_j": j,
        "effects": [size._asdict() for size in model_sizes(top, j, effects)],
        "limits": [asdict(limit) for limit in largest_first([*model_limits(top, j, effects), *further])],
        "splitting_nuclei": [asdict(one) for one in splitting_nuclei(top)],
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
    found = []
    if absent_effects(top, effects):
        nuclei = splitting_nuclei(top)
        size = max(one.splitting_mhz if one.known else abs(one.chi_mhz) for one in nuclei)
        found.append(Limit("nuclear quadrupole", size, _split_text(nuclei)))
    if top.molecule is None:
        return found
    magnetic = sorted({one.label for one in top.molecule.nuclei if one.spin > 0})
    if magnetic and not {"spin-rotation", "spin-spin"} & {effect.name for effect in effects}:
        found.append(Limit("magnetic coupling of nuclear spins", None, f"{', '.join(magnetic)}: small splittings"))
    return found


def _split_text(nuclei: Sequence[Splitting]) -> str:
    """Which nuclei split lines, by how much where it is known, and what to do."""
    known = [f"{one.nucleus} splits J = 1 by {one.splitting_mhz:.3g} MHz" for one in nuclei if one.known]
    others = sorted({one.nucleus for one in nuclei if not one.known})
    texts = [f"{', '.join(known)}: {COMPUTE}"] if known else []
    if others:
        texts.append(
            f"{', '.join(others)} split{'s' if len(others) == 1 else ''} lines of low J; an order of magnitude"
        )
    return "; ".join(texts)


def _of_geometry(top: Top, molecule: Molecule, present: set[str]) -> list[Limit]:
    """Motions of large amplitude, and unpaired electrons, that the geometry shows."""
    found, bonds = [], _neighbours(molecule)
    if tops := _internal_rotors(molecule, bonds):
        what = "a methyl group turns" if len(tops) == 1 else f"{len(tops)} methyl groups turn"
        text = f"{what} against the rest: lines of A and of E species are apart, by less the higher the barrier"
        found.append(Limit("internal rotation", max(tops), text, at_most=True))
    if _pyramidal_nitrogens(molecule, bonds) and "interacting states" not in present:
        text = "nitrogen is pyramidal: its levels are pairs that this leaves out; the size is ammonia's, heavier groups have less"
        found.append(Limit("inversion", AMMONIA_MHZ, text, at_most=True))
    electrons = sum(one.element_number for one in molecule.nuclei) - molecule.charge
    if (electrons % 2 or molecule.electronic == "odd") and "spin-rotation" not in present:
        found.append(Limit(ELECTRON_SPIN, None, "the molecule has unpaired electrons: levels and lines are multiplets"))
    return found


def _neighbours(molecule: Molecule) -> list[Ints]:
    """Atoms bonded to each atom, by distance alone: hydrogen within 1.3 Å, others within 1.7 Å."""
    x = molecule.positions_angstrom
    hydrogen = np.array([symbol == "H" for symbol in molecule.symbols])
    found: list[list[int]] = [[] for _ in x]
    pairs = _pairs_within(x, NEIGHBOUR_ANGSTROM)
    apart = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    reach = np.where(hydrogen[pairs].any(axis=1), CH_ANGSTROM, NEIGHBOUR_ANGSTROM)
    for first, second in pairs[apart < reach].tolist():
        found[first].append(second)
        found[second].append(first)
    return [np.array(sorted(near), dtype=np.int64) for near in found]


def _pairs_within(x: Floats, reach: float) -> Ints:
    """Pairs (m, 2) of points nearer than a reach, Å."""
    if len(x) > FEW_ATOMS:
        from scipy.spatial import cKDTree

        return np.asarray(cKDTree(x).query_pairs(reach, output_type="ndarray"), dtype=np.int64)
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    return np.argwhere(np.triu(apart < reach, k=1))


def _internal_rotors(molecule: Molecule, bonds: Sequence[Ints]) -> list[float]:
    """F in MHz of each methyl group whose turning is not that of the whole: other atoms lie off its axis."""
    found: list[tuple[Floats, list[int]]] = []
    x = molecule.positions_angstrom
    for carbon, near in enumerate(bonds):
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        if molecule.symbols[carbon] != "C" or len(hydrogens) != 3:
            continue
        axis = x[carbon] - x[hydrogens].mean(axis=0)
        if len(x) > len(hydrogens) + 2 and _any_off_axis(x, [carbon, *hydrogens], axis):
            found.append((axis / np.linalg.norm(axis), hydrogens))
    return _free_rotation_mhz(molecule, found)


def _free_rotation_mhz(molecule: Molecule, groups: Sequence[tuple[Floats, list[int]]]) -> list[float]:
    """F = ħ²/2 I_red in MHz of groups, each with its unit axis and its atoms off it."""
    if not groups:
        return []
    from rotor.geometry.inertia import point_masses, principal_frame

    x, mass = molecule.positions_angstrom, molecule.masses_u
    frame, found = principal_frame(point_masses(mass, x)), []
    for axis, atoms in groups:
        off = x[atoms] - x[atoms].mean(axis=0)
        off -= np.outer(off @ axis, axis)
        own = float(mass[atoms] @ np.sum(off**2, axis=1))
        share = own * float(np.sum((frame.axes @ axis) ** 2 / frame.moments))
        found.append(units.ROTATIONAL_MHZ_U_ANGSTROM2 / (own * (1.0 - share)))
    return found


def _any_off_axis(x: Floats, group: list[int], axis: Floats) -> bool:
    """Whether some atom that is not of the group lies off the axis through its first atom; a thousand atoms at a time."""
    for start in range(0, len(x), 1000):
        rest = np.setdiff1d(np.arange(start, min(start + 1000, len(x))), group)
        if len(rest) and (_sines(x[rest] - x[group[0]], axis) > OFF_AXIS).any():
            return True
    return False


def _sines(vectors: Floats, axis: Floats) -> Floats:
    """Sines of the angles (n,) of vectors (n, 3) with an axis (3,)."""
    lengths = np.linalg.norm(vectors, axis=1) * np.linalg.norm(axis)
    return np.asarray(np.linalg.norm(np.cross(vectors, axis), axis=1) / lengths)


def _pyramidal_nitrogens(molecule: Molecule, bonds: Sequence[Ints]) -> int:
    """Nitrogens with three neighbours, two of them hydrogens, that are not flat."""
    count, x = 0, molecule.positions_angstrom
    for atom, near in enumerate(bonds):
        hydrogens = sum(molecule.symbols[i] == "H" for i in near.tolist())
        if molecule.symbols[atom] != "N" or len(near) != 3 or hydrogens < 2:
            continue
        a, b, c = (v / np.linalg.norm(v) for v in x[near] - x[atom])
        angles = [math.degrees(math.acos(float(np.clip(u @ v, -1, 1)))) for u, v in ((a, b), (b, c), (a, c))]
        count += sum(angles) < FLAT_DEGREES
    return count
