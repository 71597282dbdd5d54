"""A knob: how fine one approximation is. It stands with its field; accuracy goals, sweeps and plans use it.

    relative_error: float = declared(1e-6, Quantity(above=0), "Of Q, U and C_v", "numerics.relative_error", knob=Knob(
        (1e-1, 1e-2, 1e-3), 1e-13, (Measure("Q", "%", error_of_q),), "sums to {:g}", least=1e-13))

A sweep computes answers at each step and compares them with the finest value. An accuracy goal either sets a field whose value bounds
the error, or is reached by trying values, coarsest first. `Numerics`, beside the request, holds the knobs of a verb that are no fields,
and its plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from rotor.requests.field import Field, all_fields, changed_fields

NOTHING_CHEAPER = "exact: nothing cheaper"
LOOSEST = ", nothing cheaper: the loosest there is"
DECADES = tuple(10.0**-n for n in range(13))  # values of a search
Answering = Callable[[Any], Any]


@dataclass(frozen=True)
class Setting:
    """One value of a knob. label: the value as text. request: input of the sweep's `answer`. in_scene: whether the scene has this value."""

    label: str
    request: Any
    in_scene: bool = False


@dataclass(frozen=True)
class Measure:
    """An error measure. of: the observable. unit: of the error. error: from an answer and the reference answer."""

    of: str
    unit: str
    error: Callable[[Any, Any], float]


@dataclass(frozen=True)
class Sweep:
    """The settings of a knob for one request.

    name: the key of the scene. title: in words. measures: errors of each answer. settings: coarsest first. reference: the request that
    errors are measured against; None if the true value is known. against: the reference in words. answer: computes a request; its
    processor time is the cost of a setting. repeats: number of calculations in one answer; reported times are for one of them.
    """

    name: str
    measures: tuple[Measure, ...]
    settings: tuple[Setting, ...]
    reference: Any
    against: str
    answer: Callable[[Any], Any]
    repeats: int = 1
    title: str = ""


