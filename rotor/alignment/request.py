"""Request and answer for the alignment of a gas by pulses."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.alignment.pulse import DEFAULT_TOLERANCE, PULSES, Pulse
from rotor.arrays import Floats
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import REQUIRED, check_fields, declared
from rotor.requests.knob import Estimate, Knob, Measure, Sought
from rotor.requests.lists import Pairs
from rotor.requests.plan import Growth
from rotor.requests.readers import Names, Quantity, Whole
from rotor.table import Table, TextOf
from rotor.tops.facts import top_facts
from rotor.units import MOST_POINTS

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.tops.top import Top

REVIVALS = 1.1  # after the pulses by default: the whole peak of the full revival
LONGEST_PS = 100.0  # default time after the pulses for a top without revivals
DEFAULT_POINTS = 2001
FARTHEST_PS = 1e9  # a phase of 2π 1 THz times this time has an error of 1e-6


TOLERANCES = (3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
FINEST_TOLERANCE = 1e-11
LOOSEST_COSINE = 0.05
LOOSER = (1e3, 1e2, 1e1, 1.0, 0.3, 0.1)  # tolerances of cosines that are tried, times the accuracy
PILOT_TOLERANCE, PILOT_POINTS = 1e-3, 11  # at the finest, of a plan


def cosine_error(trace: AlignmentTrace, reference: AlignmentTrace) -> float:
    """The largest difference of a cosine."""
    pairs = [(trace.cosines[name], true) for name, true in reference.cosines.items()]
    return max(float(np.max(np.abs(cosines - true), initial=0.0)) for cosines, true in pairs)


def _looser(sought: Sought) -> list[float]:
    """The loosest tolerances first: the error is often a hundred times less than the tolerance, which bounds it."""
    tolerances = [min(looser * sought.accuracy, LOOSEST_COSINE) for looser in LOOSER]
    return [value for value in tolerances if value >= FINEST_TOLERANCE] or [FINEST_TOLERANCE]


def _tolerance_error(_: Sought, request: AlignRequest, tolerance: float) -> Estimate:
    """The error that a run of the quantum gas finds."""
    trace = answer_align(replace(request, classical_molecules=0)).trace
    return Estimate(trace.error_estimate, trace)


def _coarser(request: AlignRequest, fineness: float) -> AlignRequest:
    """A shorter request, of a fineness 1/tolerance."""
    return replace(request, tolerance=1.0 / fineness, points=PILOT_POINTS)


TOLERANCE = Knob(
    TOLERANCES, lambda request: max(1e-2 * min(*TOLERANCES, request.tolerance), FINEST_TOLERANCE),
    (Measure("cosine", "", lambda answer, reference: cosine_error(answer.trace, reference.trace)),), "a tolerance of {:g}",
    # a given J max may be too small for a finer tolerance
    swept=lambda request, value: replace(request, jmax=None, tolerance=value),
    prepare=lambda request: replace(request, classical_molecules=0),
    tried=_looser, error=_tolerance_error,
    cost=Growth(
        (1.0 / PILOT_TOLERANCE,), lambda request: 1.0 / request.tolerance, _coarser,
        prepare=lambda request: replace(request, classical_molecules=0),
        work=lambda _, fineness: fineness**0.25,  # steps of a method of order 4
        largest=lambda request: replace(request, tolerance=max(request.tolerance, PILOT_TOLERANCE)),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class AlignRequest:
    """Cosines as functions of time to compute; all fields are checked when the request is made.

    top: with the property that the pulses act on. pulses: at least one. temperature_k: of the gas, 0 for its lowest level. state: a
    single level instead, by quantum numbers; m: its |M|, None for all. from_ps, until_ps: first and last time; None: begin of the pulses,
    and 1.1 revivals after their end. points: number of times. observables: names of cosines. tolerance: of the cosines. jmax: None: as
    needed for the tolerance. classical_molecules: size of an additional classical gas, 0 for none; seed: of its start.
    """

    top: Top
    pulses: tuple[Pulse, ...] = declared(
        REQUIRED, PULSES, "One or more; shape is gaussian, switched, kick, table or thz", "pulses", option=""
    )
    temperature_k: float = declared(
        1.0,
        Quantity("K", least=0, metavar="T"),
        "Temperature (K); 0 is the lowest level",
        "conditions.temperature",
        common=True,
    )
    state: Mapping[str, int] | None = declared(
        None, Pairs(int, "name", "j=1,ka=0,kc=1", lower=True), "One level instead of a temperature, such as j=0 or j=1,ka=0,kc=1",
        "conditions.state", common=True, example={"j": 1, "ka": 0, "kc": 1},
    )  # fmt: skip
    m: int | None = declared(None, Whole(), "|M| of that level; by default all alike", "conditions.m", example=0)
    from_ps: float | None = declared(
        None, Quantity("ps", metavar="T"), "First time (ps); by default where the pulses begin", "conditions.first_time", option="--from",
        example="-1 ps",
    )  # fmt: skip
    until_ps: float | None = declared(
        None, Quantity("ps", metavar="T"), "Last time (ps); by default 1.1 revivals after the pulses, or 100 ps", "conditions.last_time",
        option="--until", common=True, example="100 ps",
    )  # fmt: skip
    points: int = declared(DEFAULT_POINTS, Whole(2, MOST_POINTS), "Number of times", "conditions.points")
    observables: tuple[str, ...] = declared(
        ("cos2theta",), Names(), "cos2theta, costheta, cos2theta_2d, cos2_aZ, cos_bX, ...; repeatable", "observables.cosines",
        option="--observable", common=True, example=["cos2theta"],
    )  # fmt: skip
    tolerance: float = declared(
        DEFAULT_TOLERANCE, Quantity(above=1e-12, below=0.1), "Error of the cosines: steps, J max and populations follow from it",
        "numerics.tolerance", knob=TOLERANCE,
    )  # fmt: skip
    jmax: int | None = declared(
        None, Whole(2), "Highest J of the basis; by default what the tolerance needs", "numerics.jmax", example=30
    )
    classical_molecules: int = declared(
        0, Whole(0), "Also a classical gas of this many molecules under the same pulses", "observables.classical_molecules",
        option="--classical",
    )  # fmt: skip
    seed: int = declared(1, Whole(0), "Seed of the classical gas", "numerics.seed")

    def __post_init__(self) -> None:
        from rotor.alignment.acting import acted_on

        if not self.pulses:
            raise ValueError("pulses: there is no pulse; give at least one, in a scene a table [[pulses]]")
        check_fields(self)
        for pulse in self.pulses:
            acted_on(self.top, pulse.acts_on)
        first, last = self.ends_ps
        for name, time in (("from_ps", first), ("until_ps", last)):
            if not abs(time) <= FARTHEST_PS:
                raise ValueError(
                    f"{name}: {time:g} ps: expected a time within {FARTHEST_PS:g} ps; beyond that, phases in double precision mean "
                    "nothing"
                )
        if not first < last:
            raise ValueError(f"until_ps: {last:g} ps is not after the first time, {first:g} ps")
        end = max(pulse.window_ps[1] for pulse in self.pulses)
        if last < end:
            raise ValueError(f"until_ps: {last:g} ps is before the pulses have ended, at {end:g} ps; give a later time")

    @property
    def ends_ps(self) -> tuple[float, float]:
        """The first and the last time."""
        from rotor.alignment.acting import revival_period_ps

        begins = min(pulse.window_ps[0] for pulse in self.pulses)
        ends = max(pulse.window_ps[1] for pulse in self.pulses)
        long = LONGEST_PS if self.top.kind == "asymmetric" else REVIVALS * revival_period_ps(self.top)
        first = begins if self.from_ps is None else self.from_ps
        return first, ends + long if self.until_ps is None else self.until_ps

    @property
    def times_ps(self) -> Floats:
        """All times (points,)."""
        return np.linspace(*self.ends_ps, self.points)


@dataclass(frozen=True, eq=False, repr=False)
class AlignmentTable(Table):
    """Quantum cosines as functions of time, and those of a classical gas in columns with the suffix _classical."""

    trace: AlignmentTrace
    classical: Mapping[str, Floats]

    @property
    def columns(self) -> dict[str, Floats]:
        """t_ps, the cosines, and those of the classical gas."""
        return {**self.trace.columns, **{f"{name}_classical": values for name, values in self.classical.items()}}

    @property
    def provenance(self) -> dict[str, Any]:
        """The provenance of the quantum calculation."""
        return self.trace.provenance


@dataclass(frozen=True, repr=False)
class AlignAnswer(TextOf):
    """The cosines of a request."""

    shown = "table"

    request: AlignRequest
    trace: AlignmentTrace
    classical: Mapping[str, Floats]

    @property
    def table(self) -> AlignmentTable:
        """All cosines as a table."""
        return AlignmentTable(self.trace, self.classical)

    @property
    def _compared_j(self) -> int:
        """The J at which effects and neglected effects are compared; at J = 0 all of them vanish."""
        return max(self.trace.reached_jmax, 1)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the cosines."""
        from rotor.alignment.budgets import cosines_budget
        from rotor.quantum.effects.of_top import effects_of
        from rotor.quantum.estimates.limits import all_limits

        trace = self.trace
        effects = effects_of(trace.top, hyperfine=False)
        return cosines_budget(trace, all_limits(trace.top, self._compared_j, effects))

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table, by the keys of docs/verbs."""
        from rotor.alignment.acting import revival_period_ps
        from rotor.quantum.effects.of_top import effects_of
        from rotor.quantum.estimates.limits import limit_facts

        trace, cosines = self.trace, {name: values for name, values in self.table.columns.items() if name != "t_ps"}
        molecules = self.request.classical_molecules
        return {
            **top_facts(trace.top),
            **trace.provenance,
            "windows_ps": [list(pulse.window_ps) for pulse in trace.pulses],
            "populated_jmax": trace.ensemble.jmax,
            "error_estimate": trace.error_estimate,
            "permanent": trace.permanent,
            "extremes": [_extremes(name, trace.t_ps, values) for name, values in cosines.items()],
            "classical_molecules": molecules,
            "classical_errors": {
                name: _sampling_error(name, means, molecules) for name, means in self.classical.items()
            },
            "times": len(trace.t_ps),
            "revival_ps": None if trace.top.kind == "asymmetric" else revival_period_ps(trace.top),
            **limit_facts(trace.top, self._compared_j, effects_of(trace.top, hyperfine=False)),
            "errors": self.errors.as_json(),
        }


def _sampling_error(name: str, mean: Floats, molecules: int) -> float:
    """Bound on the standard error of a mean over molecules, √((1 - m)(m - low)/n) of numbers from `low` to 1, at the worst time."""
    low = 0.0 if name.startswith("cos2") else -1.0
    return float(np.sqrt(np.maximum((1.0 - mean) * (mean - low), 0.0).max() / molecules))


def _extremes(name: str, times: Floats, values: Floats) -> dict[str, Any]:
    high, low = int(np.argmax(values)), int(np.argmin(values))
    return {
        "name": name,
        "max": float(values[high]),
        "max_at_ps": float(times[high]),
        "min": float(values[low]),
        "min_at_ps": float(times[low]),
    }


def answer_align(request: AlignRequest, executor: Executor | None = None) -> AlignAnswer:
    """Compute the cosines of a request. executor: runs blocks of states in parallel.

    >>> from rotor.alignment.pulse import GaussianPulse
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6 GHz", polarizability_abc_angstrom3=((8, 0, 0), (0, 4, 0), (0, 0, 4)))
    >>> answer = answer_align(AlignRequest(rod, (GaussianPulse(1e13, 0.05),), temperature_k=0, tolerance=1e-4, points=101))
    >>> round(float(answer.table.columns["cos2theta"].max()), 2)
    0.88
    """
    from rotor.alignment.align import align

    trace = align(
        request.top,
        request.pulses,
        request.times_ps,
        temperature_k=0.0 if request.state is not None else request.temperature_k,
        state=request.state,
        m=request.m,
        tolerance=request.tolerance,
        jmax=request.jmax,
        observables=request.observables,
        executor=executor,
    )
    classical: dict[str, Floats] = {}
    if request.classical_molecules:
        from rotor.alignment.classical import classical_trace

        classical = classical_trace(
            request.top,
            request.pulses,
            request.times_ps,
            temperature_k=request.temperature_k,
            molecules=request.classical_molecules,
            observables=request.observables,
            rng=np.random.default_rng(request.seed),
        )
    return AlignAnswer(request, trace, classical)
