"""The search: families of lines are matched to the strongest peaks, and the roots are ranked by a likelihood ratio.

At fixed κ the frequencies of a family's three lines are linear in ½(A+C) and ½(A-C). Two peaks determine both; the third line as a
function of κ then crosses a third peak at isolated roots. Roots whose predicted lines lie near peaks are ranked by the likelihood ratio
of their strongest lines (`rotor.assignment.species.evidence`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.search import _kernels
from rotor.assignment.search._sweep import sweep
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import SAME_PEAK_MHZ, Family
from rotor.assignment.search.rigid_table import MIXED, RigidTable

BIN_MHZ = 0.1
NEAR_MHZ = 0.5  # distance of a peak from a predicted line that counts as a hit: shifts by distortion and errors of the family's lines
CHANCE = 0.025  # share of the band that is near a peak; limits the number of peaks to match
RATIO = np.log(10.0)  # largest ratio of the intensities of a family's lines
ROUGH_MHZ = 0.25  # standard error of rigid lines when roots are ranked
# standard error of a rigid line over B, if larger: distortion shifts scale as E² B/ω², with E of some kT
SOFTNESS = 2e-4
SPREAD = 0.6  # standard deviation of ln intensity about the model: response of the instrument, saturation
DETECTED = 0.95  # probability that a line above the threshold is in the list
# grid points of κ between tests for a crossing; least number of tests if the bounds are narrow
STRIDE, FEWEST_POINTS = (
    4,
    12,
)
CHANCE_OF_FEW = 0.25
SAME = 3e-4  # relative difference below which roots are the same


class Candidate(NamedTuple):
    """A root: A, B, C in MHz, its family, ln of its likelihood ratio, and the best temperature."""

    constants: Floats
    family: Family
    ratio: float
    temperature_k: float


@dataclass(frozen=True, eq=False)
class Field:
    """The inputs of a search: peaks, the table, bounds of constants, trial temperatures.

    parent : constants (8,) of a species with similar distortion. spread : a-priori standard errors of A, B, C (3,), if known.
    chance_of_few : largest number of chance peaks in the window of a line while few lines are assigned
    """

    peaks: PeakList
    table: RigidTable
    bounds: Bounds
    temperatures: Floats
    parent: Floats | None = None
    spread: Floats | None = None
    chance_of_few: float = CHANCE_OF_FEW

    @cached_property
    def jj(self) -> Floats:
        """J(J+1) of the levels."""
        j = self.table.quanta[:, 0].astype(np.float64)
        return j * (j + 1)

    @cached_property
    def points(self) -> slice:
        """The part of the grid of κ within the bounds."""
        return self.bounds.points(self.table.kappa)

    @cached_property
    def energies(self) -> Floats:
        """E_κ of the levels at the points of κ (levels, points)."""
        return np.ascontiguousarray(self.table.reduced[self.points].T)

    @cached_property
    def order(self) -> Ints:  # stable: equal heights keep the order of frequency
        """Peaks by decreasing intensity."""
        return np.argsort(-self.peaks.intensity, kind="stable")

    @cached_property
    def near(self) -> NDArray[np.uint8]:
        """Distance from the centres of bins of the band to the nearest of the strongest peaks, in fifths of a bin, at most 255."""
        low, high = self.peaks.band_mhz
        most = max(30, int(CHANCE * (high - low) / (2 * NEAR_MHZ)))
        strongest = np.sort(self.peaks.frequency_mhz[self.order[:most]])
        centres = low + BIN_MHZ * (np.arange(int((high - low) / BIN_MHZ) + 2) + 0.5)
        right = np.clip(np.searchsorted(strongest, centres), 0, len(strongest) - 1)
        left = np.maximum(right - 1, 0)
        apart = np.minimum(np.abs(centres - strongest[left]), np.abs(centres - strongest[right]))
        # fifths of a bin in a byte; beyond 255 nothing is near
        return np.minimum(5 * apart / BIN_MHZ, 255).astype(np.uint8)

    def seeds(self, count: int) -> Ints:
        """The strongest peaks in order of frequency."""
        return np.sort(self.order[:count])


def search_roots(field: Field, family: Family, seeds: Ints, need: int) -> Floats:
    """Roots of a family (n, 5): hits, misses, A, B, C."""
    table = field.table
    # the line with the largest change of J first: two Q branches alone do not give ½(A+C)
    lines = family.lines[np.argsort(-np.abs(_jj_change(field, family.lines)), kind="stable")]
    upper, lower = table.upper[lines], table.lower[lines]
    further, below = table.upper[family.companions], table.lower[family.companions]
    energies, kappa = field.energies, table.kappa[field.points]
    out = np.empty((4000, 5))
    low, high = field.peaks.band_mhz
    count = sweep(
        energies[upper] - energies[lower], field.jj[upper] - field.jj[lower], kappa,
        np.ascontiguousarray((energies[further] - energies[below]).T), field.jj[further] - field.jj[below],
        field.peaks.frequency_mhz[seeds], field.peaks.log_intensity[seeds], field.near, low, high, BIN_MHZ, NEAR_MHZ, 2 * SOFTNESS, RATIO,
        field.bounds.array, need, min(STRIDE, max(1, len(kappa) // FEWEST_POINTS)), out,
    )  # fmt: skip
    return out[:count]


def alike(constants: Floats, others: Floats, share: float) -> bool:
    """Whether all constants differ by less than a share of them."""
    return all(abs(x - y) < share * y for x, y in zip(constants.tolist(), others.tolist(), strict=True))


def _jj_change(field: Field, lines: Ints) -> Floats:
    return np.asarray(field.jj[field.table.upper[lines]] - field.jj[field.table.lower[lines]])


def ranked(field: Field, family: Family, roots: Floats, least: float) -> list[Candidate]:
    """Candidates from the roots of a family with a ratio above `least`, best first, without duplicates."""
    if not len(roots):
        return []
    order = np.argsort(roots[:, 1] - 2 * roots[:, 0], kind="stable")[:300]  # stable; a miss costs half of a hit
    tops = np.ascontiguousarray(roots[order, 2:])
    ratios, temperatures = quick_ratios(field, tops, family.kind, least)
    out, left = list[Candidate](), np.argsort(-ratios)
    left = left[ratios[left] >= least]
    while len(left):
        best = left[0]
        out.append(Candidate(tops[best], family, float(ratios[best]), float(temperatures[best])))
        left = left[(np.abs(tops[left] - tops[best]) >= SAME * tops[best]).any(axis=1)]
    return out


def quick_ratios(field: Field, tops: Floats, kind: int, least: float = 0.0) -> tuple[Floats, Floats]:
    """ln of the likelihood ratios of rigid tops (n, 3) from lines of a type or of all, and the best temperatures.

    least : of a ratio of one type that matters; lower ones count as 0.
    """
    table, peaks = field.table, field.peaks
    lines = table.with_type(kind)
    ratios: tuple[Floats, Floats] = _kernels.quick_ratios(
        table.reduced, table.theta, field.jj, lines.upper, lines.lower, lines.kind, lines.strength, kind == MIXED, tops,
        field.temperatures, peaks.windows, ROUGH_MHZ, SOFTNESS, peaks.frequency_mhz, peaks.log_intensity, peaks.log_density,
        peaks.log_threshold, SPREAD, DETECTED, 40, SAME_PEAK_MHZ, least,
    )  # fmt: skip
    return ratios
