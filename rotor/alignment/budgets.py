"""Error budget of cosines of an aligned gas (`rotor.requests.budget`).

Truncation: the terms of `AlignmentTrace.error_estimate`. Model: a frequency that is off by δ turns a coherence by 2π δ t in the time t, so
that a cosine is off by at most as much of its departure from the isotropic gas, and never by more than all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rotor.alignment.align import rounding_of_phases
from rotor.alignment.pulse import RAD_PER_PS_MHZ
from rotor.quantum.estimates.budgets import NO_SAMPLES, model_term
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.quantum.estimates.beyond import Limit


def cosines_budget(trace: AlignmentTrace, limits: Sequence[Limit]) -> ErrorBudget:
    """The errors of cosines, the largest over all times.

    Parameters
    ----------
    trace : AlignmentTrace
    limits : sequence of Limit
        What the calculation leaves out of frequencies, at the highest J that is populated before the pulses.

    Returns
    -------
    ErrorBudget
        Of numbers between -1 and 1.
    """
    rounding = rounding_of_phases(trace)
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
        model=model_of_cosines(trace, limits),
        data=ErrorTerm(None, f"the {_acting(trace)} no stated uncertainty"),
        statistics=NO_SAMPLES,
    )


def _acting(trace: AlignmentTrace) -> str:
    names = sorted({pulse.acts_on for pulse in trace.pulses})
    return " and ".join(names) + (" has" if len(names) == 1 else " have")


def model_of_cosines(trace: AlignmentTrace, limits: Sequence[Limit]) -> ErrorTerm:
    """What frequencies that are off make of the cosines at the last time after the first pulse."""
    term = model_term(limits)
    if term.value is None:
        return term
    passed = float(trace.t_ps[-1]) - min(pulse.window_ps[0] for pulse in trace.pulses)
    angle = RAD_PER_PS_MHZ * term.value * passed
    return replace(term, value=min(angle, 1.0) * trace.moved, source=f"phases after {passed:.3g} ps by {term.source}")
