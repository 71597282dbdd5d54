"""Sums over rotational levels, J by J: the partition function, and the mean and spread of the energy with it.

With x = E/kT, E from the lowest level that exists, and g = g_I (2J+1),

    Q = Σ g e⁻ˣ,      U/RT = Σ g x e⁻ˣ / Q,      C_v/R = Σ g x² e⁻ˣ / Q - (U/RT)²

(J. E. Mayer and M. Goeppert Mayer, Statistical Mechanics, Wiley 1940, chapter 6). What is left out beyond the last J is
estimated by a series that falls at least as fast as a geometric one: the same terms with every level weighing as much as
the heaviest class of nuclear spin does, which are smooth in J whatever the spin weights leave out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.levels import weights_of_levels
from rotor.quantum.solve import solve_levels
from rotor.thermo.spin_factor import without_spins
from rotor.tops.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


STRIDE = 8  # J are solved by so many at a time
JMAX_LIMIT = 4000
LOWEST_X, HIGHEST_X = -300.0, 1e4  # levels that do not exist may lie below the lowest that does; e³⁰⁰ is enough
ENDLESS = 1e150  # stands for a tail that is not known because the terms still grow
DIMENSIONS = {"A": 1, "E": 2, "F": 3, "G": 4, "H": 5}


@dataclass(frozen=True)
class PartitionFunction:
    """Q at one temperature: the sum, the J it was summed to, its estimated relative truncation error, how it came."""

    temperature_k: float
    q: float
    jmax: int | None
    relative_error: float
    source: str


@dataclass(frozen=True)
class LevelSums:
    """What the levels of one set of spin weights sum to at n temperatures.

    ground_k: energy of its lowest level over k, from the Hamiltonian's zero, in K. q: (n,), from that level. energy_over_rt,
    cv_over_r: (n,), from that level. jmax: (n,), the last J that was added. error_q, error_energy, error_cv: (n,), estimated
    truncation errors, relative.
    """

    temperatures_k: Floats
    ground_k: float
    q: Floats
    energy_over_rt: Floats
    cv_over_r: Floats
    jmax: Ints
    error_q: Floats
    error_energy: Floats
    error_cv: Floats


def checked_temperatures(temperatures_k: ArrayLike) -> Floats:
    """Temperatures as (n,); ValueError where one is not above 0 K."""
    temperatures = np.atleast_1d(np.asarray(temperatures_k, dtype=np.float64)).ravel()
    for t in temperatures.tolist():
        if not (math.isfinite(t) and t > 0):
            raise ValueError(f"temperature {t} K: a temperature is above 0 K")
    return temperatures


def partition_function(
    top: Top, temperature_k: float, relative_error: float = 1e-6, effects: Sequence[QuantumEffect] = SEMI_RIGID
) -> PartitionFunction:
    """Q(T) summed over levels until the tail is below `relative_error` of it.

    The tail is estimated by the ratio of the last two J, which falls with J. Raises ValueError for a temperature not
    above 0 K, and where the terms rise again before they have died away: then the distortion constants are used beyond
    their reach, and no sum would mean anything.
    """
    return partition_functions(top, [temperature_k], relative_error, effects)[0]


def partition_functions(
    top: Top,
    temperatures_k: Iterable[float],
    relative_error: float = 1e-6,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> list[PartitionFunction]:
    """Q at several temperatures from one set of levels; see `partition_function`."""
    temperatures = checked_temperatures(list(temperatures_k))
    spinless, factor = without_spins(top, effects)
    sums = level_sums(top, [top.spin_weights], temperatures, relative_error, energies=False, effects=spinless)[0]
    rows = zip(
        temperatures.tolist(), (factor * sums.q).tolist(), sums.jmax.tolist(), sums.error_q.tolist(), strict=True
    )
    source = "summed from levels to J = {}, relative error below {:g}"
    return [PartitionFunction(t, q, j, error, source.format(j, relative_error)) for t, q, j, error in rows]


def level_sums(
    top: Top,
    weights: Sequence[SpinWeights],
    temperatures_k: ArrayLike,
    relative_error: float = 1e-8,
    *,
    energies: bool = True,
    at_worst: float = 0.0,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> list[LevelSums]:
    """Q, U/RT and C_v/R of a top's levels for each of several sets of spin weights, from levels solved once.

    The sum at each temperature goes on until the estimated truncation error of Q, and with `energies` those of U and C_v
    too, are below `relative_error`. Where the terms grow again before that, or a level falls below the lowest, since the
    distortion constants are used beyond their reach, it ends where the error was least, as an asymptotic series does;
    ValueError where that is above `at_worst`. The errors say what was reached.

    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=60 GHz")
    >>> sums = level_sums(top, [top.spin_weights], [300.0])[0]
    >>> round(float(sums.q[0]), 4), round(float(sums.cv_over_r[0]), 6)  # T/Θ + 1/3 + ..., 1 + (Θ/T)²/45 + ...
    (104.5171, 1.000002)
    """
    temperatures = checked_temperatures(temperatures_k)
    least_k = min(top.rotational_constants_mhz) / units.MHZ_PER_K
    enough = -0.5 * math.log(max(relative_error, at_worst))  # half of what x of the last J must be, about
    if least_k * JMAX_LIMIT**2 < enough * temperatures.max():
        raise _endless(temperatures.max())
    ladder = _Ladder(top, tuple(weights), tuple(effects))
    return [_summed(ladder, s, temperatures, relative_error, energies, at_worst) for s in range(len(weights))]


def lowest_level_k(top: Top, weights: Sequence[SpinWeights]) -> list[float]:
    """E/k of the lowest level that exists by each set of spin weights, from the Hamiltonian's zero, in K."""
    return [energy for energy, _ in _Ladder(top, tuple(weights)).ground]


