"""A knob: how fine one approximation is. It declares its values, the error at a value, and what a calculation costs by it.

    relative_error: float = declared(1e-6, Quantity(above=0), "Of Q, U and C_v", "numerics.relative_error", knob=Knob(
        (1e-1, 1e-2, 1e-3), 1e-13, (Measure("Q", "%", error_of_q),), "sums to {:g}", least=1e-13))

A sweep computes answers at each step and compares them with the finest value. An accuracy takes the coarsest value whose error is within
it. A plan extrapolates the cost from small values. A knob of a field stands with it, others in the `Numerics` of a verb; nothing else
is written for one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from rotor.frozen import dataclass
from rotor.requests.field import all_fields
from rotor.requests.fill import Entries
from rotor.requests.readers import Field

if TYPE_CHECKING:
    from rotor.requests.plan import Cost, Run

NOTHING_CHEAPER = "exact: nothing cheaper"
DECADES = tuple(10.0**-n for n in range(13))  # values that are tried
Answering = Callable[[Any], Any]
T = TypeVar("T", "Choice", "Estimate")


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

    settings: coarsest first. reference: the request that errors are measured against; None if the true value is known. against: the
    reference in words. answer: computes a request; its processor time is the cost of a setting.
    """

    knob: Knob
    settings: tuple[Setting, ...]
    reference: Any
    against: str
    answer: Callable[[Any], Any]

    @property
    def name(self) -> str:
        """The key of the scene."""
        return self.knob.key


@dataclass(frozen=True)
class Choice:
    """Settings for an accuracy.

    request: with these settings. how: the settings in words. error: estimated, in the unit of the accuracy; 0 if only the answer states
    it. answer: with these settings, if the search computed it. confirming: cost of the estimate of an error in a run, in runs.
    """

    request: Any
    how: str
    error: float = 0.0
    answer: Any = None
    confirming: float = 0.0


