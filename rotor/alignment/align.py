"""Alignment and orientation of a gas by pulses: from a top, pulses and a temperature to cosines against time.

    trace = align(top, [GaussianPulse(1e13, 0.05)], np.linspace(-0.2, 164, 4001), temperature_k=10)

How each stretch of time is treated follows from what acts in it: nothing, exact phases and a sum of harmonics; a kick, one phase
in the eigenvectors of its operator; one operator, a splitting of order 4 or 6; several, a Magnus method. The number of steps and J max
follow from the tolerance, which is that of the cosines: the block M = 0 is carried with steps and with half of them until both agree.
The result says what it found: step error, population at the highest J, population left out, norm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.alignment import observables as observe
from rotor.alignment import propagate
from rotor.alignment.ensemble import Ensemble, ground_level, one_level, thermal
from rotor.alignment.observables import Coherences, Harmonics, Observable
from rotor.alignment.pulse import RAD_PER_PS_MHZ, Kick, Pulse
from rotor.alignment.timeline import Channel, Window, timeline
from rotor.arrays import Floats, Ints
from rotor.quantum.field_blocks import AxialBlock, Contraction, FieldBlock, FieldSpace, FreeLevels, field_space
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.tops.top import Top

Complexes = NDArray[np.complex128]

DEFAULT_TOLERANCE = 1e-6
HIGHEST_J = 600
FIRST_STEPS = 4
LARGEST_SPLIT = 700  # states of a block whose operator is still diagonalised
MOST_STEPS = 200_000
EDGE = 2  # the highest values of J, whose population is the leakage
PILOT_COLUMNS = 64
PILOT_TIMES = 256


@dataclass(frozen=True)
class AlignmentTrace(Table):
    """Cosines against time, and how they were found.

    t_ps: (t,). cosines: by name (t,). ensemble: what the gas was like at first. levels, populations: of the free top after the last
    pulse, one row for each level, over all M. jmax: of the basis. states: initial states (level, M) that were propagated. steps: of
    each window. step_error: by halving the steps, in the cosines. edge_population: largest population of the two highest J.
    norm_error: largest departure of the norm from 1. harmonics: of each cosine after the last pulse.
    """

    top: Top
    pulses: tuple[Pulse, ...]
    t_ps: Floats
    cosines: dict[str, Floats]
    ensemble: Ensemble
    levels: FreeLevels = field(repr=False)
    populations: Floats = field(repr=False)
    jmax: int
    states: int
    method: str
    steps: tuple[int, ...]
    step_error: float
    edge_population: float
    norm_error: float
    tolerance: float
    harmonics: dict[str, Harmonics] = field(repr=False)

    @property
    def columns(self) -> dict[str, Floats]:
        """t_ps and every cosine."""
        return {"t_ps": self.t_ps, **self.cosines}

    @property
    def facts(self) -> dict[str, Any]:
        """Top, pulses, ensemble and what was found about accuracy."""
        top = self.top
        return {
            "constants_mhz": dict(top.constants.values),
            "dipole_abc_debye": top.dipole_abc_debye,
            "polarizability_abc_angstrom3": top.polarizability_abc_angstrom3,
            "polarizability_source": top.polarizability_source or None,
            "pulses": [repr(pulse) for pulse in self.pulses],
            "temperature_k": self.ensemble.temperature_k or None,
            "state": dict(self.ensemble.chosen) if self.ensemble.chosen is not None else None,
            "m": self.ensemble.m,
            "states": self.states,
            "left_out": self.ensemble.left_out,
            "jmax": self.jmax,
            "method": self.method,
            "steps": list(self.steps),
            "tolerance": self.tolerance,
            "step_error": self.step_error,
            "edge_population": self.edge_population,
            "norm_error": self.norm_error,
        }

    @cached_property
    def permanent(self) -> dict[str, float]:
        """The mean over time of each cosine after the last pulse."""
        return {name: one.constant for name, one in self.harmonics.items()}

    @property
    def error_estimate(self) -> float:
        """Of the cosines: steps, leakage and what the ensemble leaves out."""
        return self.step_error + self.edge_population + 0.2 * self.ensemble.left_out


def align(
    top: Top,
    pulses: Sequence[Pulse] | Pulse,
    times_ps: ArrayLike,
    *,
    temperature_k: float = 0.0,
    state: Mapping[str, int] | None = None,
    m: int | None = None,
    observables: Sequence[str] = ("cos2theta",),
    tolerance: float = DEFAULT_TOLERANCE,
    jmax: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> AlignmentTrace:
    """Cosines of a gas of tops under pulses.

    Parameters
    ----------
    top : Top
        With `polarizability_abc_angstrom3` for light, `dipole_abc_debye` for fields that act on the dipole.
    pulses : sequence of Pulse
        Any polarizations and directions; M stays good, and the work small, where all are symmetric about Z (linear along Z,
        circular in the XY plane).
    times_ps : (t,) rising
        They may begin before the first pulse; the last pulse must have ended by the last of them.
    temperature_k : float
        Of the gas; 0 is its lowest level.
    state, m : optional
        One level instead, by quantum numbers such as {"j": 0}, and one of its M.
    observables : names
        cos2theta, costheta, cos2theta_2d, cos2_aZ, ...; see `rotor.alignment.observables.observable`.
    tolerance : float
        Of the cosines: steps, J max and the populations left out follow from it.
    jmax : int, optional
        Of the basis; by default what the tolerance needs.
    executor : Executor, optional
        Blocks (M and symmetry) are spread over it.
    progress : callable, optional
        Called with the number of blocks done and of all.

    Returns
    -------
    AlignmentTrace

    Raises
    ------
    ValueError
        No polarizability or dipole that the pulses act on; a pulse that ends after the last time; a given J max that is too small for
        the tolerance.

    Notes
    -----
    Neglected: what light does beyond the polarizability (hyperpolarizability, ionisation), averaging over the optical cycle (below
    1e-7 at 800 nm), centrifugal change of the tensors, nuclear hyperfine coupling, the profile of the focus.
    """
    pulses = (pulses,) if isinstance(pulses, Pulse) else tuple(pulses)
    times = _checked_times(times_ps, pulses)
    _check_tolerance(tolerance)
    ensemble = _ensemble(top, temperature_k, state, m, tolerance)
    wanted = tuple(observe.observable(name, top) for name in observables)
    windows = timeline(pulses)
    problem = _Problem(top, pulses, windows, times, ensemble, wanted, tolerance, _contractions(top, windows))
    given = jmax
    jmax = guessed_jmax(top, pulses, ensemble.jmax, tolerance) if given is None else given
    if jmax < ensemble.jmax + EDGE:
        raise ValueError(f"J max {jmax}: the ensemble itself has J up to {ensemble.jmax}; give at least {ensemble.jmax + EDGE}")
    while True:
        pilot = _pilot(problem, jmax)
        if pilot.edge <= 0.3 * tolerance:
            trace = _carried(problem, jmax, pilot, executor, progress)
            if trace.edge_population <= tolerance:
                return trace
            pilot = replace(pilot, edge=trace.edge_population)
        if given is not None:
            raise ValueError(
                f"J max {jmax} is too small for a tolerance of {tolerance:g}: the two highest J hold {pilot.edge:.2g} of the "
                "population; give a higher J max, or none and it is chosen"
            )
        jmax = int(1.15 * jmax) + 4
        if jmax > HIGHEST_J:
            raise ValueError(f"the pulses need J beyond {HIGHEST_J}; lower the intensity or the temperature")


def _checked_times(times_ps: ArrayLike, pulses: Sequence[Pulse]) -> Floats:
    times = np.array(times_ps, dtype=np.float64)
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ValueError("times must be a list of finite numbers of ps that rise")
    if not pulses:
        raise ValueError("no pulse: give at least one")
    end = max(pulse.window_ps[1] for pulse in pulses)
    if times[-1] < end:
        raise ValueError(
            f"the times end at {times[-1]:g} ps, before the last pulse does ({end:g} ps): a pulse is longer than the times; let them "
            "go on, or shorten it"
        )
    return times


def _check_tolerance(tolerance: float) -> None:
    if not 1e-12 <= tolerance <= 0.1:
        raise ValueError(f"tolerance {tolerance:g} of a cosine: a number from 1e-12 to 0.1 is expected")


def _ensemble(top: Top, temperature_k: float, state: Mapping[str, int] | None, m: int | None, tolerance: float) -> Ensemble:
    if state is not None:
        if temperature_k:
            raise ValueError("give a temperature or a state, not both")
        return one_level(top, state, m)
    if m is not None:
        raise ValueError(f"M = {m} belongs to one state: give the state too")
    return thermal(top, temperature_k, tolerance) if temperature_k else ground_level(top)


def acted_on(top: Top, acts_on: str) -> Floats:
    """What a channel acts on: the polarizability without its mean (3, 3) in Å³, or the dipole (3,) in D.

    Raises ValueError where it is not known or does nothing.
    """
    name = top.name or "this top"
    if top.kind == "spherical":
        raise ValueError(f"{name} is a spherical top: its polarizability is isotropic and it has no dipole, so no pulse turns it")
    if acts_on == "dipole":
        dipole = np.array(top.dipole_abc_debye if top.dipole_abc_debye is not None else (0.0, 0.0, 0.0))
        if not dipole.any():
            raise ValueError(f"{name} has no dipole that is known and not 0; a field that acts on it needs one")
        return dipole
    if top.polarizability_abc_angstrom3 is None:
        raise ValueError(f"the polarizability of {name} is not known: give one, in principal axes (Å³)")
    tensor = np.array(top.polarizability_abc_angstrom3)
    tensor = tensor - np.eye(3) * np.trace(tensor) / 3
    if not np.abs(tensor).max() > 0:
        raise ValueError(f"the polarizability of {name} is isotropic: no light turns it")
    return tensor


def _contraction(top: Top, channel: Channel) -> Contraction:
    body, space = acted_on(top, channel.acts_on), np.array(channel.space)
    return Contraction(body, space - np.eye(3) * np.trace(space) / 3 if space.ndim == 2 else space)


def _contractions(top: Top, windows: Sequence[Window]) -> tuple[tuple[Contraction, ...], ...]:
    return tuple(tuple(_contraction(top, channel) for channel in window.channels) for window in windows)


def guessed_jmax(top: Top, pulses: Sequence[Pulse], highest: int, tolerance: float) -> int:
    """J that a gas reaches from J = `highest`: J + min(P, √(J² + U0/B) - J) for each pulse, P = ∫U0 dt/ħ, U0 the well; and a tail."""
    smallest = RAD_PER_PS_MHZ * min(x for x in top.rotational_constants_mhz if math.isfinite(x))
    reached = float(highest)
    for pulse in pulses:
        size = _spread(acted_on(top, pulse.acts_on))
        if isinstance(pulse, Kick):
            reached += size * pulse.area
            continue
        strength, area = _peak_and_area(pulse)
        reached += min(size * area, math.sqrt(reached**2 + size * strength / smallest) - reached)
    return int(reached + max(6.0, 6 - 1.5 * math.log10(tolerance) - highest / 5))


def _spread(body: Floats) -> float:
    """Largest difference of energies that orientation makes, for strength 1."""
    if body.ndim == 1:
        return 2 * float(np.linalg.norm(body))
    values = np.linalg.eigvalsh(body)
    return float(values[-1] - values[0])


def _peak_and_area(pulse: Pulse) -> tuple[float, float]:
    first, last = pulse.window_ps
    times = np.linspace(first, last, 1001)
    strength = np.abs(pulse.strength(times))
    return float(strength.max()), float(strength.sum() * (times[1] - times[0]))


# One block


@dataclass(frozen=True)
class _Problem:
    """What is asked for, the same for every block."""

    top: Top
    pulses: tuple[Pulse, ...]
    windows: tuple[Window, ...]
    times: Floats
    ensemble: Ensemble
    wanted: tuple[Observable, ...]
    tolerance: float
    contractions: tuple[tuple[Contraction, ...], ...]

    def space(self, jmax: int) -> FieldSpace:
        """The states up to J max and their blocks."""
        return field_space(self.top, jmax, [one for of_window in self.contractions for one in of_window])

    def m_values(self, space: FieldSpace) -> Sequence[int]:
        """|M| of the blocks to be carried; 0 stands for all where M is mixed."""
        if not space.m_is_good:
            return (0,)
        return range(self.ensemble.jmax + 1) if self.ensemble.m is None else (self.ensemble.m,)

    def free_times(self, after: int) -> NDArray[np.bool_]:
        """Which times lie between window `after` (-1: before the first) and the next."""
        start = self.windows[after].stop_ps if after >= 0 else -np.inf
        stop = self.windows[after + 1].start_ps if after + 1 < len(self.windows) else np.inf
        return (self.times > start if after >= 0 and self.windows[after].is_kick else self.times >= start) & (self.times <= stop)

    def times_in(self, window: Window) -> NDArray[np.bool_]:
        """Which times lie inside a window."""
        return (self.times > window.start_ps) & (self.times < window.stop_ps)


@dataclass(frozen=True)
class _Plan:
    """How each window is passed: kicks of a splitting, the grid of a Magnus method, or the area of a kick."""

    windows: tuple[Window, ...]
    passages: tuple[propagate.KickPlan | propagate.Grid | float, ...]


@dataclass(frozen=True)
class _Task:
    """One block: energies (n,) in rad/ps, operators by window, cosines, rows, initial columns with weights, edge states."""

    energies: Floats
    operators: tuple[tuple[NDArray[Any], ...], ...]
    cosines: tuple[NDArray[Any], ...]
    rows: Ints
    columns: Ints
    weights: Floats
    edge: NDArray[np.bool_]
    plan: _Plan
    before: bool
    gradients: tuple[GradientOf | None, ...] | None = None


@dataclass(frozen=True)
class GradientOf:
    """W = scale (x^rank - shift) of x = cosθ, and B in rad/ps across the figure axis: what B (dW/dθ)² follows from."""

    rank: int
    scale: float
    across: float

    def at(self, values: Floats) -> Floats:
        """B (dW/dθ)² at eigenvalues of W (n,)."""
        if self.rank == 1:
            return self.across * (self.scale**2 - values**2)
        squares = values / self.scale + 1 / 3
        return np.asarray(4 * self.across * self.scale**2 * squares * (1 - squares))


@dataclass(frozen=True)
class _Outcome:
    """Of a block: coherences by free stretch and cosine, samples by window and cosine, final populations, edge, norm."""

    free: tuple[tuple[Coherences, ...], ...]
    samples: tuple[Floats, ...]
    populations: Floats
    edge: Floats
    norm_error: float


def _run(task: _Task) -> _Outcome:
    """Carry one block through all windows."""
    states = np.zeros((len(task.energies), len(task.columns)), dtype=np.complex128)
    states[task.columns, np.arange(len(task.columns))] = 1.0
    free, samples, edges = [], [], []
    if task.before:
        free.append(_all_coherences(task, states))
    now = task.plan.windows[0].start_ps
    known: dict[int, propagate.Decomposed] = {}
    for window, passage, operators in zip(task.plan.windows, task.plan.passages, task.operators, strict=True):
        states = np.exp(-1j * task.energies * (window.start_ps - now))[:, None] * states
        states, leaked, found = _through(task, window, passage, operators, states, known)
        now = window.stop_ps
        samples.append(found)
        free.append(_all_coherences(task, states))
        edges.append(float(task.weights @ leaked))
    here = np.abs(states) ** 2
    norm = float(np.abs(here.sum(axis=0) - 1).max(initial=0.0))
    return _Outcome(tuple(free), tuple(samples), here @ task.weights, np.array(edges), norm)


def _all_coherences(task: _Task, states: Complexes) -> tuple[Coherences, ...]:
    return tuple(observe.coherences(states, task.weights, matrix, task.rows) for matrix in task.cosines)


def _through(
    task: _Task,
    window: Window,
    passage: propagate.KickPlan | propagate.Grid | float,
    operators: tuple[NDArray[Any], ...],
    states: Complexes,
    known: dict[int, propagate.Decomposed],
) -> tuple[Complexes, Floats, Floats]:
    """States after a window, each one's largest population at the edge, and the cosines (cosines, samples) inside."""
    snapshots = _Snapshots(task)
    if isinstance(passage, propagate.Grid):
        states, leaked = propagate.magnus_through(window, passage, task.energies, operators, states, task.edge, snapshots)
        return states, leaked, snapshots.cosines
    operator = known.get(id(operators[0]))
    if operator is None:
        operator = known[id(operators[0])] = _decomposed(task, window, operators[0])
    if isinstance(passage, propagate.KickPlan):
        states, leaked = propagate.split_through(passage, task.energies, operator, states, task.edge, snapshots)
    else:
        states = propagate.kick_through(passage, operator, states)
        leaked = (np.abs(states[task.edge]) ** 2).sum(axis=0)
    return states, leaked, snapshots.cosines


