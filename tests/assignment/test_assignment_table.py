"""The table of rigid tops and its compiled loops against `rotor.api.line_list` and `rotor.api.solve_levels`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor.assignment.peaks.peak_list import peak_list
from rotor.assignment.search import _kernels
from rotor.assignment.search.bounds import Bounds, sample_tops
from rotor.assignment.search.families import families
from rotor.assignment.search.rigid_table import JMAX, PARAMETERS, rigid_table
from rotor.assignment.search.roots import Field
from rotor.assignment.species.evidence import probability, word
from rotor.assignment.species.grown import FEWEST_MOVED, Grown
from rotor.assignment.species.likelihood import line_slopes, predict
from rotor.assignment.species.successive import _mirrored_row

TOPS = [
    (2458.69, 490.426, 408.870, 2.6e-5, 6.7e-5, 2.0e-3, -4.3e-6, -5.8e-7),  # κ = -0.92
    (8628.65, 457.5, 434.46, 2.0e-5, 3.0e-4, 9.0e-3, -1.0e-6, -2.0e-7),  # κ = -0.99
    (1327.89, 1062.97, 658.72, 5.0e-5, 1.0e-4, 1.0e-4, -1.0e-5, -3.0e-6),  # κ = 0.21
]


def field_of(low: float = 6000.0, high: float = 18000.0) -> Field:
    """A search with two peaks at the ends of a band."""
    peaks = peak_list([low, high], [1e-30, 1e-30], band_mhz=(low, high))
    bounds = Bounds(np.array([500.0, 200, 150]), np.array([2e4, 1.2e4, 9e3]))
    return Field(peaks, rigid_table(JMAX), bounds, np.array([2.0]))


@pytest.mark.parametrize("values", TOPS)
def test_lines_are_those_of_line_list(values: tuple[float, ...]) -> None:
    constants = dict(zip(PARAMETERS, values, strict=True))
    top = rotor.Top.from_constants(
        rotor.Constants(**constants, reduction="S", representation="Ir"), dipole_abc_debye=(1, 1, 1)
    )
    lines = rotor.api.line_list(top, temperature_k=2.0, jmax=JMAX, range_mhz=(6000, 18000), min_lgint=None)
    columns = lines.columns
    seen = field_of()
    prediction = predict(seen, np.array(values), 2.0, 4000)
    names = ("j_upper", "ka_upper", "kc_upper", "j_lower", "ka_lower", "kc_lower")
    known = {tuple(row): n for n, row in enumerate(np.column_stack([columns[name] for name in names]).tolist())}
    table = seen.table
    labels = np.column_stack(
        [table.quanta[table.upper[prediction.row]], table.quanta[table.lower[prediction.row]]]
    ).tolist()
    strongest = np.argsort(-prediction.expected)[:150]
    pairs = [(n, known[tuple(labels[n])]) for n in strongest.tolist()]
    mine, theirs = np.array(pairs).T
    # 20 kHz: interpolation, and distortion to first order alone; the widths of peaks are five times that
    np.testing.assert_allclose(prediction.frequency[mine], lines.frequency_mhz[theirs], atol=0.02)
    intensity = np.log(10.0) * columns["lgint"][theirs]
    difference = prediction.expected[mine] - intensity
    assert np.ptp(difference) < 0.2  # 1 - exp(-hν/kT) is taken to first order: 0.13 between 6 and 18 GHz at 2 K


def test_derivatives_are_differences() -> None:
    seen, values = field_of(), np.array(TOPS[0])
    lines = predict(seen, values, 2.0, 40)
    slopes = line_slopes(seen, lines.row, values)
    energy, moved = np.empty(len(seen.jj)), np.empty(len(seen.jj))
    table = seen.table
    for q, step in enumerate((0.01, 0.01, 0.01, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6)):
        shifted = values.copy()
        shifted[q] += step
        _kernels.level_energies(table.levels, table.theta, seen.jj, values, energy)
        _kernels.level_energies(table.levels, table.theta, seen.jj, shifted, moved)
        change = (moved - energy) / step
        expected = change[table.upper[lines.row]] - change[table.lower[lines.row]]
        # half a per cent: the slope of the grid between its points
        np.testing.assert_allclose(slopes[:, q], expected, rtol=5e-3, atol=2e-2 * np.abs(expected).max())


def test_sampled_tops_keep_the_bounds_and_the_planar_limit() -> None:
    bounds = Bounds(np.array([1000.0, 500, 400]), np.array([5000.0, 2000, 1500]))
    a, b, c = sample_tops(bounds, 500, np.random.default_rng(1)).T
    assert ((a > b) & (b > c)).all()
    assert (1 / c <= 1 / a + 1 / b + 1e-12).all()
    assert ((a >= 1000) & (a <= 5000) & (b >= 500) & (b <= 2000) & (c >= 400) & (c <= 1500)).all()


def test_bounds_without_a_top_are_refused() -> None:
    bounds = Bounds(np.array([1000.0, 2000, 400]), np.array([1100.0, 2200, 500]))
    with pytest.raises(ValueError, match="no A > B > C"):
        sample_tops(bounds, 10, np.random.default_rng(1))


def test_families_determine_three_constants() -> None:
    """Each family's lines have independent derivatives for some top of the sample, and it predicts other lines."""
    bounds = Bounds(np.array([1000.0, 500, 400]), np.array([5000.0, 2000, 1500]))
    table = rigid_table(JMAX)
    family_list = families(table, bounds, (6000.0, 18000.0), (1.0, 4.0), np.random.default_rng(2), 200, 50)
    assert len(family_list) == 50
    assert family_list[0].share >= family_list[-1].share
    for entry in family_list:
        change = table.quanta[table.upper[entry.lines], 0] - table.quanta[table.lower[entry.lines], 0]
        assert (change != 0).any()  # Q branches alone say nothing of A + C
        assert len(entry.companions) >= 4
        assert not set(entry.lines.tolist()) & set(entry.companions.tolist())


