"""Accuracy of intensities in percent: for each line (from Q and its strength), and for the sum of all lines, which a cut makes incomplete.

The loss from a cut is the difference from a list with a cut a hundred times finer. Each decade of a cut holds about a tenth of the
intensity of the decade before (docs/accuracy.md), so that lines below the finer cut hold about a hundredth; `SPARE` covers a fourth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from rotor.requests.budget import ROUNDING
from rotor.requests.field import declared_fields
from rotor.requests.knob import Choice, Sought

SPARE = 1.25
MOST_DECADES = 12  # largest lowering of a cut
FINER = 2  # decades between a cut and its reference


def intensity_error(answer: Any) -> float:
    """Error of the intensity of a line in percent, from Q and from rounding of the strengths."""
    lines = answer.lines
    # rounding of a strength grows with the steps in J
    return 100.0 * (
        float(lines.partition.relative_error) + ROUNDING * max(1, int(lines.levels.rotational.max(initial=0)))
    )


@dataclass(frozen=True)
class Cut:
    """An intensity cut. name: of the field. lower: returns the cut lowered by some decades. left_out: percentage that an answer lacks
    compared with a reference. answer: computes a request.
    """

    name: str
    lower: Callable[[float, int], float]
    left_out: Callable[[Any, Any], float]
    answer: Callable[[Any], Any]

    def choices(self, sought: Sought) -> Iterator[Choice]:
        """The cut, then lower ones by decades, with the intensity that weaker lines hold; of a cut that the user set, that cut alone.

        A higher cut would be cheaper but leave out requested lines. No lower cut helps if the intensities of lines are not good enough.
        """
        structure: Any = type(sought.request)
        field, cut = declared_fields(structure)[self.name], getattr(sought.request, self.name)
        if cut is None:
            return
        for decades in range(MOST_DECADES + 1 if cut == field.default else 1):
            chosen = replace(sought.request, **{self.name: self.lower(cut, decades)})
            answer = self.answer(chosen)
            finer = self.answer(replace(chosen, **{self.name: self.lower(cut, decades + FINER)}))
            missing, line_error = SPARE * self.left_out(answer, finer), intensity_error(answer)
            how = f"{field.last} {getattr(chosen, self.name):g}, weaker lines hold {missing:.1g} %"
            yield Choice(chosen, how, missing + line_error)
            if line_error > sought.accuracy:
                return