def _decomposed(task: _Task, window: Window, matrix: NDArray[Any]) -> propagate.Decomposed:
    found = propagate.decompose(matrix)
    gradient = task.gradients[task.plan.windows.index(window)] if task.gradients is not None else None
    return found if gradient is None else replace(found, gradient=gradient.at(found.values))


class _Snapshots(list[Complexes]):
    """Takes states at sampled times and turns them into cosines, so that they do not fill the memory."""

    def __init__(self, task: _Task) -> None:
        super().__init__()
        self._task, self._made = task, [np.zeros((len(task.cosines), 0))]

    def append(self, states: Complexes) -> None:
        """Of states (times, n, m) only the cosines stay."""
        self._made.append(np.array([observe.expectation(states, self._task.weights, one) for one in self._task.cosines]))

    @property
    def cosines(self) -> Floats:
        """(cosines, samples)."""
        return np.concatenate(self._made, axis=1)


# Steps and J max


@dataclass(frozen=True)
class _Pilot:
    """What the block M = 0 has shown: the plan, its steps, their error, and the population at the highest J."""

    plan: _Plan
    steps: tuple[int, ...]
    error: float
    edge: float
    task: _Task | None = None
    outcome: _Outcome | None = None

    def outcome_of(self, tasks: Sequence[_Task]) -> _Outcome | None:
        """What was found already, where the pilot has carried all there is."""
        whole = len(tasks) == 1 and self.task is not None and len(self.task.columns) == len(tasks[0].columns)
        return self.outcome if whole else None


