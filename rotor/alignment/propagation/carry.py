"""Propagation of a block of states through all windows of the pulses: its task and its outcome."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from rotor.alignment import observables as observe
from rotor.alignment.ensemble import Ensemble
from rotor.alignment.observables import Coherences, Observable
from rotor.alignment.propagation import propagate
from rotor.alignment.propagation.timeline import Window
from rotor.alignment.pulse import RAD_PER_PS_MHZ, Pulse
from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import AxialSpace
from rotor.quantum.fields.blocks import Contraction, FieldBlock, FieldSpace, FreeLevels
from rotor.quantum.fields.solved_space import field_space
from rotor.tops.top import require_single_state

if TYPE_CHECKING:
    from rotor.tops.top import Top

Complexes = NDArray[np.complex128]

EDGE = 2  # number of highest J whose population is the leakage


@dataclass(frozen=True)
class Problem:
    """The inputs of a calculation, common to all blocks."""

    top: Top
    pulses: tuple[Pulse, ...]
    windows: tuple[Window, ...]
    times: Floats
    ensemble: Ensemble
    observables: tuple[Observable, ...]
    tolerance: float
    contractions: tuple[tuple[Contraction, ...], ...]
    cached: dict[str, Any] = field(default_factory=dict)  # populations of the last set of levels

    def space(self, jmax: int) -> FieldSpace:
        """The states up to J max and their blocks."""
        return field_space(
            require_single_state(self.top, "alignment"),
            jmax,
            [contraction for window_contractions in self.contractions for contraction in window_contractions],
        )

    def m_values(self, space: FieldSpace) -> Sequence[int]:
        """|M| of the blocks to propagate; (0,) if fields mix M."""
        if not space.m_is_good:
            return (0,)
        return range(self.ensemble.jmax + 1) if self.ensemble.m is None else (self.ensemble.m,)

    def free_times(self, after: int) -> slice:
        """Which times lie between window `after` (-1: before the first) and the next; a kick acts just after its time."""
        first, last = 0, len(self.times)
        if after >= 0:
            side: Literal["left", "right"] = "right" if self.windows[after].is_kick else "left"
            first = int(np.searchsorted(self.times, self.windows[after].stop_ps, side))
        if after + 1 < len(self.windows):
            last = int(np.searchsorted(self.times, self.windows[after + 1].start_ps, "right"))
        return slice(first, max(first, last))

    @property
    def begins_before(self) -> bool:
        """Whether any time lies before the first window."""
        return bool(self.free_times(-1).stop)

    def times_in(self, window: Window) -> slice:
        """Which times lie inside a window."""
        first = int(np.searchsorted(self.times, window.start_ps, "right"))
        return slice(first, max(first, int(np.searchsorted(self.times, window.stop_ps))))

    def populations(self, levels: FreeLevels) -> Floats:
        """Population (n,) of a single state of each level, computed once for all blocks."""
        if self.cached.get("levels") is not levels:
            self.cached.update(levels=levels, populations=self.ensemble.populations(levels))
        return np.asarray(self.cached["populations"])


@dataclass(frozen=True)
class Plan:
    """Integration of each window: kicks of a splitting, the grid of a Magnus method, or the area of a kick."""

    windows: tuple[Window, ...]
    passages: tuple[propagate.KickPlan | propagate.Grid | float, ...]


@dataclass(frozen=True)
class Task:
    """Inputs of a block: energies (n,) in rad/ps, operators by window, cosines, rows, initial columns with weights, edge states."""

    energies: Floats
    operators: tuple[tuple[NDArray[Any], ...], ...]
    cosines: tuple[NDArray[Any], ...]
    rows: Ints
    columns: Ints
    weights: Floats
    edge: NDArray[np.bool_]
    plan: Plan
    before: bool
    gradients: tuple[GradientOf | None, ...] | None = None
    cached: dict[Any, Any] = field(default_factory=dict)  # decomposed operators and patterns of cosines


@dataclass(frozen=True)
class GradientOf:
    """Parameters of B (dW/dθ)² for W = scale (x^rank - shift), x = cosθ; across : B across the figure axis, rad/ps."""

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
class Outcome:
    """Outcome of a block: coherences by free stretch and cosine, samples by window and cosine, final populations, edge, norm."""

    free: tuple[tuple[Coherences, ...], ...]
    samples: tuple[Floats, ...]
    populations: Floats
    edge: Floats
    norm_error: float


def run(task: Task) -> Outcome:
    """Propagate a block through all windows."""
    states = np.zeros((len(task.energies), len(task.columns)), dtype=np.complex128)
    states[task.columns, np.arange(len(task.columns))] = 1.0
    free, samples, edges = [], [], []
    if task.before:
        free.append(_all_coherences(task, states))
    now = task.plan.windows[0].start_ps
    for window, passage, operators in zip(task.plan.windows, task.plan.passages, task.operators, strict=True):
        if window.start_ps > now:
            states = np.exp(-1j * task.energies * (window.start_ps - now))[:, None] * states
        states, leaked, sample = _through(task, window, passage, operators, states)
        now = window.stop_ps
        samples.append(sample)
        free.append(_all_coherences(task, states))
        edges.append(float(task.weights @ leaked))
    here = np.abs(states) ** 2
    norm = float(np.abs(here.sum(axis=0) - 1).max(initial=0.0))
    return Outcome(tuple(free), tuple(samples), here @ task.weights, np.array(edges), norm)


def _all_coherences(task: Task, states: Complexes) -> tuple[Coherences, ...]:
    if "patterns" not in task.cached:
        task.cached["patterns"] = [observe.pattern(matrix, task.rows) for matrix in task.cosines]
    return observe.coherences(states, task.weights, task.cached["patterns"])


def _through(
    task: Task,
    window: Window,
    passage: propagate.KickPlan | propagate.Grid | float,
    operators: tuple[NDArray[Any], ...],
    states: Complexes,
) -> tuple[Complexes, Floats, Floats]:
    """States after a window, the largest edge population of each, and the cosines (cosines, samples) inside it."""
    snapshots = _Snapshots(task)
    if isinstance(passage, propagate.Grid):
        states, leaked = propagate.magnus_through(
            window, passage, task.energies, operators, states, task.edge, snapshots
        )
        return states, leaked, snapshots.cosines
    operator = task.cached.get(id(operators[0]))
    if operator is None:
        operator = task.cached[id(operators[0])] = _decomposed(task, window, operators[0])
    if isinstance(passage, propagate.KickPlan):
        states, leaked = propagate.split_through(passage, task.energies, operator, states, task.edge, snapshots)
    else:
        states = propagate.kick_through(passage, operator, states)
        leaked = (np.abs(states[task.edge]) ** 2).sum(axis=0)
    return states, leaked, snapshots.cosines


def _decomposed(task: Task, window: Window, matrix: NDArray[Any]) -> propagate.Decomposed:
    decomposed = propagate.decompose(matrix)
    gradient = task.gradients[task.plan.windows.index(window)] if task.gradients is not None else None
    return decomposed if gradient is None else replace(decomposed, gradient=gradient.at(decomposed.values))


class _Snapshots(list[Complexes]):
    """Converts states at sampled times to cosines at once, to limit memory."""

    def __init__(self, task: Task) -> None:
        super().__init__()
        self._task, self._made = task, [np.zeros((len(task.cosines), 0))]

    def append(self, states: Complexes) -> None:
        """Store the cosines of states (times, n, m), not the states."""
        self._made.append(
            np.array([observe.expectation(states, self._task.weights, cosine) for cosine in self._task.cosines])
        )

    @property
    def cosines(self) -> Floats:
        """(cosines, samples)."""
        return np.concatenate(self._made, axis=1)


def block_task(problem: Problem, block: FieldBlock, plan: Plan, before: bool) -> Task | None:
    """The task of a block; None if nothing in it is populated.

    Parameters
    ----------
    problem : Problem
        Top, pulses, times, gas and observables.
    block : FieldBlock
        States that the pulses do not couple to other blocks.
    plan : Plan
        Steps of every window.
    before : bool
        Whether some of the times lie before the first pulse.

    Returns
    -------
    Task or None
        Energies in rad/ps, matrices, and the populated columns with their weights.
    """
    population = problem.populations(block.levels)[block.rows] * block.copies
    if problem.ensemble.m is not None:
        population = population * (block.space.abs_m(block) == problem.ensemble.m) / (2 if problem.ensemble.m else 1)
    columns = np.flatnonzero(population)
    if not len(columns):
        return None
    matrices: dict[int, NDArray[Any]] = {}
    operators = tuple(
        tuple(_cached_matrix(block, contraction, matrices) for contraction in window_contractions)
        for window_contractions in problem.contractions
    )
    return Task(
        energies=RAD_PER_PS_MHZ * block.energies_mhz,
        operators=operators,
        cosines=tuple(observable.matrix(block) for observable in problem.observables),
        rows=block.rows,
        columns=columns,
        weights=population[columns],
        edge=block.j > block.levels.j.max() - EDGE,
        plan=plan,
        before=before,
        gradients=tuple(_gradient(problem.top, per_window[0]) for per_window in problem.contractions)
        if isinstance(block.space, AxialSpace)
        else None,
    )


def _gradient(top: Top, contraction: Contraction) -> GradientOf:
    """Gradient of a contraction of an axial top, whose tensors have no trace."""
    axis = 2 if top.kind == "oblate" else 0
    a, b, _ = top.rotational_constants_mhz
    body, space = contraction.body, contraction.space
    scale = body[axis] * space[2] if contraction.rank == 1 else 2.25 * body[axis, axis] * space[2, 2]
    return GradientOf(contraction.rank, float(scale), RAD_PER_PS_MHZ * (a if top.kind == "oblate" else b))


def _cached_matrix(block: FieldBlock, contraction: Contraction, matrices: dict[int, NDArray[Any]]) -> NDArray[Any]:
    """The matrix of a contraction, computed once for all windows that share it."""
    key = hash((contraction.body.tobytes(), contraction.space.tobytes()))
    if key not in matrices:
        matrices[key] = block.matrix(contraction)
    return matrices[key]


def block_tasks(problem: Problem, space: FieldSpace, plan: Plan, before: bool) -> Iterator[Task]:
    """The tasks of all blocks with populated states.

    Parameters
    ----------
    problem : Problem
        Top, pulses, times, gas and observables.
    space : FieldSpace
        The states up to J max.
    plan : Plan
        Steps of every window.
    before : bool
        Whether some of the times lie before the first pulse.

    Returns
    -------
    iterator of Task
        One for each block, generated lazily.
    """
    for m in problem.m_values(space):
        for block in space.blocks(m):
            task = block_task(problem, block, plan, before)
            if task is not None:
                yield task
