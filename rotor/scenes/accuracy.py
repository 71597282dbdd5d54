"""Accuracy as an input: the cheapest settings that reach the requested accuracy, and the error that is reached.

| kind | accuracy of | what is chosen | error stated |
|---|---|---|---|
| spectrum, levels, raman | frequencies, energies, shifts, "1 kHz" | spins, left out if smaller; method of several | rounding, and these |
| stark, zeeman | energies, "1 kHz" | tolerance, and with it J max of the basis | by which energies move with a higher J max, round-off |
| align | cosines, 1e-4 | the loosest tolerance (steps, populations), the smallest J max | steps, edge, populations, phases |
| thermo | Q, U and C_v, "0.1 %" | levels summed, or the classical limit with corrections | of the sums |
| tumble | attitude, "1e-6 rad" | see `rotor.classical.tolerance_search`; free motion is exact | from finer steps |
| spectrum, raman | intensities, "0.1 %" | see `rotor.spectra.intensity_accuracy` | of the sum Q, of rounding, of weaker lines |
| emission | brightness, "1 mK" | the largest least depth, in decades | lines left out, Q |
| fit | frequencies, "1 kHz"; constants, "1 %" of their standard errors | the loosest tolerance of the search, in decades | the next step |
| torsion | levels | nothing: exact | functions, terms of the series |
| gas, fluid | see `rotor.thermodynamics.gas_numerics`, `rotor.fluids.numerics` | | |

The accuracy concerns the numerical error with the constants as given. Uncertain constants and missing orders of distortion are listed
in the plan. An accuracy beyond double precision is refused.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.requests.field import Field
from rotor.requests.knob import NOTHING_CHEAPER, Choice, knobs_of_fields
from rotor.requests.readers import Quantity
from rotor.scenes.choice import Accuracy, Reached, TotalAccuracy
from rotor.scenes.scene import Scene
from rotor.verbs.verb import verb_of

CONVERTED = ("MHz", "K", "Å")  # units of an accuracy for which others may stand
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def accuracy_of(scene: Scene) -> float | None:
    """The accuracy that a scene requests, in the unit of its kind; None if it requests none.

    >>> from rotor.scenes.scene import StarkScene, ThermoScene
    >>> accuracy_of(StarkScene(molecule="OCS", accuracy="1 kHz")), accuracy_of(ThermoScene(molecule="CO", accuracy="0.1 %"))
    (0.001, 0.001)
    """
    stated = accuracy_text(scene)
    if stated is None:
        return None
    goals, unit, text = verb_of(scene.kind).load_numerics().goals, unit_of(scene), str(stated).strip()
    if unit not in goals:
        units = ", or ".join(f"{unit} of the {goal.of}" for unit, goal in goals.items())
        raise ValueError(f"accuracy: {stated!r}: expected a unit: {units}")
    percent = text.endswith("%")
    if percent and unit not in ("", "%"):
        raise ValueError(f"accuracy: {stated!r}: expected {unit}, not a percentage")
    reader = Quantity(unit if unit in CONVERTED else "")
    number: float = Field(reader, "", "accuracy").read(text.removesuffix("%").removesuffix("rad").strip(), "key")
    if not number > 0.0:
        raise ValueError(f"accuracy: {stated!r}: expected more than 0")
    return 0.01 * number if percent and not unit else number


def accuracy_text(scene: Any) -> str | float | None:
    """The accuracy as the scene states it, for the total or the numerical error."""
    stated: Accuracy = getattr(scene, "accuracy", None)
    return stated.total if isinstance(stated, TotalAccuracy) else stated


def unit_of(scene: Scene) -> str:
    """The unit of the accuracy of a scene.

    >>> from rotor.scenes.scene import GasScene
    >>> [unit_of(GasScene(molecule="water", accuracy=text)) for text in ("1 K", "0.1 %", 0.02)]
    ['K', '%', '']
    """
    numerics, text = verb_of(scene.kind).load_numerics(), str(accuracy_text(scene)).strip()
    first = next(iter(numerics.goals))
    if text.endswith("%"):
        unit = numerics.percent(scene)
        return unit if unit in numerics.goals else first
    return "" if _NUMBER.fullmatch(text) and ("" in numerics.goals or not numerics.bare) else first


def chosen(scene: Scene, request: Any) -> Choice:
    """The request with the cheapest settings that reach the accuracy of its scene; unchanged if no field decides on it.

    Raises ValueError for an accuracy beyond double precision, and for a knob that is set as well.
    """
    goal, unit = accuracy_of(scene), unit_of(scene)
    assert goal is not None
    verb = verb_of(scene.kind)
    declared = verb.load_numerics().goals[unit]
    if not declared.by_field:
        return declared.chosen(scene, request, goal, verb.compute)
    for field, knob in knobs_of_fields(request) if unit != "%" else ():
        if knob.least is not None or knob.tried:
            return knob.choose(field, request, goal, verb.compute)
    return Choice(request, NOTHING_CHEAPER)


def reached(scene: Scene, answer: Any, choice: Choice) -> Reached:
    """The error that an answer reached; ValueError, with the reason, if it exceeds the requested accuracy."""
    goal = accuracy_of(scene)
    assert goal is not None
    unit = unit_of(scene)
    error = max(verb_of(scene.kind).load_numerics().goals[unit].error(answer), choice.error)
    if error > goal:
        raise out_of_reach(goal, error, unit, choice.how)
    if isinstance(getattr(scene, "accuracy", None), TotalAccuracy):
        refuse_total(_with_error(answer.errors, choice), goal, unit)
    return Reached(goal, error, unit, choice.how)


def out_of_reach(goal: float, error: float, unit: str, how: str) -> ValueError:
    """The error for an accuracy that the settings, or double precision, do not reach."""
    return ValueError(
        f"accuracy: {goal:g} {unit}".rstrip() + f" cannot be given: the error here is {error:.2g} ({how}); ask for less"
    )


def _with_error(budget: ErrorBudget, choice: Choice) -> ErrorBudget:
    """The budget with the error estimated during the choice of settings, if the answer has no truncation error."""
    if not choice.error or budget.truncation.value is not None:
        return budget
    return replace(budget, truncation=ErrorTerm(choice.error, choice.how))


def refuse_total(budget: ErrorBudget, accuracy: float, unit: str) -> None:
    """Raise ValueError if the total of a budget exceeds the accuracy or is not estimated; the text has the terms and remedies."""
    requested = f"accuracy.total: {accuracy:g} {unit}".rstrip()
    if budget.unit != unit:
        raise ValueError(
            f"{requested}: the errors here are of {budget.of} in {budget.unit or 'parts of 1'}; use that unit"
        )
    alone = "an accuracy without total is that of the numerical error alone"
    unestimated = [(name, term) for name, term in budget.shown() if term.value is None]
    if unestimated:
        texts = [
            f"{name} {term.text(unit)}" + (f" ({term.remedy} would lower it)" if term.remedy else "")
            for name, term in unestimated
        ]
        larger = filter(None, (budget.shortfall(accuracy), *texts))
        raise ValueError(f"{requested} cannot be given: {'; '.join(larger)}; {alone}")
    total = budget.total
    if total is not None and total > accuracy:
        largest = budget.shortfall(accuracy) or budget.line()
        raise ValueError(
            f"{requested} cannot be given: the total is {total:.2g} {unit}".rstrip() + f"; {largest}; {alone}"
        )