def _plan(problem: _Problem, steps: Sequence[int], rule: str | None, factor: int = 1) -> _Plan:
    """Passages with about so many steps a window, `factor` times as many; a Magnus method where `rule` is None."""
    out: list[propagate.KickPlan | propagate.Grid | float] = []
    for window, count in zip(problem.windows, steps, strict=True):
        if window.is_kick:
            kick = window.channels[0].pulses[0]
            out.append(kick.area if isinstance(kick, Kick) else 0.0)
            continue
        grid = propagate.grid_of(window, (window.stop_ps - window.start_ps) / count, problem.times).refined(factor)
        splits = rule is not None and len(window.channels) == 1
        out.append(propagate.kick_plan(window, grid, propagate.splitting(rule)) if splits and rule else grid)
    return _Plan(problem.windows, tuple(out))


def _pilot(problem: _Problem, jmax: int) -> _Pilot:
    """Steps that are fine enough for the tolerance, found on the block M = 0 that holds most of the gas."""
    space = problem.space(jmax)
    task, whole = _pilot_task(problem, space)
    if task is None or all(window.is_kick for window in problem.windows):
        plan = _plan(problem, [1] * len(problem.windows), "nystrom 4")
        outcome = None if task is None else _run(replace(task, plan=plan))
        edge = _relative_edge(outcome, task) if outcome and task else 0.0
        return _Pilot(plan, (0,) * len(problem.windows), 0.0, edge, task if whole else None, outcome)
    if len(task.rows) > LARGEST_SPLIT or all(len(window.channels) > 1 for window in problem.windows):
        return _refined(problem, space, task, None)
    if whole:
        return _refined(problem, space, task, "nystrom 4" if problem.tolerance >= 1e-10 else "nystrom 6", 16)
    rules = propagate.SPLITTINGS if task.gradients is not None else propagate.SPLITTINGS[1:]
    best = _refined(problem, space, task, rules[0])
    for rule in rules[1:]:
        best = _refined(problem, space, task, rule, below=best)
    return best


