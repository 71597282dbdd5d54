"""Errors of the steps of a driven motion: against finer steps, where that costs little.

The motion is repeated with finer steps, see `error_by_finer`, or with a quarter of a fixed step; the largest difference of the
attitudes is the error. Beyond `MOST_STEPS` only the local errors are known, steps times tolerance (E. Hairer, S. P. Nørsett, G. Wanner,
Solving Ordinary Differential Equations I, section II.4): 8 to 1000 times the error of regular motions, but no bound for chaotic ones.

Rounding: a step changes the attitude by some units in the last place, at most `EVALUATED`, and L by the same fraction of |L| at random.
After n steps the relative error of the rotation rate is √n units, and that of the angle φ is √n φ units.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence

from rotor.classical.integrators.method import Motion
from rotor.requests.budget import ErrorBudget, ErrorTerm

# most steps of a motion that is repeated for an estimate: compiled, and step by step
MOST_STEPS, MOST_CALLED = 20_000, 500
FINEST = 1e-14  # a tolerance
MORE_STEPS, USUAL_STEPS = 1.5, 2.4  # of a finer motion, times those of the coarse one: 10^(2/8) = 1.8 is usual
# a reference a hundred times finer has at most a fifth of the error (largest of 1,000 motions: 13 %)
OF_REFERENCE = 1.25
DENSE = 4  # steps between two times, below which these set the length of many steps
# of steps a quarter as long: 1/(1 - 4^-p) for order p, 1.07 of order 2, with a margin where steps are long
OF_QUARTER = 1.3
# a quarter of a step longer than the spacing of the times may give the same steps
QUARTERS, TRIPLED = [4.0**k for k in range(1, 40)], 3
EVALUATED = 8 * sys.float_info.epsilon  # of a step
OF_REMEDY = "an accuracy, which is compared with a finer motion,"


def finer_tolerances(tolerance: float) -> list[float]:
    """Tolerances of references, each a hundred times finer.

    >>> finer_tolerances(1e-10)
    [1e-12, 1e-14]
    """
    # finer by 100 until close to double precision, which is the last
    return [*(tolerance / 100**k for k in range(1, 8) if tolerance / 100**k > 1.5 * FINEST), FINEST]


def error_by_finer(coarse: Motion, finer: Sequence[float], at: Callable[[float], Motion]) -> tuple[float, bool]:
    """The largest error of the attitude in radians from motions with finer tolerances, and whether one of them took clearly more steps.

    Steps also end at the output times. If these are dense, several tolerances give the same steps and a meaningless difference of 0;
    therefore the first motion with at least 1.5 times as many steps is compared. Several tolerances may miss a wobble smaller than them:
    if the number of steps does not scale as usual, or times are dense, the next finer motion counts too. If no motion takes enough steps,
    the number of steps of the finest times its tolerance is added. Differences are multiplied by 1.25 for the error of the finer motion.
    """
    for place, tolerance in enumerate(finer):
        more = at(tolerance).steps / coarse.steps
        if more >= MORE_STEPS:
            # where the number of steps scales as usual, one finer motion suffices
            is_usual = place == 0 and more < USUAL_STEPS and coarse.steps > DENSE * len(coarse.times)
            beyond = tolerance if is_usual else finer[min(place + 1, len(finer) - 1)]
            return OF_REFERENCE * max(apart(coarse, at(tolerance)), apart(coarse, at(beyond))), True
    finest = at(finer[-1])
    return finest.steps * finer[-1] + OF_REFERENCE * apart(coarse, finest), False


def apart(motion: Motion, other: Motion) -> float:
    """The largest angle between the attitudes of two motions at the same times."""
    from rotor.geometry.rotations import distance

    return float(distance(motion.attitude, other.attitude).max())


def step_rounding(motion: Motion) -> float:
    """Rounding error of the attitude of a stepped motion, rad."""
    from rotor.geometry.rotations import distance

    # a lower bound if the times are far apart
    turned = float(distance(motion.attitude[1:], motion.attitude[:-1]).sum())
    return EVALUATED * (motion.steps + math.sqrt(motion.steps) * max(turned, 0.1 * motion.steps))


def driven_budget(motion: Motion, truncation: ErrorTerm) -> ErrorBudget:
    """The errors of the attitude of a driven body in rad, largest over its times."""
    return ErrorBudget(
        of="attitude",
        unit="rad",
        rounding=ErrorTerm(step_rounding(motion), f"{motion.steps} steps"),
        truncation=truncation,
        model=ErrorTerm(None, "a rigid body under the effects named, and no others"),
        data=ErrorTerm(None, "moments, effects and start have no stated uncertainty"),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def step_truncation(
    motion: Motion, compiled: bool, tolerance: float | None, at: Callable[[float], Motion]
) -> ErrorTerm:
    """The error of the steps; not estimated if the motion is too long to be repeated.

    compiled: longer motions of compiled steps are repeated. tolerance: of a step; None for fixed steps. at: the motion for another
    tolerance, or with the fixed step divided by a number.
    """
    if motion.steps > (MOST_STEPS if compiled else MOST_CALLED):
        return ErrorTerm(None, f"{motion.steps} steps are not made a second time", OF_REMEDY)
    if tolerance is None:
        shorter = next(other for other in map(at, QUARTERS) if other.steps >= TRIPLED * motion.steps)
        return ErrorTerm(OF_QUARTER * apart(motion, shorter), f"{motion.steps} steps against a quarter of their length")
    error, more = error_by_finer(motion, finer_tolerances(tolerance), at)
    against = f"{motion.steps} steps to {tolerance:g} against finer ones"
    return ErrorTerm(error, against if more else f"at most: {motion.steps} steps, hardly more with {FINEST:g}")
