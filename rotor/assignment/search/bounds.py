"""Bounds of A, B and C, and random tops within them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats


@dataclass(frozen=True, eq=False)
class Bounds:
    """Least and greatest A, B, C in MHz (3,) each."""

    low: Floats
    high: Floats

    @property
    def array(self) -> Floats:
        """A low, A high, B low, ... (6,)."""
        return np.column_stack([self.low, self.high]).ravel()

    def points(self, kappa: Floats) -> slice:
        """The part of an increasing grid of κ = (2B-A-C)/(A-C) within the bounds; κ increases with B and decreases with A and C."""
        (a, b, c), (a2, b2, c2) = self.low, self.high
        lowest = (2 * b - a2 - c2) / (a2 - c2) if a2 > c2 else -1.0
        highest = (2 * b2 - a - c) / (a - c) if a > c else 1.0
        first, last = np.searchsorted(kappa, [lowest, highest])
        return slice(max(int(first) - 1, 0), min(int(last) + 2, len(kappa)))


def sample_tops(bounds: Bounds, count: int, rng: np.random.Generator) -> Floats:
    """A, B, C (count, 3): A and B log-uniform, C between that of a planar molecule and B."""
    rows = list[Floats]()
    total = 0
    low, high = np.log(bounds.low), np.log(bounds.high)
    for _ in range(200):
        u = rng.random((4 * count, 3))  # four times as many as needed, since many are rejected
        a, b = (np.exp(low[i] + (high[i] - low[i]) * u[:, i]) for i in (0, 1))
        planar = a * b / (a + b)
        # C lies between planarity and B
        least, most = np.maximum(planar, bounds.low[2]), np.minimum(b, bounds.high[2])
        c = least + (most - least) * u[:, 2] ** 1.5  # a power of 1.5: more tops near planarity
        selected = (a > 1.02 * b) & (c < 0.999 * b) & (most > least)  # nearly symmetric tops are left out
        rows.append(np.column_stack([a, b, c])[selected])
        total += len(rows[-1])
        if total >= count:
            return np.concatenate(rows)[:count]
    if not total:
        raise ValueError("bounds: no A > B > C with 1/C of at most 1/A + 1/B lies within them; widen them")
    return np.concatenate(rows)
