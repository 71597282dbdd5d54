"""Accuracy goals, sweeps and plan of a verb, beyond the knobs of its fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rotor.requests.knob import Choice, Knob, stated
from rotor.requests.plan import Plan


def numerical_error(answer: Any) -> float:
    """The numerical error of an answer; ValueError, with the reason, if it is not estimated."""
    error: float | None = answer.errors.numerical
    if error is None:
        terms = (answer.errors.rounding, answer.errors.truncation)
        why = next(term.source for term in terms if term.value is None)
        raise ValueError(f"accuracy: the numerical error of {answer.errors.of} is not estimated: {why}; leave it out")
    return error


@dataclass(frozen=True)
class Goal:
    """An accuracy goal in one unit.

    of: the observable in words. error: the error of an answer. knob: whose values are tried; without it, the knob of a field chooses.
    choose: returns the settings from (scene, request, accuracy), where the accuracy determines them without a search.
    """

    of: str = ""
    choose: Callable[[Any, Any, float], Choice] | None = None
    error: Callable[[Any], float] = numerical_error
    knob: Knob | None = None

    @property
    def by_field(self) -> bool:
        """Whether the knob of a field chooses."""
        return self.choose is None and self.knob is None

    def chosen(self, scene: Any, request: Any, accuracy: float, answer: Callable[[Any], Any]) -> Choice:
        """The settings for an accuracy, where no knob of a field chooses. answer: computes a request."""
        if self.choose is not None:
            return self.choose(scene, request, accuracy)
        assert self.knob is not None
        error = stated if self.error is numerical_error else self.error
        return self.knob.search("", self.knob.key, request, accuracy, answer, error)


@dataclass(frozen=True)
class Numerics:
    """Accuracy goals, sweeps and plan of a verb.

    goals: by unit. bare: whether an accuracy may have no unit; it then belongs to the goal "" or, without one, to the first goal.
    percent: the unit that a percentage means in a scene.
    knobs: that are no fields. prepare: returns the request for their sweeps. remarks: approximations without a sweep, with the reason.
    plan: from a request; the default is the plan of a run.
    planned: plan and settings from (scene, request, accuracy in the first unit), where a search would take as long as a run.
    rounding: error of the highest level from rounding, in MHz.
    """

    goals: Mapping[str, Goal] = field(default_factory=lambda: {"MHz": Goal()})
    bare: bool = True
    percent: Callable[[Any], str] = lambda scene: "%"
    knobs: tuple[Knob, ...] = ()
    prepare: Callable[[Any], Any] = lambda request: request
    remarks: Callable[[Any], Iterable[str]] = lambda request: ()
    plan: Callable[[Any], Plan] | None = None
    planned: Callable[[Any, Any, float], tuple[Plan, Choice | None]] | None = None
    rounding: Callable[[Any], float] | None = None
