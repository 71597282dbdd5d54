"""Choosing, sweeping and planning of a verb: what it has beside the knobs of its fields, in one object beside its request."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rotor.requests.knob import Choice, Sweeps
from rotor.requests.plan import Plan


def numerical_error(answer: Any) -> float:
    """The numerical error that an answer states; ValueError, with the reason, where it is not estimated."""
    error: float | None = answer.errors.numerical
    if error is None:
        terms = (answer.errors.rounding, answer.errors.truncation)
        why = next(term.source for term in terms if term.value is None)
        raise ValueError(f"accuracy: the numerical error of {answer.errors.of} is not estimated: {why}; leave it out")
    return error


@dataclass(frozen=True)
class Goal:
    """What an accuracy in one unit is of.

    of: in words. choose: of (scene, request, accuracy), the settings; None: those of the knob of a field. error: of an answer.
    """

    of: str = ""
    choose: Callable[[Any, Any, float], Choice] | None = None
    error: Callable[[Any], float] = numerical_error


@dataclass(frozen=True)
class Numerics:
    """Choosing, sweeping and planning of a verb beside the knobs of its fields.

    goals: by the unit of an accuracy; a number is in "", else in the first one. bare: whether a number may stand without a unit.
    percent: the unit of a percentage of a scene. sweeps: of a request. plan: of a request; by default that of a run. planned: of (scene,
    request, accuracy in the first unit), the plan with its choice, where a search would take as long as a run. rounding: of the highest
    level in MHz.
    """

    goals: Mapping[str, Goal] = field(default_factory=lambda: {"MHz": Goal()})
    bare: bool = True
    percent: Callable[[Any], str] = lambda scene: "%"
    sweeps: Callable[[Any], Sweeps] = lambda request: Sweeps(())
    plan: Callable[[Any], Plan] | None = None
    planned: Callable[[Any, Any, float], tuple[Plan, Choice | None]] | None = None
    rounding: Callable[[Any], float] | None = None
