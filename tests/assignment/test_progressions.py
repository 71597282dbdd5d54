"""Progressions of linear and symmetric tops in lists of peaks: made lists, measured lines, lists without any."""

import numpy as np
import pytest

import rotor
from rotor.assignment.peaks.peak_list import peak_list
from rotor.assignment.peaks.progressions import progressions

ERROR = 0.01


def random_peaks(rng, count, band=(6_000.0, 18_000.0)):
    return rng.uniform(*band, count), rng.lognormal(0.0, 1.0, count)


def everything(frequency, intensity, error=ERROR):
    peaks = peak_list(frequency, intensity, error)
    return progressions(peaks, np.ones(len(peaks), dtype=bool))


@pytest.mark.parametrize(("b", "d", "first"), [(650.0, 2e-5, 5), (900.0, 4e-4, 4), (1_100.0, 0.0, 4), (450.0, 6e-5, 8)])
def test_constants_come_back_from_lines_among_others(b, d, first):
    rng = np.random.default_rng(3)
    m = np.arange(first, int(18_000 / (2 * b)) + 1)
    lines = 2 * b * m - 4 * d * m**3 + rng.normal(0, ERROR, len(m))
    others, heights = random_peaks(rng, 60)
    (series,) = everything(np.append(lines, others), np.append(np.full(len(m), 3.0), heights))
    assert series.lines.lower[:, 0].tolist() == (m - 1).tolist()
    assert series.lines.upper[:, 0].tolist() == m.tolist()
    deviation = (series.constants_mhz - (b, d)) / series.errors_mhz
    assert np.abs(deviation).max() < 4  # standard errors
    assert series.chance < 1e-6


def test_errors_are_those_of_the_normal_equations():
    """ν/m is linear in m²: an independent weighted fit of a line gives the same constants and errors."""
    rng = np.random.default_rng(5)
    m = np.arange(1, 12)
    frequency = 2 * 4_500.0 * m - 4 * 5e-4 * m**3 + rng.normal(0, ERROR, len(m))
    (series,) = everything(frequency, np.ones(len(m)))
    (slope, start), covariance = np.polyfit(m**2.0, frequency / m, 1, w=m / ERROR, cov="unscaled")
    assert series.constants_mhz == pytest.approx((start / 2, -slope / 4), rel=1e-9)  # round-off
    chi2 = np.sum(((frequency / m - start - slope * m**2.0) * m / ERROR) ** 2) / (len(m) - 2)
    errors = np.sqrt(np.diag(covariance) * max(1.0, chi2))
    assert series.errors_mhz == pytest.approx((errors[1] / 2, errors[0] / 4), rel=1e-6)


def test_two_molecules_are_separated():
    m, n = np.arange(1, 10), np.arange(2, 14)
    frequency = np.concatenate([2 * 6081.492 * m - 4 * 1.3e-3 * m**3, 2 * 4549.058 * n - 4 * 5.4e-4 * n**3])
    found = everything(frequency, np.ones(len(frequency)))
    assert sorted(len(series.peak) for series in found) == [9, 12]
    assert not set(found[0].peak.tolist()) & set(found[1].peak.tolist())


def test_random_peaks_and_rigid_asymmetric_tops_have_none():
    """Twenty lists of random peaks, and the a-type lines of an asymmetric top, whose K = 0 lines are no cubic in m."""
    rng = np.random.default_rng(7)
    for count in rng.integers(10, 200, 20).tolist():
        assert not everything(*random_peaks(rng, count))
    lines = rotor.spectrum(
        constants="A=9000 B=1500 C=1200 MHz", dipole_abc="1,0,0", temperature_k=2, range_mhz="2:40GHz"
    )
    table = lines.to_pandas()
    strong = table[table.lgint > table.lgint.max() - 2]
    assert not everything(strong.frequency_mhz.to_numpy(), 10 ** strong.lgint.to_numpy())


def test_every_second_line_is_another_molecule():
    """Lines of odd m alone, 2B (2n + 1), are no progression of B, nor of 2B or 4B."""
    m = np.arange(1, 16, 2)
    assert not everything(2 * 1_100.0 * m - 4 * 3e-4 * m**3, np.ones(len(m)))
