"""Sums over rotational levels, J by J: the partition function, and the mean and spread of the energy with it.

With x = E/kT, E from the lowest level that exists, and g = g_I (2J+1),

    Q = Σ g e⁻ˣ,      U/RT = Σ g x e⁻ˣ / Q,      C_v/R = Σ g x² e⁻ˣ / Q - (U/RT)²

(J. E. Mayer and M. Goeppert Mayer, Statistical Mechanics, Wiley 1940, chapter 6). The tail beyond the last J is bounded by a
geometric series. Its terms use the largest spin weight for all levels, so that they are smooth in J even if some weights are 0.

Levels beyond the range of the distortion constants enter with energies from simpler constants, see `trusted_levels`; the change of
the sum if they had their lowest possible energies is added to the error.

If the sum would be long and the corrected classical limit reaches the requested error, no levels are solved.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID, centrifugal_operators
from rotor.quantum.levels import Levels, weights_of_levels
from rotor.quantum.solve import solve_levels
from rotor.thermodynamics.sums.classical_limit import classical_limit
from rotor.thermodynamics.sums.species import weights_in_species
from rotor.thermodynamics.sums.trusted_levels import trusted_energies_mhz
from rotor.tops.internal_rotation import sigma_species
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


STRIDE = 8  # number of J solved at a time
LONG_SUM = 60  # J above which the corrected classical limit replaces the sum if its error is small enough
LOOSE = 1e-3  # errors above this count as this, so that a looser request does not switch from the limit back to a sum
MOST_J = {"asymmetric": 1000}  # longest sum; J 4000 for other kinds: both take some seconds
MOST_J_DISTORTED = {
    "asymmetric": 800
}  # with distortion all levels are solved, and up to two simpler approximations of them
QUICK_PRODUCTS = 1e9  # Σ n³ of the diagonalizations, about 5e-9 s each
QUICK_TURNING_PRODUCTS = 1e11  # the same for large blocks, of which populated functions are a part: about 3e-11 s each
HIGHEST_KT = 80.0  # energy over kT above which rigid levels are left out: e⁻⁸⁰ of 10⁹ states is 1e-26
JMAX_LIMIT = 4000
AT_WORST = 0.1  # estimated relative error above which a sum is refused
HIGHEST_KT_OF_TORSION = 30.0  # the limit with internal rotation: e⁻³⁰ times 10⁷ states is 1e-6
LOWEST_X, HIGHEST_X = -300.0, 1e4  # levels of weight 0 may lie below the lowest existing one; the limits avoid overflow
ENDLESS = 1e150  # marks an unknown tail: the terms still grow
NOT_SUMMED = -1  # J max if the classical limit was used
DIMENSIONS = {"A": 1, "E": 2, "F": 3, "G": 4, "H": 5}

Progress = Callable[[int, int], object]


class OutOfReachError(ValueError):
    """The levels populated at a temperature lie beyond the range of the constants or of a sum.

    reasons: by refused temperature in K.
    """

    def __init__(self, reasons: Mapping[float, str], others: str = "") -> None:
        super().__init__(next(iter(reasons.values())) + others)
        self.reasons = reasons


@dataclass(frozen=True)
class LevelSums:
    """Sums over the levels for one set of spin weights at n temperatures.

    ground_k: lowest level over k in K, from the zero of the Hamiltonian. q, energy_over_rt, cv_over_r: (n,), from that level.
    jmax: (n,), the last J of the sum, -1 for the classical limit. error_q, error_energy, error_cv: (n,), estimated relative errors from
    truncation and from levels that are not trusted.
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
    """Temperatures as an array (n,); ValueError if one is not above 0 K."""
    temperatures = np.atleast_1d(np.asarray(temperatures_k, dtype=np.float64)).ravel()
    for t in temperatures.tolist():
        if not (math.isfinite(t) and t > 0):
            raise ValueError(f"temperature {t} K: a temperature is above 0 K")
    return temperatures