def _refined(
    problem: _Problem, space: FieldSpace, task: _Task, rule: str | None, first: int = FIRST_STEPS, below: _Pilot | None = None
) -> _Pilot:
    """About the fewest steps of a method whose error is below half the tolerance; `below` where that would cost more.

    The number of steps is doubled; the difference between a run and the next is taken as the error of the first. Of the number that
    is enough and its half, between which the answer lies, the place is taken where log(error) on a straight line meets the goal.
    """
    goal, before, factor = 0.5 * problem.tolerance, 0.0, 1
    counts = [first] * len(problem.windows)
    plan = _plan(problem, counts, rule)
    outcome = _run(replace(task, plan=plan))
    while sum(_steps_of(plan)) <= MOST_STEPS:
        finer = _plan(problem, counts, rule, 2 * factor)
        check = _run(replace(task, plan=finer))
        error = _difference(problem, space, task, outcome, check)
        if error <= goal:
            edge, mine = _relative_edge(check, task), _Pilot(plan, _steps_of(plan), error, 0.0, task, outcome)
            if before > error > 0:
                steps = 0.5 * 2 ** (math.log(before / goal) / math.log(before / error)) * sum(_steps_of(plan))
                fewer = _plan(problem, [math.ceil(steps / len(counts))] * len(counts), rule)
                if steps <= sum(_steps_of(fewer)) and _cost(fewer) < _cost(plan):
                    mine = _Pilot(fewer, _steps_of(fewer), goal, 0.0)
            mine = replace(mine, edge=edge)
            return mine if below is None or _cost(mine.plan) < _cost(below.plan) else below
        before, factor, plan, outcome = error, 2 * factor, finer, check
        if below is not None and _cost(plan) > 2 * _cost(below.plan):
            return below
    raise ValueError(f"more than {MOST_STEPS} steps would be needed for a tolerance of {problem.tolerance:g}; give a larger one")


