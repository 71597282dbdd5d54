"""Error budgets of line lists: the errors of the levels behind them, at their strongest lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.estimates.budgets import NO_SAMPLES, data_term, model_term, rounding_term, truncation_term
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.quantum.estimates.beyond import Limit
    from rotor.quantum.levels import Levels

STRONG = 0.1  # of the strongest line: weaker ones do not count in the error that the constants make


def frequencies_budget(
    levels: Levels,
    limits: Sequence[Limit],
    intensities: Floats,
    errors_mhz: Floats | None,
    source: str | None,
    of: str = "frequencies",
) -> ErrorBudget:
    """The errors of frequencies of lines.

    Parameters
    ----------
    levels : Levels
        Behind the lines.
    limits : sequence of Limit
        What the calculation leaves out, at the J of the strongest lines.
    intensities : (n,) array
        In any unit; lines above a tenth of the strongest count for `data`.
    errors_mhz : (n,) array or None
        One standard deviation of each line by the uncertainty of the constants; NaN where it is not known.
    source : str or None
        Where they come from, or why there are none.
    of : str, optional
        Name of the observable.

    Returns
    -------
    ErrorBudget
        In MHz.
    """
    energy = rounding_term(levels.energy_mhz)
    assert energy.value is not None
    truncation = truncation_term(levels)
    return ErrorBudget(
        of=of,
        unit="MHz",
        rounding=replace(energy, value=2 * energy.value, source="difference of two eigenvalues in double precision"),
        truncation=truncation,
        model=model_term(limits),
        data=_strong_line_error(intensities, errors_mhz, source),
        statistics=NO_SAMPLES,
    )


def _strong_line_error(intensities: Floats, errors_mhz: Floats | None, source: str | None) -> ErrorTerm:
    if errors_mhz is None or not len(intensities):
        return data_term(None, source)
    strong = np.abs(intensities) >= STRONG * np.abs(intensities).max()
    known = errors_mhz[strong & np.isfinite(errors_mhz)]
    return data_term(known, f"{source}; largest of the lines above a tenth of the strongest")
