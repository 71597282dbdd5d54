"""Points to draw of a spectrum of any length: minimum and maximum of the channels of each pixel, from a min/max pyramid.

Level k has the extremes of blocks of 8^k channels. A window is drawn from the coarsest level with at least four blocks per pixel. The
time depends on the pixels, not on the channels; all extremes are drawn, and they move by at most a quarter of a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats

FACTOR = 8
BLOCKS_A_PIXEL = 4


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Extremes of a spectrum. frequency_mhz, intensity (n,): channels. lows, highs: by level from 1 on, (n/8^k,) each."""

    frequency_mhz: Floats
    intensity: Floats
    lows: tuple[Floats, ...]
    highs: tuple[Floats, ...]

    def window(self, first_mhz: float, last_mhz: float, pixels: int) -> tuple[Floats, Floats]:
        """Points (m,), (m,) to draw: the channels, or minimum and maximum of each pixel for more than two channels per pixel.

        A further channel on each side makes the line reach the edges.
        """
        x = self.frequency_mhz
        a = max(int(np.searchsorted(x, first_mhz)) - 1, 0)
        b = min(int(np.searchsorted(x, last_mhz, side="right")) + 1, len(x))
        if b - a <= 2 * pixels:
            return x[a:b], self.intensity[a:b]
        edges = np.linspace(max(first_mhz, float(x[a])), min(last_mhz, float(x[b - 1])), pixels + 1)
        starts = np.clip(np.searchsorted(x, edges[:-1]), a, b - 1)
        stops = np.append(starts[1:], b)
        filled = stops > starts
        middles, starts, stops = (edges[:-1] + edges[1:])[filled] / 2, starts[filled], stops[filled]
        low, high = self._extremes(starts, stops, (b - a) / pixels)
        return np.repeat(middles, 2), np.stack([low, high], axis=1).reshape(-1)

    def _extremes(self, starts: ArrayLike, stops: ArrayLike, channels: float) -> tuple[Floats, Floats]:
        """Minimum and maximum of ranges of channels, widened to whole blocks. channels: average length of a range."""
        level, size = 0, 1
        while level < len(self.lows) and channels >= BLOCKS_A_PIXEL * size * FACTOR:
            level, size = level + 1, size * FACTOR
        low = self.intensity if level == 0 else self.lows[level - 1]
        high = self.intensity if level == 0 else self.highs[level - 1]
        first = np.asarray(starts) // size
        last = -(-np.asarray(stops) // size)
        low, high = low[first[0] : last[-1]], high[first[0] : last[-1]]
        first, last = first - first[0], last - first[0]
        # reduceat of pairs (first, last): every second result is that of a range
        bounds = np.stack([first, np.minimum(last, len(low))], axis=1).reshape(-1)
        low, high = np.append(low, np.inf), np.append(high, -np.inf)  # so that the end is a place too
        return np.minimum.reduceat(low, bounds)[::2], np.maximum.reduceat(high, bounds)[::2]


def pyramid(frequency_mhz: ArrayLike, intensity: ArrayLike) -> Pyramid:
    """The pyramid of channels (n,) of rising frequency.

    >>> made = pyramid(np.arange(1000.0), np.where(np.arange(1000) == 777, 5.0, 0.0))
    >>> x, y = made.window(0.0, 999.0, 10)
    >>> len(x), float(x[y.argmax()])
    (20, 749.25)
    """
    x, y = np.asarray(frequency_mhz, dtype=np.float64), np.asarray(intensity, dtype=np.float64)
    lows, highs = [y], [y]
    while len(lows[-1]) > FACTOR:
        places = np.arange(0, len(lows[-1]), FACTOR)
        lows.append(np.minimum.reduceat(lows[-1], places))
        highs.append(np.maximum.reduceat(highs[-1], places))
    return Pyramid(x, y, tuple(lows[1:]), tuple(highs[1:]))
