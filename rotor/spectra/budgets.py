"""Error budgets of line lists, from the errors of their levels at the strongest lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.estimates.budgets import NO_SAMPLES, data_term, model_term, rounding_term, truncation_term
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.quantum.estimates.limits import Limit
    from rotor.quantum.levels import Levels

STRONG = 0.1  # of the strongest line: weaker lines do not count for the error from the constants


def frequencies_budget(
    levels: Levels,
    limits: Sequence[Limit],
    intensities: Floats,
    errors_mhz: Floats | None,
    source: str | None,
    of: str = "frequencies",
) -> ErrorBudget:
    """Error budget of line frequencies.

    Parameters
    ----------
    levels : Levels
        The levels of the lines.
    limits : sequence of Limit
        Neglected effects at the J of the strongest lines.
    intensities : (n,) array
        In any unit; only lines above a tenth of the strongest count for `data`.
    errors_mhz : (n,) array or None
        Standard deviation of each line from the uncertainty of the constants; NaN if unknown.
    source : str or None
        Source of these errors, or the reason why there are none.
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
    # errors of weak lines do not describe the list
    strong = np.abs(intensities) >= STRONG * np.abs(intensities).max()
    errors = errors_mhz[strong & np.isfinite(errors_mhz)]
    return data_term(errors, f"{source}; largest of the lines above a tenth of the strongest")
