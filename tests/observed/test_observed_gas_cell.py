"""Gas cells: absorbance by Lambert and Beer, the temperature from intensities."""

import math

import numpy as np
import pytest
from observed_cases import artificial, rigid

from rotor.observed.fit import contributions
from rotor.observed.gas_cell import absorbance, fit_cell, start_cell
from rotor.observed.model.model import Component
from rotor.observed.spectrum import observed_spectrum

GRID = np.concatenate([np.arange(f - 3, f + 3, 0.02) for f in 20e3 * np.arange(1, 9)])


def test_absorbance_of_one_line() -> None:
    """A at the centre: N L I √(4 ln 2/π)/(Δν ln 10)."""
    species = rigid()
    intensity = float(species.intensity_nm2_mhz(250.0)[0]) * 1e-14
    exact = 1e15 * intensity * math.sqrt(4 * math.log(2) / math.pi) / (20e3 * 3.0 / 299792.458) / math.log(10)
    assert absorbance([Component(species, 1e15, 250.0, 0.0, 3.0)], np.array([20e3]))[0] == pytest.approx(
        exact, rel=1e-12
    )


def test_temperature_from_intensities() -> None:
    """Twenty spectra: deviations in standard errors have the scatter 1."""
    true = Component(rigid(), 1e16, 250.0, 0.0, 3.0)
    clean = absorbance([true], GRID)
    noise = 0.02 * clean.max()
    rng = np.random.default_rng(1)
    pulls = []
    for _ in range(20):
        spectrum = observed_spectrum(GRID, clean + rng.normal(0, noise, len(GRID)), noise=noise, unit="absorbance")
        fit = fit_cell(spectrum, [Component(rigid(), 3e15, 150.0, 0.0, 2.0)])
        pulls.append(
            [
                (fit.temperature_k - 250.0) / fit.temperature_error_k,
                (fit.components[0].column_per_cm2 - 1e16) / fit.column_errors[0],
            ]
        )
    assert np.abs(np.mean(pulls, axis=0)).max() < 4 / math.sqrt(20)
    assert np.allclose(np.std(pulls, axis=0), 1.0, atol=0.6)  # 20 draws: 0.16


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="in K; a gas cell"):
        fit_cell(observed_spectrum([1.0, 2.0], [0.1, 0.2], noise=1.0), [])
    far = artificial("far", np.random.default_rng(1), 5e5, 6e5)
    spectrum = observed_spectrum(GRID, np.zeros(len(GRID)), noise=1.0, unit="absorbance")
    with pytest.raises(ValueError, match="far: no lines"):
        fit_cell(spectrum, [Component(far, 1e15, 300.0)])


def test_start_from_the_spectrum_and_what_brightness_alone_has() -> None:
    """Two species, one of which is not there; a fit of absorbance has no contributions of brightness."""
    present, absent = rigid(), rigid(7e3, "absent")
    clean = absorbance([Component(present, 1e16, 250.0, 0.0, 3.0)], GRID)
    noise = 0.01 * clean.max()
    seen = clean + np.random.default_rng(3).normal(0, noise, len(GRID))
    spectrum = observed_spectrum(GRID, seen, noise=noise, unit="absorbance")
    start = start_cell(spectrum, [present, absent])
    assert 0.3 < start[0].column_per_cm2 / 1e16 < 3
    fit = fit_cell(spectrum, start)
    assert abs(fit.temperature_k - 250.0) < 4 * fit.temperature_error_k
    assert fit.components[1].column_per_cm2 < 5e14
    assert "rms" in fit.facts()
    with pytest.raises(ValueError, match="in absorbance; a fit needs brightness"):
        contributions(fit)