def _steps_of(plan: _Plan) -> tuple[int, ...]:
    totals = []
    for passage in plan.passages:
        totals.append(0 if isinstance(passage, float) else passage.steps_taken)
    return tuple(totals)


def _cost(plan: _Plan) -> int:
    """Drifts or exponentials in all windows."""
    return sum(0 if isinstance(one, float) else one.stages for one in plan.passages)


def _pilot_task(problem: _Problem, space: FieldSpace) -> tuple[_Task | None, bool]:
    """The populated block of lowest M with the largest population, with a few of its columns; and whether that is all there is."""
    m = problem.m_values(space)[0]
    plan = _plan(problem, [1] * len(problem.windows), "nystrom 4")
    before = bool(problem.free_times(-1).any())
    tasks = [task for block in space.blocks(m) if (task := _task(problem, block, plan, before)) is not None]
    if not tasks:
        return None, False
    task = max(tasks, key=lambda one: float(one.weights.sum()))
    whole = len(tasks) == 1 and (len(problem.m_values(space)) == 1)
    if len(task.columns) > PILOT_COLUMNS:
        chosen = np.unique(np.linspace(0, len(task.columns) - 1, PILOT_COLUMNS).astype(int))
        return replace(task, columns=task.columns[chosen], weights=task.weights[chosen]), False
    return task, whole


