"""What each kind of scene says of its numerics: how an accuracy is read, chosen and checked, what is swept, and what a plan holds.

The knobs of fields that are declared (`rotor.requests.knob`) serve every kind without a word here; a kind that is not in the table has
these alone, states the numerical error of its budget, and its plan is that of a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from rotor.requests.fill import Given
from rotor.requests.knob import Choice, Sweeps, knobs_of_fields
from rotor.scenes.choice import NOTHING_CHEAPER
from rotor.verbs.verb import Work, verb_of


@dataclass(frozen=True)
class Numerics:
    """The numerics of a kind of scene; functions as "module:name" in `rotor.scenes`, loaded where they are used.

    unit: of an accuracy. units: of which each is the accuracy of something else, instead. percent: whether it may be a percentage.
    choose: of (scene, request, accuracy), the settings; by default those of the knob whose value bounds the error. error: of
    (answer, unit); by default the numerical error of the budget. sweeps: of a request, what is swept beside the knobs of its fields.
    relative: of an answer, the error in percent of what an accuracy in percent is of, beside the unit; choose_relative: its settings.
    plan: of a request. levels: an answer has levels of which the rounding is checked.
    """

    unit: str = "MHz"
    units: tuple[str, ...] = ()
    percent: bool = False
    choose: str = ""
    error: str = ""
    relative: str = ""
    choose_relative: str = ""
    sweeps: str = ""
    plan: str = ""
    levels: bool = False


_TABLE = {
    "spectrum": Numerics(choose="accuracy:choose_spins", error="accuracy:error_of_list", sweeps="knobs.of_levels:spectrum",
                         relative="accuracy_intensities:error_of_intensities", choose_relative="accuracy_intensities:choose_cut",
                         plan="plan:plan_of_spectrum", levels=True),
    "levels": Numerics(choose="accuracy:choose_spins", error="accuracy:error_of_levels", sweeps="knobs.of_levels:levels",
                       plan="plan:plan_of_levels", levels=True),
    "raman": Numerics(choose="accuracy:choose_spins", error="accuracy:error_of_list", sweeps="knobs.of_levels:raman",
                      relative="accuracy_intensities:error_of_intensities", choose_relative="accuracy_intensities:choose_cut",
                      plan="plan:plan_of_raman", levels=True),
    "thermo": Numerics("", percent=True, sweeps="knobs.of_fields:thermo", plan="plan:plan_of_thermo"),
    "stark": Numerics(sweeps="knobs.of_fields:stark", plan="plan_in_fields:plan_in_field"),
    "zeeman": Numerics(sweeps="knobs.of_fields:zeeman", plan="plan_in_fields:plan_in_field"),
    "align": Numerics("", percent=True, choose="accuracy:choose_basis", sweeps="knobs.of_fields:align", plan="plan:plan_of_align"),
    "tumble": Numerics("rad", choose="accuracy_motion:choose", error="accuracy_motion:error_of_motion", sweeps="knobs.of_motion:tumble",
                       plan="plan_of_motion:plan_of_motion"),
    "gas": Numerics(units=("K", "%", ""), choose="accuracy_sampled:choose_molecules", error="accuracy_sampled:error_of_gas",
                    sweeps="knobs.of_motion:gas", plan="plan:plan_of_gas"),
    "fluid": Numerics(units=("K", "%"), choose="accuracy_sampled:choose_step", error="accuracy_sampled:error_of_fluid",
                      sweeps="knobs.of_motion:fluid", plan="plan:plan_of_fluid"),
    "fit": Numerics(choose="accuracy_measured:choose_for_lines", relative="accuracy_measured:error_of_constants",
                    choose_relative="accuracy_measured:choose_for_constants",
                    sweeps="knobs.of_measured:fit", plan="plan_measured:plan_of_fit"),
    "emission": Numerics("K", choose="accuracy_measured:choose_depth", plan="plan_measured:plan_of_emission"),
    "assign": Numerics(sweeps="knobs.of_measured:assign", plan="plan_measured:plan_of_assign"),
    "structure": Numerics("Å"),
    "torsion": Numerics(sweeps="knobs.of_measured:torsion", plan="plan:plan_of_torsion"),
}  # fmt: skip


def numerics_of(kind: str) -> Numerics:
    """The numerics of a kind; those of its declared knobs alone where the table has none."""
    return _TABLE.get(kind, Numerics())


def load(name: str) -> Callable[..., Any]:
    """A function by "module:name" in `rotor.scenes`."""
    module, _, function = name.partition(":")
    found: Callable[..., Any] = getattr(import_module(f"rotor.scenes.{module}"), function)
    return found


def choose(scene: Any, request: Any, accuracy: float, unit: str) -> Choice:
    """The request with the cheapest settings that reach an accuracy."""
    numerics = numerics_of(scene.kind)
    if numerics.relative and unit == "%":
        by_percent: Choice = (
            load(numerics.choose_relative)(scene, request, accuracy)
            if numerics.choose_relative
            else Choice(request, NOTHING_CHEAPER)
        )
        return by_percent
    if numerics.choose:
        found: Choice = load(numerics.choose)(scene, request, accuracy)
        return found
    return choose_by_knob(request, accuracy)


def choose_by_knob(request: Any, accuracy: float) -> Choice:
    """The accuracy as the value of the field that bounds the error; without such a field, nothing is cheaper."""
    for field, knob in knobs_of_fields(request):
        if knob.least is not None:
            return knob.choose(field, request, accuracy)
    return Choice(request, NOTHING_CHEAPER)


def error_of(kind: str, answer: Any, unit: str) -> float:
    """The error that an answer has, in the unit of the accuracy."""
    numerics = numerics_of(kind)
    if numerics.relative and unit == "%":
        return float(load(numerics.relative)(answer))
    if numerics.error:
        return float(load(numerics.error)(answer, unit))
    numerical: float | None = answer.errors.numerical
    if numerical is None:
        terms = (answer.errors.rounding, answer.errors.truncation)
        why = next(term.source for term in terms if term.value is None)
        raise ValueError(f"accuracy: the numerical error of {answer.errors.of} is not estimated: {why}; leave it out")
    return numerical


def sweeps_of(kind: str, request: Any) -> Sweeps:
    """Everything of a request that is swept: the knobs of its fields, then what its kind has beside them."""
    verb = verb_of(kind)
    work = Work(shown=verb.read_shown(Given()))
    declared = [
        knob.sweep(field, request, lambda one: verb.answer(one, work)) for field, knob in knobs_of_fields(request)
    ]
    name = numerics_of(kind).sweeps
    further: Sweeps = load(name)(request) if name else Sweeps(())
    return Sweeps((*declared, *further.knobs), further.remarks)
