"""Groups of lines that alone determine a constant: chance matches are left out, wrong places are left, right ones are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from assignment_cases import BAND, SECOND, lines_of

from rotor.assignment.confirmation import confirmed
from rotor.assignment.evidence import differs
from rotor.assignment.families import Bounds, Family
from rotor.assignment.growth import Grown, grow
from rotor.assignment.peaks import PeakList, peak_list
from rotor.assignment.rigid_table import JMAX, PARAMETERS, rigid_table
from rotor.assignment.search import Candidate, Field
from rotor.assignment.species import multiples

VALUES = np.array([SECOND[name] for name in PARAMETERS])
TABLE = rigid_table(JMAX)


def peaks_of(truth: dict[str, float], dipole: tuple[float, float, float], seed: int = 3) -> PeakList:
    """Lines with errors of 4 kHz among 60 foreign peaks."""
    rng = np.random.default_rng(seed)
    f, i = lines_of(truth, dipole, 100.0)
    strong = i > 3.0
    f = np.concatenate([f[strong] + 0.004 * rng.normal(size=strong.sum()), rng.uniform(*BAND, 60)])
    return peak_list(f, np.concatenate([i[strong], 3.0 * rng.random(60) ** (-1 / 0.8)]), 0.004, band_mhz=BAND)


def field_of(peaks: PeakList) -> Field:
    """The peaks with wide bounds and the temperature of the lines."""
    return Field(peaks, TABLE, Bounds(np.array([500.0, 200, 150]), np.array([2e4, 1.2e4, 9e3])), np.array([2.0]))


def grown_near(seen: Field, constants: np.ndarray) -> Grown:
    """A species grown from rigid constants and three lines of J = 6 - 5."""
    labels = [TABLE.label(row) for row in range(len(TABLE.upper))]
    lines = np.array([labels.index(text) for text in ("6 0 6 - 5 0 5", "6 1 6 - 5 1 5", "6 1 5 - 5 1 4")])
    grown = grow(seen, Candidate(constants, Family(0, lines, lines[:0], 0.0), 100.0, 2.0))
    assert grown is not None
    return grown


def highest_ka(grown: Grown) -> np.ndarray:
    """The larger Ka of each line."""
    return np.maximum(TABLE.quanta[TABLE.upper[grown.rows], 1], TABLE.quanta[TABLE.lower[grown.rows], 1])


@pytest.fixture(scope="module")
def right() -> tuple[Field, Grown]:
    """An a- and c-type species grown from its rigid constants."""
    seen = field_of(peaks_of(SECOND, (1.0, 0.0, 1.0)))
    return seen, grown_near(seen, VALUES[:3])


def test_a_right_species_keeps_its_lines(right: tuple[Field, Grown]) -> None:
    seen, grown = right
    checked = confirmed(seen, grown)
    assert checked.lines > 0.9 * grown.lines
    assert (np.abs(checked.constants - VALUES) < 5 * np.sqrt(np.diag(checked.covariance)))[:3].all()


def test_one_peak_does_not_determine_a_constant(right: tuple[Field, Grown]) -> None:
    """Of the lines with Ka of 3 and more only a foreign peak is there, at another DK: it is left out, and A is right within its error."""
    seen, grown = right
    least = 3
    high = np.unique(grown.peak[highest_ka(grown) >= least])
    kept = np.setdiff1d(np.arange(len(seen.peaks)), high)
    order = np.argsort(-seen.peaks.intensity[high])
    target = int(high[order[0]])
    f = np.append(seen.peaks.frequency_mhz[kept], seen.peaks.frequency_mhz[target] + 0.4)
    height = np.append(seen.peaks.intensity[kept], seen.peaks.intensity[target])
    poor = field_of(peak_list(f, height, 0.004, band_mhz=BAND))
    place = int(np.searchsorted(poor.peaks.frequency_mhz, f[-1]))
    peak = np.searchsorted(poor.peaks.frequency_mhz, seen.peaks.frequency_mhz[grown.peak])
    chosen = (highest_ka(grown) < least) | (grown.peak == target)
    peak = np.where(grown.peak == target, place, peak)
    wrong = replace(
        grown, rows=grown.rows[chosen], peak=peak[chosen], residual=np.where(grown.peak == target, 0.4, grown.residual)[chosen],
        share=grown.share[chosen], weight=grown.weight[chosen],
    )  # fmt: skip
    assert place in wrong.peak
    checked = confirmed(poor, wrong)
    assert place not in checked.peak
    errors = np.sqrt(np.diag(checked.covariance))
    assert (np.abs(checked.constants - VALUES) < 5 * errors)[:3].all()


def test_multiples_of_j_are_fitted_to_the_lines() -> None:
    """A near-prolate top with twice B and C shares every second line; its multiple is the top of all lines."""
    truth = {"A": 5024.7, "B": 473.92, "C": 455.26, "DJ": 1e-5, "DJK": 1e-4, "DK": 3e-3, "d1": -5e-7, "d2": -1e-8}
    seen = field_of(peaks_of(truth, (1.0, 0.0, 0.0), 4))
    mean = (truth["B"] + truth["C"]) / 2
    double = np.array([2 * mean + (truth["A"] - mean) / 2, 2 * truth["B"], 2 * truth["C"]])
    alias = grown_near(seen, double)
    grown = [
        species for species in (grow(seen, candidate) for candidate in multiples(seen, alias)) if species is not None
    ]
    best = max(grown, key=lambda species: species.evidence)
    values = np.array([truth[name] for name in PARAMETERS])
    assert best.evidence > 2 * alias.evidence
    assert (np.abs(best.constants - values) < 5 * np.sqrt(np.diag(best.covariance)))[:3].all()


def test_twins_differ_by_more_than_their_errors(right: tuple[Field, Grown]) -> None:
    _, grown = right
    errors = np.sqrt(np.diag(grown.covariance))
    shift = np.array([0.0, 1.0, 0, 0, 0, 0, 0, 0])
    assert not differs(grown, replace(grown, constants=grown.constants + 3 * errors * shift))
    assert differs(grown, replace(grown, constants=grown.constants + 9 * errors * shift))
