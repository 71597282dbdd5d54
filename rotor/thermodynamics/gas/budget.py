"""Error budget of a classical gas (`rotor.requests.budget`): of C1 and C2 if the request has times, otherwise of the temperature.

The kinetic energy of f N independent degrees of freedom, and so the kinetic temperature, has a relative variance of 2/(f N). Free motion
is exact at any time. The rounding error of an attitude is that of `rotor.classical.free.budget`; C1 and C2 have slopes of at most 1 and
3/2 in that angle, so their error is at most twice as large.
"""

from __future__ import annotations

import math
import sys
from statistics import NormalDist
from typing import Any

from rotor import units
from rotor.classical.free.budget import attitude_rounding
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

EXACT_MOTION = ErrorTerm(0.0, "free motion in closed form")
FASTEST = 6.0  # times the rms rate: 1 of 1e8 molecules rotates faster about an axis
LEFT_OUT = ErrorTerm(None, "a classical gas without collisions and vibrations", "the quantum calculation")


def gas_budget(answer: Any) -> ErrorBudget:
    """The errors of the temperature in K, or of C1 and C2 at all their times."""
    return _temperature_budget(answer) if answer.correlations is None else _curves_budget(answer)


def _temperature_budget(answer: Any) -> ErrorBudget:
    request = answer.request
    degrees = round(answer.ensemble.kinetic.total)
    return ErrorBudget(
        of="temperature",
        unit="K",
        rounding=ErrorTerm(
            (ROUNDING + math.log2(degrees) * sys.float_info.epsilon) * request.temperature_k, "sum over the molecules"
        ),
        truncation=EXACT_MOTION,
        model=LEFT_OUT,
        data=ErrorTerm(0.0, "equipartition holds for any constants"),
        statistics=_sampled(answer, request.temperature_k * math.sqrt(2.0 / degrees)),
    )


def _curves_budget(answer: Any) -> ErrorBudget:
    curves, request = answer.correlations, answer.request
    assert curves is not None
    spread = max(float(error.max()) for error in (curves.c1_error, curves.c2_error) if error is not None)
    lightest = min(moment for moment in request.top.moments_u_angstrom2 if moment > 0)
    rate = FASTEST * math.sqrt(request.kt / lightest) / units.ASE_TIME_PS
    turned = rate * max(abs(time) for time in request.times_ps or (0.0,))
    return ErrorBudget(
        of="C1 and C2",
        unit="",
        rounding=ErrorTerm(2 * attitude_rounding(turned, converted=True), "attitudes at the last time"),
        truncation=EXACT_MOTION,
        model=LEFT_OUT,
        data=ErrorTerm(None, "uncertainties of the constants are not carried to correlation functions"),
        statistics=_sampled(answer, spread),
    )


def _sampled(answer: Any, deviation: float) -> ErrorTerm:
    request = answer.request
    z = NormalDist().inv_cdf(0.5 + 0.5 * request.confidence)
    return ErrorTerm(
        deviation,
        f"{request.molecules} molecules; within {z:.3g} times this at a confidence of {request.confidence:g}",
        "more molecules",
    )
