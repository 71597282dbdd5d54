"""The error of the steps of a driven motion, before it is made: `rotor.classical.step_errors`."""

from __future__ import annotations

from typing import Any

from rotor.classical.step_errors import MOST_CALLED, MOST_STEPS
from rotor.scenes.left_out import LeftOut
from rotor.scenes.motion_steps import is_compiled

NAME = "error of the steps"


def step_error(request: Any, steps: int) -> LeftOut:
    """The largest error of an attitude in radians at the times of a request whose motion has so many steps."""
    if steps <= (MOST_STEPS if is_compiled(request) else MOST_CALLED):
        from rotor.classical.driven import answer_driven

        term = answer_driven(request).errors.truncation
        return LeftOut(NAME, term.value, "rad", f"{term.source}; chaos makes it grow")
    if request.step is not None:
        return LeftOut(NAME, None, "rad", "halve numerics.step")
    basis = f"at most, {steps} steps each to {request.tolerance:g} of |L| and of a radian; chaos makes it grow"
    return LeftOut(NAME, steps * request.tolerance, "rad", basis)
