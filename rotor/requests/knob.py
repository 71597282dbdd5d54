"""A knob: how fine one approximation is. It stands with its field; accuracy goals, sweeps and plans use it.

    relative_error: float = declared(1e-6, Quantity(above=0), "Of Q, U and C_v", "numerics.relative_error", knob=Knob(
        (1e-1, 1e-2, 1e-3), 1e-13, (Measure("Q", "%", error_of_q),), "sums to {:g}", least=1e-13))

A sweep computes answers at each step and compares them with the finest value. An accuracy takes the coarsest setting whose estimated
error is within it. `Numerics`, beside the request, holds the knobs of a verb that are no fields,
and its plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.field import Field, all_fields
from rotor.requests.fill import Entries

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
    processor time is the cost of a setting. repeats: number of calculations in one answer; reported times are for one of them. series:
    whether the settings are values of one quantity, which a picture joins.
    """

    name: str
    measures: tuple[Measure, ...]
    settings: tuple[Setting, ...]
    reference: Any
    against: str
    answer: Callable[[Any], Any]
    repeats: int = 1
    title: str = ""
    series: bool = True


@dataclass(frozen=True)
class Sweeps:
    """All sweeps of a scene. remarks: approximations that have no sweep, each with the reason."""

    knobs: tuple[Sweep, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """Settings for an accuracy, chosen or tried.

    request: with these settings. how: the settings in words. error: estimated during the search, in the unit of the accuracy; 0 if only
    the answer states it; a function if its estimate takes a run: a plan does not call it. answer: with these settings, if the search
    computed it. confirming: cost of the estimate of an error in a run, in runs.
    """

    request: Any
    how: str
    error: float | Callable[[], float] = 0.0
    answer: Any = None
    confirming: float = 0.0

    @property
    def estimate(self) -> float:
        """The error; 0 if only a run estimates it."""
        return 0.0 if callable(self.error) else self.error


@dataclass(frozen=True)
class Sought:
    """Where a search for settings begins.

    request: with the settings of earlier knobs. accuracy: in its unit. compute: answers a request. error: of an answer. entries: as
    entered. answer: of the knob before, if it was computed.
    """

    request: Any
    accuracy: float
    compute: Answering
    error: Callable[[Any], float]
    entries: Entries
    answer: Any = None


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
    search: settings for an accuracy, coarsest first, each with its estimated error, where they are more than such values.
    title: in words, for pictures. key: of a knob that is declared beside the fields. attribute: of the request, which it changes, or
    value: of a request.
    reference: returns the request of the reference if `change` to the finest value does not; it returns None if the true value is known.
    answer: computes a request, by default as the verb does. repeats: number of calculations in one answer. label: formats a value.
    series: whether the values are those of one quantity.
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
    search: Callable[[Sought], Iterable[Choice]] | None = None
    title: str = ""
    key: str = ""
    attribute: str = ""
    value: Callable[[Any], Any] | None = None
    reference: Callable[[Any], Any] | None = None
    answer: Answering | None = None
    repeats: int = 1
    label: Callable[[Any], str] = "{:g}".format
    series: bool = True

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
            self.series,
        )

    def choices(self, sought: Sought, field: Field | None = None) -> Iterator[Choice]:
        """Settings for an accuracy, coarsest first. field: that `change` sets."""
        if self.search is not None:
            yield from self.search(sought)
            return
        name, key = ("", self.key) if field is None else (field.name, field.key)
        words = in_words(key)
        if self.least is not None:
            value = max(sought.accuracy, self.least)
            error = self.least if sought.accuracy < self.least else 0.0
            yield Choice(self.change(sought.request, name, value), f"{words} {value:g}", error)
        for number, value in enumerate(self.tried):
            changed = self.change(sought.request, name, value)
            answer = sought.compute(changed)
            how = f"{words} {value:g}" + ("" if number else LOOSEST)
            yield Choice(changed, how, sought.error(answer), answer)


def in_words(key: str) -> str:
    """The last part of a key in words."""
    return key.partition(",")[0].rpartition(".")[2].replace("_", " ")


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

    values: coarsest first. scene_value: the value of the scene; None where it has none. make: returns the request for a value. text:
    formats a value.
    Returns: each value once.

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
