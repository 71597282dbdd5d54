"""Plans of the motion of one body: exact where it is free, else the steps, their tolerance and their number."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.scenes.choice import Choice
from rotor.scenes.left_out import LeftOut
from rotor.scenes.motion_steps import beginning, expected_steps, first_share, some_steps, steps_of
from rotor.scenes.plan_parts import LONG_SEARCH, Plan, peak_mb, timed
from rotor.scenes.plan_steps import NAME, step_error

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest
    from rotor.scenes.scene import Scene

ORDER = 8  # of the adaptive method: steps go with the tolerance to the power -1/8


def plan_of_motion(request: Any) -> Plan:
    """The plan of a free or driven motion with the settings of its request."""
    from rotor.classical.tumble import TumbleRequest, answer_tumble

    if not isinstance(request, TumbleRequest):
        return _driven(request)
    return Plan(
        kind="tumble",
        effects=("free rotation",),
        good=("energy", "angular momentum in space"),
        parts=(("method", "the exact free motion (theta functions): no step, round-off alone"),),
        counts={"times": len(request.times or ()) or 201},
        seconds=timed(lambda: answer_tumble(request)),
        memory_mb=peak_mb(lambda: answer_tumble(request).table.columns),
        left_out=(),
    )


def plan_with_accuracy(scene: Scene, request: DrivenRequest) -> tuple[Plan, Choice | None]:
    """The plan of a driven motion with the tolerance that its run takes, and that choice where the whole motion was searched.

    Of a long motion that is found by its first part; the run then makes a motion a hundred times finer beside it, for the error.
    """
    from rotor.scenes.accuracy import asked_of
    from rotor.scenes.accuracy_motion import FINER, Planned, planned_tolerance

    asked, found = asked_of(scene), list[Planned]()
    assert asked is not None
    search = timed(lambda: found.append(planned_tolerance(scene, request, asked)), LONG_SEARCH)
    planned = found[-1]
    plan = _driven(replace(request, tolerance=planned.tolerance), planned.steps, planned.error)
    parts = (*plan.parts, ("accuracy", planned.how))
    if planned.steps is not None:
        choice = Choice(replace(request, tolerance=planned.tolerance), planned.how, planned.error or 0.0)
        return replace(plan, parts=parts, seconds=search + plan.seconds), choice
    finer = 10.0 ** (FINER / ORDER)  # times as many steps
    return replace(plan, parts=parts, seconds=search + (2.0 + finer) * plan.seconds), None


def _driven(request: DrivenRequest, known_steps: int | None = None, known_error: float | None = None) -> Plan:
    steps = expected_steps(request) if known_steps is None else known_steps
    if known_error is None:
        error = step_error(request, steps)
    else:
        error = LeftOut(NAME, known_error, "rad", f"{steps} steps, found by the search for the accuracy")
    return Plan(
        kind="tumble",
        effects=tuple(type(effect).__name__ for effect in request.effects),
        good=("energy",) if all(effect.conserves_energy for effect in request.effects) else (),
        parts=(("method", _stepping(request, steps)),),
        counts={"steps": steps, "times": len(request.times)},
        seconds=_seconds_of_steps(request, steps),
        memory_mb=_memory_mb(request),
        left_out=(error,),
    )


def _stepping(request: DrivenRequest, steps: int) -> str:
    if request.step is not None:
        return f"splitting of order {request.order}, step {request.step:g}"
    mean = abs(request.times[-1] - request.times[0]) / steps
    return f"Runge-Kutta of order {ORDER}, adaptive, tolerance {request.tolerance:g} of a step; {mean:.3g} a step in the mean"


def _seconds_of_steps(request: DrivenRequest, steps: int) -> float:
    """Processor time of a driven motion: its first steps are made one by one and the further ones compiled, so two parts are timed."""
    some, more = some_steps(request)
    if steps < more * some:
        return timed(lambda: steps_of(request, 1.0))
    counts, seconds = [], []
    for share in (some / steps, more * some / steps):
        seconds.append(timed(lambda share=share: counts.append(steps_of(request, share))))  # type: ignore[misc]
    near, far = counts[0], counts[-1]
    rate = max(seconds[1] - seconds[0], 0.0) / max(far - near, 1)
    return seconds[0] + rate * max(steps - near, 0)


def _memory_mb(request: DrivenRequest) -> float:
    from rotor.classical.driven import answer_driven

    first = beginning(request, first_share(request))
    return peak_mb(lambda: answer_driven(first).table.columns) * len(request.times) / len(first.times)
