"""Error budget of the attitude of a free body (`rotor.requests.budget`).

Rounding: moments, momentum and times are exact data, and phases are stored in two doubles. The error of an attitude is some units in
the last place at any time, plus `DOUBLED` times the angle turned. If times and momenta are converted from other units, their rounding
adds one unit in the last place of the angle turned at the fastest rate that |L| allows.

Data: rounded digits of moments and momentum shift the period T of the momentum in the body. Near the separatrix T is close to
(4/σ) ln(4/k') with k'² = 1 - k² and the growth rate σ, so that k'² = 16 exp(-σT/2). An error ε of k'², the relative error of the data,
gives δT = 2ε/(σ k'²), and an error of the phase of the flips of 2π t δT/T².
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.classical.free.free_motion import FreeMotion

EPS = sys.float_info.epsilon
EVALUATED = 32 * EPS  # theta functions, and products of three quaternions
DOUBLED = 64 * EPS**2  # of a phase in two doubles
LAST_DIGITS = 4 * EPS  # error of k'² if six numbers each have an error of one unit in the last place
SMALL_TURN = 1e-4  # rad by which a varied moment turns the attitude
SMALLEST_CHANGE = 1e-12  # of a moment, relative
EXACT_INPUT = "moments and angular momentum have no stated uncertainty"


def attitude_budget(
    motion: FreeMotion, last: float, growth_rate: float, converted: bool, relative: Floats | None = None
) -> ErrorBudget:
    """The errors of the attitude of one body, in rad.

    last: the time farthest from 0. growth_rate: of a small deviation from the unstable axis, 0 without such an axis. converted: whether
    times and momenta were converted from other units. relative: relative errors of the moments (3,), None if not known.
    """
    turned = _fastest(motion) * last
    rounding = attitude_rounding(turned, converted)
    how = "times and momentum converted from other units" if converted else "phases in two doubles"
    return ErrorBudget(
        of="attitude",
        unit="rad",
        rounding=ErrorTerm(rounding, f"{how}, at most {turned:.2g} rad turned"),
        truncation=ErrorTerm(0.0, "closed form"),
        model=ErrorTerm(None, "a rigid body without torques"),
        data=_data(motion, last, growth_rate, relative),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def attitude_rounding(turned: float, converted: bool) -> float:
    """Rounding error of an attitude in rad after an angle; converted: whether times and momenta were converted from other units."""
    return EVALUATED + (DOUBLED + (2 * EPS if converted else 0.0)) * turned


def _fastest(motion: FreeMotion) -> float:
    """The largest rate of rotation that |L| allows."""
    moments = motion.moments[motion.moments > 0]
    return float(np.linalg.norm(motion.momentum0) / moments.min())


def _data(motion: FreeMotion, last: float, growth_rate: float, relative: Floats | None) -> ErrorTerm:
    """The term of the data: errors of the moments if known, or a note if last digits leave the phase of the flips unknown."""
    shift = flip_phase_error(float(motion.period), last, growth_rate)
    if shift < 1.0 and relative is not None:
        error, source = moments_error(motion, last, relative), "errors of A, B, C, at the given angular momentum"
        lost = ", which lose the attitude" if error > 1.0 else ""
        return ErrorTerm(min(error, math.pi), source + lost, "better constants")
    if shift < 1.0:
        return ErrorTerm(None, EXACT_INPUT)
    return ErrorTerm(
        None,
        f"the phase of the flips is not known after {last:.2g}, one unit in the last place of the data moves it by {shift:.2g} rad",
    )


def moments_error(motion: FreeMotion, last: float, relative: Floats) -> float:
    """Error of the attitude at a time, in rad, to first order in relative errors of the moments (3,); equal moments change together.

    >>> from rotor.classical.free.free_motion import free_motion
    >>> round(moments_error(free_motion([0.0, 2.0, 2.0], [0.0, 6.0, 0.0]), 5.0, np.full(3, 1e-3)), 6)  # of 15 rad
    0.015
    """
    from rotor.classical.free.free_motion import free_motion
    from rotor.geometry.rotations import distance

    turned, errors = max(_fastest(motion) * last, 1.0), []
    for moment in set(motion.moments[motion.moments > 0].tolist()):
        equal = motion.moments == moment
        error = float(relative[equal].max())
        step = max(min(error, SMALL_TURN / turned), SMALLEST_CHANGE)
        varied = free_motion(np.where(equal, moment * (1.0 + step), motion.moments), motion.momentum0)
        moved = distance(varied.at([last])[1][0], motion.at([last])[1][0])
        errors.append(float(moved) * error / step)
    return math.hypot(*errors)


def flip_phase_error(period: float, last: float, growth_rate: float) -> float:
    """Error of the phase of the flips at a time, in rad, from the last digits of moments and momentum.

    >>> flip_phase_error(113.0, 1e13, 0.584) > 1e6, flip_phase_error(6.9, 1e3, 0.66) < 1e-9
    (True, True)
    """
    if not (math.isfinite(period) and period and growth_rate):
        return 0.0
    # q' = exp(-πK/K'): the modulus near the separatrix
    complementary = min(1.0, 16 * math.exp(-0.5 * period * growth_rate))
    return 2 * math.pi * last / period**2 * 2 * LAST_DIGITS / (growth_rate * complementary)