def _relative_edge(outcome: _Outcome, task: _Task) -> float:
    return float(outcome.edge.max(initial=0.0) / task.weights.sum())


def _difference(problem: _Problem, space: FieldSpace, task: _Task, first: _Outcome, second: _Outcome) -> float:
    """Largest difference of the cosines of two runs of one block, of the population in it."""
    energies = RAD_PER_PS_MHZ * space.levels.energy_mhz
    period = max(float(problem.times[-1]) - problem.windows[-1].stop_ps, 0.0)
    times = np.linspace(0.0, period, PILOT_TIMES)
    worst = 0.0
    for place in range(len(problem.wanted)):
        signals = [observe.harmonics([one.free[-1][place]], energies, 0.0).at(times) for one in (first, second)]
        worst = max(worst, float(np.abs(signals[0] - signals[1]).max()))
        pairs = zip(first.samples, second.samples, strict=True)
        worst = max([worst, *(float(np.abs(a[place] - b[place]).max(initial=0.0)) for a, b in pairs)])
    return worst / float(task.weights.sum())


# All blocks


def _task(problem: _Problem, block: FieldBlock, plan: _Plan, before: bool) -> _Task | None:
    """What has to be done for a block; None where nothing in it is populated."""
    population = problem.ensemble.populations(block.levels)[block.rows] * block.copies
    if problem.ensemble.m is not None:
        population = population * (block.abs_m == problem.ensemble.m) / (2 if problem.ensemble.m else 1)
    columns = np.flatnonzero(population)
    if not len(columns):
        return None
    made: dict[int, NDArray[Any]] = {}
    operators = tuple(tuple(_made(block, one, made) for one in of_window) for of_window in problem.contractions)
    return _Task(
        energies=RAD_PER_PS_MHZ * block.energies_mhz,
        operators=operators,
        cosines=tuple(one.matrix(block) for one in problem.wanted),
        rows=block.rows,
        columns=columns,
        weights=population[columns],
        edge=block.j > block.levels.j.max() - EDGE,
        plan=plan,
        before=before,
        gradients=tuple(_gradient(problem.top, one[0]) for one in problem.contractions) if isinstance(block, AxialBlock) else None,
    )


