"""The smallest J max of an alignment: the block that holds most of the gas, carried with fewer J by the same steps.

With too few J population reaches the highest of them, and is turned back there. Two things say so: the population of the two highest J,
and by how much the cosines differ from those of the larger basis. The larger of both is taken, of the block of lowest M with the largest
population, where light couples most.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.alignment import observables as observe
from rotor.alignment.acting import contractions_of
from rotor.alignment.carry import EDGE, Outcome, Plan, Problem, run
from rotor.alignment.pulse import RAD_PER_PS_MHZ
from rotor.alignment.steps import PILOT_TIMES, pilot_of, pilot_task, relative_edge
from rotor.alignment.timeline import timeline

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.arrays import Floats


def least_jmax(trace: AlignmentTrace, allowed: float) -> tuple[int, float]:
    """The smallest J max whose truncation moves the cosines by less than `allowed`, and that truncation error.

    Parameters
    ----------
    trace : AlignmentTrace
        Of a basis that is large enough.
    allowed : float
        Of the cosines.

    Returns
    -------
    int
        J max, not above that of the trace.
    float
        The estimate for it: the larger of the population of its two highest J and of the change of the cosines; 0 for that of the trace.

    Notes
    -----
    Of one block; `AlignmentTrace.edge_population` of a run with this J max says what all blocks have at the edge.
    """
    problem = _problem_of(trace)
    pilot = pilot_of(problem, trace.jmax)
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

    jmax: at least that of the populated levels.
    """
    from rotor.alignment.align import carried

    problem = _problem_of(trace)
    return carried(problem, pilot_of(problem, jmax))


def _problem_of(trace: AlignmentTrace) -> Problem:
    followed = tuple(observe.observable(name, trace.top) for name in trace.cosines)
    windows = timeline(trace.pulses)
    acting = contractions_of(trace.top, windows)
    return Problem(
        trace.top, trace.pulses, windows, trace.t_ps, trace.ensemble, followed, trace.tolerance, acting
    )  # fmt: skip


def _signals(problem: Problem, jmax: int, plan: Plan) -> tuple[list[Floats], float]:
    """Every cosine of the largest block within and after the pulses, and the population at the edge, of what is in the block."""
    space = problem.space(jmax)
    task, _ = pilot_task(problem, space)
    assert task is not None  # populated levels are below every J max that is tried
    outcome = run(replace(task, plan=plan))
    energies, share = RAD_PER_PS_MHZ * space.levels.energy_mhz, float(task.weights.sum())
    period = max(float(problem.times[-1]) - problem.windows[-1].stop_ps, 0.0)
    times = np.linspace(0.0, period, PILOT_TIMES)
    after = [observe.harmonics([free], energies, 0.0).at(times) / share for free in outcome.free[-1]]
    return [*after, *_within(outcome, share)], relative_edge(outcome, task)


def _within(outcome: Outcome, share: float) -> list[Floats]:
    return [np.ravel(samples) / share for samples in outcome.samples]
