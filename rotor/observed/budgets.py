"""Error budget of fitted column densities (`rotor.requests.budget`) in percent, for the least certain of them.

| term | value |
|---|---|
| rounding | brightness in double precision |
| truncation | twice the next step of the search, in standard errors |
| model | relative error of the brightness of a single layer in equilibrium; the column density has the same error |
| data | frequencies of the catalogue are in the noise of the channels; strengths have no stated error |
| statistics | standard error by the noise of the channels, times √(χ²/ν) where that is above 1 |
"""

from __future__ import annotations

import math

from rotor.observed.fit import SourceFit
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

REMAINING = 2.0  # distance to the minimum in next steps: each step of the search at least halves it
COLUMN = "column_per_cm2"


def columns_budget(fit: SourceFit | None, model_error: float) -> ErrorBudget:
    """Error budget of the column densities of a fit; model_error: relative error of the brightness."""
    statistics = _statistics(fit)
    left = None if fit is None or statistics.value is None else REMAINING * fit.minimum.distance * statistics.value
    return ErrorBudget(
        of="column densities",
        unit="%",
        rounding=ErrorTerm(100 * ROUNDING, "brightness in double precision"),
        truncation=ErrorTerm(left, statistics.source if left is None else "twice the next step of the search"),
        model=ErrorTerm(100 * model_error, "one layer in equilibrium, by the error of the model that is given"),
        data=ErrorTerm(None, "strengths of catalogues have no stated error; errors of frequencies are in the noise"),
        statistics=statistics,
    )


def _statistics(fit: SourceFit | None) -> ErrorTerm:
    """The largest relative standard error of a column density."""
    if fit is None:
        return ErrorTerm(None, "no species is found")
    columns = [row for row in fit.parameters if row["parameter"] == COLUMN]
    unknown = [row["name"] for row in columns if not row["determined"]]
    if unknown or not columns:
        return ErrorTerm(None, f"not determined by this spectrum: {', '.join(unknown) or COLUMN}")
    errors = [100 * row["error"] / row["value"] for row in columns]
    largest = max(errors)
    if not math.isfinite(largest):
        return ErrorTerm(None, "a column density without an error")
    return ErrorTerm(
        largest, f"noise of the channels, {columns[errors.index(largest)]['name']}", "a longer integration"
    )
