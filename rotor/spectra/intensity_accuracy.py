"""Accuracy of intensities in percent: of every line (of Q and of its strength), and of all lines together, which a cut leaves incomplete.

What a cut leaves out is the difference from a list with a cut a hundred times finer. Each decade of a cut holds about a tenth of what the
decade before did (docs/accuracy.md), so that lines below the finer cut hold about a hundredth of that; `SPARE` covers a fourth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rotor.requests.budget import ROUNDING
from rotor.requests.field import declared_fields
from rotor.requests.knob import NOTHING_CHEAPER, Choice

SPARE = 1.25
MOST_DECADES = 12  # by which a cut is lowered
FINER = 2  # decades of the reference


def error_of_intensities(answer: Any) -> float:
    """The error of the intensity of a line in percent: of Q, and of strengths whose vectors are rounded."""
    lines = answer.lines
    return 100.0 * (
        float(lines.partition.relative_error) + ROUNDING * max(1, int(lines.levels.rotational.max(initial=0)))
    )


@dataclass(frozen=True)
class Cut:
    """A cut of a list. name: of the field. lower: the cut some decades lower. left_out: the part in percent that an answer leaves out
    beside another one. answer: of a request.
    """

    name: str
    lower: Callable[[float, int], float]
    left_out: Callable[[Any, Any], float]
    answer: Callable[[Any], Any]

    def choose(self, scene: Any, request: Any, accuracy: float) -> Choice:
        """The cut as it is where the lines below it hold less than the accuracy, else the highest, in decades, with which they do.

        A higher cut than that of the request would be cheaper and leave out lines that are requested. A cut that is given by hand stays.
        """
        structure: Any = type(request)
        field, cut = declared_fields(structure)[self.name], getattr(request, self.name)
        if cut is None:
            return Choice(request, NOTHING_CHEAPER)
        for decades in range(MOST_DECADES + 1 if cut == field.default else 1):
            chosen = replace(request, **{self.name: self.lower(cut, decades)})
            answer = self.answer(chosen)
            finer = self.answer(replace(chosen, **{self.name: self.lower(cut, decades + FINER)}))
            left, of_lines = SPARE * self.left_out(answer, finer), error_of_intensities(answer)
            error = left + of_lines
            if error <= accuracy or of_lines > accuracy:
                break
        how = f"{field.last} {getattr(chosen, self.name):g}, weaker lines hold {left:.1g} %"
        return Choice(chosen, how, error)
