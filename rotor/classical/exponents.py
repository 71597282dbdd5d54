"""Lyapunov exponents with their errors, and the error budget of rates of growth (`rotor.requests.budget`).

| source | error of an exponent λ_i |
|---|---|
| finite time | 2 ln[(1 - e^-g t1)/(1 - e^-g t0)]/(t1 - t0), g = gap to the nearest exponent; 2 ln(t1/t0)/(t1 - t0) without a gap |
| integration | n tolerance (1 + e^λ1 τ) e^-λ_i τ: n steps per time, τ between orthogonalisations, where a vector is e^λ_i τ long |
| rounding | of a length once in τ, and of each step; central differences of a Jacobian that is not exact |
| statistics | standard error of the mean over segments |

t0 and t1 are the begin and end of the average, counted from the arbitrary initial tangent vectors. Consider two vectors whose lengths
grow with λ and λ - g. A vector initially along the second, sheared by s, has the length s (e^λt - e^(λ-g)t)/g. It grows faster than λ by
g/(e^gt - 1) ≤ 1/t, which the first line integrates; the factor 2 allows for bodies whose lengths also oscillate. A vector that starts
nearly along the wrong direction deviates more, but then the segments deviate too: the bound includes twice the standard error. Gaps are
reduced by three standard errors. λ1 is the largest exponent, or 0.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

DIFFERENCE = 6e-6  # relative step of central differences: cube root of the rounding of doubles
PER_TIME = "1/time"
EXACT_INPUT = "moments, torques and drives have no stated uncertainty"
STAGES = 12  # of DOP853: evaluations of a step
CONFIDENT = 2.0  # standard errors that an accuracy allows for


@dataclass(frozen=True)
class Growth:
    """Growth of the tangent vectors: rates (segments, m), mean trace of the Jacobian (segments,), steps per time.

    exact_slopes: whether the Jacobian is exact, not from differences. whole: whether all exponents of the flow were computed.
    """

    rates: Floats
    divergence: Floats
    steps: float
    exact_slopes: bool
    whole: bool


@dataclass(frozen=True)
class Settings:
    """Alignment time, measuring time, total time, time between orthogonalisations, and tolerance of a step."""

    before: float
    measured: float
    time: float
    interval: float
    tolerance: float

    @property
    def bias(self) -> float:
        """Bias ln(t2/t1)/(t2 - t1) from vectors that grow in proportion to time."""
        return float(np.log1p(self.measured / self.before) / self.measured)


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents, natural logarithm per time, largest first.

    values: (m,), means over segments of orbit. errors: (m,), the standard error of the mean and `bias`, added in squares.
    divergence: mean trace of the Jacobian, which the sum of a full spectrum equals. time: total time averaged over.
    bias: contribution of a linear growth in time, which is not an exponent (see the head of `rotor.classical.lyapunov`).
    rounding, truncation: (m,), bounds. spread: (m,), the standard error of the mean alone.
    """

    values: Floats
    errors: Floats
    divergence: float
    time: float
    bias: float
    rounding: Floats
    truncation: Floats
    spread: Floats

    @property
    def kaplan_yorke(self) -> float:
        """Kaplan-Yorke dimension of the full spectrum; exponents within three errors of zero count as zero."""
        # an exponent within three errors of 0 counts as 0: a flow always has one such
        return kaplan_yorke(np.where(np.abs(self.values) <= 3.0 * self.errors, 0.0, self.values))

    @property
    def reached(self) -> float:
        """The error to compare with an accuracy: bounds and twice the standard error of the least certain exponent."""
        return float(np.max(self.rounding + self.truncation + CONFIDENT * self.spread))

    @property
    def budget(self) -> ErrorBudget:
        """The errors of the exponents, the largest of each source.

        >>> exact = np.zeros(1)
        >>> Exponents(np.array([0.5]), exact, 0.5, 40.0, 0.1, exact, np.array([1e-9]), exact).budget.line()
        'errors of growth rates: numerical 1e-09 1/time, data not estimated: moments, torques and drives have no stated uncertainty'
        """
        return ErrorBudget(
            of="growth rates",
            unit=PER_TIME,
            rounding=ErrorTerm(float(self.rounding.max()), "lengths of tangent vectors in double precision"),
            truncation=ErrorTerm(
                float(self.truncation.max()),
                f"a time of {self.time:g}, in which neighbouring exponents mix, and steps to the tolerance",
                "a longer time",
            ),
            model=ErrorTerm(0.0, "the flow as it is given"),
            data=ErrorTerm(None, EXACT_INPUT),
            statistics=ErrorTerm(float(self.spread.max()), "scatter of the segments of the orbit", "a longer time"),
        )


def mean_exponents(growth: Growth, settings: Settings) -> Exponents:
    """Means over segments with their errors, the largest exponent first."""
    rates = growth.rates
    spread = np.std(rates, axis=0, ddof=1) / math.sqrt(len(rates))  # errors of a mean of independent segments
    mean = np.mean(rates, axis=0)
    order = np.argsort(-mean, kind="stable")
    values, spread = mean[order], spread[order]
    first, tau = max(float(values[0]), 0.0), settings.interval
    integration = growth.steps * settings.tolerance * (1.0 + math.exp(first * tau)) * np.exp(-values * tau)
    # what rounds off within an interval grows along the first exponent before the next orthogonalization
    rounding = ROUNDING * (growth.steps + np.exp((first - values) * tau) / tau)
    if not growth.exact_slopes:
        # central differences: the difference of two values of 8 ε over the step
        rounding = rounding + 8 * sys.float_info.epsilon / DIFFERENCE * (1.0 + np.abs(values).max())
    return Exponents(
        values=values,
        errors=np.hypot(spread, settings.bias),
        divergence=float(np.mean(growth.divergence)),
        time=settings.time,
        bias=settings.bias,
        rounding=rounding,
        truncation=np.asarray(_finite_time(values, spread, settings, growth.whole) + integration),
        spread=spread,
    )


def _finite_time(values: Floats, spread: Floats, settings: Settings, whole: bool) -> Floats:
    """Error of exponents from a finite time, by the gap to the nearest other exponent; without a gap for one that was not computed."""
    # gaps beyond three errors, else the exponents are taken as equal
    gaps = np.maximum(-np.diff(values) - 3.0 * np.hypot(spread[1:], spread[:-1]), 0.0)
    nearest = np.minimum(np.append(gaps, np.inf if whole else 0.0), np.append(np.inf, gaps))
    nearest = np.clip(nearest * settings.before, 1e-12, 1e3) / settings.before  # from ln(t1/t0) to twelve digits, to 0
    first, last = settings.before, settings.before + settings.measured
    return np.asarray(2 * np.log(np.expm1(-nearest * last) / np.expm1(-nearest * first)) / settings.measured)


def kaplan_yorke(exponents: ArrayLike) -> float:
    """Dimension j + Σ_{i<=j} λ_i / |λ_{j+1}|, j the largest number of exponents whose sum is not negative.

    (J. L. Kaplan and J. A. Yorke, Lect. Notes Math. 730, 204 (1979).) It is the dimension of the space if the sum of all exponents
    is not negative, and 0 if the first exponent is negative.

    >>> kaplan_yorke([0.5, 0.0, -2.0])
    2.25
    """
    values = np.sort(np.asarray(exponents, dtype=np.float64))[::-1]
    sums = np.cumsum(values)
    if sums[-1] >= 0.0:
        return float(values.size)  # all sums are positive: the dimension is that of the space
    j = int(np.argmax(sums < 0.0))
    return float(j + (sums[j - 1] / abs(values[j]) if j else 0.0))
