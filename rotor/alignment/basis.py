"""The smallest J max of an alignment: the most populated block is propagated with fewer J and the same steps.

In too small a basis, population is reflected at the highest J. The truncation error is the larger of the population of the two highest J
and the change of the cosines relative to the larger basis. It is computed for the most populated block of lowest M, where the coupling by
light is strongest.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.alignment import observables as observe
from rotor.alignment.acting import window_contractions
from rotor.alignment.propagation.carry import EDGE, Outcome, Plan, Problem, run
from rotor.alignment.propagation.steps import PILOT_TIMES, pilot_task, relative_edge, run_pilot
from rotor.alignment.propagation.timeline import timeline
from rotor.alignment.pulse import RAD_PER_PS_MHZ

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.arrays import Floats


def least_jmax(trace: AlignmentTrace, allowed: float) -> tuple[int, float]:
    """The smallest J max whose truncation changes the cosines by less than `allowed`, and this truncation error.

    Parameters
    ----------
    trace : AlignmentTrace
        A run with a sufficiently large basis.
    allowed : float
        Largest truncation error of the cosines.

    Returns
    -------
    int
        J max, at most that of the trace.
    float
        Its truncation error, see above; 0 for the J max of the trace.

    Notes
    -----
    The estimate is for one block; `AlignmentTrace.edge_population` of a run with this J max covers all blocks.
    """
    problem = _traced_problem(trace)
    pilot = run_pilot(problem, trace.jmax)
    if pilot.task is None:
        return trace.jmax, 0.0
    true = _signals(problem, trace.jmax, pilot.plan)[0]
    misses, reaches, error = trace.ensemble.jmax + EDGE - 1, trace.jmax, 0.0
    while reaches > misses + 1:
        tried = (misses + reaches) // 2
        signals, edge = _signals(problem, tried, pilot.plan)
        largest_error = max(
            edge, max(float(np.abs(a - b).max(initial=0.0)) for a, b in zip(signals, true, strict=True))
        )
        if largest_error <= allowed:
            reaches, error = tried, largest_error
        else:
            misses = tried
    return reaches, error


def trace_with(trace: AlignmentTrace, jmax: int) -> AlignmentTrace:
    """Cosines recomputed with any J max; `align` itself refuses a J max too small for its tolerance.

    jmax: at least the highest J of the populated levels.
    """
    from rotor.alignment.align import carried

    problem = _traced_problem(trace)
    return carried(problem, run_pilot(problem, jmax))


def _traced_problem(trace: AlignmentTrace) -> Problem:
    followed = tuple(observe.observable(name, trace.top) for name in trace.cosines)
    windows = timeline(trace.pulses)
    acting = window_contractions(trace.top, windows)
    return Problem(
        trace.top, trace.pulses, windows, trace.t_ps, trace.ensemble, followed, trace.tolerance, acting
    )  # fmt: skip


def _signals(problem: Problem, jmax: int, plan: Plan) -> tuple[list[Floats], float]:
    """All cosines of the largest block during and after the pulses, and its population at the edge, relative to that of the block."""
    space = problem.space(jmax)
    task, _ = pilot_task(problem, space)
    assert task is not None  # populated levels are below all trial values of J max
    outcome = run(replace(task, plan=plan))
    energies, share = RAD_PER_PS_MHZ * space.levels.energy_mhz, float(task.weights.sum())
    period = max(float(problem.times[-1]) - problem.windows[-1].stop_ps, 0.0)
    times = np.linspace(0.0, period, PILOT_TIMES)
    after = [observe.harmonics([free], energies, 0.0).at(times) / share for free in outcome.free[-1]]
    return [*after, *_within(outcome, share)], relative_edge(outcome, task)


def _within(outcome: Outcome, share: float) -> list[Floats]:
    return [np.ravel(samples) / share for samples in outcome.samples]
