"""Accuracy goals, knobs and plan of a verb, beyond the knobs of its fields."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.budget import ErrorTerm
from rotor.requests.fill import Entries
from rotor.requests.knob import Knob, knobs_of_fields
from rotor.requests.plan import Cost, Run, complete_cost


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

    of: the observable in words. error: of an answer. unfit: why the goal does not suit a request. prepare: returns the request for which
    knobs are chosen.
    """

    of: str = ""
    error: Callable[[Any], float] = numerical_error
    unfit: Callable[[Any], str] = lambda request: ""
    prepare: Callable[[Any], Any] = lambda request: request


@dataclass(frozen=True)
class Numerics:
    """Accuracy goals, knobs and plan of a verb.

    goals: by unit. bare: whether an accuracy may have no unit; it then belongs to the goal "" or, without one, to the first goal.
    percent: the unit that a percentage means, from the entries.
    knobs: that are no fields. prepare: returns the request for their sweeps.
    describe: fields of a plan from a request and its cost. rounding: error that no knob lowers, in the unit of the first goal.
    """

    goals: Mapping[str, Goal] = field(default_factory=lambda: {"MHz": Goal()})
    bare: bool = True
    percent: Callable[[Entries], str] = lambda entries: "%"
    knobs: tuple[Knob, ...] = ()
    prepare: Callable[[Any], Any] = lambda request: request
    describe: Callable[[Any, Cost], Mapping[str, Any]] | None = None
    rounding: Callable[[Any], ErrorTerm] | None = None

    @property
    def first_unit(self) -> str:
        """The unit of the first goal."""
        return next(iter(self.goals))

    def all_knobs(self, request: Any) -> Iterator[Knob]:
        """All knobs that affect a request: those of its fields first."""
        yield from knobs_of_fields(request)
        yield from (knob for knob in self.knobs if knob.used(request))

    def cost(self, request: Any, run: Run) -> Cost:
        """The cost of a request by the first knob that decides on it, else that of a complete run."""
        for knob in self.all_knobs(request):
            if knob.cost is not None:
                return knob.cost(request, run, knob.present, knob.changed)
        return complete_cost(request, run)
