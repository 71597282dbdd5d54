"""Accuracy of intensities in percent: of every line (of Q and of its strength), and of all lines together, which a cut leaves incomplete.

What a cut leaves out is the difference from a list with a cut a hundred times finer. Each decade of a cut holds about a tenth of what the
decade before did (docs/accuracy.md), so that lines below the finer cut hold about a hundredth of that; `SPARE` covers a fourth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rotor.requests.budget import ROUNDING
from rotor.requests.field import all_fields
from rotor.scenes.choice import NOTHING_CHEAPER, Choice
from rotor.verbs.verb import verb_of

SPARE = 1.25
MOST_DECADES = 12  # by which a cut is lowered
FINER = 2  # decades of the reference


def error_of_intensities(answer: Any) -> float:
    """The error of the intensity of a line in percent: of Q, and of strengths whose vectors are rounded."""
    lines = answer.lines
    return 100.0 * (
        float(lines.partition.relative_error) + ROUNDING * max(1, int(lines.levels.rotational.max(initial=0)))
    )


def choose_cut(scene: Any, request: Any, accuracy: float) -> Choice:
    """The cut as it is where the lines below it hold less than the accuracy, else the highest, in decades, with which they do.

    A higher cut than that of the request would be cheaper and leave out lines that are requested. A cut that is given by hand stays.
    """
    name, lower, left_out = _cut_of(scene.kind)
    field = next(one for one in all_fields(type(request)).values() if one.name == name)
    cut = getattr(request, name)
    if cut is None:
        return Choice(request, NOTHING_CHEAPER)
    answer_of = _answers(scene.kind)
    for decades in range(MOST_DECADES + 1 if cut == field.default else 1):
        chosen = replace(request, **{name: lower(cut, decades)})
        answer = answer_of(chosen)
        finer = answer_of(replace(chosen, **{name: lower(cut, decades + FINER)}))
        left = SPARE * left_out(answer, finer)
        of_lines = error_of_intensities(answer)
        error = left + of_lines
        if error <= accuracy or of_lines > accuracy:
            break
    how = f"{field.last} {getattr(chosen, name):g}, weaker lines hold {left:.1g} %"
    return Choice(chosen, how, error)


def _answers(kind: str) -> Callable[[Any], Any]:
    from rotor.requests.fill import Given
    from rotor.verbs.verb import Work

    verb = verb_of(kind)
    work = Work(shown=verb.read_shown(Given()))
    return lambda request: verb.answer(request, work)


def _cut_of(kind: str) -> tuple[str, Callable[[float, int], float], Callable[[Any, Any], float]]:
    """The field of a cut, the cut some decades lower, and the part in percent that an answer leaves out beside another."""
    if kind == "spectrum":
        from rotor.spectra.request import intensity_left_out

        return "min_lgint", lambda cut, decades: cut - decades, intensity_left_out
    from rotor.spectra.raman_request import section_left_out

    return "min_relative", lambda cut, decades: cut * 10.0**-decades, section_left_out
