"""Accuracy and plan of the motion of a body: exact for free motion, otherwise the tolerance and number of steps."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from rotor.classical import tolerance_search as search
from rotor.classical.driven import answer_driven
from rotor.classical.motion_steps import beginning, expected_steps, is_compiled, timed_steps
from rotor.classical.step_errors import MOST_CALLED, MOST_STEPS, apart
from rotor.classical.tumble import TumbleAnswer, TumbleRequest
from rotor.requests.budget import ROUNDING
from rotor.requests.knob import NOTHING_CHEAPER, Knob, Measure
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest

NAME = "error of the steps"
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
FINEST_TOLERANCE = 1e-13  # of references: a hundred times finer than the finest that is tried
DIVISIONS = (8, 16, 32, 64, 128)  # of the duration: steps of a splitting, times 16
ORDERS = (2, 4, 6, 8)


def motion_error(answer: Any) -> float:
    """Rounding error of a free motion; 0 for a driven motion, whose step error is estimated when the step is chosen."""
    return float(answer.errors.rounding.value or 0.0) if isinstance(answer, TumbleAnswer) else 0.0


def _under_effects(request: Any) -> str:
    """Why an accuracy of the growth rate, which is a closed form, does not suit a motion under effects."""
    if isinstance(request, TumbleRequest):
        return ""
    return (
        "% is the unit of the growth rate of a free motion; for a motion under effects give the "
        "accuracy of the attitude, in rad"
    )


def growth_error(answer: Any) -> float:
    """Rounding of the growth rate in percent: a square root of products and quotients of seven numbers."""
    return 100 * ROUNDING


def _refusal(request: Any) -> str | None:
    """Why no splitting applies to these effects; None if one does."""
    first, second = request.times[:2]
    try:
        answer_driven(replace(request, times=(first, second), step=(second - first) / 4))
    except ValueError as error:
        return str(error)
    return None


ATTITUDE = Measure("attitude", "rad", lambda answer, reference: apart(answer.motion, reference.motion))


def _finest(request: Any) -> float:
    return float(min(FINEST_TOLERANCE, 1e-2 * request.tolerance))


def _is_driven(request: Any) -> bool:
    return not isinstance(request, TumbleRequest)


def _with_tolerance(request: Any, _: str, tolerance: float) -> Any:
    return replace(request, step=None, tolerance=tolerance)


class Counted(NamedTuple):
    """A driven motion with its expected number of steps."""

    request: DrivenRequest
    steps: int


def _first_steps(motion: Counted, steps: int) -> DrivenRequest:
    """The first part of a motion, of so many steps."""
    return motion.request if steps == motion.steps else beginning(motion.request, steps / motion.steps)


def _short_steps(motion: Counted) -> tuple[int, int]:
    """Steps of two parts: the first run in Python, the others compiled."""
    first_steps, more = timed_steps(motion.request)
    return first_steps, more * first_steps


TOLERANCE = Knob(
    TOLERANCES,
    _finest,
    (ATTITUDE,),
    "steps to {:g}",
    key="numerics.tolerance",
    change=_with_tolerance,
    value=lambda request: request.tolerance if request.step is None else None,
    used=_is_driven,
    answer=answer_driven,
    tried=search.TOLERANCES,
    error=search.tolerance_error,
    predicted=search.predicted_tolerance,
    proportional=True,
    coarsest=(search.TOLERANCES[0], "loosest"),
    text="tolerance {:g} of a step",
    refuses=("numerics.tolerance", "numerics.step"),
    cost=Growth(
        _short_steps,
        lambda motion: motion.steps,
        _first_steps,
        lambda request: Counted(request, expected_steps(request)),
    ),
)


def _splitting(order: int) -> Knob:
    """The step of a splitting of an order."""
    return Knob(
        lambda request: [abs(request.times[-1] - request.times[0]) / (16 * number) for number in DIVISIONS],
        _finest,
        (ATTITUDE,),
        "steps to {:g}",
        key=f"numerics.step, order {order}",
        title="length of a step",
        change=lambda request, _, step: replace(request, step=step, order=order),
        used=lambda request: _is_driven(request) and _refusal(request) is None,
        value=lambda request: request.step if request.order == order else None,
        reference=lambda request: _with_tolerance(request, "", _finest(request)),
        answer=answer_driven,
        label="{:.3g}".format,
    )


FREE = Knob(
    key="the free motion",
    fixed=f"{NOTHING_CHEAPER}; theta functions, round-off alone",
    used=lambda request: isinstance(request, TumbleRequest),
)
UNSPLIT = Knob(key="numerics.step", fixed=lambda request: _refusal(request) or "", used=_is_driven)


def step_error(request: Any, steps: int) -> LeftOut:
    """The largest error of the attitude in radians at the times of a request, for this number of steps."""
    if steps <= (MOST_STEPS if is_compiled(request) else MOST_CALLED):
        term = answer_driven(request).errors.truncation
        return LeftOut(NAME, term.value, "rad", f"{term.source}; chaos makes it grow")
    if request.step is not None:
        return LeftOut(NAME, None, "rad", "halve numerics.step")
    basis = f"at most, {steps} steps each to {request.tolerance:g} of |L| and of a radian; chaos makes it grow"
    return LeftOut(NAME, steps * request.tolerance, "rad", basis)


def describe_motion(request: Any, cost: Cost) -> dict[str, Any]:
    """What a free motion does, or a driven one."""
    steps = cost.amount
    if isinstance(request, TumbleRequest):
        return {
            "effects": ("free rotation",),
            "good": ("energy", "angular momentum in space"),
            "parts": (("method", "the exact free motion (theta functions): no step, round-off alone"),),
            "counts": {"times": len(request.times or ()) or 201},
        }
    return {
        "effects": tuple(type(effect).__name__ for effect in request.effects),
        "good": ("energy",) if all(effect.conserves_energy for effect in request.effects) else (),
        "parts": (("method", _stepping(request, steps)),),
        "counts": {"steps": steps, "times": len(request.times)},
        "left_out": (step_error(request, steps),),
    }


def _stepping(request: DrivenRequest, steps: int) -> str:
    if request.step is not None:
        return request.stepping
    return f"{request.stepping}; {abs(request.times[-1] - request.times[0]) / steps:.3g} a step in the mean"


TUMBLE = Numerics(
    {"rad": Goal("attitude", motion_error), "%": Goal("growth rate", growth_error, _under_effects)},
    knobs=(TOLERANCE, *map(_splitting, ORDERS), FREE, UNSPLIT),
    describe=describe_motion,
)
