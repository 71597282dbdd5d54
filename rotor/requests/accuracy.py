"""Accuracy as an input: the cheapest settings that reach the requested accuracy, and the error that is reached.

| kind | accuracy of | knob |
|---|---|---|
| spectrum, levels, raman | frequencies, energies, shifts, "1 kHz" | spins, left out if smaller; method of several |
| stark, zeeman | energies, "1 kHz" | tolerance, and with it J max of the basis |
| align | cosines, 1e-4 | the loosest tolerance (steps, populations), the smallest J max |
| thermo | Q, U and C_v, "0.1 %" | levels summed, or the classical limit with corrections |
| tumble | attitude, "1e-6 rad" | tolerance of a step; free motion is exact |
| spectrum, raman | intensities, "0.1 %" | weakest line of the list |
| emission | brightness, "1 mK" | the largest least depth, in decades |
| fit | frequencies, "1 kHz"; constants, "1 %" of their standard errors | the loosest tolerance of the search, in decades |
| gas | temperature, "1 K"; heat capacity, "1 %"; C1 and C2, 0.02 | molecules |
| fluid | conserved energy, "0.5 K"; forces, "0.1 %" | step; tolerance of Ewald's sum |

The accuracy concerns the numerical error with the constants as given. Uncertain constants and missing orders of distortion are listed
in the plan. An accuracy beyond double precision is refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.requests.field import REQUIRED, declared
from rotor.requests.fill import Entries, within
from rotor.requests.knob import NOTHING_CHEAPER, Choice, Knob, Sought
from rotor.requests.numerics import Numerics
from rotor.requests.readers import Custom
from rotor.units import parse_quantity

CONVERTED = ("MHz", "K", "Å")  # units of an accuracy for which others may stand
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class TotalAccuracy:
    """An accuracy of the whole error budget, not of its numerical part alone."""

    total: str | float = declared(
        REQUIRED, Custom(str, scene_type=str | float), "of all sources of error together", "total"
    )


Stated = str | float | Mapping[str, str | float] | None  # a table has the key of `TotalAccuracy`


@dataclass(frozen=True)
class Reached:
    """The requested accuracy and the error that was reached, in `unit`. how: the chosen settings."""

    asked: float
    error: float
    unit: str
    how: str


@dataclass(frozen=True)
class Accuracy:
    """A requested accuracy. value: in `unit`. total: whether it holds for the whole error budget."""

    value: float
    unit: str
    total: bool
    numerics: Numerics

    def chosen(
        self, request: Any, entries: Entries, compute: Callable[[Any], Any], *, confirmed: bool = True
    ) -> Choice:
        """The cheapest settings that reach the accuracy: of each knob the first, coarsest first, whose error is within it.

        confirmed: whether errors that take a run are estimated too. Raises ValueError if no setting suffices, and for a knob that is
        set as well.
        """
        goal, knobs = self.numerics.goals[self.unit], self.knobs(request)
        if reason := goal.unfit(request):
            raise ValueError(f"accuracy: {self.text}: {reason}")
        refused = (key for knob in knobs for key in ((knob.key,) if knob.refuses is None else knob.refuses))
        if stated := next((key for key in refused if entries.values.get(key) is not None), ""):
            raise ValueError(f"accuracy and {stated}: give one of them")
        chosen, words = Choice(goal.prepare(request), NOTHING_CHEAPER), list[str]()
        for knob in knobs:
            sought = Sought(chosen.request, self.value, self.unit, compute, goal.error, entries, chosen.answer)
            choice = knob.choose(sought, confirmed)
            if choice is None:
                continue
            if choice.error > self.value:
                raise self.out_of_reach(choice.error, choice.how)
            words.append(choice.how)
            chosen = replace(choice, how=", and ".join(words))
        return chosen

    def knobs(self, request: Any) -> list[Knob]:
        """The knobs of a request that are chosen for the accuracy."""
        return [knob for knob in self.numerics.all_knobs(request) if self.unit in knob.units]

    @property
    def text(self) -> str:
        """The accuracy with its unit."""
        return f"{self.value:g} {self.unit}".rstrip()

    def reached(self, answer: Any, choice: Choice) -> Reached:
        """The error that an answer reached; ValueError, with the reason, if it exceeds the accuracy."""
        error = max(self.numerics.goals[self.unit].error(answer), choice.error)
        if error > self.value:
            raise self.out_of_reach(error, choice.how)
        if self.total:
            refuse_total(_with_error(answer.errors, choice), self.value, self.unit)
        return Reached(self.value, error, self.unit, choice.how)

    def out_of_reach(self, error: float, how: str) -> ValueError:
        """The error for an accuracy that the settings, or double precision, do not reach."""
        return ValueError(f"accuracy: {self.text} cannot be given: the error here is {error:.2g} ({how}); ask for less")


def read_accuracy(stated: Stated, numerics: Numerics, entries: Entries = Entries()) -> Accuracy | None:  # noqa: B008
    """An accuracy as stated, in the unit of a goal; None if none is stated. entries: may decide on the meaning of a percentage.

    >>> from rotor.requests.numerics import Goal
    >>> frequencies = Numerics({"MHz": Goal("frequencies")})
    >>> [read_accuracy(text, frequencies).value for text in ("1 kHz", 0.001)]
    [0.001, 0.001]
    >>> [read_accuracy(text, Numerics({"": Goal("Q")})).value for text in ("0.1 %", 0.02)]
    [0.001, 0.02]
    >>> gas = Numerics({unit: Goal() for unit in ("K", "%", "")})
    >>> [read_accuracy(text, gas).unit for text in ("1 K", "0.1 %", "0.02")]
    ['K', '%', '']
    """
    if stated is None:
        return None
    total = isinstance(stated, Mapping)
    plain = stated["total"] if isinstance(stated, Mapping) else stated
    goals, text = numerics.goals, str(plain).strip()
    percent, bare = text.endswith("%"), _NUMBER.fullmatch(text) and ("" in goals or not numerics.bare)
    unit = numerics.percent(entries) if percent else "" if bare else numerics.first_unit
    unit = numerics.first_unit if percent and unit not in goals else unit
    if unit not in goals:
        units = ", or ".join(f"{unit} of the {goal.of}" for unit, goal in goals.items())
        raise ValueError(f"accuracy: {plain!r}: expected a unit: {units}")
    if percent and unit not in ("", "%"):
        raise ValueError(f"accuracy: {plain!r}: expected {unit}, not a percentage")
    with within("accuracy"):
        number = parse_quantity(text.removesuffix("%").removesuffix("rad").strip(), unit if unit in CONVERTED else "")
    if not number > 0.0:
        raise ValueError(f"accuracy: {plain!r}: expected more than 0")
    return Accuracy(0.01 * number if percent and not unit else number, unit, total, numerics)


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
