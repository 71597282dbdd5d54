"""Accuracy of a driven motion: the loosest tolerance of its steps whose attitudes meet the accuracy.

The error of a tolerance t is the largest difference of an attitude, at all times of the request, from motions of t/100, t/10⁴, ..., see
`rotor.classical.step_errors.error_by_finer`.

The search computes about five motions. For a long motion it computes only the first part, to the accuracy divided by the expected growth
of the error: quadratic in time, as for phases with drifting rates, or exponential if the second half of that part shows it. The run uses
this tolerance and a finer motion for the stated error; if that exceeds the accuracy, a finer tolerance is tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.classical.integrators.lie_runge_kutta import ORDER
from rotor.classical.motion_steps import BEGINNINGS, MOST_STEPS, beginning, expected_steps, is_compiled
from rotor.classical.step_errors import error_by_finer, step_rounding
from rotor.requests.knob import Estimate, Prediction, Sought, first_by_proportion

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest
    from rotor.classical.integrators.method import Motion

LOOSEST, FINEST, FINEST_REFERENCE = 3, 13, 14  # decades: tolerances of 1e-3, 1e-13 and 1e-14
FINER = 2  # decades of a reference
CHAOS = "the motion is chaotic or too long for double precision"
LONG_STEPS, LONG_PLAIN_STEPS = 1_000_000, 4000  # of a motion, compiled or not: about a second
REGULAR = 2.0  # the power of the time with which the error of a regular motion grows at the most
CHAOTIC = 4.0  # a power that is seen beyond which the growth is taken as exponential


def decade_tolerance(decade: int) -> float:
    """The double next to a power of ten.

    >>> decade_tolerance(3)
    0.001
    """
    return float(f"1e-{decade}")


TOLERANCES = tuple(map(decade_tolerance, range(LOOSEST, FINEST + 1)))  # of a search


@dataclass(frozen=True)
class Motions:
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

    def error(self, tolerance: float) -> float:
        """The largest error of the attitude in radians, from steps (`error_by_finer`) and rounding."""
        decade = LOOSEST + TOLERANCES.index(tolerance)
        finer = [*range(decade + FINER, FINEST_REFERENCE, FINER), FINEST_REFERENCE]
        decades = {decade_tolerance(each): each for each in finer}
        step_error = error_by_finer(self.at(decade), list(decades), lambda tolerance: self.at(decades[tolerance]))[0]
        return step_error + step_rounding(self.at(decade))


def likely_decade(allowed: float) -> int:
    """A typical decade of tolerances for an accuracy, with which the search starts."""
    return min(max(round(-math.log10(allowed)), LOOSEST) + FINER, FINEST)


def tolerance_error(sought: Sought, _: object, tolerance: float) -> Estimate:
    """The error of the whole motion, in radians."""
    error = sought.known.setdefault("motions", Motions(sought.request)).error(tolerance)
    return Estimate(error, remark="" if error <= sought.accuracy else f": {CHAOS}")


def predicted_tolerance(sought: Sought) -> Prediction | None:
    """Of a long motion the tolerance of its first part; a plan and a run choose the same."""
    if not _is_long(sought.request, sought.accuracy):
        return None
    _refuse_endless(sought.request, sought.accuracy)
    cost = 1.0 + 10.0 ** (FINER / ORDER)  # steps go with the tolerance to the power -1/8
    return Prediction(*_pilot(sought.request, sought.accuracy), cost)


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


def _pilot(request: DrivenRequest, allowed: float) -> tuple[float, str]:
    """The tolerance determined from the first part of a motion, and a text that describes the choice."""
    from rotor.geometry.rotations import distance

    motions = Motions(beginning(request, 1 / BEGINNINGS, 0.5))
    likely = likely_decade(allowed)
    apart = distance(motions.at(likely).attitude, motions.at(min(likely + FINER, FINEST_REFERENCE)).attitude)
    # the half of the part that is compared with its end
    middle = int(np.searchsorted(np.abs(np.array(motions.request.times) - request.times[0]), 0.5 * _span(motions)))
    grown = math.log10(_growth(float(np.max(apart[: middle + 1])), float(np.max(apart))))
    needed, tolerance = math.log10(allowed) - grown, TOLERANCES[-1]
    if needed > -FINEST_REFERENCE:
        tolerance = first_by_proportion(TOLERANCES, lambda value: Estimate(motions.error(value)), 10.0**needed)[0]
    kind = "exponentially" if grown > REGULAR * math.log10(BEGINNINGS) else "as the square of the time at the most"
    return tolerance, f", from the first {100 / BEGINNINGS:g} % of the time, in which errors grow {kind}"


def _span(motions: Motions) -> float:
    return abs(motions.request.times[-1] - motions.request.times[0])


def _growth(middle: float, end: float) -> float:
    """Expected growth of an error from the end of the first part to that of the motion, from two values in the part.

    >>> _growth(1e-9, 4e-9), _growth(0.0, 0.0)  # as the square, 20² times
    (400.0, 400.0)
    """
    if middle > 0.0 and end > middle * 2.0**CHAOTIC:  # faster than any power: errors grow exponentially
        return float(min((end / middle) ** (2.0 * (BEGINNINGS - 1)), 1e300))
    return float(BEGINNINGS**REGULAR)