@dataclass(frozen=True)
class Sought:
    """What is known where a value is chosen.

    request: with the values of earlier knobs. accuracy: in `unit`. compute: answers a request. error: of an answer. entries: as
    entered. answer: of the knob before, if it was computed. known: what the estimates of this search share.
    """

    request: Any
    accuracy: float
    unit: str
    compute: Answering
    error: Callable[[Any], float]
    entries: Entries
    answer: Any = None
    known: dict[Any, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Estimate:
    """The error of a value. answer: if it was computed. remark: follows the value in words. least: what no finer value lowers."""

    error: float
    answer: Any = None
    remark: str = ""
    least: float = 0.0


@dataclass(frozen=True)
class Prediction:
    """A value that a short calculation suggests. remark: follows it in words. runs: what the estimate of its error costs, in runs."""

    value: Any
    remark: str
    runs: float


@dataclass(frozen=True, eq=False)
class Knob:
    """How fine an approximation is.

    key, title: for reports; key and attribute of a field's knob are the field's. attribute: of the request, that `change` sets.
    change: returns the request with a value. value: of a request, if not that of the attribute. used: whether the knob affects a request.

    Sweep. steps: values, coarsest first. finest: value of the reference. Both may be functions of the request.
    measures: errors of an answer beside the reference. against: the reference in words, with {:g} for its value, or a function of it.
    fixed: why it is not swept; without a remark if empty; None: it is swept. prepare: returns the request of a sweep.
    swept: returns the input of `answer` from a request and a value. answer: by default as the verb does. repeats: number of calculations
    in one answer. reference: returns the input for the reference, if it is not that of `finest`, or None if the true value is known.
    label: formats a value. series: whether the values are those of one quantity.

    Accuracy. least: finest value, if the value bounds the error; else tried: values, coarsest first, and error: at a value in a changed
    request, by default of its answer. bounds: units of the accuracies it is chosen for, by default those of the measures.
    stated: whether the answer states the error, so that the estimate serves the choice alone. proportional: whether the values are
    decades, and the error about proportional to them. predicted: a value that is tried first. coarsest: value that nothing can be
    coarser than, and the word for it. text: a value in words. refuses: keys of the user that exclude an accuracy, by default that of
    the knob. unchosen: why no value is chosen, in a plan.

    Plan. cost: of a request, such as a `Growth`; None if the knob does not decide on it.
    """

    steps: Iterable[Any] | Callable[[Any], Iterable[Any]] = ()
    finest: Any = None
    measures: tuple[Measure, ...] = ()
    against: str | Callable[[Any], str] = "{:g}"
    least: float | None = None
    key: str = ""
    title: str = ""
    attribute: str = ""
    change: Callable[[Any, str, Any], Any] = lambda request, name, value: replace(request, **{name: value})
    value: Callable[[Any], Any] | None = None
    used: Callable[[Any], bool] = lambda request: True
    fixed: str | Callable[[Any], str | None] | None = None
    prepare: Callable[[Any], Any] = lambda request: request
    swept: Callable[[Any, Any], Any] | None = None
    answer: Answering | None = None
    repeats: int = 1
    reference: Callable[[Any], Any] | None = None
    label: Callable[[Any], str] = "{:g}".format
    series: bool = True
    tried: Iterable[Any] | Callable[[Sought], Iterable[Any]] = ()
    error: Callable[[Sought, Any, Any], Estimate] | None = None
    bounds: tuple[str, ...] | None = None
    stated: bool = False
    proportional: bool = False
    predicted: Callable[[Sought], Prediction | None] = lambda sought: None
    coarsest: tuple[Any, str] = (None, "")
    text: str | Callable[[Sought, Any], str] = ""
    unchosen: str = ""
    refuses: tuple[str, ...] | None = None
    cost: Callable[[Any, Run, Callable[[Any], Any], Callable[[Any, Any], Any]], Cost] | None = None
    field: Field | None = None

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the accuracies that the knob is chosen for."""
        if self.bounds is not None:
            return self.bounds
        return tuple(measure.unit for measure in self.measures) if self.tried or self.least is not None else ()

    def present(self, request: Any) -> Any:
        """The value that a request has."""
        return getattr(request, self.attribute) if self.value is None else self.value(request)

    def changed(self, request: Any, value: Any) -> Any:
        """The request with a value."""
        return self.change(request, self.attribute, value)

    def reason(self, request: Any) -> str | None:
        """Why the knob is not swept; None if it is."""
        return self.fixed(request) if callable(self.fixed) else self.fixed

    def sweep(self, request: Any, answer: Answering) -> Sweep:
        """The settings of this knob for a request, including the request's value."""
        plain = self.prepare(request)
        present = self.present(plain)
        steps = self.steps(plain) if callable(self.steps) else self.steps
        finest = self.finest(plain) if callable(self.finest) else self.finest
        swept = self.changed if self.swept is None else self.swept

        def make(value: Any) -> Any:
            """The input with this value; a request that has it is not changed."""
            return plain if self.swept is None and value == present else swept(plain, value)

        settings = ladder(steps, present, make, self.label)
        if present is None and self.field is not None:
            settings += (Setting(self.field.none or "none", plain, True),)
        against = self.against(finest) if callable(self.against) else self.against.format(finest)
        reference = swept(plain, finest) if self.reference is None else self.reference(plain)
        return Sweep(self, settings, reference, against, self.answer or answer)

    def choose(self, sought: Sought, confirmed: bool) -> Choice | None:
        """The first value, coarsest first, whose error is within an accuracy, else the last one tried; None without values.

        confirmed: whether the error of a predicted value, which takes a run, is estimated.
        """
        missed, values = "", self.tried(sought) if callable(self.tried) else self.tried
        if self.least is not None:
            values = (max(sought.accuracy, self.least),)
        if (predicted := self.predicted(sought)) is not None:
            choice = replace(
                self._attempt(sought, predicted.value, predicted.remark, confirmed)[0], confirming=predicted.runs
            )
            values = tuple(value for value in values if value < predicted.value)
            if choice.error <= sought.accuracy or not values:
                return choice
            missed = f", finer than the plan's {predicted.value:g}, which missed"
        if self.proportional:
            attempt = partial(self._attempt, sought, remark=missed)
            return first_by_proportion(tuple(values), lambda value: attempt(value)[0], sought.accuracy)[1]
        last = None
        for value in values:
            last, least = self._attempt(sought, value, missed)
            if last.error <= sought.accuracy or least > sought.accuracy:
                break
        return last

    def _attempt(self, sought: Sought, value: Any, remark: str, confirmed: bool = True) -> tuple[Choice, float]:
        """A value as a choice, and what no finer value lowers of its error. confirmed: whether the error is estimated."""
        request = self.change(sought.request, self.attribute, value)
        if not confirmed:
            estimate = Estimate(0.0)
        elif self.error is not None:
            estimate = self.error(sought, request, value)
        elif self.least is not None:
            estimate = Estimate(value)
        else:
            answer = sought.compute(request)
            estimate = Estimate(sought.error(answer), answer)
        text = self.text or f"{in_words(self.key)} {{:g}}"
        coarsest, word = self.coarsest
        alone = f", nothing cheaper: the {word} there is" if word and value == coarsest else ""
        how = (text(sought, value) if callable(text) else text.format(value)) + alone + remark + estimate.remark
        is_stated = (self.stated or self.least is not None) and estimate.error <= sought.accuracy
        return Choice(request, how, 0.0 if is_stated else estimate.error, estimate.answer), estimate.least


def first_by_proportion(values: Sequence[float], attempt: Callable[[float], T], accuracy: float) -> tuple[float, T]:
    """The first of decades within an accuracy, else the last, with its attempt.

    Errors are about proportional to the values, so that few are tried. attempt: has the error of a value.
    """
    attempts: dict[int, T] = {}
    misses, reaches = -1, len(values)
    place = min(range(len(values)), key=lambda n: abs(math.log10(values[n] / accuracy)))
    while reaches > misses + 1:
        attempts[place] = attempt(values[place])
        error = attempts[place].error
        decades = max(math.floor(abs(math.log10(max(error, 1e-30) / accuracy))), 1)
        if error <= accuracy:
            reaches, place = place, max(place - decades, misses + 1)
        else:
            misses, place = place, min(place + decades, reaches - 1)
    first = min(reaches, len(values) - 1)
    return values[first], attempts[first]


def in_words(key: str) -> str:
    """The last part of a key in words."""
    return key.partition(",")[0].rpartition(".")[2].replace("_", " ")


def knobs_of_fields(request: Any) -> Iterator[Knob]:
    """The knobs of the fields of a request that affect it, with their keys and names."""
    structure: Any = type(request)
    for declaration in all_fields(structure).values():
        knob: Knob | None = declaration.knob
        if knob is not None and knob.used(request):
            yield replace(knob, key=declaration.identity, attribute=declaration.name, field=declaration)


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
        scene_value
        if isinstance(scene_value, int | float) and math.isclose(value, scene_value, rel_tol=1e-9)
        else value
        for value in values
    ]
    falling = len(values) > 1 and values[0] > values[-1]
    ordered = sorted({*values, *(() if scene_value is None else (scene_value,))}, reverse=falling)
    return tuple(Setting(text(value), make(value), value == scene_value) for value in ordered)
