"""The error of the steps of a driven motion, before it is made: against finer steps, where that costs little.

The motion is made twice, with its steps and with finer ones: a tolerance of t/100, t/10⁴, ... until it takes more steps (they also end at
the times asked for, and where those are dense several tolerances give the same), or a quarter of a fixed step. The largest difference
of the attitudes is the error, up to a tenth; where no finer tolerance takes more steps it is below their number times the finest. Of a
motion of more than `MOST_STEPS` a bound is given, steps times tolerance: the local error per step is below the tolerance (E. Hairer,
S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.4). It is 8 to 1000 times the error of the examples.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotor.scenes.left_out import LeftOut

NAME = "error of the steps"
MOST_STEPS, MOST_CALLED = 20_000, 500  # of motions that are made for an estimate: compiled, and called step by step
FINEST = 1e-14  # a tolerance


def step_error(request: Any, steps: int) -> LeftOut:
    """The largest error of an attitude in radians at the times of a request whose motion has so many steps."""
    from rotor.classical.system import system_of

    called = system_of(request.moments, request.effects).compiled is None
    if steps <= (MOST_CALLED if called else MOST_STEPS):
        return _against_finer(request, steps)
    if request.step is not None:
        return LeftOut(NAME, None, "rad", "halve numerics.step")
    basis = f"at most, {steps} steps each to {request.tolerance:g} of |L| and of a radian; chaos makes it grow"
    return LeftOut(NAME, steps * request.tolerance, "rad", basis)


def _against_finer(request: Any, steps: int) -> LeftOut:
    from rotor.classical.driven import answer_driven
    from rotor.geometry.rotations import distance

    motion = answer_driven(request).motion
    tolerance, basis = request.tolerance / 100, f"{steps} steps against finer ones; chaos makes it grow"
    while request.step is None and tolerance > FINEST:
        fine = answer_driven(replace(request, tolerance=tolerance)).motion
        if fine.steps > motion.steps:
            return LeftOut(NAME, float(distance(motion.attitude, fine.attitude).max()), "rad", basis)
        tolerance /= 100
    if request.step is None:
        return LeftOut(
            NAME, motion.steps * FINEST, "rad", f"at most: {steps} steps, as many with a tolerance of {FINEST:g}"
        )
    fine = answer_driven(replace(request, step=request.step / 4)).motion
    return LeftOut(NAME, float(distance(motion.attitude, fine.attitude).max()), "rad", basis)
