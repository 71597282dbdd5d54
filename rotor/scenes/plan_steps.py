"""The error of the steps of a driven motion, before it is made: against finer steps, where that costs little.

The motion is made twice, with its steps and with finer ones, see `error_by_finer`, or a quarter of a fixed step. The largest difference
of the attitudes is the error. Of a motion of more than `MOST_STEPS` a bound is given, steps times tolerance: the local error per step
is below the tolerance (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.4). It is 8 to 1000 times
the error of the examples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.scenes.left_out import LeftOut
from rotor.scenes.motion_steps import is_compiled

if TYPE_CHECKING:
    from rotor.classical.integrators.method import Motion

NAME = "error of the steps"
MOST_STEPS, MOST_CALLED = 20_000, 500  # of motions that are made for an estimate: compiled, and called step by step
FINEST = 1e-14  # a tolerance
MORE_STEPS, USUAL_STEPS = 1.5, 2.4  # of a finer motion, times those of the coarse one: 10^(2/8) = 1.8 is usual
OF_REFERENCE = (
    1.1  # a reference a hundred times finer has a tenth of the error at most: 15 times less was the least seen
)


def step_error(request: Any, steps: int) -> LeftOut:
    """The largest error of an attitude in radians at the times of a request whose motion has so many steps."""
    if steps <= (MOST_STEPS if is_compiled(request) else MOST_CALLED):
        return _against_finer(request, steps)
    if request.step is not None:
        return LeftOut(NAME, None, "rad", "halve numerics.step")
    basis = f"at most, {steps} steps each to {request.tolerance:g} of |L| and of a radian; chaos makes it grow"
    return LeftOut(NAME, steps * request.tolerance, "rad", basis)


def _against_finer(request: Any, steps: int) -> LeftOut:
    from rotor.classical.driven import answer_driven

    motion = answer_driven(request).motion
    basis = f"{steps} steps against finer ones; chaos makes it grow"
    if request.step is not None:
        fine = answer_driven(replace(request, step=request.step / 4)).motion
        return LeftOut(NAME, apart(motion, fine), "rad", basis)
    finer = [request.tolerance / 100**k for k in range(1, 8) if request.tolerance / 100**k > FINEST]
    error, seen = error_by_finer(
        motion, [*finer, FINEST], lambda tolerance: answer_driven(replace(request, tolerance=tolerance)).motion
    )
    return LeftOut(NAME, error, "rad", basis if seen else f"at most: {steps} steps, hardly more with {FINEST:g}")


def error_by_finer(coarse: Motion, finer: Sequence[float], at: Callable[[float], Motion]) -> tuple[float, bool]:
    """The largest error of an attitude in radians by motions of finer tolerances, and whether one of them took clearly more steps.

    Steps also end at the times asked for, and where these are dense, several tolerances give the same steps, whose difference of 0 says
    nothing: so the first counts that takes half as many more. A wobble smaller than the tolerance is wrong in all motions that
    do not see it: where the number of steps does not go as usual, the next finer motion counts too. Where none takes so many, the
    number of steps of the finest times its tolerance is added. The finer motion has an error of its own: differences are taken 1.1 times.
    """
    for place, tolerance in enumerate(finer):
        more = at(tolerance).steps / coarse.steps
        if more >= MORE_STEPS:
            is_usual = place == 0 and more < USUAL_STEPS
            beyond = tolerance if is_usual else finer[min(place + 1, len(finer) - 1)]
            return OF_REFERENCE * max(apart(coarse, at(tolerance)), apart(coarse, at(beyond))), True
    finest = at(finer[-1])
    return finest.steps * finer[-1] + OF_REFERENCE * apart(coarse, finest), False


def apart(one: Motion, other: Motion) -> float:
    """The largest angle between the attitudes of two motions at the same times."""
    from rotor.geometry.rotations import distance

    return float(distance(one.attitude, other.attitude).max())
