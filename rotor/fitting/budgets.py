"""Error budgets of a fit (`rotor.requests.budget`): its constants, in standard errors, and the frequencies of its lines, in MHz.

A change δr of the weighted residuals moves each constant, and each prediction, by at most |δr| times its standard error. This is the
Cauchy-Schwarz inequality with the covariance (JᵀJ)⁻¹.

| term | constants, standard errors | frequencies, MHz |
|---|---|---|
| rounding | √Σ (δν/σ_i)², δν of the energies | δν, and that times σ(ν) |
| truncation | twice the next step, since each step at least halves the remaining distance | that times σ(ν) |
| model | √(χ²/f - 1) where χ²/f, f degrees of freedom, is two deviations √(2/f) above 1; else 0 | times the error of a line |
| data | 1: the errors of the lines | σ(ν) |
| statistics | 1/√(2f): relative uncertainty of errors derived from the scatter | that times σ(ν) |
"""

from __future__ import annotations

import math

import numpy as np

from rotor.fitting.result import Fit
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.table import counted

REMAINING = 2.0  # times the next step: each step at least halves the distance to the minimum
CONFIDENCE, NORMAL = 0.95, 1.959963984540054  # two-sided, in standard deviations of a normal distribution
SIGNIFICANT = 2.0  # standard deviations of χ²/f above 1; exceeded by chance in 2 % of fits
CONSTANTS = "constants"
TIGHTER, LINES = "a smaller tolerance of the search", "more lines, or more precise ones"
UNCHECKED = "as many frequencies as constants: nothing checks the model"


def constants_budget(fit: Fit) -> ErrorBudget:
    """The errors of the fitted constants, in standard errors."""
    return _budget(fit, CONSTANTS, "standard errors", 1.0, 0.0, 1.0)


def predictions_budget(fit: Fit) -> ErrorBudget:
    """The largest error from each source (MHz) among the calculated frequencies of the lines that count."""
    calculated_errors = fit.calculated_errors_mhz[fit.used]
    sigma = float(calculated_errors.max(initial=0.0))
    line = float(fit.line_errors_mhz[fit.used].max(initial=0.0))
    return _budget(fit, "predicted frequencies", "MHz", sigma, fit.rounding_mhz, line)


def _budget(fit: Fit, of: str, unit: str, scale: float, rounding: float, line: float) -> ErrorBudget:
    """scale : one standard error. rounding : error added to that from shifted constants. line : size of a weighted residual of 1."""
    if not math.isfinite(scale) or (of == CONSTANTS and not np.isfinite(fit.errors).all()):
        lost = ", ".join(combination.text for combination in fit.statistics.undetermined)
        unknown = ErrorTerm(None, f"not determined by these lines: {lost}", LINES)
        return ErrorBudget(of, unit, unknown, unknown, unknown, unknown, unknown)
    free = fit.degrees_of_freedom
    moved = scale * weighted_rounding(fit)
    return ErrorBudget(
        of=of,
        unit=unit,
        rounding=ErrorTerm(rounding + moved, "energies in double precision"),
        truncation=ErrorTerm(
            scale * REMAINING * fit.minimum.distance,
            f"twice the next step, after {len(fit.minimum.iterations)}",
            TIGHTER,
        ),
        model=_misfit(fit, line),
        data=ErrorTerm(scale, f"errors of {len(fit.groups)} frequencies; {confidence_text(free)}", LINES),
        statistics=ErrorTerm(scale / math.sqrt(2 * free), freedom_text(fit), LINES)
        if free
        else ErrorTerm(None, UNCHECKED, LINES),
    )


def freedom_text(fit: Fit) -> str:
    """The degrees of freedom, and what they count where some data are a-priori values."""
    text = f"{counted(fit.degrees_of_freedom, 'degree')} of freedom"
    priors = fit.parameters.prior_count
    if not priors:
        return text
    data = f"{len(fit.residuals) - priors} frequencies and {counted(priors, 'a-priori value')}"
    return f"{text} from {data} for {counted(fit.statistics.rank, 'constant')}"


def weighted_rounding(fit: Fit) -> float:
    """Norm of the rounding errors in the weighted residuals."""
    sigma = fit.line_errors_mhz[fit.groups]
    return fit.rounding_mhz * float(np.sqrt(np.sum(1.0 / sigma[sigma > 0] ** 2)))


def _misfit(fit: Fit, line: float) -> ErrorTerm:
    free = fit.degrees_of_freedom
    if not free:
        return ErrorTerm(None, UNCHECKED, LINES)
    # reduced χ² of normal residuals has a standard deviation of √(2/free)
    excess, scatter = fit.reduced_chi**2 - 1.0, math.sqrt(2.0 / free)
    if excess <= SIGNIFICANT * scatter:
        # the largest misfit that the scatter of χ² can hide
        hidden = math.sqrt(max(excess, 0.0) + SIGNIFICANT * scatter)
        return ErrorTerm(
            0.0,
            f"no misfit: reduced chi {fit.reduced_chi:.3g}; its scatter would hide one below {hidden:.2g} errors of a line",
        )
    return ErrorTerm(
        line * math.sqrt(excess),
        f"misfit of the lines beyond their errors, reduced chi {fit.reduced_chi:.3g}",
        "further constants",
    )


def confidence_text(free: int) -> str:
    """The 95 % confidence interval in standard errors; Student's distribution for errors from the scatter.

    >>> confidence_text(10)
    'at a confidence of 0.95 within 1.96 times this, 2.23 times the error from the scatter'
    """
    stated = f"at a confidence of {CONFIDENCE:g} within {NORMAL:.3g} times this"
    if not free:
        return stated
    # Student's t, because the scatter comes from the same residuals
    return f"{stated}, {student_quantile(free):.3g} times the error from the scatter"


def student_quantile(free: int) -> float:
    """The interval of Student's t that has the same probability as `NORMAL`, to 0.2 %; loading scipy takes longer than most fits.

    Source: M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions (1964), 26.7.5; f = 1 and 2 are in closed form.
    """
    if free <= 2:
        return math.tan(0.5 * math.pi * CONFIDENCE) if free == 1 else CONFIDENCE / math.sqrt(0.5 * (1 - CONFIDENCE**2))
    square = NORMAL * NORMAL
    terms = (
        (square + 1) / 4,
        ((5 * square + 16) * square + 3) / 96,
        (((3 * square + 19) * square + 17) * square - 15) / 384,
        ((((79 * square + 776) * square + 1482) * square - 1920) * square - 945) / 92160,
    )
    relative: float = sum(term / free**power for power, term in enumerate(terms, 1))
    return NORMAL * (1 + relative)
