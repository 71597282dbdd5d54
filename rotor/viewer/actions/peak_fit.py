"""Fit of a peak of a spectrum: a Gaussian on a sloping baseline, fitted to the channels of a range.

    y(ν) = b₀ + b₁ (ν - ν_m) + h exp(-u²),    u = 2 √(ln 2) (ν - ν₀)/w,    w the full width at half maximum

Errors follow from the noise of the channels, or from their scatter about the fit where that is larger. The error of the centre of a
peak of height h in white noise σ on a grid of steps Δ, with the baseline known, is (σ/h) √(2 s Δ/√π), s = w/2.355 (see
`rotor.assignment.peaks.peak_finding`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.observed.spectrum import ObservedSpectrum
from rotor.statistics.least_squares import minimise
from rotor.statistics.regression import regression

LEAST_CHANNELS = 7  # for five parameters
_U = 2 * math.sqrt(math.log(2))
NAMES = ("baseline", "slope", "height", "frequency", "width")


@dataclass(frozen=True)
class Peak:
    """A peak: centre, full width at half maximum and height with standard errors; None for values that a list of peaks lacks.

    baseline: below it. rms: of the residuals of the fit over the noise.
    """

    frequency_mhz: float
    error_mhz: float
    width_mhz: float | None = None
    width_error_mhz: float | None = None
    height: float = 0.0
    height_error: float | None = None
    baseline: float | None = None
    rms: float | None = None


def fit_peak(spectrum: ObservedSpectrum, first_mhz: float, last_mhz: float) -> Peak:
    """The peak in a range.

    Raises ValueError for a range with fewer than seven channels, and where no peak in it can be fitted.

    >>> from rotor.observed.spectrum import observed_spectrum
    >>> f = np.arange(1000.0, 1010.0, 0.05)
    >>> y = 2 * np.exp(-(((f - 1004.03) / 0.3) ** 2)) + 0.01 * np.random.default_rng(1).normal(size=len(f))
    >>> peak = fit_peak(observed_spectrum(f, y, noise=0.01), 1003.0, 1005.0)
    >>> round(peak.frequency_mhz, 2), round(peak.width_mhz, 1), peak.error_mhz < 0.002
    (1004.03, 0.5, True)
    """
    a, b = np.searchsorted(spectrum.frequency_mhz, (first_mhz, last_mhz))
    x, y, noise = (column[a:b] for column in (spectrum.frequency_mhz, spectrum.intensity, spectrum.noise))
    if len(x) < LEAST_CHANNELS:
        raise ValueError(
            f"{first_mhz:.4f} to {last_mhz:.4f} MHz: {len(x)} channels; a peak needs {LEAST_CHANNELS} or more, choose a wider range"
        )
    middle, span = float(x.mean()), float(x[-1] - x[0])

    def evaluate(values: Floats) -> tuple[Floats, Floats]:
        b0, b1, h, centre, log_width = values
        width = math.exp(min(max(log_width, -50.0), 50.0))
        u = _U * (x - centre) / width
        g = np.exp(-u * u)
        slopes = [np.ones(len(x)), x - middle, g, h * g * 2 * u * _U / width, h * g * 2 * u * u]
        residuals = (y - b0 - b1 * (x - middle) - h * g) / noise
        return residuals, np.stack(slopes, axis=1) / noise[:, None]

    start = _start(x, y, middle, span)
    minimum = minimise(evaluate, start)
    b0, _, height, centre, log_width = minimum.parameters.tolist()
    width = float(math.exp(log_width))
    if not (minimum.converged and x[0] <= centre <= x[-1] and span / len(x) / 2 < width < 2 * span):
        raise ValueError(
            f"{first_mhz:.4f} to {last_mhz:.4f} MHz: no peak can be fitted there; choose a range about one peak"
        )
    rms = float(np.sqrt(minimum.residuals @ minimum.residuals / (len(x) - len(NAMES))))
    errors = regression(minimum.jacobian, NAMES).errors * max(1.0, rms)
    return Peak(centre, float(errors[3]), width, float(errors[4]) * width, height, float(errors[2]), float(b0), rms)


def _start(x: Floats, y: Floats, middle: float, span: float) -> Floats:
    """Initial parameters: the largest deviation from the line through both ends, and its width at half height."""
    ends = max(1, len(x) // 8)
    left, right = float(np.median(y[:ends])), float(np.median(y[-ends:]))
    slope = (right - left) / span
    above = y - (left + slope * (x - x[0]))
    top = int(np.argmax(np.abs(above)))
    half = int(np.count_nonzero(above * np.sign(above[top]) > abs(above[top]) / 2))
    width = max(half, 2) * span / len(x)
    return np.array([left + slope * (middle - x[0]), slope, above[top], x[top], math.log(width)])
