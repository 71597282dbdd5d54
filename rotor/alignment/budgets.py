"""Error budget of cosines of an aligned gas (`rotor.requests.budget`).

Truncation: the terms of `AlignmentTrace.error_estimate`. Model: a frequency error δ changes the phase of a coherence by 2π δ t after a
time t. The relative error of a cosine's deviation from the isotropic value is at most this phase, and at most 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rotor.alignment.align import phase_rounding
from rotor.alignment.pulse import RAD_PER_PS_MHZ
from rotor.quantum.estimates.budgets import NO_SAMPLES, model_term
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.quantum.estimates.limits import Limit


def cosines_budget(trace: AlignmentTrace, limits: Sequence[Limit]) -> ErrorBudget:
    """The errors of cosines, the largest over all times.

    Parameters
    ----------
    trace : AlignmentTrace
    limits : sequence of Limit
        Neglected contributions to frequencies, at the highest J that the gas reaches.

    Returns
    -------
    ErrorBudget
        Absolute errors of the cosines.
    """
    rounding = phase_rounding(trace)
    parts = {
        "steps": trace.step_error,
        "populations left out": trace.ensemble.left_out * trace.moved,
        "population at the edge of the basis": trace.edge_population,
    }
    source = ", ".join(f"{name} {value:.1e}" for name, value in sorted(parts.items(), key=lambda pair: -pair[1]))
    return ErrorBudget(
        of="cosines",
        unit="",
        rounding=ErrorTerm(rounding + trace.norm_error, "phases at the last time, norm of the states"),
        truncation=ErrorTerm(max(trace.error_estimate - rounding, 0.0), source, "a smaller tolerance"),
        model=cosine_model_error(trace, limits),
        data=ErrorTerm(None, f"the {_acting(trace)} no stated uncertainty"),
        statistics=NO_SAMPLES,
    )


def _acting(trace: AlignmentTrace) -> str:
    names = sorted({pulse.acts_on for pulse in trace.pulses})
    return " and ".join(names) + (" has" if len(names) == 1 else " have")


def cosine_model_error(trace: AlignmentTrace, limits: Sequence[Limit]) -> ErrorTerm:
    """Error of the cosines at the last time from errors of the frequencies."""
    term = model_term(limits)
    if term.value is None:
        return term
    passed = float(trace.t_ps[-1]) - min(pulse.window_ps[0] for pulse in trace.pulses)
    angle = RAD_PER_PS_MHZ * term.value * passed
    return replace(term, value=min(angle, 1.0) * trace.moved, source=f"phases after {passed:.3g} ps by {term.source}")
