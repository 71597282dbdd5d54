"""The rotational partition function, summed from the levels and beside it its classical limit.

Q(T) = Σ g_I (2J+1) exp(-E/kT), E from the lowest level that exists, g_I reduced by its common divisor. Classically, with
⟨g_I⟩ the weight averaged over many levels (G. Herzberg, Molecular Spectra and Molecular Structure II, eqs. V,18 and V,27),

    Q = ⟨g_I⟩ kT/hB  (linear),      Q = ⟨g_I⟩ √(π (kT/h)³ / ABC)  (all others).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotor import units
from rotor.quantum.levels import solve_levels

if TYPE_CHECKING:
    from rotor.top import Top

STRIDE = 8  # J are solved by so many at a time
JMAX_LIMIT = 4000


@dataclass(frozen=True)
class PartitionFunction:
    """Q at one temperature: the sum, the J it was summed to, its estimated relative truncation error, how it came."""

    temperature_k: float
    q: float
    jmax: int | None
    relative_error: float
    source: str


def classical_partition_function(top: Top, temperature_k: float) -> float:
    """Q in the classical limit, with the mean spin weight; about 1 % low for water at 300 K, worse when colder.

    >>> from rotor.top import Top
    >>> round(classical_partition_function(Top.from_constants("B=57635.968 MHz"), 300.0), 2)
    108.46
    """
    kt_mhz = temperature_k * units.MHZ_PER_K
    a, b, c = top.rotational_constants_mhz
    if top.kind == "linear":
        return top.spin_weights.mean * kt_mhz / b
    return top.spin_weights.mean * math.sqrt(math.pi * kt_mhz**3 / (a * b * c))


def partition_function(top: Top, temperature_k: float, relative_error: float = 1e-6) -> PartitionFunction:
    """Q(T) summed over levels until the tail is below `relative_error` of it.

    The tail is estimated by the ratio of the last pairs of J, which falls with J. Raises ValueError for a temperature not
    above 0 K, and where the terms rise again before they have died away: then the distortion constants are used beyond
    their reach, and no sum would mean anything.
    """
    return partition_functions(top, [temperature_k], relative_error)[0]


def partition_functions(
    top: Top, temperatures_k: Iterable[float], relative_error: float = 1e-6
) -> list[PartitionFunction]:
    """Q at several temperatures from one set of levels; see `partition_function`."""
    temperatures = [float(t) for t in temperatures_k]
    for t in temperatures:
        if not (math.isfinite(t) and t > 0):
            raise ValueError(f"temperature {t} K: a temperature is above 0 K")

    terms = _Terms(top)
    return [_summed(terms, t, relative_error) for t in temperatures]


class _Terms:
    """Energies above the lowest existing level, in K, and degeneracies, J by J, solved when first asked for."""

    def __init__(self, top: Top) -> None:
        self._top = top
        self._ground: float | None = None
        self._by_j: list[tuple[np.ndarray, np.ndarray]] = []

    def _solve_more(self) -> None:
        first = len(self._by_j)
        stride = max(STRIDE, first // 4)
        levels = solve_levels(self._top, first + stride - 1, jmin=first, vectors=False)
        exists = levels.weight > 0
        if self._ground is None:
            self._ground = levels.ground_mhz
        kelvin = (levels.energy_mhz - self._ground) / units.MHZ_PER_K
        for j in range(first, first + stride):
            here = exists & (levels.j == j)
            self._by_j.append((kelvin[here], levels.degeneracy[here].astype(float)))

    def at(self, j: int, temperature_k: float) -> float:
        """The sum over the levels of one J; 0 where none of them exists, as for every second J of CO2."""
        while len(self._by_j) <= j:
            self._solve_more()
        kelvin, degeneracy = self._by_j[j]
        return float(degeneracy @ np.exp(-kelvin / temperature_k))


def _summed(terms: _Terms, temperature_k: float, relative_error: float) -> PartitionFunction:
    """The sum, J by J; its tail from pairs of neighbouring J, since spin weights may alternate with J."""
    values: list[float] = []
    total, highest, lowest = 0.0, 0.0, math.inf  # of the pairs, the lowest since the highest
    for j in range(JMAX_LIMIT):
        values.append(terms.at(j, temperature_k))
        total += values[-1]
        if j < 3:
            continue
        pair, before = sum(values[-2:]), sum(values[-4:-2])
        lowest = pair if pair >= highest else min(lowest, pair)
        highest = max(highest, pair)

        if 2 * lowest < pair < highest / 2:
            raise ValueError(
                f"Q({temperature_k:g} K): the sum over levels grows again at J = {j}; the distortion constants are used "
                f"beyond their reach (tail {pair / total:.1e} of Q there); lower the temperature or give Q"
            )
        ratio = pair / before if before else 1.0
        if ratio < 1.0:
            tail = pair * ratio / (1.0 - ratio)
            if tail < relative_error * total:
                source = f"summed from levels to J = {j}, relative error below {relative_error:g}"
                return PartitionFunction(temperature_k, total, j, tail / total, source)
    raise ValueError(f"Q({temperature_k:g} K) needs levels beyond J = {JMAX_LIMIT - 1}; use the classical limit")
