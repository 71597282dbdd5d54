"""Error budget of the attitude of a free body (`rotor.requests.budget`).

Rounding: moments, momentum and times are exact data, and phases are held in two doubles, so that an attitude is off by some units in
the last place at any time, and by `DOUBLED` of the angle turned. Times and momenta that come in other units are rounded when they are
converted, by one unit in the last place of the angle turned at the fastest rate that |L| allows.

Data: digits of moments and momentum beyond the last one shift the period T of the momentum in the body. Near the separatrix T is close to
(4/σ) ln(4/k'), k'² = 1 - k², σ the rate of growth, so that k'² = 16 exp(-σT/2), and a k'² that is off by some ε, the relative error of
the data, makes δT = 2ε/(σ k'²). The phase of the flips is then off by 2π t δT/T².
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from rotor.requests.budget import ErrorBudget, ErrorTerm

if TYPE_CHECKING:
    from rotor.classical.free.free_motion import FreeMotion

EPS = sys.float_info.epsilon
EVALUATED = 32 * EPS  # theta functions, and products of three quaternions
DOUBLED = 64 * EPS**2  # of a phase in two doubles
LAST_DIGITS = 4 * EPS  # of k'², where six numbers have each one unit in the last place
GIVEN = "moments and angular momentum have no stated uncertainty"


def attitude_budget(motion: FreeMotion, last: float, growth_rate: float, converted: bool) -> ErrorBudget:
    """The errors of the attitude of one body.

    Parameters
    ----------
    motion : FreeMotion
    last : float
        The latest time, of either sign, in the unit of the motion.
    growth_rate : float
        Of a small departure from the unstable axis; 0 where there is none.
    converted : bool
        Whether times and momenta came in other units.

    Returns
    -------
    ErrorBudget
        In rad.
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
        data=_data(motion, last, growth_rate),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def attitude_rounding(turned: float, converted: bool) -> float:
    """Rounding of an attitude in rad after an angle; converted: whether times and momenta came in other units."""
    return EVALUATED + (DOUBLED + (2 * EPS if converted else 0.0)) * turned


def _fastest(motion: FreeMotion) -> float:
    """The largest rate of rotation that |L| allows."""
    moments = motion.moments[motion.moments > 0]
    return float(np.linalg.norm(motion.momentum0) / moments.min())


def _data(motion: FreeMotion, last: float, growth_rate: float) -> ErrorTerm:
    """Not estimated, and whether the last digits of the data leave the phase of the flips unknown."""
    shift = flip_phase_error(float(motion.period), last, growth_rate)
    if shift < 1.0:
        return ErrorTerm(None, GIVEN)
    return ErrorTerm(
        None,
        f"the phase of the flips is not known after {last:.2g}, one unit in the last place of the data moves it by {shift:.2g} rad",
    )


def flip_phase_error(period: float, last: float, growth_rate: float) -> float:
    """By how much the last digits of moments and momentum may move the phase of the flips at a time, in rad.

    >>> flip_phase_error(113.0, 1e13, 0.584) > 1e6, flip_phase_error(6.9, 1e3, 0.66) < 1e-9
    (True, True)
    """
    if not (math.isfinite(period) and period and growth_rate):
        return 0.0
    complementary = min(1.0, 16 * math.exp(-0.5 * period * growth_rate))
    return 2 * math.pi * last / period**2 * 2 * LAST_DIGITS / (growth_rate * complementary)