class _Ladder:
    """Levels J by J, solved when first asked for: energies in K, degeneracies without spin, and with each set of weights."""

    def __init__(
        self, top: Top, weights: tuple[SpinWeights, ...], effects: tuple[QuantumEffect, ...] = SEMI_RIGID
    ) -> None:
        self._top, self._weights, self._effects = top, weights, effects
        self._by_j: list[tuple[Floats, Floats, Floats]] = []
        self.heaviest = [heaviest_component(one) for one in weights]
        self.ground = [self._lowest(s) for s in range(len(weights))]

    def at(self, j: int) -> tuple[Floats, Floats, Floats]:
        """Energies (n,), degeneracies (n,) and those with spin weights (sets, n) of one J."""
        while len(self._by_j) <= j:
            self._solve_more()
        return self._by_j[j]

    def _solve_more(self) -> None:
        first = len(self._by_j)
        last = first + max(STRIDE, first // 8) - 1
        levels = solve_levels(self._top, last, jmin=first, effects=self._effects, vectors=False)
        kelvin = levels.energy_mhz / units.MHZ_PER_K
        plain = levels.states.astype(np.float64)
        spin = np.array([levels.multiplicity * weights_of_levels(levels, one) for one in self._weights], dtype=float)
        rotational = levels.rotational
        for j in range(first, last + 1):
            here = rotational == j
            self._by_j.append((kelvin[here], plain[here], spin[:, here]))

    def _lowest(self, s: int) -> tuple[float, int]:
        """Energy in K and J of the lowest level that exists, among those of the J solved by then."""
        while True:
            self._solve_more()
            found = [(e[g[s] > 0].min(), j) for j, (e, _, g) in enumerate(self._by_j) if (g[s] > 0).any()]
            if found:
                energy, j = min(found)
                return float(energy), j


def heaviest_component(weights: SpinWeights) -> float:
    """The largest weight that one component of a level can have."""
    if weights.rule == "irrep":
        return max(value / DIMENSIONS[name[0]] for name, value in zip(weights.classes, weights.values, strict=True))
    return float(max(weights.values))


def _summed(
    ladder: _Ladder, s: int, temperatures: Floats, relative_error: float, energies: bool, at_worst: float
) -> LevelSums:
    """The sums for one set of weights; each temperature leaves the loop at the J where its tail is small enough."""
    (ground, ground_j), kinds = ladder.ground[s], 3 if energies else 1
    sums, tails, best = np.zeros((3, len(temperatures))), _Tails(temperatures), _Best(len(temperatures))
    going = np.arange(len(temperatures))
    for j in range(JMAX_LIMIT):
        kelvin, plain, spin = ladder.at(j)
        x = np.clip((kelvin - ground) / temperatures[going, None], LOWEST_X, HIGHEST_X)
        terms = np.exp(-x) * np.array([np.ones_like(x), x, x * x])
        sums[:, going] += terms @ spin[s]
        tail = tails.after(going, ladder.heaviest[s] * (np.abs(terms) @ plain))
        if j < max(3, ground_j + 2):
            continue
        beyond = bool(
            (kelvin[spin[s] > 0] < ground).any()
        )  # below the lowest level that exists: no energy of a molecule
        errors = relative_errors(sums[:, going], tail)
        best.take(going, j, sums[:, going], errors, errors[:kinds].max(axis=0))
        going = going[best.worst[going] >= relative_error]
        grown = tails.grows[going] | beyond
        reached = temperatures[best.worst <= max(relative_error, at_worst)]
        way_out = "lower the temperature" + ("" if energies else " or give Q") + _up_to(reached)
        what = (
            f"the levels of J = {j} fall below the lowest" if beyond else f"the sum over levels grows again at J = {j}"
        )
        tails.refuse(going[grown & (best.worst[going] > at_worst)], what, sums[0], way_out)
        going = going[~grown]
        if not len(going):
            return best.as_sums(temperatures, ground)
    raise _endless(temperatures[going].max())


def _endless(hottest: float) -> ValueError:
    return ValueError(f"Q({hottest:g} K) needs levels beyond J = {JMAX_LIMIT - 1}; use the classical limit")


def _up_to(reached: Floats) -> str:
    """Of the temperatures asked for those that can be had, if there are any."""
    return f"; of those asked for the sum can be had up to {reached.max():g} K" if len(reached) else ""


def relative_errors(moments: Floats, tails: Floats) -> Floats:
    """Relative truncation errors (3, n) of Q, U and C_v, from moments of x and the tails left out of them, (3, n).

    To first order in the tails t: δ⟨x⟩ ≤ (t₁ + ⟨x⟩ t₀)/Q and δC ≤ (t₂ + 2⟨x⟩ t₁ + |2⟨x⟩² - ⟨x²⟩| t₀)/Q. Nothing left out of
    nothing is no error.
    """
    q = moments[0]
    mean, square = moments[1] / q, moments[2] / q
    t0, t1, t2 = tails / q
    absolute = np.array([t0, t1 + mean * t0, t2 + 2 * mean * t1 + np.abs(2 * mean**2 - square) * t0])
    values = np.array([np.ones_like(q), mean, square - mean**2])
    ratio = np.full_like(absolute, np.inf)
    np.divide(absolute, values, out=ratio, where=values > 0)
    return np.where(absolute == 0, 0.0, ratio)


class _Tails:
    """The part of each sum beyond the last J, by the ratio of the last two terms, t r/(1 - r), for every temperature."""

    def __init__(self, temperatures: Floats) -> None:
        n = len(temperatures)
        self._temperatures = temperatures
        self._last = np.zeros((3, n))
        self._highest, self._lowest = np.zeros(n), np.full(n, np.inf)  # of the terms of Q, and since the highest
        self.grows = np.zeros(n, dtype=bool)

    def after(self, going: Ints, terms: Floats) -> Floats:
        """The tails (3, n) once the terms (3, n) of one more J are added; endless while they grow."""
        before, highest, lowest = self._last[:, going], self._highest[going], self._lowest[going]
        self.grows[going] = (terms[0] > 2 * lowest) & (lowest < highest / 2)  # has fallen, and grows again
        self._lowest[going] = np.where(terms[0] >= highest, terms[0], np.minimum(lowest, terms[0]))
        self._highest[going] = np.maximum(highest, terms[0])
        self._last[:, going] = terms
        falls = terms < before
        tail = terms * (terms / np.where(falls, before - terms, 1.0))
        return np.where(terms == 0, 0.0, np.where(falls, tail, ENDLESS))

    def refuse(self, grown: Ints, what: str, totals: Floats, way_out: str) -> None:
        """ValueError for the first of the temperatures where the sum has lost its meaning, if there is one."""
        if len(grown):
            share = self._last[0, grown[0]] / totals[grown[0]]
            raise ValueError(
                f"Q({self._temperatures[grown[0]]:g} K): {what}; the distortion "
                f"constants are used beyond their reach (tail {share:.1e} of Q there); {way_out}"
            )


class _Best:
    """Of the sums up to each J those with the least error, for every temperature."""

    def __init__(self, n: int) -> None:
        self.worst = np.full(n, np.inf)
        self._moments, self._errors, self._jmax = np.zeros((3, n)), np.zeros((3, n)), np.zeros(n, dtype=np.int64)

    def take(self, going: Ints, j: int, moments: Floats, errors: Floats, worst: Floats) -> None:
        """Keep what is better than before: moments and errors (3, m), and the largest error that counts (m,)."""
        better = worst <= self.worst[going]
        these = going[better]
        self.worst[these], self._jmax[these] = worst[better], j
        self._moments[:, these], self._errors[:, these] = moments[:, better], errors[:, better]

    def as_sums(self, temperatures: Floats, ground_k: float) -> LevelSums:
        q, first, second = self._moments
        mean = first / q
        return LevelSums(temperatures, ground_k, q, mean, second / q - mean**2, self._jmax, *self._errors)
