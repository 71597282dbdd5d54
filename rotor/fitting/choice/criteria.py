"""Criteria to compare sets of constants: χ², Akaike's criterion, cross-validation, the F-test."""

from __future__ import annotations

import math

import numpy as np

from rotor.fitting.result import Fit

ROUNDING = 1e-12  # weighted residuals below this are rounding, not scatter


def chi_squared(fit: Fit) -> float:
    """Σ of squared weighted residuals, a-priori values included."""
    return float(fit.residuals @ fit.residuals)


def aicc(fit: Fit) -> float:
    """Akaike's criterion, corrected for small samples; infinite if the lines are too few."""
    n, k = len(fit.residuals), fit.statistics.rank + 1  # the scale of the errors is a parameter too
    if n - k - 1 <= 0:  # the correction for small samples diverges
        return math.inf
    scatter = max(chi_squared(fit) / n, ROUNDING**2)  # an exact fit has no scatter
    return n * math.log(scatter) + 2 * k + 2 * k * (k + 1) / (n - k - 1)


def cross_validated_rms(fit: Fit) -> float:
    """Weighted rms of the leave-one-out residuals, to first order; infinite if a single line determines a constant."""
    left = 1.0 - fit.statistics.leverages[: len(fit.groups)]
    if (left < 1e-9).any():  # a line that alone determines a parameter cannot be predicted by the others
        return math.inf
    parts = fit.residuals[: len(fit.groups)] / left
    return float(np.sqrt(parts @ parts / len(parts)))


def f_test(smaller: Fit, larger: Fit) -> tuple[float, float]:
    """F of the additional constants of the larger model, and the probability of an F this large by chance."""
    from scipy.special import fdtrc

    more = larger.statistics.rank - smaller.statistics.rank
    free = larger.degrees_of_freedom
    if more < 1 or free < 1:
        return 0.0, 1.0
    left = max(chi_squared(larger), free * ROUNDING**2)  # an exact fit leaves no scatter to compare with
    ratio = (chi_squared(smaller) - chi_squared(larger)) / more / (left / free)
    return float(ratio), float(fdtrc(more, free, max(ratio, 0.0)))
