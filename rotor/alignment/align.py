"""Alignment and orientation of a gas by pulses: from a top, pulses and a temperature to cosines against time.

    trace = align(top, [GaussianPulse(1e13, 0.05)], np.linspace(-0.2, 164, 4001), temperature_k=10)

The method for each interval of time depends on the fields: without fields, exact phases and a sum of harmonics; for a kick, a phase
in the eigenvectors of its operator; for one operator, a splitting of order 4 or 6; for several, a Magnus method. The number of steps and
J max follow from the tolerance of the cosines: the block M = 0 is propagated with steps of halved length until the cosines agree.
The result reports step error, population at the highest J, omitted population, and norm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.alignment import observables as observe
from rotor.alignment.acting import guessed_jmax, window_contractions
from rotor.alignment.ensemble import Ensemble, ground_level, single_level, thermal
from rotor.alignment.observables import Harmonics
from rotor.alignment.propagation import propagate
from rotor.alignment.propagation.carry import EDGE, Outcome, Plan, Problem, Task, block_tasks, run
from rotor.alignment.propagation.steps import Pilot, lowest_jmax, run_pilot
from rotor.alignment.propagation.timeline import timeline
from rotor.alignment.pulse import DEFAULT_TOLERANCE, RAD_PER_PS_MHZ, Pulse
from rotor.arrays import Floats
from rotor.quantum.fields.blocks import FieldSpace, FreeLevels
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.tops.top import Top

HIGHEST_J = 600


@dataclass(frozen=True, eq=False, repr=False)
class AlignmentTrace(Table):
    """Cosines as functions of time, with the numerical parameters.

    t_ps: (t,). cosines: by name (t,). ensemble: the initial gas. levels, populations: of the free top after the last pulse, a row for
    each level, summed over M. jmax: of the basis. states: propagated initial states (level, M). steps: of each window. step_error: of
    the cosines, from halved steps. edge_population: largest population of the two highest J. norm_error: largest deviation of the norm
    from 1. harmonics: of each cosine after the last pulse.
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
        """t_ps and all cosines."""
        return {"t_ps": self.t_ps, **self.cosines}

    @property
    def gas_text(self) -> str:
        """The initial gas in words: its temperature and states, or its level."""
        ensemble = self.ensemble
        if ensemble.chosen is None:
            return f"{ensemble.temperature_k:g} K, {self.states} states up to J = {ensemble.jmax}"
        level = ", ".join(f"{name} = {value}" for name, value in ensemble.chosen.items())
        return f"level {level}, " + ("all M" if ensemble.m is None else f"|M| = {ensemble.m}")

    @property
    def provenance(self) -> dict[str, Any]:
        """Top, pulses, ensemble and accuracy."""
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
        """The permanent alignment: time average of each cosine after the last pulse."""
        return {name: harmonics_of_cosine.constant for name, harmonics_of_cosine in self.harmonics.items()}

    @property
    def reached_jmax(self) -> int:
        """The highest J of the gas before or after the pulses: levels above it hold less than the tolerance."""
        by_j = np.bincount(self.levels.j, self.populations)
        above = np.cumsum(by_j[::-1])[::-1]
        return max(self.ensemble.jmax, int(np.flatnonzero(above > self.tolerance).max(initial=0)))

    @property
    def moved(self) -> float:
        """The largest deviation of a cosine from that of an isotropic gas."""
        apart = (
            float(np.max(np.abs(values - observe.observable(name, self.top).isotropic)))
            for name, values in self.cosines.items()
        )
        return max(apart, default=0.0)

    @property
    def error_estimate(self) -> float:
        """Error of the cosines from steps, leakage, rounded phases and states omitted from the ensemble.

        Twice the difference to a run with half as many steps bounds the step error for any order >= 1. The steps have order 4 only if they
        are short (two of 100 random cases exceeded 16/15 of the difference, by up to 42 %). Omitted states are taken as isotropic; their
        cosines deviate no more than those of the propagated gas, since a pulse aligns higher J less.
        """
        return truncation_apart(self) + self.edge_population


class BasisTooSmallError(ValueError):
    """The population of the two highest J exceeds the tolerance."""


def truncation_apart(trace: AlignmentTrace) -> float:
    """The error of the cosines from steps, omitted populations and rounded phases, without that of the truncated basis."""
    return trace.step_error * 2 + trace.ensemble.left_out * trace.moved + phase_rounding(trace)