def level_sums(
    top: Top,
    weights: Sequence[SpinWeights],
    temperatures_k: ArrayLike,
    relative_error: float = 1e-8,
    *,
    energies: bool = True,
    at_worst: float = AT_WORST,
    refuse: bool = True,
    progress: Progress | None = None,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
) -> list[LevelSums]:
    """Q, U/RT and C_v/R of a top for several sets of spin weights; the levels are solved once.

    Parameters
    ----------
    top : Top
    weights : sequence of SpinWeights
    temperatures_k : array_like
        (n,), above 0 K.
    relative_error : float
        Largest error of Q, and with `energies` of U and C_v too. At each temperature the sum ends when its tail is smaller.
        If it would extend beyond J = 60 and the corrected classical limit is as accurate, the limit is used.
    energies : bool
        Whether the error limit applies to U and C_v too.
    at_worst : float
        Largest estimated error of a result.
    refuse : bool
        False: return sums with a larger error too, for a caller that checks the errors; see `refusal`.
    progress : callable, optional
        Called as `progress(j, last)` when more levels are solved; `last` is the expected last J.
    effects : sequence of QuantumEffect
        Effects in the Hamiltonian. With effects beyond the semi-rigid ones all levels are solved and trusted.

    Returns
    -------
    list of LevelSums
        One for each set of weights. Their errors can exceed `relative_error` if levels beyond the range of the distortion
        constants are populated.

    Raises
    ------
    ValueError
        A temperature not above 0 K; an error above `at_worst`, unless `refuse` is False.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=60 GHz")
    >>> sums = level_sums(top, [top.spin_weights], [300.0])[0]
    >>> round(float(sums.q[0]), 4), round(float(sums.cv_over_r[0]), 6)  # T/Θ + 1/3 + ..., 1 + (Θ/T)²/45 + ...
    (104.5171, 1.000002)
    """
    temperatures, kinds = checked_temperatures(temperatures_k), 3 if energies else 1
    ladder = _Ladder(top, tuple(weights), tuple(effects), progress)
    longest = ladder.longest
    expected = _last_j(top, temperatures, relative_error)
    errors = np.array([classical_limit(top, each).errors(temperatures)[:kinds].max(axis=0) for each in weights])
    long_sum = _last_j(top, temperatures, min(relative_error, LOOSE)) > LONG_SUM
    limit_serves = long_sum & (errors <= relative_error) | (expected > longest) & (errors <= at_worst)
    limit_serves &= ladder.semi_rigid
    ladder.reach(temperatures[~limit_serves.all(axis=0)].max(initial=0.0))
    sums = []
    for s, classical in enumerate(limit_serves):
        parts = np.zeros((7, len(temperatures)))
        parts[:, classical] = _expanded(ladder, s, temperatures[classical])
        if not classical.all():
            hottest = expected[~classical].max()
            ladder.last = int(min(hottest, longest))
            enough = (relative_error, 2 * at_worst)
            parts[:, ~classical] = _summed(ladder, s, temperatures[~classical], enough, kinds)
        q, energy, cv, jmax, *estimated = parts
        sums.append(LevelSums(temperatures, ladder.ground[s][0], q, energy, cv, jmax.astype(np.int64), *estimated))
        if refuse:
            _refuse_inexact(sums[-1], kinds, at_worst)
    return sums


def lowest_level_k(
    top: Top, weights: Sequence[SpinWeights], effects: Sequence[QuantumEffect] = SEMI_RIGID
) -> list[float]:
    """E/k in K of the lowest existing level for each set of spin weights, from the zero of the Hamiltonian."""
    return [energy for energy, _ in _Ladder(top, tuple(weights), tuple(effects)).ground]


def is_quick(top: Top, temperature_k: float, relative_error: float = 1e-6) -> bool:
    """Whether the sum at a temperature takes at most some seconds; blocks cost their cube.

    A J has four blocks of S mixed states with (2J + 1)/4 levels each; with internal rotation a block of 2J + 1 times the torsional
    functions for each species.

    >>> from rotor.tops.top import Top
    >>> mixed = {"A": 9400.0, "B": 3100.0, "C": 2500.0, "E[1]": 6e4, "A[1]": 9480.0, "B[1]": 3090.0, "C[1]": 2497.0, "G_c[0,1]": 450.0}
    >>> [is_quick(Top.from_constants(mixed), kelvin) for kelvin in (75.0, 300.0)]
    [True, False]
    """
    turning = top.internal_rotation
    if turning is None and (top.states is None or not top.states.couplings):
        return True
    last = float(_last_j(top, np.array([temperature_k]), relative_error)[0])
    if turning is not None:  # the sum over J of (2J functions)³
        return len(sigma_species(turning.tops)) * 2 * last**4 * turning.functions**3 <= QUICK_TURNING_PRODUCTS
    assert top.states is not None
    return (top.states.count * last) ** 3 * last / 8 <= QUICK_PRODUCTS  # 4 blocks per J: the sum over J of 4 (S J/2)³


def _last_j(top: Top, temperatures: Floats, relative_error: float) -> Floats:
    """Estimate of the last J of a sum: J² Θ/T, with Θ of the smallest constant, slightly above ln(1/error)."""
    least_k = min(top.rotational_constants_mhz) / units.MHZ_PER_K
    return np.sqrt((3.0 - math.log(min(relative_error, 0.1))) * temperatures / least_k)


