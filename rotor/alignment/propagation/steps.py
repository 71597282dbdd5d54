"""Choice of method and number of steps for a tolerance, from runs of one block with repeatedly doubled steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotor.alignment import observables as observe
from rotor.alignment.propagation import propagate
from rotor.alignment.propagation.carry import Outcome, Plan, Problem, Task, block_task, run
from rotor.alignment.pulse import RAD_PER_PS_MHZ, Kick
from rotor.quantum.fields.blocks import FieldSpace

FIRST_STEPS = 4
LARGEST_SPLIT = 700  # most states of a block for diagonalisation of its operator
MOST_STEPS = 200_000
PILOT_COLUMNS = 64
PILOT_TIMES = 256
USUAL_STEPS = 15  # of the coarser of two runs; the finer one is used
USUAL_TOLERANCE = 1e-9  # that twice as many steps of a short pulse give
ASYMPTOTIC = 1e-4  # error of a cosine below which it falls as the order of the method says
SEARCH_WORK = 1e9  # complex products of a run, one to three seconds, above which a lower J max is looked for
SEARCH_TOLERANCE = 1e-3  # of a cosine, in runs that look for J max
SEARCH_EDGE = 0.03  # of the tolerance: population at the edge of such a run
SMALLEST_EDGE = 1e-30  # a population that is 0 for its logarithm


@dataclass(frozen=True)
class Pilot:
    """Result of test runs of the block M = 0: the plan, its steps, their error, and the population at the highest J."""

    plan: Plan
    steps: tuple[int, ...]
    error: float
    edge: float
    space: FieldSpace
    task: Task | None = None
    outcome: Outcome | None = None
    whole: bool = False  # whether task and outcome are all there is


def _grids(problem: Problem, steps: Sequence[int]) -> list[propagate.Grid | None]:
    """Grids with about this number of steps per window; None for a kick."""
    lengths = [(window.stop_ps - window.start_ps) / count for window, count in zip(problem.windows, steps, strict=True)]
    return [
        None if window.is_kick else propagate.step_grid(window, length, problem.times)
        for window, length in zip(problem.windows, lengths, strict=True)
    ]


def _step_plan(problem: Problem, grids: Sequence[propagate.Grid | None], rule: str | None, factor: int = 1) -> Plan:
    """The plan with `factor` times the steps of the grids; a Magnus method if `rule` is None."""
    out: list[propagate.KickPlan | propagate.Grid | float] = []
    for window, coarse in zip(problem.windows, grids, strict=True):
        if coarse is None:
            kick = window.channels[0].pulses[0]
            out.append(kick.area if isinstance(kick, Kick) else 0.0)
            continue
        grid = coarse if factor == 1 else coarse.refined(factor)
        splits = rule is not None and len(window.channels) == 1
        out.append(propagate.kick_plan(window, grid, propagate.splitting(rule)) if splits and rule else grid)
    return Plan(problem.windows, tuple(out))


def run_pilot(problem: Problem, jmax: int) -> Pilot:
    """Steps that meet the tolerance, determined with the most populated block M = 0."""
    space = problem.space(jmax)
    task, whole = pilot_task(problem, space)
    if task is None or all(window.is_kick for window in problem.windows):
        plan = _step_plan(problem, _grids(problem, [1] * len(problem.windows)), "nystrom 4")
        outcome = None if task is None else run(replace(task, plan=plan))
        edge = relative_edge(outcome, task) if outcome and task else 0.0
        return Pilot(plan, (0,) * len(problem.windows), 0.0, edge, space, task, outcome, whole)
    if _needs_magnus(problem, task):
        return replace(_refined(problem, space, task, None), whole=whole)
    if whole:
        rule = "nystrom 4" if problem.tolerance >= 1e-10 else "nystrom 6"
        order = propagate.splitting(rule).order
        first = max(USUAL_STEPS, math.ceil(USUAL_STEPS * (USUAL_TOLERANCE / problem.tolerance) ** (1 / order)))
        return replace(_refined(problem, space, task, rule, first, finer_order=order), whole=True)
    rules = propagate.SPLITTINGS if task.gradients is not None else propagate.SPLITTINGS[1:]
    best = _refined(problem, space, task, rules[0])
    for rule in rules[1:]:
        best = _refined(problem, space, task, rule, below=best)
    return best


def _needs_magnus(problem: Problem, task: Task) -> bool:
    """Whether the block is too large for eigenvectors of its operator, or several operators act in all windows."""
    return len(task.rows) > LARGEST_SPLIT or all(len(window.channels) > 1 for window in problem.windows)


def lowest_jmax(problem: Problem, guess: int) -> int:
    """A lower J max than the guess if a run with that takes long and the edge of a smaller basis stays empty in runs with coarse steps.

    The work of a run grows with the fourth power of J max or faster, and the guess has a margin of up to fifteen J.
    """
    if expected_work(problem, guess) < SEARCH_WORK:
        return guess
    coarse = replace(problem, tolerance=max(problem.tolerance, SEARCH_TOLERANCE), cached={})
    goal, seen, jmax = math.log(SEARCH_EDGE * problem.tolerance), list[tuple[int, float]](), problem.ensemble.jmax + 4
    while jmax < guess:
        seen.append((jmax, math.log(max(_coarse_edge(coarse, jmax), SMALLEST_EDGE))))
        if seen[-1][1] <= goal:
            return jmax
        jmax += _further(seen, goal)
    return guess


def _coarse_edge(problem: Problem, jmax: int) -> float:
    """Relative population of the two highest J of the pilot's block, with one method."""
    space = problem.space(jmax)
    task, _ = pilot_task(problem, space)
    if task is None:
        return 0.0
    return _refined(problem, space, task, None if _needs_magnus(problem, task) else "nystrom 4").edge


