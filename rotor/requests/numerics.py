"""Accuracy goals, sweeps and plan of a verb, beyond the knobs of its fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.fill import Entries
from rotor.requests.knob import Knob
from rotor.requests.plan import Cost


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

    of: the observable in words. error: of an answer. knobs: set one after the other; without them, the first knob of a field that can be
    set. sets: keys of the fields that they set. unfit: why the goal does not suit a request. prepare: returns the request of the search.
    """

    of: str = ""
    error: Callable[[Any], float] = numerical_error
    knobs: tuple[Knob, ...] = ()
    sets: tuple[str, ...] = ()
    unfit: Callable[[Any], str] = lambda request: ""
    prepare: Callable[[Any], Any] = lambda request: request


@dataclass(frozen=True)
class Numerics:
    """Accuracy goals, sweeps and plan of a verb.

    goals: by unit. bare: whether an accuracy may have no unit; it then belongs to the goal "" or, without one, to the first goal.
    percent: the unit that a percentage means, from the entries.
    knobs: that are no fields. prepare: returns the request for their sweeps. remarks: approximations without a sweep, with the reason.
    describe: fields of a plan from a request and an answer that its cost has. cost: of a request; None: that of a complete run.
    rounding: error of the highest level from rounding, in MHz.
    """

    goals: Mapping[str, Goal] = field(default_factory=lambda: {"MHz": Goal()})
    bare: bool = True
    percent: Callable[[Entries], str] = lambda entries: "%"
    knobs: tuple[Knob, ...] = ()
    prepare: Callable[[Any], Any] = lambda request: request
    remarks: Callable[[Any], Iterable[str]] = lambda request: ()
    describe: Callable[[Any, Any], Mapping[str, Any]] | None = None
    cost: Callable[[Any], Cost] | None = None
    rounding: Callable[[Any], float] | None = None
