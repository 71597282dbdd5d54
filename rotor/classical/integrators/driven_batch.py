"""Steps of very many bodies in the same fields, 10⁵ to 10⁶ at once, optimised for throughput.

The steps are those of order 2 of `SymmetricTopSplitting`, without compensated sums: half a kick by the torques, a drift (the sphere's
turn about L and two turns about body axes, `strang.py`), half a kick; neighbouring half kicks are merged. L and attitude are
stepped in the body; |q| and, without torques, |L| change by rounding, about 1e-16 √steps. Torques may depend on attitude and time:
fields, gravity, constant torques and drives. Drag, internal rotors and torques given by Python functions need `integrate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.classical.effect import ClassicalEffect
from rotor.classical.integrators.batch import checked_bodies, over_blocks, rates_and_axes
from rotor.classical.system import System, flatten_system
from rotor.classical.torque_form import BODY_FIXED, INDUCED, LEVER, TURNING, SystemForm
from rotor.geometry.rotations import normalised, to_matrix


def propagate_driven(
    moments: ArrayLike,
    momentum: ArrayLike,
    attitude: ArrayLike,
    step: float,
    steps: int,
    effects: Sequence[ClassicalEffect],
    time: float = 0.0,
    executor: ThreadPoolExecutor | None = None,
) -> tuple[Floats, Floats]:
    """Momentum and attitude of n bodies under the same torques after `steps` steps of length `step`.

    Parameters
    ----------
    moments, momentum, attitude, step, steps, executor
        As for `propagate`; none of the three turns of a step may be wider than ½ rad for any body.
    effects : sequence of ClassicalEffect
        Torques of attitude and time with a compiled form; the same on every body.
    time : float
        At the start, for drives.

    Returns
    -------
    (n, 3) array, (n, 4) array
        Momentum in body axes and attitude, coherent units.

    Raises
    ------
    ValueError
        Shapes that do not fit; an effect that needs `integrate`; a step that turned out too long.

    Notes
    -----
    Order 2 in the step, bounded error of the energy in a constant field.

    >>> from rotor.classical.effects.gravity import GravityAboutPivot
    >>> pendulum = [GravityAboutPivot(1.0, [0, 0, -1.0], [0, 0, -9.8])]  # hangs at rest
    >>> propagate_driven([1.0, 1.0, 0.1], np.zeros((1, 3)), [1, 0, 0, 0], 0.01, 100, pendulum)[0].tolist()
    [[0.0, 0.0, 0.0]]
    """
    from rotor.classical.integrators._field_kernels import advance_in_field
    from rotor.classical.integrators._kernels import LANES, WIDEST_TURN

    body, momentum = checked_bodies(moments, momentum)
    if steps < 1:
        raise ValueError(f"expected at least one step; got {steps} (to go back, give a negative step)")
    form = _served(flatten_system(body, effects))
    n = len(momentum)
    out = momentum.copy(), np.array(np.broadcast_to(normalised(attitude), (n, 4)))
    rates, axes = (np.broadcast_to(a, (n, a.shape[-1])) for a in rates_and_axes(body))
    for frame, members in _by_frame(axes):
        part = tuple(np.ascontiguousarray(a[members]) for a in out)
        widest = np.zeros(len(part[0]))
        turned = (form.codes, _in_frame(form, frame))
        clock = (float(time), float(step), int(steps))
        arguments = (turned, clock, *(np.ascontiguousarray(a[members]) for a in (rates, axes)), part, widest)
        over_blocks(advance_in_field, -(-len(widest) // LANES), arguments, executor)
        _check_turns(2.0 * widest, step, WIDEST_TURN)
        out[0][members], out[1][members] = part
    if not np.isfinite(out[0]).all():
        raise ValueError("the motion diverged: the step is too long, or an effect adds energy without bound")
    return out


def _served(system: System) -> SystemForm:
    """The compiled form of effects that blocks of bodies serve."""
    form = system.compiled
    if form is None or system.inner or system.needs_velocity:
        raise ValueError(
            "many bodies at once need torques of attitude and time with a compiled form: fields, gravity, constant "
            "torques, drives; drag, inner momenta and Python functions need integrate(...)"
        )
    return form


def _by_frame(axes: Floats) -> list[tuple[Floats, NDArray[np.int64] | slice]]:
    """The different quaternions (4,) of rows (n, 4), with the rows that have each."""
    if np.all(axes == axes[:1]):
        return [(axes[0], slice(None))]
    frames, which = np.unique(axes, axis=0, return_inverse=True)
    return [(frame, np.flatnonzero(which.ravel() == k)) for k, frame in enumerate(frames)]


def _in_frame(form: SystemForm, frame: Floats) -> Floats:
    """Parameters (k, WIDTH) with vectors and matrices of the body turned into a frame."""
    turn, parameters = to_matrix(frame), form.parameters.copy()
    for code, row in zip(form.codes, parameters, strict=True):
        if code in (BODY_FIXED, LEVER):
            row[:3] = turn @ row[:3]
        elif code in (INDUCED, TURNING):
            row[:9] = (turn @ row[:9].reshape(3, 3) @ turn.T).ravel()
    return parameters


def _check_turns(turns: Floats, step: float, most: float) -> None:
    """Refuse a result with turns (n,) beyond the polynomials, or of a body that is lost."""
    if turns.size and not np.max(turns) <= most:  # nan fails too
        raise ValueError(
            f"a step of {step:g} turned a body by {np.max(turns):.3g} rad about one axis, more than {most}; take a shorter step"
        )