def _further(seen: Sequence[tuple[int, float]], goal: float) -> int:
    """How many J to add: the logarithm of the population at the edge falls at least linearly; two before two J maxima are known."""
    if len(seen) < 2:
        return 2
    (low, before), (high, now) = seen[-2:]
    slope = (before - now) / (high - low)
    return max(2, min(math.ceil((now - goal) / slope), high // 2)) if slope > 0 else 2


def expected_work(problem: Problem, jmax: int) -> float:
    """Complex products of a run of the pilot's block: drifts of `nystrom 4`, a step for each radian between J max and two below."""
    space = problem.space(jmax)
    task, _ = pilot_task(problem, space)
    if task is None:
        return 0.0
    centres = [float(np.mean(space.levels.energy_mhz[space.levels.j == j])) for j in (jmax - 2, jmax)]
    duration = sum(window.stop_ps - window.start_ps for window in problem.windows)
    steps = RAD_PER_PS_MHZ * abs(centres[1] - centres[0]) * duration
    return 6.0 * steps * len(task.rows) ** 2 * len(task.columns)


def _refined(
    problem: Problem,
    space: FieldSpace,
    task: Task,
    rule: str | None,
    first: int = FIRST_STEPS,
    below: Pilot | None = None,
    finer_order: int = 0,
) -> Pilot:
    """Approximately the fewest steps of a method with an error below half the tolerance; `below` if that is cheaper.

    The number of steps is doubled; the difference between successive runs is taken as the error of the coarser one. Between the
    sufficient number and its half, log(error) is interpolated linearly to the goal. finer_order: order of a method whose finer run is
    the result; its error is the difference divided by half of the factor that the order predicts. In that case no population is
    omitted, so that the steps may use the part of the tolerance that leakage does not need.
    """
    goal, before, factor = (0.7 if finer_order else 0.5) * problem.tolerance, 0.0, 1
    windows = len(problem.windows)
    grids = _grids(problem, [first] * windows)
    plan = _step_plan(problem, grids, rule)
    outcome = run(replace(task, plan=plan))
    while sum(_step_counts(plan)) <= MOST_STEPS:
        finer = _step_plan(problem, grids, rule, 2 * factor)
        check = run(replace(task, plan=finer))
        error = _difference(problem, space, task, outcome, check)
        if finer_order and error <= ASYMPTOTIC and (left := error / 2 ** (finer_order - 1)) <= goal < error:
            edge = relative_edge(check, task)
            return Pilot(finer, _step_counts(finer), left, edge, space, task, check)
        if error <= goal:
            edge, mine = relative_edge(check, task), Pilot(plan, _step_counts(plan), error, 0.0, space, task, outcome)
            if before > error > 0:
                steps = 0.5 * 2 ** (math.log(before / goal) / math.log(before / error)) * sum(_step_counts(plan))
                fewer = _step_plan(problem, _grids(problem, [math.ceil(steps / windows)] * windows), rule)
                if steps <= sum(_step_counts(fewer)) and _cost(fewer) < _cost(plan):
                    mine = Pilot(fewer, _step_counts(fewer), goal, 0.0, space, task)
            mine = replace(mine, edge=edge)
            return mine if below is None or _cost(mine.plan) < _cost(below.plan) else below
        before, factor, plan, outcome = error, 2 * factor, finer, check
        if below is not None and _cost(plan) > 2 * _cost(below.plan):
            return below
    raise ValueError(
        f"more than {MOST_STEPS} steps would be needed for a tolerance of {problem.tolerance:g}; give a larger tolerance"
    )


def _step_counts(plan: Plan) -> tuple[int, ...]:
    totals = []
    for passage in plan.passages:
        totals.append(0 if isinstance(passage, float) else passage.steps_taken)
    return tuple(totals)


def _cost(plan: Plan) -> int:
    """Drifts or exponentials in all windows."""
    return sum(0 if isinstance(passage, float) else passage.stages for passage in plan.passages)


def pilot_task(problem: Problem, space: FieldSpace) -> tuple[Task | None, bool]:
    """The most populated block of lowest M with a few of its columns, and whether this is the whole problem."""
    m = problem.m_values(space)[0]
    plan = Plan(problem.windows, ())  # to be replaced
    before = problem.begins_before
    tasks = [task for block in space.blocks(m) if (task := block_task(problem, block, plan, before)) is not None]
    if not tasks:
        return None, False
    task = max(tasks, key=lambda task: float(task.weights.sum()))
    whole = len(tasks) == 1 and (len(problem.m_values(space)) == 1)
    if len(task.columns) > PILOT_COLUMNS:
        chosen = np.unique(np.linspace(0, len(task.columns) - 1, PILOT_COLUMNS).astype(int))
        return replace(task, columns=task.columns[chosen], weights=task.weights[chosen]), False
    return task, whole


def relative_edge(outcome: Outcome, task: Task) -> float:
    return float(outcome.edge.max(initial=0.0) / task.weights.sum())


def _difference(problem: Problem, space: FieldSpace, task: Task, first: Outcome, second: Outcome) -> float:
    """Largest difference of the cosines between two runs of a block, relative to its population."""
    energies = RAD_PER_PS_MHZ * space.levels.energy_mhz
    period = max(float(problem.times[-1]) - problem.windows[-1].stop_ps, 0.0)
    times = np.linspace(0.0, period, PILOT_TIMES)
    worst = 0.0
    for place in range(len(problem.observables)):
        change = first.free[-1][place].less(second.free[-1][place])
        signal = observe.harmonics([change], energies, 0.0).at(times)
        worst = max(worst, float(np.abs(signal).max()))
        pairs = zip(first.samples, second.samples, strict=True)
        worst = max([worst, *(float(np.abs(a[place] - b[place]).max(initial=0.0)) for a, b in pairs)])
    return worst / float(task.weights.sum())
