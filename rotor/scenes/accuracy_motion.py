"""Accuracy of a driven motion: the loosest tolerance of its steps whose attitudes are within what was asked for.

The error of a tolerance t is the largest difference of an attitude, at all times asked for, from a motion of finer steps. A finer
motion is one of t/100, or of t/10⁴, ... until it takes more steps: steps also end at every time asked for, and where these are
dense, several tolerances give the same steps, whose difference of 0 says nothing. Where no tolerance takes more, the sum of what
the control of the steps lets pass, their number times the finest tolerance, is added: the local error per step is below it
(E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.4). The finer motion has an error of its
own: the difference is taken 1.1 times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.scenes.choice import Choice

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest
    from rotor.classical.integrators.method import Motion

LOOSEST, FINEST, FINEST_REFERENCE = 3, 13, 14  # decades: tolerances of 1e-3, 1e-13 and 1e-14
FINER = 2  # decades of a reference
OF_REFERENCE = (
    1.1  # a reference a hundred times finer has a tenth of the error at most: 15 times less was the least seen
)


@dataclass(frozen=True)
class _Motions:
    """The motions of one request by the decade of their tolerance, each made once."""

    request: DrivenRequest
    made: dict[int, Motion] = field(default_factory=dict)

    def at(self, decade: int) -> Motion:
        """The motion with a tolerance of 10^-decade; between two that are alike all are."""
        from rotor.classical.driven import answer_driven

        if decade not in self.made:
            looser = [one for one in self.made if one < decade]
            finer = [one for one in self.made if one > decade]
            alike = looser and finer and self.made[max(looser)].steps == self.made[min(finer)].steps
            asked = replace(self.request, tolerance=tolerance_of(decade))
            self.made[decade] = self.made[max(looser)] if alike else answer_driven(asked).motion
        return self.made[decade]

    def error(self, decade: int) -> float:
        """The largest error of an attitude in radians, see the head of this module."""
        from rotor.geometry.rotations import distance

        coarse, unseen = self.at(decade), 0.0
        for finer in (*range(decade + FINER, FINEST_REFERENCE, FINER), FINEST_REFERENCE):
            fine = self.at(finer)
            if fine.steps > coarse.steps:
                break
        else:
            unseen = fine.steps * tolerance_of(FINEST_REFERENCE)
        return unseen + OF_REFERENCE * float(np.max(distance(coarse.attitude, fine.attitude)))


def tolerance_of(decade: int) -> float:
    """The double next to a power of ten.

    >>> tolerance_of(3)
    0.001
    """
    return float(f"1e-{decade}")


def likely_tolerance(asked: float) -> float:
    """A tolerance amid those that a search for an accuracy tries."""
    return tolerance_of(min(max(round(-math.log10(asked)), LOOSEST) + FINER, FINEST))


def choose_tolerance(scene: Any, request: DrivenRequest, asked: float) -> Choice:
    """The request with the loosest tolerance, in decades, that reaches an accuracy in radians.

    Parameters
    ----------
    scene : TumbleScene
        Without a tolerance or step of its own.
    request : DrivenRequest
        That of the scene.
    asked : float
        In radians, of the attitude at every time.

    Returns
    -------
    Choice
        With the error that was found.

    Raises
    ------
    ValueError
        Where a knob is given by hand as well, and where double precision does not reach it.
    """
    from rotor.classical.driven import DEFAULT_TOLERANCE

    if scene.numerics.tolerance != DEFAULT_TOLERANCE or scene.numerics.step is not None:
        raise ValueError("accuracy and numerics: give one of them")
    motions = _Motions(request)
    decade, error = _loosest(motions, asked)
    how = f"tolerance {tolerance_of(decade):g} of a step"
    how += ", nothing cheaper: the loosest there is" if decade == LOOSEST else ""
    return Choice(replace(request, tolerance=tolerance_of(decade)), how, error)


def _loosest(motions: _Motions, asked: float) -> tuple[int, float]:
    """The lowest decade whose error is what was asked for at the most, and that error; the one below it has more."""
    decade = min(max(round(-math.log10(asked)), LOOSEST), FINEST)
    errors: dict[int, float] = {}
    misses, reaches = LOOSEST - 1, FINEST + 1
    while reaches > misses + 1:
        error = errors[decade] = motions.error(decade)
        apart = max(
            math.floor(abs(math.log10(max(error, 1e-30) / asked))), 1
        )  # decades, if the error goes with the tolerance
        if error <= asked:
            reaches, decade = decade, max(decade - apart, misses + 1)
        else:
            misses, decade = decade, min(decade + apart, reaches - 1)
    if reaches > FINEST:
        raise ValueError(
            f"accuracy: {asked:g} rad cannot be given: steps to {tolerance_of(FINEST):g} still differ by {errors[FINEST]:.2g} rad at "
            "the end, the motion is chaotic or too long for double precision; ask for less, or for a shorter time"
        )
    return reaches, errors[reaches]