def _gradient(top: Top, contraction: Contraction) -> GradientOf:
    """Of a contraction of an axial top; its tensors have no trace."""
    axis = 2 if top.kind == "oblate" else 0
    a, b, _ = top.rotational_constants_mhz
    body, space = contraction.body, contraction.space
    scale = body[axis] * space[2] if contraction.rank == 1 else 2.25 * body[axis, axis] * space[2, 2]
    return GradientOf(contraction.rank, float(scale), RAD_PER_PS_MHZ * (a if top.kind == "oblate" else b))


def _made(block: FieldBlock, contraction: Contraction, made: dict[int, NDArray[Any]]) -> NDArray[Any]:
    """The matrix of a contraction, made once for all windows that share it."""
    key = hash((contraction.body.tobytes(), contraction.space.tobytes()))
    if key not in made:
        made[key] = block.matrix(contraction)
    return made[key]


def _tasks(problem: _Problem, space: FieldSpace, plan: _Plan, before: bool) -> Iterator[_Task]:
    for m in problem.m_values(space):
        for block in space.blocks(m):
            task = _task(problem, block, plan, before)
            if task is not None:
                yield task


def _carried(
    problem: _Problem, jmax: int, pilot: _Pilot, executor: Executor | None, progress: Callable[[int, int], None] | None
) -> AlignmentTrace:
    """All blocks, and the trace that they make together."""
    space = problem.space(jmax)
    before = bool(problem.free_times(-1).any())
    tasks = list(_tasks(problem, space, pilot.plan, before))
    found = pilot.outcome_of(tasks)
    if found is not None:
        return _trace(problem, space, tasks, [found], pilot, before)
    outcomes = []
    for done, outcome in enumerate(executor.map(_run, tasks) if executor else map(_run, tasks), 1):
        outcomes.append(outcome)
        if progress:
            progress(done, len(tasks))
    return _trace(problem, space, tasks, outcomes, pilot, before)


