"""Measures by which one set of constants is preferred to another: χ², Akaike's criterion, cross-validation, the F-test."""

from __future__ import annotations

import math

import numpy as np

from rotor.fitting.fit import Fit

ROUNDING = 1e-12  # of a weighted residual: less is no scatter


def chi_squared(fit: Fit) -> float:
    """Σ of squared weighted residuals, a-priori values included."""
    return float(fit.residuals @ fit.residuals)


def aicc(fit: Fit) -> float:
    """Akaike's criterion, corrected for small samples; infinite where the lines are too few for it."""
    n, k = len(fit.residuals), fit.statistics.rank + 1  # the scale of the errors counts
    if n - k - 1 <= 0:
        return math.inf
    scatter = max(chi_squared(fit) / n, ROUNDING**2)  # lines that fit exactly have none
    return n * math.log(scatter) + 2 * k + 2 * k * (k + 1) / (n - k - 1)


def cross_validated_rms(fit: Fit) -> float:
    """Weighted rms of each line against the fit without it, to first order; infinite where a line stands alone."""
    left = 1.0 - fit.statistics.leverages[: len(fit.groups)]
    if (left < 1e-9).any():
        return math.inf
    parts = fit.residuals[: len(fit.groups)] / left
    return float(np.sqrt(parts @ parts / len(parts)))


def f_test(smaller: Fit, larger: Fit) -> tuple[float, float]:
    """F of the constants that the larger model has more, and the probability of one so large by chance."""
    from scipy.special import fdtrc

    more = larger.statistics.rank - smaller.statistics.rank
    free = larger.degrees_of_freedom
    if more < 1 or free < 1:
        return 0.0, 1.0
    left = max(chi_squared(larger), free * ROUNDING**2)  # lines that fit exactly leave no scatter to compare with
    ratio = (chi_squared(smaller) - chi_squared(larger)) / more / (left / free)
    return float(ratio), float(fdtrc(more, free, max(ratio, 0.0)))