def _refuse_inexact(sums: LevelSums, kinds: int, at_worst: float) -> None:
    """Raise OutOfReachError for the temperatures whose estimated error exceeds `at_worst`."""
    worst = np.max([sums.error_q, sums.error_energy, sums.error_cv][:kinds], axis=0)
    bad = worst > at_worst
    if bad.any():
        good = sums.temperatures_k[~bad]
        others = f"; of those asked for the sum can be had up to {good.max():g} K" if len(good) else ""
        pairs = zip(sums.temperatures_k[bad].tolist(), worst[bad].tolist(), strict=True)
        raise OutOfReachError({t: refusal(t, error, at_worst) for t, error in pairs}, others)


def refusal(temperature_k: float, error: float, at_worst: float = AT_WORST) -> str:
    """The message for a sum that is refused because of its estimated relative error."""
    how_much = f"{error:.1e} of it" if error < 1 else "all of it"
    return (
        f"Q({temperature_k:g} K): populated levels lie beyond the reach of the distortion constants or of the sum "
        f"(estimated error {how_much}, above {at_worst:g}); lower the temperature, or give Q"
    )


class Shell(NamedTuple):
    """The levels of one J: energies (n,) in K, degeneracies without spin (n,) and with spin (sets, n).

    lower: lowest possible energies (n,) in K of untrusted levels; None if all are trusted.
    """

    kelvin: Floats
    plain: Floats
    spin: Floats
    lower: Floats | None