def test_a_mirrored_top_has_the_same_q_branches():
    """A - C the same and kappa of the other sign: the line with Ka and Kc exchanged has the same frequency, wherever A + C lies."""
    table = rigid_table(JMAX)
    j = table.quanta[:, 0].astype(float)
    rows = np.flatnonzero((j[table.upper] == j[table.lower]) & (j[table.upper] <= 12))[::7]
    a, b, c, shift = 6686.0, 4871.3, 3814.2, 431.7
    tops = np.array([[a, b, c], np.array([a, a + c - b, c]) + shift])
    energy = np.empty((2, len(j)))
    for top, out in zip(tops, energy, strict=True):
        _kernels.level_energies(table.levels, table.theta, j * (j + 1), np.append(top, np.zeros(5)), out)
    pairs = [(row, _mirrored_row(table, row)) for row in rows.tolist()]
    pairs = [(row, mirrored) for row, mirrored in pairs if mirrored is not None]  # the table ends at a highest Ka
    assert len(pairs) > 30
    for row, mirrored in pairs:
        frequencies = [energy[k][table.upper[n]] - energy[k][table.lower[n]] for k, n in ((0, row), (1, mirrored))]
        assert frequencies[0] == pytest.approx(frequencies[1], abs=1e-5)  # of levels near 10^6 MHz


def test_constants_with_few_lines_beside_q_branches_are_not_determined():
    grown = Grown(
        np.append([5000.0, 3000.0, 2000.0], np.zeros(5)), 1e-6 * np.eye(8), 2.0, np.ones(3), np.ones(3), np.arange(9),
        np.arange(9), np.zeros(9), np.ones(9), np.ones(9), 0.01, 400.0, None, FEWEST_MOVED,
    )  # fmt: skip
    assert grown.determined
    assert word(probability(grown)) == "certain"
    few = replace(grown, moved=FEWEST_MOVED - 1)
    assert not few.determined
    assert word(probability(few)) == "likely"
