"""Groups of lines that alone determine a constant: chance matches are left out, wrong places are left, right ones are kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from assignment_cases import BAND, SECOND, lines_of

from rotor.assignment.peaks.peak_list import PeakList, peak_list
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import Family
from rotor.assignment.search.rigid_table import PARAMETERS, rigid_table
from rotor.assignment.search.roots import Candidate, Field
from rotor.assignment.species.confirmation import _line_scales, confirmed
from rotor.assignment.species.evidence import differs
from rotor.assignment.species.grown import Grown
from rotor.assignment.species.growth import grow, prior_weight, quartic_sizes
from rotor.assignment.species.likelihood import line_slopes, predict
from rotor.assignment.species.successive import multiples

PROLATE = {"A": 8636.7, "B": 703.9, "C": 650.8, "DJ": 3e-5, "DJK": 3e-4, "DK": 8e-3, "d1": -2e-6, "d2": -3e-7}

VALUES = np.array([SECOND[name] for name in PARAMETERS])


def peaks_of(
    truth: dict[str, float], dipole: tuple[float, float, float], seed: int = 3, least: float = 3.0
) -> PeakList:
    """Lines with errors of 4 kHz among 60 foreign peaks."""
    rng = np.random.default_rng(seed)
    f, i = lines_of(truth, dipole, 100.0)
    strong = i > least
    f = np.concatenate([f[strong] + 0.004 * rng.normal(size=strong.sum()), rng.uniform(*BAND, 60)])
    return peak_list(f, np.concatenate([i[strong], least * rng.random(60) ** (-1 / 0.8)]), 0.004, band_mhz=BAND)


def field_of(peaks: PeakList) -> Field:
    """The peaks with wide bounds and the temperature of the lines."""
    return Field(
        peaks, rigid_table(), Bounds(np.array([500.0, 200, 150]), np.array([2e4, 1.2e4, 9e3])), np.array([2.0])
    )


def grown_near(seen: Field, constants: np.ndarray) -> Grown:
    """A species grown from rigid constants and three lines of J = 6 - 5."""
    table = rigid_table()
    labels = [table.label(row) for row in range(len(table.upper))]
    lines = np.array([labels.index(text) for text in ("6 0 6 - 5 0 5", "6 1 6 - 5 1 5", "6 1 5 - 5 1 4")])
    grown = grow(seen, Candidate(constants, Family(0, lines, lines[:0], 0.0), 100.0, 2.0))
    assert grown is not None
    return grown


def largest_ka(rows: np.ndarray) -> np.ndarray:
    """The larger Ka of each line."""
    table = rigid_table()
    return np.maximum(table.quanta[table.upper[rows], 1], table.quanta[table.lower[rows], 1])


def refitted(seen: Field, grown: Grown) -> Grown:
    """Least squares with all lines of a species and the a-priori errors of its constants."""
    slopes = line_slopes(seen, grown.rows, grown.constants)
    weight = grown.weight * grown.share
    prior = prior_weight(seen, grown.constants, quartic_sizes(grown.constants))
    covariance = np.linalg.inv(slopes.T @ (weight[:, None] * slopes) + prior)
    shift = covariance @ (slopes.T @ (weight * grown.residual))
    return replace(
        grown, constants=grown.constants + shift, covariance=covariance, residual=grown.residual - slopes @ shift
    )


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


def test_one_peak_does_not_determine_a_constant() -> None:
    """A foreign peak 3 MHz beside the strongest line of Ka = 2 - 1, which is too weak to be seen, gives a wrong DK; it is left out."""
    peaks = peaks_of(PROLATE, (0.7, 0.0, 1.0), least=25.0)
    values = np.array([PROLATE[name] for name in PARAMETERS])
    lines = predict(field_of(peaks), values, 2.0)
    second = np.where((largest_ka(lines.row) == 2) & (lines.kind == 2), lines.expected, -np.inf)
    strongest = int(np.argmax(second))
    f = np.append(peaks.frequency_mhz, lines.frequency[strongest] + 3.0)
    seen = field_of(peak_list(f, np.append(peaks.intensity, 25.0), 0.004, band_mhz=BAND))
    foreign = int(np.searchsorted(seen.peaks.frequency_mhz, f[-1]))
    first = np.flatnonzero(((largest_ka(lines.row) == 1) & (lines.kind == 2)) | (lines.kind == 0))
    near = np.abs(seen.peaks.frequency_mhz[:, None] - lines.frequency[first]).argmin(axis=0)
    apart = seen.peaks.frequency_mhz[near] - lines.frequency[first]
    matched = np.abs(apart) < 0.03
    rows, peak = np.append(lines.row[first[matched]], lines.row[strongest]), np.append(near[matched], foreign)
    ones, scales = (
        np.ones(len(rows)),
        np.array([-np.inf, -np.inf, np.log(100.0) - lines.expected[lines.kind == 2].max()]),
    )
    start = Candidate(values[:3], Family(2, rows[:3], rows[:0], 0.0), 100.0, 2.0)
    wrong = refitted(seen, Grown(
        values, np.eye(8), 2.0, np.array([0.0, 0.0, 100.0]), scales, rows, peak, np.append(apart[matched], 3.0), ones,
        ones / 0.004**2, 0.004, 100.0, start, len(rows),
    ))  # fmt: skip
    assert abs(wrong.constants[5] - values[5]) > 4 * np.sqrt(wrong.covariance[5, 5])  # DK is wrong and looks certain
    checked = confirmed(seen, wrong)
    assert foreign not in checked.peak
    assert (np.abs(checked.constants - values) < 5 * np.sqrt(np.diag(checked.covariance)))[:3].all()


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


def test_lines_of_a_type_without_evidence_determine_nothing(right: tuple[Field, Grown]) -> None:
    """Without evidence for the c type its lines go, and the error of A grows; their heights tell the scale by which they are looked for."""
    seen, grown = right
    absent = np.array([False, False, True])
    hidden = replace(grown, ratios=np.where(absent, 0.0, grown.ratios), scales=np.where(absent, -np.inf, grown.scales))
    scales = _line_scales(seen, hidden, predict(seen, hidden.constants, hidden.temperature_k))
    assert scales[2] == pytest.approx(grown.scales[2], abs=0.3)
    assert np.isneginf(scales[:2]).all()
    checked = confirmed(seen, hidden, all_types=True)
    assert (rigid_table().kind[hidden.rows] == 2).sum() > 5
    assert not (rigid_table().kind[checked.rows] == 2).any()
    assert (np.abs(checked.constants - VALUES) < 5 * np.sqrt(np.diag(checked.covariance)))[:3].all()
    assert checked.covariance[0, 0] > 4 * grown.covariance[0, 0]
