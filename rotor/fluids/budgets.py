"""Error budget of the temperature of a fluid (`rotor.requests.budget`).

Truncation: the largest deviation of the conserved energy from its mean over the run, as a temperature 2 ΔE/(f k) for f degrees of freedom.
For n steps between rows, it is at least the bound 1 + √(2 ln 2n) of the largest of n normal deviates, in standard deviations of the rows.
The deviation refers to the mean, not to the first row, because a box with newly drawn velocities deviates more than average.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from rotor import units
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rotor.fluids.record import FluidRecord
    from rotor.fluids.settings import Settings
    from rotor.fluids.summary import Mean


def temperature_budget(
    record: FluidRecord, settings: Settings, degrees: float, bodies: int, averages: Sequence[Mean]
) -> ErrorBudget:
    """The errors of the mean temperature of a run in K; degrees: of freedom of the box; averages: include the temperature."""
    temperature = next(mean for mean in averages if mean.quantity == "temperature")
    return ErrorBudget(
        of="temperature",
        unit="K",
        rounding=ErrorTerm(bodies * sys.float_info.epsilon * abs(temperature.mean), "sum over the molecules"),
        truncation=_step_error(record, settings, degrees),
        model=ErrorTerm(None, f"rigid molecules of the model {settings.model}", "another model"),
        data=ErrorTerm(None, "the parameters of the model have no stated uncertainty"),
        statistics=_statistical_error(temperature),
    )


def _step_error(record: FluidRecord, settings: Settings, degrees: float) -> ErrorTerm:
    """The error term of the step: largest deviation of the conserved energy from its mean."""
    if len(record) < 2 or not np.isfinite(record.total_ev).all():
        return ErrorTerm(None, "a run of fewer than two rows has no departure of its conserved energy")
    away = float(np.abs(record.total_ev - record.total_ev.mean()).max())
    if settings.every > 1:
        spread = float(record.total_ev.std()) * (1.0 + math.sqrt(2.0 / len(record)))  # its own error twice with it
        away = max(away, spread * (1.0 + math.sqrt(2.0 * math.log(2.0 * settings.steps))))
    source = f"conserved energy about its mean, with a step of {settings.step_fs:g} fs"
    return ErrorTerm(2.0 * away / (units.EV_PER_K * degrees), source, "a shorter step")


def _statistical_error(temperature: Mean) -> ErrorTerm:
    """The standard error of the mean over correlated rows."""
    if not math.isfinite(temperature.error):
        return ErrorTerm(None, "too few rows for a standard error", "a longer run")
    source = f"{temperature.effective_samples:.3g} independent rows; within 1.96 times this at a confidence of 0.95"
    return ErrorTerm(temperature.error, source, "a longer run")
