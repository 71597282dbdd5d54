"""A knob: how fine one approximation is. It stands with its field; choosing, sweeping and planning use it.

    relative_error: float = declared(1e-6, Quantity(above=0), "Of Q, U and C_v", "numerics.relative_error", knob=Knob(
        (1e-1, 1e-2, 1e-3), 1e-13, (Measure("Q", "%", error_of_q),), "sums to {:g}", least=1e-13))

A sweep makes answers with each step and compares them with that of the finest value. An accuracy goes to a field whose value bounds
the error, or is searched through the values to be tried, the coarsest first. What a verb has beside the knobs of its fields, and its
plan, stand in one `Numerics` beside its request.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from rotor.requests.field import Field, all_fields, own_fields

NOTHING_CHEAPER = "exact: nothing cheaper"
LOOSEST = ", nothing cheaper: the loosest there is"
DECADES = tuple(10.0**-n for n in range(13))  # values of a search
Answering = Callable[[Any], Any]


@dataclass(frozen=True)
class Setting:
    """One value of a knob. label: the value as text. request: for the sweep's `answer`. own: whether the scene has this value."""

    label: str
    request: Any
    own: bool = False


@dataclass(frozen=True)
class Measure:
    """One error. of: what it is the error of. unit: of the number. error: of an answer beside that of the reference."""

    of: str
    unit: str
    error: Callable[[Any, Any], float]


@dataclass(frozen=True)
class Sweep:
    """The settings of a knob for one request.

    name: the key of the scene. measures: errors of each answer. settings: coarsest first. reference: what errors are measured
    against, None where the true value is known. against: the reference in words. answer: of a request; its processor time is what a
    setting costs. repeats: how many calculations one answer holds; the time of one is given.
    """

    name: str
    measures: tuple[Measure, ...]
    settings: tuple[Setting, ...]
    reference: Any
    against: str
    answer: Callable[[Any], Any]
    repeats: int = 1


@dataclass(frozen=True)
class Sweeps:
    """All sweeps of a scene. remarks: parts of the calculation that have none, or that are not swept, each with the reason."""

    knobs: tuple[Sweep, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """request: with the settings that were chosen. how: which, in words. error: found while they were chosen, in the unit of the
    accuracy; 0 where the answer alone says it."""

    request: Any
    how: str
    error: float = 0.0


def with_field(request: Any, name: str, value: Any) -> Any:
    """The request with another value of a field."""
    return replace(request, **{name: value})


@dataclass(frozen=True, eq=False)
class Knob:
    """How fine the approximation of a field is.

    steps: values of a sweep, coarsest first. finest: that of the reference. Both may be functions of the request. measures: errors of an
    answer beside the reference. against: the reference in words, with {:g} for its value, or a function of it. least: the finest value
    of a field that bounds the error in the unit of the accuracy; None of other fields. tried: of a field that does not, the values of a
    search for an accuracy, coarsest first. change: the request with a value. prepare: the request of a sweep. used: whether a request
    has a use for the field.
    """

    steps: Iterable[Any] | Callable[[Any], Iterable[Any]]
    finest: Any
    measures: tuple[Measure, ...]
    against: str | Callable[[Any], str] = "{:g}"
    least: float | None = None
    change: Callable[[Any, str, Any], Any] = with_field
    prepare: Callable[[Any], Any] = lambda request: request
    used: Callable[[Any], bool] = lambda request: True
    tried: tuple[Any, ...] = ()

    def sweep(self, field: Field, request: Any, answer: Callable[[Any], Any]) -> Sweep:
        """The settings of this knob for a request, that of the request among them."""
        value_of_scene, plain = getattr(request, field.name), self.prepare(request)
        steps = self.steps(request) if callable(self.steps) else self.steps
        finest = self.finest(request) if callable(self.finest) else self.finest

        def make(value: Any) -> Any:
            """The request with a value."""
            return plain if value == value_of_scene else self.change(plain, field.name, value)

        settings = ladder(steps, value_of_scene, make)
        if value_of_scene is None:
            settings += (Setting(field.none or "none", plain, True),)
        against = self.against(finest) if callable(self.against) else self.against.format(finest)
        reference = self.change(plain, field.name, finest)
        return Sweep(field.key or field.name, self.measures, settings, reference, against, answer)

    def choose(self, field: Field, request: Any, accuracy: float, answer: Answering) -> Choice:
        """The request whose field is an accuracy, or the first value that reaches it.

        Raises ValueError where that is finer than possible, and where the field was given too.
        """
        refuse_given(request, field.name)
        name = field.last.replace("_", " ")
        if self.tried:
            return loosest(self.tried, lambda value: self.change(request, field.name, value), answer, accuracy, name)
        assert self.least is not None
        if accuracy < self.least:
            raise ValueError(f"accuracy: {accuracy:g}: the finest that is possible here is {self.least:g}")
        return Choice(self.change(request, field.name, accuracy), f"{field.last} {accuracy:g}")


def refuse_given(request: Any, *names: str) -> None:
    """ValueError where a field that an accuracy chooses was given."""
    structure: Any = type(request)
    fields = own_fields(structure)
    for name in names:
        if getattr(request, name) != fields[name].default:
            raise ValueError(f"accuracy and {fields[name].key}: give one of them")


def stated(answer: Any) -> float:
    """The numerical error that an answer states; infinite where it states none."""
    error = answer.errors.numerical
    return float("inf") if error is None else float(error)


def loosest(
    values: Iterable[float], change: Callable[[float], Any], answer: Answering, accuracy: float, name: str,
    error: Callable[[Any], float] = stated,
) -> Choice:  # fmt: skip
    """The request with the first of some values whose answer is within an accuracy; the last where none is, which a run refuses."""
    values = list(values)
    for value in values:
        request = change(value)
        if error(answer(request)) <= accuracy:
            break
    return Choice(request, f"{name} {value:g}" + (LOOSEST if value == values[0] else ""))


def knobs_of_fields(request: Any) -> Iterator[tuple[Field, Knob]]:
    """The fields of a request that have a knob, of those that it has a use for."""
    structure: Any = type(request)
    for field in all_fields(structure).values():
        if field.knob is not None and field.knob.used(request):
            yield field, field.knob


def ladder(
    values: Iterable[float],
    of_scene: float | None,
    make: Callable[[Any], Any],
    text: Callable[[Any], str] = "{:g}".format,
) -> tuple[Setting, ...]:
    """Settings of values that rise or fall from coarse to fine, that of the scene itself among them.

    Parameters
    ----------
    values : iterable of float
        Coarse ones first.
    of_scene : float or None
        The value of the scene; None where it has none.
    make : callable
        The request of a value.
    text : callable
        A value as text.

    Returns
    -------
    tuple of Setting
        Each value once.

    Examples
    --------
    >>> [(one.label, one.own) for one in ladder([1e-2, 1e-4], 1e-3, lambda tolerance: None)]
    [('0.01', False), ('0.001', True), ('0.0001', False)]
    """
    values = [
        of_scene if of_scene is not None and math.isclose(value, of_scene, rel_tol=1e-9) else value for value in values
    ]
    falling = len(values) > 1 and values[0] > values[-1]
    ordered = sorted({*values, *(() if of_scene is None else (of_scene,))}, reverse=falling)
    return tuple(Setting(text(value), make(value), value == of_scene) for value in ordered)