def _trace(
    problem: _Problem, space: FieldSpace, tasks: list[_Task], outcomes: list[_Outcome], pilot: _Pilot, before: bool
) -> AlignmentTrace:
    energies = RAD_PER_PS_MHZ * space.levels.energy_mhz
    populations = np.zeros(len(space.levels))
    for task, outcome in zip(tasks, outcomes, strict=True):
        np.add.at(populations, task.rows, outcome.populations)
    cosines, last = {}, {}
    for place, one in enumerate(problem.wanted):
        cosines[one.name], last[one.name] = _signal(problem, energies, outcomes, place, before)
    return AlignmentTrace(
        top=problem.top,
        pulses=problem.pulses,
        t_ps=problem.times,
        cosines=cosines,
        ensemble=problem.ensemble,
        levels=space.levels,
        populations=populations,
        jmax=space.jmax,
        states=sum(len(task.columns) for task in tasks),
        method=_method(pilot.plan),
        steps=pilot.steps,
        step_error=pilot.error,
        edge_population=float(sum(outcome.edge for outcome in outcomes).max(initial=0.0)),  # type: ignore[union-attr]
        norm_error=max((outcome.norm_error for outcome in outcomes), default=0.0),
        tolerance=problem.tolerance,
        harmonics=last,
    )


def _method(plan: _Plan) -> str:
    names = {float: "kick", propagate.KickPlan: "splitting", propagate.Grid: "magnus"}
    return ", ".join(sorted({names[type(passage)] for passage in plan.passages}))


def _signal(
    problem: _Problem, energies: Floats, outcomes: list[_Outcome], place: int, before: bool
) -> tuple[Floats, Harmonics]:
    """One cosine at all times, and its harmonics after the last window."""
    remainder = problem.ensemble.left_out * problem.wanted[place].isotropic
    out = np.full(len(problem.times), np.nan)
    stretches = range(-1 if before else 0, len(problem.windows))
    found = Harmonics(remainder, np.zeros(0, dtype=np.complex128), np.zeros(0))
    for index, after in enumerate(stretches):
        found = observe.harmonics([outcome.free[index][place] for outcome in outcomes], energies, remainder)
        here = problem.free_times(after)
        start = problem.windows[after].stop_ps if after >= 0 else problem.windows[0].start_ps
        out[here] = found.at(problem.times[here] - start)
    for index, window in enumerate(problem.windows):
        here = problem.times_in(window)
        if here.any():
            out[here] = remainder + sum(outcome.samples[index][place] for outcome in outcomes)
    return out, found


def revival_period_ps(top: Top) -> float:
    """1/(2Bc), after which a rigid linear or symmetric top is as it was (B the constant across its axis).

    >>> from rotor.tops.top import Top
    >>> round(revival_period_ps(Top.from_constants("B=6081.492 MHz")), 3)  # OCS
    82.217
    """
    a, b, _ = top.rotational_constants_mhz
    across = a if top.kind == "oblate" else b
    return 1e6 / (2 * across)