@dataclass(frozen=True)
class Sweeps:
    """All sweeps of a scene. remarks: approximations that have no sweep, each with the reason."""

    knobs: tuple[Sweep, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """Settings chosen for an accuracy. request: with these settings. how: the settings in words. error: estimated during the search,
    in the unit of the accuracy; 0 if only the answer states it."""

    request: Any
    how: str
    error: float = 0.0


def stated(answer: Any) -> float:
    """The numerical error of an answer; infinite if it is not estimated."""
    error = answer.errors.numerical
    return float("inf") if error is None else float(error)


def with_field(request: Any, name: str, value: Any) -> Any:
    """The request with another value of a field."""
    return replace(request, **{name: value})


def with_whole(request: Any, name: str, value: float) -> Any:
    """The request with another whole number."""
    return replace(request, **{name: int(value)})


@dataclass(frozen=True, eq=False)
class Knob:
    """How fine an approximation is: of the field where the knob stands, or of `key`.

    steps: values of a sweep, coarsest first. finest: value of the reference. Both may be functions of the request.
    measures: errors of an answer beside the reference.
    against: the reference in words, with {:g} for its value, or a function of the value.
    least: finest possible value of a field that bounds the error in the unit of the accuracy; None for other fields.
    change: returns the request with a value. prepare: returns the request of a sweep. used: whether the knob affects a request.
    tried: values tried for an accuracy, coarsest first, where no value bounds the error.
    title: in words, for pictures. key: of a knob that is declared beside the fields. attribute: of the request, which it changes, or
    value: of a request.
    reference: returns the request of the reference if `change` to the finest value does not; it returns None if the true value is known.
    answer: computes a request, by default as the verb does. repeats: number of calculations in one answer. label: formats a value.
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
    title: str = ""
    key: str = ""
    attribute: str = ""
    value: Callable[[Any], Any] | None = None
    reference: Callable[[Any], Any] | None = None
    answer: Answering | None = None
    repeats: int = 1
    label: Callable[[Any], str] = "{:g}".format

    def sweep(self, field: Field | None, request: Any, answer: Answering) -> Sweep:
        """The settings of this knob for a request, including the request's value. field: None for a knob that is no field."""
        name = self.attribute if field is None else field.name
        plain = self.prepare(request)
        value_of_scene = getattr(request, name) if self.value is None else self.value(plain)
        steps = self.steps(plain) if callable(self.steps) else self.steps
        finest = self.finest(plain) if callable(self.finest) else self.finest

        def make(value: Any) -> Any:
            """The request with this value; a field that has it is not changed."""
            return plain if field is not None and value == value_of_scene else self.change(plain, name, value)

        settings = ladder(steps, value_of_scene, make, self.label)
        if value_of_scene is None and field is not None:
            settings += (Setting(field.none or "none", plain, True),)
        against = self.against(finest) if callable(self.against) else self.against.format(finest)
        reference = self.change(plain, name, finest) if self.reference is None else self.reference(plain)
        key = self.key if field is None else field.key or field.name
        return Sweep(
            key,
            self.measures,
            settings,
            reference,
            against,
            self.answer or answer,
            self.repeats,
            self.title or in_words(key),
        )

    def choose(self, field: Field, request: Any, accuracy: float, answer: Answering) -> Choice:
        """Set the field to the accuracy, or to the first tried value that reaches it.

        Raises ValueError if the accuracy is finer than possible, or if the field was set as well.
        """
        refuse_set(request, field.name)
        if self.tried:
            return self.search(field.name, field.last, request, accuracy, answer)
        assert self.least is not None
        if accuracy < self.least:
            raise ValueError(f"accuracy: {accuracy:g}: the finest that is possible here is {self.least:g}")
        return Choice(self.change(request, field.name, accuracy), f"{field.last} {accuracy:g}")

    def search(
        self,
        name: str,
        key: str,
        request: Any,
        accuracy: float,
        answer: Answering,
        error: Callable[[Any], float] = stated,
    ) -> Choice:
        """The request with the first tried value whose answer reaches the accuracy; else with the last, which a run then refuses.

        name: of the field that `change` sets. error: of an answer.
        """
        for value in self.tried:
            changed = self.change(request, name, value)
            if error(answer(changed)) <= accuracy:
                break
        return Choice(changed, f"{in_words(key)} {value:g}" + (LOOSEST if value == self.tried[0] else ""))


def in_words(key: str) -> str:
    """The last part of a key in words."""
    return key.partition(",")[0].rpartition(".")[2].replace("_", " ")


def refuse_set(request: Any, *names: str) -> None:
    """Raise ValueError if a field that the accuracy chooses was also set."""
    for field in changed_fields(request, names):
        raise ValueError(f"accuracy and {field.key}: give one of them")


def knobs_of_fields(request: Any) -> Iterator[tuple[Field, Knob]]:
    """The fields of a request that have a knob and affect the request."""
    structure: Any = type(request)
    for field in all_fields(structure).values():
        if field.knob is not None and field.knob.used(request):
            yield field, field.knob


def ladder(
    values: Iterable[float],
    scene_value: float | None,
    make: Callable[[Any], Any],
    text: Callable[[Any], str] = "{:g}".format,
) -> tuple[Setting, ...]:
    """Settings in order from coarse to fine, including the scene's value.

    Parameters
    ----------
    values : iterable of float
        Coarsest first.
    scene_value : float or None
        The value of the scene; None where it has none.
    make : callable
        Returns the request for a value.
    text : callable
        Formats a value.

    Returns
    -------
    tuple of Setting
        Each value once.

    Examples
    --------
    >>> [(setting.label, setting.in_scene) for setting in ladder([1e-2, 1e-4], 1e-3, lambda tolerance: None)]
    [('0.01', False), ('0.001', True), ('0.0001', False)]
    """
    values = [
        scene_value if scene_value is not None and math.isclose(value, scene_value, rel_tol=1e-9) else value
        for value in values
    ]
    falling = len(values) > 1 and values[0] > values[-1]
    ordered = sorted({*values, *(() if scene_value is None else (scene_value,))}, reverse=falling)
    return tuple(Setting(text(value), make(value), value == scene_value) for value in ordered)
