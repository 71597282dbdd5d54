"""Accuracy of a driven motion: the loosest tolerance of its steps whose attitudes meet the accuracy.

The error of a tolerance t is the largest difference of an attitude, at all times of the request, from motions of t/100, t/10⁴, ..., see
`rotor.classical.step_errors.error_by_finer`.

The search computes about five motions. For a long motion it computes only the first part, to the accuracy divided by the expected growth
of the error: quadratic in time, as for phases with drifting rates, or exponential if the second half of that part shows it. The run uses
this tolerance and a finer motion for the stated error; if that exceeds the accuracy, a finer tolerance is tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rotor.classical.motion_steps import BEGINNINGS, MOST_STEPS, beginning, expected_steps, is_compiled
from rotor.classical.step_errors import error_by_finer, step_rounding
from rotor.requests.knob import Choice, Sought

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest
    from rotor.classical.integrators.method import Motion

LOOSEST, FINEST, FINEST_REFERENCE = 3, 13, 14  # decades: tolerances of 1e-3, 1e-13 and 1e-14
FINER = 2  # decades of a reference
ORDER = 8  # of the adaptive method: steps go with the tolerance to the power -1/8
CHAOS = "the motion is chaotic or too long for double precision"
LONG_STEPS, LONG_PLAIN_STEPS = 1_000_000, 4000  # of a motion, compiled or not: about a second
REGULAR = 2.0  # the power of the time with which the error of a regular motion grows at the most
CHAOTIC = 4.0  # a power that is seen beyond which the growth is taken as exponential


@dataclass(frozen=True)
class _Motions:
    """The motions of a request by the decade of their tolerance, each computed once."""

    request: DrivenRequest
    computed: dict[int, Motion] = field(default_factory=dict)

    def at(self, decade: int) -> Motion:
        """The motion with a tolerance of 10^-decade; between two decades with equal numbers of steps all motions are the same."""
        from rotor.classical.driven import answer_driven

        if decade not in self.computed:
            looser = [each for each in self.computed if each < decade]
            finer = [each for each in self.computed if each > decade]
            # equal numbers of steps on both sides: a run between has the same steps
            alike = looser and finer and self.computed[max(looser)].steps == self.computed[min(finer)].steps
            request = replace(self.request, tolerance=decade_tolerance(decade))
            self.computed[decade] = self.computed[max(looser)] if alike else answer_driven(request).motion
        return self.computed[decade]

    def error(self, decade: int) -> float:
        """The largest error of the attitude in radians, from steps (`error_by_finer`) and rounding."""
        finer = [*range(decade + FINER, FINEST_REFERENCE, FINER), FINEST_REFERENCE]
        decades = {decade_tolerance(each): each for each in finer}
        step_error = error_by_finer(self.at(decade), list(decades), lambda tolerance: self.at(decades[tolerance]))[0]
        return step_error + step_rounding(self.at(decade))


def decade_tolerance(decade: int) -> float:
    """The double next to a power of ten.

    >>> decade_tolerance(3)
    0.001
    """
    return float(f"1e-{decade}")


def likely_decade(allowed: float) -> int:
    """A typical decade of tolerances for an accuracy, with which the search starts."""
    return min(max(round(-math.log10(allowed)), LOOSEST) + FINER, FINEST)


def tolerances(sought: Sought) -> Iterator[Choice]:
    """The loosest tolerance, in decades, that reaches an accuracy in radians; of a long motion that of its first part, then finer ones.

    A plan and a run choose the same tolerance. A free motion needs none.
    """
    from rotor.classical.driven import DrivenRequest

    request, allowed = sought.request, sought.accuracy
    if not isinstance(request, DrivenRequest):
        return
    motions, misses = _Motions(request), LOOSEST - 1
    if _is_long(request, allowed):
        _refuse_endless(request, allowed)
        misses, how = _pilot_decade(request, allowed)
        chosen = replace(request, tolerance=decade_tolerance(misses))
        yield Choice(chosen, how, partial(motions.error, misses), confirming=1.0 + 10.0 ** (FINER / ORDER))
    if misses < FINEST:
        decade, error = _loosest(motions, allowed, misses)
        missed = f", finer than the plan's {decade_tolerance(misses):g}, which missed" if misses >= LOOSEST else ""
        how = _words(decade) + missed + ("" if error <= allowed else f": {CHAOS}")
        yield Choice(replace(request, tolerance=decade_tolerance(decade)), how, error)


def _words(decade: int) -> str:
    return f"tolerance {decade_tolerance(decade):g} of a step" + (
        ", nothing cheaper: the loosest there is" if decade == LOOSEST else ""
    )


def _is_long(request: DrivenRequest, allowed: float) -> bool:
    """Whether a motion takes too many steps for a search by whole motions, estimated from its beginning."""
    steps = _likely_steps(request, allowed)
    return steps > (LONG_STEPS if is_compiled(request) else LONG_PLAIN_STEPS)


def _likely_steps(request: DrivenRequest, allowed: float) -> int:
    return expected_steps(replace(request, tolerance=decade_tolerance(likely_decade(allowed))))


def _refuse_endless(request: DrivenRequest, allowed: float) -> None:
    """Refuse a motion with too many steps."""
    steps = _likely_steps(request, allowed)
    if steps > MOST_STEPS:
        raise ValueError(
            f"accuracy: this motion takes about {steps:.2g} steps, and {MOST_STEPS:.0g} take hours; give a shorter time, or a body "
            "that rotates more slowly"
        )


def _pilot_decade(request: DrivenRequest, allowed: float) -> tuple[int, str]:
    """The decade determined from the first part of a motion, and a text that describes the choice."""
    from rotor.geometry.rotations import distance

    motions = _Motions(beginning(request, 1 / BEGINNINGS, 0.5))
    likely = likely_decade(allowed)
    apart = distance(motions.at(likely).attitude, motions.at(min(likely + FINER, FINEST_REFERENCE)).attitude)
    # the half of the part that is compared with its end
    middle = int(np.searchsorted(np.abs(np.array(motions.request.times) - request.times[0]), 0.5 * _span(motions)))
    grown = math.log10(_growth(float(np.max(apart[: middle + 1])), float(np.max(apart))))
    part = f"from the first {100 / BEGINNINGS:g} % of the time, in which errors grow {{}}"
    needed = math.log10(allowed) - grown
    decade = _loosest(motions, 10.0**needed)[0] if needed > -FINEST_REFERENCE else FINEST
    kind = "exponentially" if grown > REGULAR * math.log10(BEGINNINGS) else "as the square of the time at the most"
    return decade, f"{_words(decade)}, {part.format(kind)}"


def _span(motions: _Motions) -> float:
    return abs(motions.request.times[-1] - motions.request.times[0])


def _growth(middle: float, end: float) -> float:
    """Expected growth of an error from the end of the first part to that of the motion, from two values in the part.

    >>> _growth(1e-9, 4e-9), _growth(0.0, 0.0)  # as the square, 20² times
    (400.0, 400.0)
    """
    if middle > 0.0 and end > middle * 2.0**CHAOTIC:  # faster than any power: errors grow exponentially
        return float(min((end / middle) ** (2.0 * (BEGINNINGS - 1)), 1e300))
    return float(BEGINNINGS**REGULAR)


def _loosest(motions: _Motions, allowed: float, misses: int = LOOSEST - 1) -> tuple[int, float]:
    """The lowest decade whose error is at most `allowed`, else the finest, and its error; `misses` is a decade with a larger error."""
    decade = min(max(round(-math.log10(allowed)), misses + 1), FINEST)
    errors: dict[int, float] = {}
    reaches = FINEST + 1
    while reaches > misses + 1:
        error = errors[decade] = motions.error(decade)
        # decades, if the error is proportional to the tolerance
        apart = max(math.floor(abs(math.log10(max(error, 1e-30) / allowed))), 1)
        if error <= allowed:
            reaches, decade = decade, max(decade - apart, misses + 1)
        else:
            misses, decade = decade, min(decade + apart, reaches - 1)
    decade = min(reaches, FINEST)
    return decade, errors[decade]
