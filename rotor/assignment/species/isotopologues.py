"""Isotopologues of a species in natural abundance, from its constants and a geometry.

The constants of an isotopologue are those of the parent times the ratio from the geometry (`rotor.tops.isotopes`), in which errors of
the geometry cancel within some per mille. In this range, triples of the strongest lines are matched to peaks of the expected height; each
gives shifts of A, B, C, which are judged by all visible lines. Dipole, temperature and quartic constants are those of the parent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import Family
from rotor.assignment.search.rigid_table import RigidTable
from rotor.assignment.search.roots import Candidate, Field, alike
from rotor.assignment.species.grown import Grown
from rotor.assignment.species.growth import grow
from rotor.assignment.species.likelihood import Merged, merged_lines, predict, ratio_at
from rotor.molecules.molecule import Molecule
from rotor.tops.isotopes.isotopologues import isotopologues
from rotor.tops.top import Top
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2

SHIFT_ERROR = 0.03  # relative error of the shift of a constant, for bond lengths within 1 %
MOMENT_ERROR = 0.05  # u Å², of the change of a moment of inertia: 2 Δm r δr for 1 u at 1.5 Å, known to 0.016 Å
TYPICAL = 0.5  # typical deviation in units of these generous errors (0.35 in benchmarks/isotopologue_cases.py)
LEAST_ABUNDANCE = 1e-3
LOG_HEIGHT = 1.2  # range of trial peaks about the expected height
ROUGH_MHZ = 0.05  # standard error of lines because of the parent's distortion constants
MOST_LINES, MOST_OF_TRIPLES, TRIPLES, MOST_SHIFTS, GROWN = 30, 9, 84, 2000, 6
LEAST_OF_SHIFT = 3.0  # smallest ln of the likelihood ratio of a shift that is grown
SAME_SPECIES = 3e-5  # relative difference of constants of one species
ENOUGH = 8.0  # smallest evidence of a reported isotopologue; low, because its constants are nearly known


@dataclass(frozen=True, eq=False)
class Expected:
    """An expected isotopologue: name, constants (3,) in MHz with errors, abundance relative to the parent."""

    label: str
    constants: Floats
    errors: Floats
    abundance: float


def expected_isotopologues(parent: Floats, molecule: Molecule) -> list[Expected]:
    """Singly substituted species of a molecule at natural abundance, the most abundant first.

    Raises ValueError if the constants of the geometry differ from those of the parent by more than a fifth.
    """
    top = Top.from_molecule(molecule)
    computed = np.array([top.constants[name] for name in "ABC"]) if top.kind == "asymmetric" else np.zeros(3)
    # a geometry this far off belongs to another molecule
    if not computed.all() or np.abs(computed / parent[:3] - 1).max() > 0.2:
        raise ValueError(
            f"molecule: A, B, C of its geometry are {', '.join(f'{x:.1f}' for x in computed)} MHz, those of the species "
            f"{', '.join(f'{x:.1f}' for x in parent[:3])} MHz; a geometry of this molecule is needed"
        )
    out = []
    abundant = isotopologues(top, min_abundance=LEAST_ABUNDANCE)
    for isotopologue in abundant[1:]:
        if len(isotopologue.substituted) != 1:  # only single substitutions are looked for
            continue
        ratio = np.array([isotopologue.top.constants[name] for name in "ABC"]) / computed
        constants = parent[:3] * ratio
        errors = SHIFT_ERROR * np.abs(constants - parent[:3]) + constants**2 / ROTATIONAL_MHZ_U_ANGSTROM2 * MOMENT_ERROR
        out.append(Expected(isotopologue.label, constants, errors, isotopologue.abundance / abundant[0].abundance))
    return out


def find_isotopologues(
    peaks: PeakList, parent: Grown, expected: list[Expected], table: RigidTable, over: Callable[[], bool]
) -> list[tuple[Expected, Grown]]:
    """Isotopologues among peaks, by decreasing evidence.

    The windows of isotopologues overlap, so that the search for one may find the lines of another. The species are assigned to
    isotopologues so that the sum of squared deviations of A, B, C from the expected values, in units of their errors, is minimal.
    """
    from scipy.optimize import linear_sum_assignment

    species = list[Grown]()
    for isotopologue in expected:
        if over():
            break
        for grown in candidates(peaks, parent, isotopologue, table):
            same = [
                n for n, other in enumerate(species) if alike(grown.constants[:3], other.constants[:3], SAME_SPECIES)
            ]
            if not same:
                species.append(grown)
            elif grown.evidence > species[same[0]].evidence:
                species[same[0]] = grown
    if not species:
        return []
    score = np.array([[_score(isotopologue, each, parent) for each in species] for isotopologue in expected])
    pairs = [(expected[row], species[n], score[row, n]) for row, n in zip(*linear_sum_assignment(-score), strict=True)]
    return [
        (isotopologue, grown)
        for isotopologue, grown, value in sorted(pairs, key=lambda pair: -pair[1].evidence)
        if value > ENOUGH
    ]


def _score(expected: Expected, grown: Grown, parent: Grown) -> float:
    """Evidence minus half the squared deviation from the expected constants; 0 for a species that cannot be this isotopologue."""
    off = (grown.constants[:3] - expected.constants) / expected.errors
    # constants beyond four expected errors, or heights that do not suit the abundance
    if np.abs(off).max() > 4 or not _like(grown, parent.scales + np.log(expected.abundance)):
        return 0.0
    return float(grown.evidence - 0.5 * np.sum((off / TYPICAL) ** 2))


def candidates(peaks: PeakList, parent: Grown, expected: Expected, table: RigidTable) -> list[Grown]:
    """Significant species near the expected constants of an isotopologue."""
    bounds = Bounds(expected.constants - 3 * expected.errors, expected.constants + 3 * expected.errors)
    seen = Field(peaks, table, bounds, np.array([parent.temperature_k]), parent.constants, expected.errors)
    scales = parent.scales + np.log(expected.abundance)
    start = np.concatenate([expected.constants, parent.constants[3:]])
    lines = merged_lines(seen, start, predict(seen, start, parent.temperature_k), scales)
    visible = np.argsort(-lines.height, kind="stable")[:MOST_LINES]
    # lines just below the weakest peak may still be seen
    visible = visible[lines.height[visible] > peaks.log_threshold - 0.5]
    if len(visible) < 4:
        return []
    shifts = [
        (shift, three)
        for three in _triples(lines.slope[:, :3] * expected.errors, visible)
        for shift in _shifts(peaks, lines, three, expected)
    ]
    ratios = np.array([_ratio(peaks, lines, visible, shift) for shift, _ in shifts])
    grown, tried = list[Grown](), list[Floats]()
    for best in np.argsort(-ratios).tolist():
        shift, three = shifts[best]
        constants = expected.constants + shift
        if len(tried) >= GROWN or ratios[best] < LEAST_OF_SHIFT:
            break
        if any(alike(constants, other, SAME_SPECIES) for other in tried):
            continue
        tried.append(constants)
        family = Family(int(table.kind[lines.main[visible[0]]]), lines.main[three], lines.main[:0], 0.0)
        species = grow(seen, Candidate(constants, family, float(ratios[best]), parent.temperature_k))
        if species is not None and species.evidence > ENOUGH and _like(species, scales) and _within(species, bounds):
            grown.append(species)
    return grown


def _triples(slopes: Floats, visible: Ints) -> list[Ints]:
    """Triples of visible lines that determine the shifts of the constants; strong and independent triples first."""
    chosen = []
    for three in combinations(range(min(len(visible), MOST_OF_TRIPLES)), 3):
        rows = visible[list(three)]
        sizes = np.linalg.svd(slopes[rows], compute_uv=False)
        chosen.append((float(sizes[-1] / sizes[0]), rows))
    chosen.sort(key=lambda item: -item[0])
    return [three for _, three in chosen[:TRIPLES]]


def _shifts(peaks: PeakList, lines: Merged, three: Ints, expected: Expected) -> list[Floats]:
    """Shifts of A, B, C that put three lines on peaks of their height."""
    slopes = lines.slope[three, :3]
    # three expected errors, and a little for distortion
    reach = 3 * np.sqrt(((slopes * expected.errors) ** 2).sum(axis=1)) + 0.05
    near = []
    for n, line in enumerate(three.tolist()):
        first, last = np.searchsorted(peaks.frequency_mhz, lines.centre[line] + reach[n] * np.array([-1, 1]))
        rows = np.arange(first, last)
        fits = np.abs(peaks.log_intensity[rows] - lines.height[line]) < LOG_HEIGHT
        near.append(peaks.frequency_mhz[rows[fits]] - lines.centre[line])
    if not all(len(part) for part in near) or np.prod([len(part) for part in near]) > MOST_SHIFTS:
        return []
    moved = np.stack(np.meshgrid(*near, indexing="ij"), axis=-1).reshape(-1, 3)
    # three parallel lines determine no constants
    shift = np.linalg.solve(slopes, moved.T).T if abs(np.linalg.det(slopes)) > 1e-9 else np.zeros((0, 3))
    return list(shift[(np.abs(shift) < 3 * expected.errors).all(axis=1)])


def _ratio(peaks: PeakList, lines: Merged, visible: Ints, shift: Floats) -> float:
    """ln of the likelihood ratio of the visible lines at shifted constants."""
    centre = lines.centre[visible] + lines.slope[visible, :3] @ shift
    return ratio_at(peaks, centre, lines.height[visible], ROUGH_MHZ)


def _like(grown: Grown, scales: Floats) -> bool:
    """Whether the intensities agree with the abundance within a factor of three."""
    strongest = int(np.argmax(scales))
    # a factor of three of the expected heights
    return bool(abs(grown.scales[strongest] - scales[strongest]) < np.log(3.0))


def _within(grown: Grown, bounds: Bounds) -> bool:
    """Whether the constants are within the expected bounds."""
    margin = bounds.high - bounds.low
    return bool(
        (grown.constants[:3] > bounds.low - margin).all() and (grown.constants[:3] < bounds.high + margin).all()
    )
