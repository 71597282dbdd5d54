"""Error budget of bond lengths (`rotor.requests.budget`) for the last method of a request: the largest error from each source.

With equal weights the covariance of a fit is s² (JᵀJ)⁻¹, where s² is the sum of squared residuals over the degrees of freedom. A change
δr of the residuals moves a length of standard error σ by at most σ/s |δr| (Cauchy-Schwarz inequality); so does a step δ of length
√(δᵀ JᵀJ δ) = |δr|. Rounding changes each moment by `ROUNDING` of its size; the search ends within twice its next step of the minimum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.structures.least_squares import FittedStructure
from rotor.structures.substitution import Value
from rotor.table import counted

REMAINING = 2.0  # times the next step: each step at least halves the distance to the minimum
NO_LENGTH = ErrorTerm(None, "no error of a bond length follows from these moments")
VIBRATION = {
    "rs": "effect of vibration on the moments; Costain's error is a part of it",
    "r0": "what vibration adds to the moments",
    "rm1": "vibration beyond c √I", "rm2": "vibration beyond c √I and d",
    "re": "the corrections of the constants are taken as they are",
}  # fmt: skip
REMEDY = "constants of more isotopologues"


def lengths_budget(method: str, values: Sequence[Value], fitted: FittedStructure | None, weights: str) -> ErrorBudget:
    """The errors of bond lengths in Å.

    Parameters
    ----------
    method : str
        rs, r0, rm1, rm2 or re.
    values : sequence of Value
        Bond lengths of the method; angles are ignored.
    fitted : FittedStructure or None
        The fit of these values; None for rs.
    weights : str
        Weights of the fit, "equal" or "errors".

    Returns
    -------
    ErrorBudget
    """
    length_errors = [value.error for value in values if value.unit == "Å" and math.isfinite(value.error)]
    quantity = f"bond lengths ({method})"
    # a held length has the error 0
    no_scatter = fitted is not None and weights == "equal" and not fitted.degrees_of_freedom
    if not length_errors or no_scatter:
        return ErrorBudget(quantity, "Å", *(NO_LENGTH,) * 5)
    sigma = max(length_errors)
    return ErrorBudget(
        of=quantity,
        unit="Å",
        **_numerical(sigma, fitted, weights),
        model=ErrorTerm(None, VIBRATION[method]),
        data=ErrorTerm(sigma, _source(fitted, weights), REMEDY),
        statistics=_statistics(sigma, fitted, weights),
    )


def _numerical(sigma: float, fitted: FittedStructure | None, weights: str) -> dict[str, ErrorTerm]:
    """Error terms of rounding and of the remaining step of the search."""
    if fitted is None:
        unknown = ErrorTerm(None, "Kraitchman's equations lose digits for atoms near an axis")
        return {"rounding": unknown, "truncation": ErrorTerm(0.0, "closed form")}
    scale = _scale(fitted, weights)
    if not scale:
        none = ErrorTerm(0.0, "the moments are met to the last digit")
        return {"rounding": none, "truncation": none}
    per_residual = sigma / scale
    errors = np.array([1.0 if weights == "equal" else moment.error for moment in fitted.moments])
    moments = np.array([moment.observed for moment in fitted.moments])
    rounded = ROUNDING * float(np.linalg.norm(moments / errors))
    left = REMAINING * fitted.minimum.distance
    return {
        "rounding": ErrorTerm(per_residual * rounded, "moments in double precision"),
        "truncation": ErrorTerm(
            per_residual * left, f"twice the next step of the search, after {len(fitted.minimum.iterations)}"
        ),
    }


def _scale(fitted: FittedStructure, weights: str) -> float:
    """The scale of the errors of a fit: the scatter of its residuals with equal weights, otherwise 1."""
    if weights != "equal":
        return 1.0
    return float(np.linalg.norm(fitted.minimum.residuals)) / math.sqrt(fitted.degrees_of_freedom)


def _source(fitted: FittedStructure | None, weights: str) -> str:
    if fitted is None:
        return "errors of the constants, and Costain's 0.0015 Å²/r"
    return f"{'scatter' if weights == 'equal' else 'errors'} of {len(fitted.moments)} moments"


def _statistics(sigma: float, fitted: FittedStructure | None, weights: str) -> ErrorTerm:
    if fitted is None or weights != "equal":
        return ErrorTerm(0.0, "errors do not follow from the scatter")
    return ErrorTerm(
        sigma / math.sqrt(2 * fitted.degrees_of_freedom),
        f"{counted(fitted.degrees_of_freedom, 'degree')} of freedom",
        REMEDY,
    )