def phase_rounding(trace: AlignmentTrace) -> float:
    """The error of the cosines from rounded phases of the highest level at the last time."""
    farthest = RAD_PER_PS_MHZ * float(np.abs(trace.levels.energy_mhz).max()) * float(np.abs(trace.t_ps).max())
    return float(np.finfo(np.float64).eps) * farthest * trace.moved


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
        Any polarizations and directions. If all are symmetric about Z (linear along Z, circular in the XY plane), M is conserved and
        the calculation is faster.
    times_ps : (t,) increasing
        May begin before the first pulse; must extend beyond the end of the last pulse.
    temperature_k : float
        Temperature of the gas; 0: its lowest level.
    state, m : optional
        A single level instead, by quantum numbers such as {"j": 0}, and optionally a single M.
    observables : names
        cos2theta, costheta, cos2theta_2d, cos2_aZ, ...; see `rotor.alignment.observables.observable`.
    tolerance : float
        Tolerance of the cosines; determines steps, J max and omitted populations.
    jmax : int, optional
        Of the basis; default: as needed for the tolerance.
    executor : Executor, optional
        Runs the blocks (M and symmetry) in parallel.
    progress : callable, optional
        Called with the numbers of blocks done and in total.

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
    Neglected: hyperpolarizability and ionisation, the error of averaging over the optical cycle (below 1e-7 at 800 nm), centrifugal
    changes of the tensors, nuclear hyperfine coupling, the intensity profile of the focus.
    """
    pulses = (pulses,) if isinstance(pulses, Pulse) else tuple(pulses)
    times = _checked_times(times_ps, pulses)
    _check_tolerance(tolerance)
    ensemble = _ensemble(top, temperature_k, state, m, tolerance)
    followed = tuple(observe.observable(name, top) for name in observables)
    windows = timeline(pulses)
    problem = Problem(top, pulses, windows, times, ensemble, followed, tolerance, window_contractions(top, windows))
    jmax_option = jmax
    jmax = guessed_jmax(top, pulses, ensemble.jmax, tolerance) if jmax_option is None else jmax_option
    if jmax < ensemble.jmax + EDGE:
        raise ValueError(
            f"J max {jmax}: the ensemble has J up to {ensemble.jmax}; give at least {ensemble.jmax + EDGE}"
        )
    if jmax_option is None and jmax > HIGHEST_J:
        raise ValueError(
            f"the pulses need J up to about {jmax}; states up to J = {HIGHEST_J} are propagated: lower the intensity, the duration or the "
            "temperature"
        )
    if jmax_option is None:
        jmax = lowest_jmax(problem, jmax)
    while True:
        pilot = run_pilot(problem, jmax)
        # a whole run is started only if the block that spreads most stays clear of the edge
        if pilot.edge <= 0.3 * tolerance:
            trace = carried(problem, pilot, executor, progress)
            if trace.edge_population <= tolerance:
                return trace
            pilot = replace(pilot, edge=trace.edge_population)
        if jmax_option is not None:
            raise BasisTooSmallError(
                f"J max {jmax} is too small for a tolerance of {tolerance:g}: the two highest J hold {pilot.edge:.2g} of the "
                "population; give a higher J max, or leave it out"
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
            f"the times end at {times[-1]:g} ps, before the last pulse does ({end:g} ps); give later times, "
            "or a shorter pulse"
        )
    return times


def _check_tolerance(tolerance: float) -> None:
    if not 1e-12 <= tolerance <= 0.1:
        raise ValueError(f"tolerance {tolerance:g} of a cosine: a number from 1e-12 to 0.1 is expected")


def _ensemble(
    top: Top, temperature_k: float, state: Mapping[str, int] | None, m: int | None, tolerance: float
) -> Ensemble:
    if state is not None:
        if temperature_k:
            raise ValueError("give a temperature or a state, not both")
        return single_level(top, state, m)
    if m is not None:
        raise ValueError(f"m: {m} belongs to one state: give the state too")
    return thermal(top, temperature_k, tolerance) if temperature_k else ground_level(top)


def carried(
    problem: Problem,
    pilot: Pilot,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> AlignmentTrace:
    """Propagate all blocks and combine them to a trace.

    Parameters
    ----------
    problem : Problem
        Top, pulses, times, gas and observables.
    pilot : Pilot
        Steps and basis for this problem.
    executor : Executor, optional
        Runs the blocks in parallel.
    progress : callable, optional
        Called with the numbers of blocks done and in total.

    Returns
    -------
    AlignmentTrace
        Returned for any population at the edge of the basis.
    """
    space, before = pilot.space, problem.begins_before
    if pilot.whole and pilot.task is not None and pilot.outcome is not None:
        return _trace(problem, space, [pilot.task], [pilot.outcome], pilot, before)
    tasks = list(block_tasks(problem, space, pilot.plan, before))
    outcomes = []
    for done, outcome in enumerate(executor.map(run, tasks) if executor else map(run, tasks), 1):
        outcomes.append(outcome)
        if progress:
            progress(done, len(tasks))
    return _trace(problem, space, tasks, outcomes, pilot, before)


def _trace(
    problem: Problem, space: FieldSpace, tasks: list[Task], outcomes: list[Outcome], pilot: Pilot, before: bool
) -> AlignmentTrace:
    energies = RAD_PER_PS_MHZ * space.levels.energy_mhz
    populations = np.zeros(len(space.levels))
    for task, outcome in zip(tasks, outcomes, strict=True):
        np.add.at(populations, task.rows, outcome.populations)
    cosines, last = {}, {}
    for place, observable in enumerate(problem.observables):
        cosines[observable.name], last[observable.name] = _signal(problem, energies, outcomes, place, before)
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


def _method(plan: Plan) -> str:
    names = {float: "kick", propagate.KickPlan: "splitting", propagate.Grid: "magnus"}
    return ", ".join(sorted({names.get(type(passage), "kick") for passage in plan.passages}))


def _signal(
    problem: Problem, energies: Floats, outcomes: list[Outcome], place: int, before: bool
) -> tuple[Floats, Harmonics]:
    """A cosine at all times, and its harmonics after the last window."""
    remainder = problem.ensemble.left_out * problem.observables[place].isotropic
    out = np.full(len(problem.times), np.nan)
    stretches = range(-1 if before else 0, len(problem.windows))
    harmonics = Harmonics(remainder, np.zeros(0, dtype=np.complex128), np.zeros(0))
    for index, after in enumerate(stretches):
        harmonics = observe.harmonics([outcome.free[index][place] for outcome in outcomes], energies, remainder)
        here = problem.free_times(after)
        start = problem.windows[after].stop_ps if after >= 0 else problem.windows[0].start_ps
        out[here] = harmonics.at(problem.times[here] - start)
    for index, window in enumerate(problem.windows):
        here = problem.times_in(window)
        if here.stop > here.start:
            out[here] = remainder + sum(outcome.samples[index][place] for outcome in outcomes)
    return out, harmonics
