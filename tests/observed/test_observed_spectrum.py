"""Observed spectra: what is left out, noise, baselines, units."""

import numpy as np
import pytest
from observed_cases import injected, rigid

from rotor.observed.model.model import Component
from rotor.observed.spectrum import (
    in_kelvin,
    kelvin_per_jansky,
    line_free,
    noise_level,
    observed_spectrum,
    without_baseline,
)

GRID = np.arange(19990.0, 20010.0, 0.01)


def test_channels_are_sorted_and_nan_left_out() -> None:
    y = np.sin(GRID)
    y[7] = np.nan
    spectrum = observed_spectrum(GRID[::-1], y[::-1], noise=0.1)
    assert len(spectrum) == len(GRID) - 1
    assert (np.diff(spectrum.frequency_mhz) > 0).all()
    assert spectrum.intensity[0] == y[0]
    assert spectrum.notes == ("1 channel without a finite number left out",)


def test_noise_of_a_spectrum_with_lines() -> None:
    rng = np.random.default_rng(5)
    spectrum = injected([Component(rigid(), 1e15, 30.0, 0.0, 5.0)], GRID, 0.03, rng)
    assert noise_level(spectrum.intensity) == pytest.approx(
        0.03, rel=0.05
    )  # 2000 channels: 1.6 % of statistics, and line wings
    free = line_free(spectrum.intensity)
    assert not free[np.abs(GRID - 20e3) < 0.15].any()
    assert free.mean() > 0.7


@pytest.mark.parametrize("channels", [2, 3, 4, 5])
def test_a_spectrum_of_a_few_channels_has_a_noise_level(channels: int) -> None:
    """Fewer channels than a clipped channel and its neighbours take could not be read."""
    intensity = np.arange(channels) % 2 + 1.0
    assert line_free(intensity).all()
    assert observed_spectrum(np.arange(1.0, channels + 1), intensity).noise[0] > 0


def test_baseline_of_second_order() -> None:
    rng = np.random.default_rng(6)
    spectrum = injected([Component(rigid(), 1e15, 30.0, 0.0, 5.0)], GRID, 0.03, rng)
    x = (GRID - 20e3) / 10
    bent = observed_spectrum(GRID, spectrum.intensity + 0.3 + 0.2 * x - 0.4 * x * x)
    flat = without_baseline(bent, 2)
    off = flat.intensity - spectrum.intensity
    assert np.abs(off).max() < 0.02  # a fraction of the noise; without the baseline 0.9
    assert flat.noise[0] == pytest.approx(0.03, rel=0.05)
    assert "baseline of order 2" in flat.notes[-1]


def test_jansky_to_kelvin() -> None:
    """Rayleigh-Jeans against 1.222e6 K GHz² arcsec², the factor of CASA's documentation to its four digits."""
    assert float(kelvin_per_jansky(345e3, (0.5, 0.7))) == pytest.approx(1.222e6 / (345.0**2 * 0.35), rel=5e-4)
    spectrum = observed_spectrum([230e3, 230e3 + 1], [0.1, 0.2], noise=0.01, unit="Jy/beam", beam_arcsec=(0.5, 0.5))
    assert in_kelvin(spectrum).intensity[1] == pytest.approx(0.2 * 92.4, rel=1e-3)
    with pytest.raises(ValueError, match="without a beam"):
        in_kelvin(observed_spectrum([1.0, 2.0], [0.1, 0.2], noise=1.0, unit="Jy/beam"))


@pytest.mark.parametrize(
    ("frequency", "intensity", "noise", "facts", "rule"),
    [
        ([1.0, 2.0], [1.0], 1.0, {}, "frequencies for"),
        ([1.0, 1.0], [1.0, 2.0], 1.0, {}, "two channels at 1 MHz"),
        ([1.0, 2.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0], 1.0, {}, "two channels at 2 MHz"),
        ([1.0, np.nan], [1.0, 2.0], 1.0, {}, "expected two or more"),
        ([-1.0, 1.0], [1.0, 2.0], 1.0, {}, "above 0"),
        ([1.0, 2.0], [1.0, 2.0], 0.0, {}, "noise"),
        ([1.0, 2.0], [1.0, 2.0], 1.0, {"unit": "furlong"}, "known are K"),
    ],
)
def test_mistakes_are_named(frequency: list, intensity: list, noise: float, facts: dict, rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        observed_spectrum(frequency, intensity, noise=noise, **facts)
