"""Accuracy and plans of alignment: the loosest tolerance and the smallest J max whose cosines are within an accuracy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from rotor.alignment.align import BasisTooSmallError, truncation_apart
from rotor.alignment.basis import least_jmax, trace_with
from rotor.alignment.request import FINEST_TOLERANCE, TOLERANCE, answer_align, cosine_error
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.plans import plan_fields
from rotor.quantum.fields.inputs import largest_difference
from rotor.requests.knob import Choice, Knob, Measure, Sought, with_whole
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, whole_cost

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


def _looser(sought: Sought) -> Iterator[Choice]:
    """The loosest tolerances first, with the error that a run finds: often a hundred times less than the tolerance, which bounds it."""
    tolerances = [min(looser * sought.accuracy, LOOSEST_COSINE) for looser in LOOSER]
    for tolerance in [value for value in tolerances if value >= FINEST_TOLERANCE] or [FINEST_TOLERANCE]:
        trace = answer_align(replace(sought.request, tolerance=tolerance, classical_molecules=0)).trace
        chosen = replace(sought.request, tolerance=tolerance)
        yield Choice(chosen, f"tolerance {tolerance:g}", trace.error_estimate, trace)


def _smaller_bases(sought: Sought) -> Iterator[Choice]:
    """The smallest J max first, estimated on one block and confirmed by a run; at last the one that follows from the tolerance."""
    if sought.request.jmax is not None:
        return
    trace = sought.answer
    first, truncation = least_jmax(trace, sought.accuracy - truncation_apart(trace))
    for jmax in range(first, min(first + MOST_CONFIRMED, trace.jmax)):
        smaller = replace(sought.request, jmax=jmax)
        try:
            confirmed = answer_align(replace(smaller, classical_molecules=0)).trace
        except BasisTooSmallError:
            continue
        error = truncation_apart(confirmed) + max(confirmed.edge_population, truncation)
        yield Choice(smaller, f"J max {jmax}", error)
    yield Choice(sought.request, f"J max {trace.jmax} from it")


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
    search=_smaller_bases,
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


def align_cost(request: Any) -> Cost:
    """The cost with a coarse tolerance, scaled: the number of steps grows with its fourth root; and the coarse answer."""
    coarse = _coarse(request)
    growth = (coarse.tolerance / request.tolerance) ** 0.25  # steps of a method of order 4
    all_times = replace(coarse, points=request.points)
    return whole_cost(lambda: answer_align(coarse), growth, lambda: answer_align(all_times))


def _coarse(request: Any) -> Any:
    """A shorter request: the pilot of a plan is coarse."""
    return replace(request, tolerance=max(request.tolerance, 1e-3), points=11, classical_molecules=0)


def describe_align(request: Any, coarse: Any) -> dict[str, Any]:
    """What a gas under pulses does, from a coarse answer."""
    trace = coarse.trace
    described = plan_fields(request.top, max(trace.ensemble.jmax, 1), SEMI_RIGID)
    basis = f"J to {trace.jmax} at least, for a tolerance of {_coarse(request).tolerance:g}"
    method = f"{trace.method} during the pulses, exact phases after them; steps halved until the cosines agree"
    return {
        "effects": (*described["effects"], *(f"pulse on the {pulse.acts_on}" for pulse in request.pulses)),
        "good": ("M",) if all(pulse.axis == (0, 0, 1) for pulse in request.pulses) else (),
        "parts": (("basis", f"J to {request.jmax}" if request.jmax else basis), ("method", method)),
        "counts": {"initial states": trace.states, "times": request.points},
        "left_out": described["left_out"],
    }


ALIGN = Numerics(
    {"": Goal("cosines", knobs=(replace(TOLERANCE, search=_looser), BASIS), sets=("numerics.tolerance",))},
    knobs=(BASIS, CLASSICAL),
    describe=describe_align,
    cost=align_cost,
)
