"""Accuracy of intensities in percent: for each line (from Q and its strength), and for the sum of all lines, which a cut makes incomplete.

The loss from a cut is the difference from a list with a cut a hundred times finer. Each decade of a cut holds about a tenth of the
intensity of the decade before (docs/accuracy.md), so that lines below the finer cut hold about a hundredth; `SPARE` covers a fourth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rotor.requests.budget import ROUNDING
from rotor.requests.field import declared_fields
from rotor.requests.knob import Estimate, Knob, Measure, Sought

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


def cut_knob(
    name: str, steps: Any, finest: Any, measure: Measure, lower: Callable[[float, int], float], title: str
) -> Knob:
    """The knob of an intensity cut: the cut, then lower ones by decades, with the intensity that weaker lines hold.

    Of a cut that the user set, that cut alone: a higher cut would be cheaper but leave out requested lines. No lower cut helps if the
    intensities of lines are not good enough. name: of the field. lower: returns the cut lowered by some decades.
    """

    def lower_cuts(sought: Sought) -> list[float]:
        structure: Any = type(sought.request)
        cut = getattr(sought.request, name)
        usual = cut == declared_fields(structure)[name].default
        return [] if cut is None else [lower(cut, decades) for decades in range(MOST_DECADES + 1 if usual else 1)]

    def error(sought: Sought, request: Any, cut: float) -> Estimate:
        answer, finer = sought.compute(request), sought.compute(replace(request, **{name: lower(cut, FINER)}))
        missing, line_error = SPARE * measure.error(answer, finer), intensity_error(answer)
        return Estimate(missing + line_error, remark=f", weaker lines hold {missing:.1g} %", least=line_error)

    return Knob(
        steps, finest, (measure,), lambda finest: "no cut" if finest is None else f"a cut at {finest:g}", title=title,
        tried=lower_cuts, error=error, text=f"{name} {{:g}}", refuses=(),
    )  # fmt: skip
