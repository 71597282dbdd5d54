"""Peaks of a spectrum on a grid: noise, local maxima of the smoothed spectrum, and a parabola through the logarithm of each.

The noise is 1.4826 times the median of |x_(k+1) - x_k|/√2 in windows, which lines and a slow baseline hardly affect. The width w of lines
(standard deviation of a Gaussian) is that of the strongest ones. The spectrum is smoothed with a Gaussian of that width, the filter
matched to the lines; maxima above six times its noise are peaks, and a parabola through the logarithms of three points, exact for a
Gaussian, gives the centre. With white noise σ, steps Δ and height h the matched filter places a line within

    σ_ν = (σ/h) √(2 w Δ/√π),    for Σ (∂g/∂ν)² Δ = h² √π/2w of g = h exp(-ν²/2w²)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList, peak_list

THRESHOLD = 6.0  # times the noise
LEAST_POINTS = 16  # fewest points of a spectrum or of a piece of it
WINDOW = 4096  # points in a window with constant noise
SMALLEST_MHZ = 0.001  # smallest standard error of a centre: accuracy of a parabola through three points
MOST_PEAKS = 20_000
STRONGEST = 30  # strongest peaks that determine the width


def local_noise(intensity: Floats) -> Floats:
    """Standard deviation of the noise at each point (n,)."""
    steps = np.abs(np.diff(intensity))
    edges = np.arange(0, max(len(steps) - WINDOW // 2, 1), WINDOW)
    # a difference of two points has √2 times the noise of one; 1.4826 from the median
    levels = [1.4826 * float(np.median(steps[a : a + WINDOW])) / np.sqrt(2) for a in edges]
    positive = [level for level in levels if level > 0]
    floor = min(positive) if positive else float(np.ptp(intensity)) * 1e-9 or 1.0
    # between windows the noise is interpolated; it is never below the floor
    return np.interp(np.arange(len(intensity)), edges + WINDOW / 2, np.maximum(levels, floor))


def pick_peaks(frequency_mhz: ArrayLike, intensity: ArrayLike, source: str = "") -> PeakList:
    """Peaks of a spectrum.

    Raises ValueError for frequencies below 500 MHz or without equal rising steps, for lines that point down, and for more than 20,000
    peaks. A spectrum of noise has none.

    >>> f = np.arange(6000.0, 6100.0, 0.02)
    >>> lines = sum(np.exp(-(((f - f0) / 0.06) ** 2)) for f0 in (6020.011, 6071.3))
    >>> peaks = pick_peaks(f, lines + 1e-3 * np.random.default_rng(1).normal(size=len(f)))
    >>> [round(float(x), 3) for x in peaks.frequency_mhz]
    [6020.011, 6071.3]
    """
    return pick_peaks_in_pieces([(np.asarray(frequency_mhz, np.float64), np.asarray(intensity, np.float64))], source)


def pick_peaks_in_pieces(pieces: Sequence[tuple[Floats, Floats]], source: str = "") -> PeakList:
    """Peaks of a spectrum in pieces (frequencies in MHz, intensities), each with a noise, a step and a width of lines of its own.

    Two pieces or more are the recorded windows of the list. Raises ValueError as pick_peaks does.
    """
    where = f"{source}: " if source else ""
    for f, x in pieces:
        if len(f) < LEAST_POINTS or not (np.diff(f) > 0).all() or not np.isfinite(x).all():
            raise ValueError(
                f"{where}expected a spectrum of at least {LEAST_POINTS} points with rising frequencies and finite intensities"
            )
    parts = [_Piece(f, x) for f, x in pieces]
    count = sum(len(part.top) for part in parts)
    if count > MOST_PEAKS:
        raise ValueError(
            f"{where}{count} peaks above {THRESHOLD:g} times the noise; at most {MOST_PEAKS} can be searched"
        )
    windows = np.array([(f[0], f[-1]) for f, _ in pieces])
    band = (float(windows.min()), float(windows.max()))
    frequency, height, error = (
        np.concatenate(column) for column in zip(*(part.peaks() for part in parts), strict=True)
    )
    recorded = windows if len(pieces) > 1 else None
    if count < 2:
        down = sum(part.count_down() for part in parts)
        if down > 2:
            raise ValueError(
                f"{where}{count} peaks above {THRESHOLD:g} times the noise and {down} below: the lines point down; change the sign"
            )
        return PeakList(frequency, height, error, band, source, recorded, tuple(pieces))
    peaks = peak_list(frequency, height, error, band_mhz=band, source=source)
    return replace(peaks, stated_windows=recorded, trace=tuple(pieces))


class _Piece:
    """A piece of a spectrum, smoothed, and its maxima."""

    def __init__(self, f: Floats, x: Floats) -> None:
        self.f = f
        self.noise = local_noise(x)
        self.width = _width(x, self.noise)  # in steps
        # four widths on either side: the Gaussian has fallen to 3e-4
        reach = np.arange(-int(np.ceil(4 * self.width)), int(np.ceil(4 * self.width)) + 1)
        kernel = np.exp(-0.5 * (reach / self.width) ** 2)
        kernel /= kernel.sum()
        edge = len(reach) // 2
        self.smooth = np.convolve(x, kernel)[edge : edge + len(x)]
        self.quiet = self.noise * float(np.sqrt((kernel**2).sum()))
        self.top = _maxima(self.smooth, self.quiet)

    def peaks(self) -> tuple[Floats, Floats, Floats]:
        """Frequencies, heights and standard errors of the frequencies."""
        step, top = float(np.median(np.diff(self.f))), self.top
        shift, bend, centre = _parabola(self.smooth, top)
        height = np.sqrt(2) * np.exp(centre - 0.5 * bend * shift**2)  # smoothing made the line √2 wider and lower
        error = self.noise[top] / height * np.sqrt(2 * self.width / np.sqrt(np.pi)) * step
        return self.f[top] + shift * step, height, np.maximum(error, SMALLEST_MHZ)

    def count_down(self) -> int:
        """Number of minima as deep as a peak is high."""
        return len(_maxima(-self.smooth, self.quiet))


def _maxima(x: Floats, noise: Floats) -> Ints:
    """Local maxima above the threshold whose neighbours are positive."""
    middle = x[1:-1]
    top = np.flatnonzero((middle >= x[:-2]) & (middle > x[2:]) & (middle > THRESHOLD * noise[1:-1])) + 1
    return np.asarray(top[(x[top - 1] > 0) & (x[top + 1] > 0)])


def _parabola(x: Floats, top: Ints) -> tuple[Floats, Floats, Floats]:
    """Shift of the centre in steps, second difference and middle of the logarithms around maxima."""
    left, centre, right = (np.log(x[top + k]) for k in (-1, 0, 1))
    bend = np.minimum(left - 2 * centre + right, -1e-9)
    # a maximum lies within half a step of its highest point
    return np.clip(0.5 * (left - right) / bend, -0.5, 0.5), bend, centre


def _width(x: Floats, noise: Floats) -> float:
    """Standard deviation of lines in steps, from the strongest maxima."""
    top = _maxima(x, noise)
    if not len(top):
        return 1.0
    strongest = top[np.argsort(-x[top])][:STRONGEST]
    _, bend, _ = _parabola(x, strongest)
    return float(np.clip(np.median(1 / np.sqrt(-bend)), 0.5, 50.0))  # widths from half a step to fifty
