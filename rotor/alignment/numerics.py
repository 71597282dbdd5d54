"""Accuracy and plans of alignment: the loosest tolerance and the smallest J max whose cosines are within an accuracy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotor.alignment.align import BasisTooSmallError, truncation_apart
from rotor.alignment.basis import least_jmax, trace_with
from rotor.alignment.request import AlignRequest, answer_align, cosine_error
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.plans import plan_fields
from rotor.quantum.fields.inputs import largest_difference
from rotor.requests.field import declared_fields
from rotor.requests.knob import Choice, Knob, Measure, with_whole
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Plan, peak_mb, timed

MORE_J = 6  # in the reference
SHARES_OF_J = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
LOOSEST_COSINE = 0.05
MOST_CONFIRMED = 6  # J max that are confirmed by whole runs, before the one of its tolerance is taken
LOOSER = (1e3, 1e2, 1e1, 1.0, 0.3, 0.1)  # tolerances of cosines that are tried, times the accuracy


def _in_basis(request: Any) -> tuple[Any, int]:
    """The quantum gas of a request, and J max of its basis."""
    trace = answer_align(replace(request, classical_molecules=0)).trace
    return trace, trace.jmax


def _smaller(setting: tuple[Any, int]) -> list[int]:
    """Values of J max up to that of the request, at least the highest populated J."""
    trace, jmax = setting
    values = {round(share * jmax) for share in SHARES_OF_J} | {jmax - 1}
    return sorted(j for j in values if j >= trace.ensemble.jmax)


BASIS = Knob(
    _smaller,
    lambda setting: setting[1] + MORE_J,
    (Measure("cosine", "", cosine_error),),
    "J max {}",
    change=lambda setting, _, jmax: (setting[0], jmax),
    prepare=_in_basis,
    key="numerics.jmax",
    title="highest J of the basis",
    value=lambda setting: setting[1],
    answer=lambda setting: trace_with(*setting),
)


def _classical_error(answer: Any, reference: Any) -> float:
    """The error of the classical gas, which is that of a mean."""
    return max(largest_difference(answer.classical[name], true) for name, true in reference.classical.items())


CLASSICAL = Knob(
    lambda request: [request.classical_molecules / part for part in (64, 16, 4)],
    lambda request: 16 * request.classical_molecules,
    (Measure("cosine of the classical gas", "", _classical_error),),
    "{} other molecules",
    change=lambda request, name, count: with_whole(request, name, max(count, 2)),
    # the quantum gas beside it does not matter here
    prepare=lambda request: replace(request, tolerance=max(request.tolerance, 1e-2)),
    used=lambda request: request.classical_molecules > 0,
    key="observables.classical_molecules",
    title="molecules of the classical gas",
    attribute="classical_molecules",
    reference=lambda request: replace(
        request, classical_molecules=16 * request.classical_molecules, seed=request.seed + 1
    ),
    label="{:.0f}".format,
)


def choose_basis(scene: Any, request: Any, allowed: float) -> Choice:
    """The loosest tolerance whose error, measured by a run, meets the accuracy, and then the smallest J max.

    A tolerance bounds each source of error; what a run finds is often a hundred times less.
    """
    structure: Any = AlignRequest
    field = declared_fields(structure)["tolerance"]
    choice: Choice = field.knob.choose(field, request, allowed, answer_align)
    for looser in LOOSER:
        tried = replace(request, tolerance=min(looser * allowed, LOOSEST_COSINE), classical_molecules=0)
        trace = answer_align(tried).trace
        if trace.error_estimate > allowed:
            continue
        if request.jmax is not None:
            return Choice(replace(request, tolerance=tried.tolerance), f"tolerance {tried.tolerance:g}")
        return _least_basis(request, tried.tolerance, trace, allowed)
    return choice


def _least_basis(request: Any, tolerance: float, trace: Any, allowed: float) -> Choice:
    """The smallest J max whose error fits into the accuracy left by other errors; estimated on one block, confirmed by a run."""
    first, truncation = least_jmax(trace, allowed - truncation_apart(trace))
    for jmax in range(first, min(first + MOST_CONFIRMED, trace.jmax)):
        smaller = replace(request, tolerance=tolerance, jmax=jmax)
        try:
            confirmed = answer_align(replace(smaller, classical_molecules=0)).trace
        except BasisTooSmallError:
            continue
        error = truncation_apart(confirmed) + max(confirmed.edge_population, truncation)
        if error <= allowed:
            return Choice(smaller, f"tolerance {tolerance:g}, and J max {jmax}", error)
    return Choice(replace(request, tolerance=tolerance), f"tolerance {tolerance:g}, and J max {trace.jmax} from it")


def plan_align(request: Any) -> Plan:
    """The plan of a gas under pulses: timed with a coarse tolerance; the number of steps grows with its fourth root."""
    # the pilot of a plan is coarse
    coarse = replace(request, tolerance=max(request.tolerance, 1e-3), points=11, classical_molecules=0)
    trace = answer_align(coarse).trace
    # steps of a method of order 4 grow with tolerance^(-1/4)
    seconds = timed(lambda: answer_align(coarse)) * (coarse.tolerance / request.tolerance) ** 0.25
    described = plan_fields(request.top, max(trace.ensemble.jmax, 1), SEMI_RIGID)
    basis = f"J to {trace.jmax} at least, for a tolerance of {coarse.tolerance:g}"
    method = f"{trace.method} during the pulses, exact phases after them; steps halved until the cosines agree"
    return Plan(
        kind="align",
        effects=(*described["effects"], *(f"pulse on the {pulse.acts_on}" for pulse in request.pulses)),
        good=("M",) if all(pulse.axis == (0, 0, 1) for pulse in request.pulses) else (),
        parts=(("basis", f"J to {request.jmax}" if request.jmax else basis), ("method", method)),
        counts={"initial states": trace.states, "times": request.points},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_align(replace(coarse, points=request.points))),
        left_out=described["left_out"],
    )


ALIGN = Numerics({"": Goal("cosines", choose_basis)}, knobs=(BASIS, CLASSICAL), plan=plan_align)
