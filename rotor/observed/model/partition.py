"""Partition functions as tables over temperature, interpolated in log Q against log T.

The interpolation is a monotone cubic (F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17, 238 (1980)) of both logarithms, in
which Q of a linear molecule has the slope 1 and Q of a nonlinear molecule the slope 3/2 (C. H. Townes and A. L. Schawlow, Microwave
Spectroscopy, 1955, chapter 4). Beyond the table the slope at its end is continued, for at most a factor of two in T.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.tops.top import Top

BEYOND = 2.0  # factor in temperature for which the slope at an end of the table is continued
SUMMED_K = (
    2.725,
    3.7,
    5.0,
    7.0,
    9.375,
    13.3,
    18.75,
    26.5,
    37.5,
    53.0,
    75.0,
    106.0,
    150.0,
    184.0,
    225.0,
    260.0,
    300.0,
    387.0,
    500.0,
    707.0,
    1000.0,
)


@dataclass(frozen=True, eq=False, repr=False)
class PartitionTable(Table):
    """Q(T) at rising temperatures (n,), with the nuclear-spin weights of the lines.

    Raises ValueError for a table without a point, temperatures that do not rise, and Q not above 0.
    """

    temperature_k: Floats
    q: Floats
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("temperature_k", "q"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        if not len(self.q) or self.q.shape != self.temperature_k.shape or self.q.ndim != 1:
            raise ValueError(
                f"{self.source or 'Q(T)'}: {len(self.temperature_k)} temperatures, {len(self.q)} values of Q"
            )
        if (np.diff(self.temperature_k) <= 0).any() or self.temperature_k[0] <= 0 or not (self.q > 0).all():
            raise ValueError(f"{self.source or 'Q(T)'}: expected rising temperatures and Q above 0")

    @property
    def columns(self) -> dict[str, Any]:
        """temperature_k, q."""
        return {"temperature_k": self.temperature_k, "q": self.q}

    @property
    def range_k(self) -> tuple[float, float]:
        """Lowest and highest temperature of Q: the ends of the table, extended by a factor of two."""
        if len(self.q) == 1:
            return float(self.temperature_k[0]), float(self.temperature_k[0])
        return float(self.temperature_k[0]) / BEYOND, float(self.temperature_k[-1]) * BEYOND

    def at(self, temperature_k: float) -> float:
        """Q at a temperature; ValueError beyond `range_k`."""
        return math.exp(self._log(temperature_k)[0])

    def slope(self, temperature_k: float) -> float:
        """d ln Q / d ln T at a temperature; ValueError beyond `range_k`."""
        return self._log(temperature_k)[1]

    def _log(self, temperature_k: float) -> tuple[float, float]:
        """ln Q and its slope in ln T."""
        low, high = self.range_k
        if not low <= temperature_k <= high:
            raise ValueError(
                f"Q at {temperature_k:g} K of {self.source or 'a table'}: known from {low:g} to {high:g} K"
            )
        if self._pieces is None:
            return math.log(self.q[0]), 0.0
        x, cubic, slope = self._pieces
        at = math.log(temperature_k)
        inside = min(max(at, x[0]), x[-1])
        steepness = float(slope(inside))
        return float(cubic(inside)) + steepness * (at - inside), steepness

    @cached_property
    def _pieces(self) -> Any:
        """log T, the interpolating function and its derivative; None for a single point."""
        if len(self.q) < 2:
            return None
        from scipy.interpolate import PchipInterpolator

        x, y = np.log(self.temperature_k), np.log(self.q)
        cubic = PchipInterpolator(x, y)
        return x, cubic, cubic.derivative()


def top_partition(top: Top, temperatures_k: Sequence[float] = SUMMED_K) -> PartitionTable:
    """Q(T) of a top, summed from its levels at the temperatures of CDMS and at others between them.

    >>> from rotor.tops.top import Top
    >>> table = top_partition(Top.from_constants("B=57635.968 MHz"))
    >>> round(table.at(300.0), 2)
    108.79
    """
    from rotor.thermodynamics.sums.partition import partition_function

    sums = partition_function(top, list(temperatures_k), refuse=False)
    selected = [(value.temperature_k, value.q) for value in sums if value.relative_error < 1e-3]
    if not selected:
        raise ValueError(f"{top.name or 'a top'}: Q(T) cannot be summed at any temperature of the table")
    temperatures, q = np.array(selected).T
    return PartitionTable(temperatures, q, f"summed from the levels of {top.name or 'the top'}")