class _Ladder:
    """Levels by J, solved on demand."""

    def __init__(
        self,
        top: Top,
        weights: tuple[SpinWeights, ...],
        effects: tuple[QuantumEffect, ...] = SEMI_RIGID,
        progress: Progress | None = None,
    ) -> None:
        self.top, self.weights, self._effects, self._progress = top, weights, effects, progress
        self.semi_rigid = effects == SEMI_RIGID and top.states is None and top.internal_rotation is None
        self._rigid = self.semi_rigid and top.level_table is None and not centrifugal_operators(top.constants)
        self.longest = (MOST_J if self._rigid else MOST_J_DISTORTED).get(top.kind, JMAX_LIMIT)
        self._below_mhz = math.inf
        self._by_j: list[Shell] = []
        self.last = 0
        others = [] if top.states is None else list(top.states.weights.values())
        self.heaviest = [
            max(heaviest_component(each) for each in (weights_of_species, *others)) for weights_of_species in weights
        ]
        self.ground = [self._lowest(s) for s in range(len(weights))]

    def reach(self, hottest_k: float) -> None:
        """Restrict J not yet solved to levels that are populated at this temperature."""
        if self._rigid or self.top.internal_rotation is not None:
            ground = max(energy for energy, _ in self.ground)
            highest = HIGHEST_KT if self._rigid else HIGHEST_KT_OF_TORSION
            self._below_mhz = (ground + highest * hottest_k) * units.MHZ_PER_K

    def at(self, j: int) -> Shell:
        """The levels of one J."""
        while len(self._by_j) <= j:
            self._solve_more()
        return self._by_j[j]

    def _solve_more(self) -> None:
        first = len(self._by_j)
        last = first + max(STRIDE, first // 8) - 1
        if self._progress is not None:
            self._progress(first, max(self.last, first))
        levels = solve_levels(
            self.top, last, jmin=first, effects=self._effects, vectors=False, below_mhz=self._below_mhz
        )
        plain = levels.states.astype(np.float64)
        spin = np.array([levels.multiplicity * self._weights(levels, each) for each in self.weights], dtype=float)
        energies = lower = levels.energy_mhz
        if self.semi_rigid:
            energies, lower = trusted_energies_mhz(self.top, levels)
        order = np.argsort(levels.rotational, kind="stable")
        order = order[energies[order] <= self._below_mhz]
        starts = np.searchsorted(levels.rotational[order], np.arange(first, last + 2))
        for start, stop in itertools.pairwise(starts.tolist()):
            here = order[start:stop]
            kelvin, low = energies[here] / units.MHZ_PER_K, lower[here] / units.MHZ_PER_K
            self._by_j.append(Shell(kelvin, plain[here], spin[:, here], low if (low < kelvin).any() else None))

    def _weights(self, levels: Levels, species: SpinWeights) -> Ints:
        """The spin weights of levels by one set; further states have their own weights in the classes of the set."""
        if "v" not in levels.quanta or self.top.states is None:
            return weights_of_levels(levels, species)
        total = np.zeros(len(levels), dtype=np.int64)
        for v in range(self.top.states.count):
            weights_of_state = self.top.states.weights.get(v)
            weights = weights_of_levels(
                levels, species if weights_of_state is None else weights_in_species(weights_of_state, species)
            )
            total = np.where(levels.quanta["v"] == v, weights, total)
        return total

    def _lowest(self, s: int) -> tuple[float, int]:
        """Energy in K and J of the lowest existing level among the J solved so far."""
        while True:
            self._solve_more()
            lowest = [
                (solved.kelvin[solved.spin[s] > 0].min(), j)
                for j, solved in enumerate(self._by_j)
                if (solved.spin[s] > 0).any()
            ]
            if lowest:
                energy, j = min(lowest)
                return float(energy), j


def heaviest_component(weights: SpinWeights) -> float:
    """The largest weight that one component of a level can have."""
    if weights.rule == "irrep":
        return max(value / DIMENSIONS[name[0]] for name, value in zip(weights.classes, weights.values, strict=True))
    return float(max(weights.values))


def _expanded(ladder: _Ladder, s: int, temperatures: Floats) -> Floats:
    """Rows Q, U/RT, C_v/R, J max and three errors (7, n) from the corrected classical limit, from the ground level."""
    limit = classical_limit(ladder.top, ladder.weights[s])
    q, energy, cv = limit.corrected(temperatures)
    below = ladder.ground[s][0] / temperatures
    unsummed = np.full(len(temperatures), float(NOT_SUMMED))
    return np.array([q * np.exp(below), energy - below, cv, unsummed, *limit.errors(temperatures)])


def _summed(ladder: _Ladder, s: int, temperatures: Floats, enough: tuple[float, float], kinds: int) -> Floats:
    """Rows Q, U/RT, C_v/R, J max and three errors (7, n) from the sum; a temperature is finished when its tail is small enough.

    enough: the requested relative error, and the error of untrusted levels above which the sum is abandoned.
    """
    longest = ladder.longest
    ground, ground_j = ladder.ground[s]
    n = len(temperatures)
    moments, doubts, tails = np.zeros((3, n)), np.zeros((3, n)), np.zeros((3, n))
    before, jmax, going = np.zeros((3, n)), np.full(n, longest), np.arange(n)
    for j in range(longest + 1):
        shell, t = ladder.at(j), temperatures[going, None]
        terms = _terms((shell.kelvin - ground) / t)
        moments[:, going] += terms @ shell.spin[s]
        if shell.lower is not None:
            doubts[:, going] += np.abs(_terms((shell.lower - ground) / t) - terms) @ shell.spin[s]
        smooth = ladder.heaviest[s] * (np.abs(terms) @ shell.plain)
        tails[:, going], before[:, going] = _tail(smooth, before[:, going]), smooth
        if j < max(3, ground_j + 2):
            continue
        # the energies of the distortion series decrease with J
        if not ladder.semi_rigid and shell.kelvin.min() < ladder.at(j - 1).kelvin.min():
            tails[:, going] = ENDLESS
            break
        errors = relative_errors(moments[:, going], tails[:, going])[:kinds]
        done = errors.max(axis=0) < enough[0]
        done |= doubts[0, going] > enough[1] * moments[0, going]
        jmax[going[done]] = j
        going = going[~done]
        if not len(going):
            break
    mean, square = moments[1] / moments[0], moments[2] / moments[0]
    return np.array([moments[0], mean, square - mean**2, jmax, *relative_errors(moments, tails + doubts)])


def _terms(x: Floats) -> Floats:
    """e⁻ˣ, x e⁻ˣ and x² e⁻ˣ of energies over kT, stacked."""
    x = np.clip(x, LOWEST_X, HIGHEST_X)
    return np.asarray(np.exp(-x) * np.array([np.ones_like(x), x, x * x]))


def _tail(terms: Floats, before: Floats) -> Floats:
    """Bound on the tail after the last term, t r/(1 - r), for terms that fall at least geometrically; `ENDLESS` while they grow."""
    falls = terms < before
    tail = terms * (terms / np.where(falls, before - terms, 1.0))
    return np.where(terms == 0, 0.0, np.where(falls, tail, ENDLESS))


def relative_errors(moments: Floats, tails: Floats) -> Floats:
    """Relative errors (3, n) of Q, U and C_v from moments of x and bounds on their tails, (3, n) each.

    To first order in the tails t: δ⟨x⟩ ≤ (t₁ + ⟨x⟩ t₀)/Q and δC ≤ (t₂ + 2⟨x⟩ t₁ + |2⟨x⟩² - ⟨x²⟩| t₀)/Q. A zero value with a zero
    tail has no error.
    """
    q = moments[0]
    mean, square = moments[1] / q, moments[2] / q
    t0, t1, t2 = tails / q
    absolute = np.array([t0, t1 + mean * t0, t2 + 2 * mean * t1 + np.abs(2 * mean**2 - square) * t0])
    values = np.array([np.ones_like(q), mean, square - mean**2])
    ratio = np.full_like(absolute, np.inf)
    np.divide(absolute, values, out=ratio, where=values > 0)
    return np.where(absolute == 0, 0.0, ratio)
