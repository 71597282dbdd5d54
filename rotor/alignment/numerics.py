"""Accuracy and plans of alignment: J max of the basis and molecules as knobs; the tolerance is one of the request."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from rotor.alignment.align import BasisTooSmallError, truncation_apart
from rotor.alignment.basis import least_jmax, trace_with
from rotor.alignment.request import PILOT_TOLERANCE, answer_align, cosine_error
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.estimates.plans import plan_fields
from rotor.quantum.fields.inputs import largest_difference
from rotor.requests.knob import Estimate, Knob, Measure, Sought
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost

MORE_J = 6  # in the reference
SHARES_OF_J = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
MOST_CONFIRMED = 6  # J max that are confirmed by whole runs, before the one of its tolerance is taken


def _in_basis(request: Any) -> tuple[Any, int]:
    """The quantum gas of a request, and J max of its basis."""
    trace = answer_align(replace(request, classical_molecules=0)).trace
    return trace, trace.jmax


def _smaller(setting: tuple[Any, int]) -> list[int]:
    """Values of J max up to that of the request, at least the highest populated J."""
    trace, jmax = setting
    values = {round(share * jmax) for share in SHARES_OF_J} | {jmax - 1}
    return sorted(j for j in values if j >= trace.ensemble.jmax)


def _smaller_bases(sought: Sought) -> Iterator[int | None]:
    """The smallest J max first, estimated on one block; at last the one that follows from the tolerance."""
    if sought.request.jmax is not None:
        return
    trace = sought.answer
    first, sought.known["truncation"] = least_jmax(trace, sought.accuracy - truncation_apart(trace))
    yield from range(first, min(first + MOST_CONFIRMED, trace.jmax))
    yield None


def _basis_error(sought: Sought, request: Any, jmax: int | None) -> Estimate:
    """Error with a smaller basis, confirmed by a run; that of the tolerance's own basis is known."""
    if jmax is None:
        return Estimate(0.0)
    try:
        confirmed = answer_align(replace(request, classical_molecules=0)).trace
    except BasisTooSmallError:
        return Estimate(math.inf)
    return Estimate(truncation_apart(confirmed) + max(confirmed.edge_population, sought.known["truncation"]))


def _basis_text(sought: Sought, jmax: int | None) -> str:
    return f"J max {sought.answer.jmax} from it" if jmax is None else f"J max {jmax}"


BASIS = Knob(
    _smaller,
    lambda setting: setting[1] + MORE_J,
    (Measure("cosine", "", cosine_error),),
    "J max {}",
    key="numerics.jmax",
    title="highest J of the basis",
    attribute="jmax",
    value=lambda setting: setting[1],
    prepare=_in_basis,
    swept=lambda setting, jmax: (setting[0], jmax),
    answer=lambda setting: trace_with(*setting),
    tried=_smaller_bases,
    error=_basis_error,
    text=_basis_text,
    refuses=(),
)


def _classical_error(answer: Any, reference: Any) -> float:
    """The error of the classical gas, which is that of a mean."""
    return max(largest_difference(answer.classical[name], true) for name, true in reference.classical.items())


CLASSICAL = Knob(
    lambda request: [max(request.classical_molecules // part, 2) for part in (64, 16, 4)],
    lambda request: 16 * request.classical_molecules,
    (Measure("cosine of the classical gas", "", _classical_error),),
    "{} other molecules",
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


def describe_align(request: Any, cost: Cost) -> dict[str, Any]:
    """What a gas under pulses does, from a coarse answer."""
    trace = cost.answer.trace
    described = plan_fields(request.top, max(trace.ensemble.jmax, 1), SEMI_RIGID)
    basis = f"J to {trace.jmax} at least, for a tolerance of {max(request.tolerance, PILOT_TOLERANCE):g}"
    method = f"{trace.method} during the pulses, exact phases after them; steps halved until the cosines agree"
    return {
        "effects": (*described["effects"], *(f"pulse on the {pulse.acts_on}" for pulse in request.pulses)),
        "good": ("M",) if all(pulse.axis == (0, 0, 1) for pulse in request.pulses) else (),
        "parts": (("basis", f"J to {request.jmax}" if request.jmax else basis), ("method", method)),
        "counts": {"initial states": trace.states, "times": request.points},
        "left_out": described["left_out"],
    }


ALIGN = Numerics(
    {"": Goal("cosines")},
    knobs=(BASIS, CLASSICAL),
    describe=describe_align,
)
