"""Free steps of very many independent tops, 10⁵ to 10⁶ at once, optimised for throughput.

With the axes numbered so that I3 is the intermediate moment, the energy is that of a sphere and two remainders,

    H = L²/2I3 + ½ (1/I1 - 1/I3) L1² + ½ (1/I2 - 1/I3) L2².

|L|² commutes with all functions of L. The sphere's flow, a steady rotation of the body at |L|/I3 about L in space, therefore commutes
with the flows of the remainders, rotations at (1/I_i - 1/I3) L_i about the body's axes, and is applied once, exactly, for all steps. The
rest of a step (Strang 1968) is half a rotation about axis 1, one about axis 2, half a rotation about axis 1; neighbouring halves are
merged, which gives two rotations per step. Axis 1 has the larger remainder: the error h²(2 r1 r2² + r1² r2)/24, with r the rates of the
remainders, is thirty times smaller in the median than for rotations about three axes, and zero for spherical and symmetric tops and
linear rotors. These are the steps of order 2 of `SymmetricTopSplitting`, without compensated sums. L in space is conserved by
construction: it is not stepped, and L in the body follows from the attitude. |L| in the body is as accurate as |q|², which is not
renormalised and changes by rounding, about 1e-16 √steps. Rates rounded to double precision cost up to 2e-16 of the angle turned, far
below the error of the step. The energy error stays bounded. For the exact state at a few times, `free.free_motion` is faster.

Sources: the split into flows of rotations is that of `splitting.py`; that |L|² is a Casimir of the bracket of Euler's
equations: J. E. Marsden and T. S. Ratiu, Introduction to Mechanics and Symmetry, chapter 15.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, checked_momentum
from rotor.classical.integrators.splitting import turned_axes
from rotor.classical.system import acting_inverse
from rotor.geometry.rotations import from_matrix, normalised


def propagate(
    moments: ArrayLike,
    momentum: ArrayLike,
    attitude: ArrayLike,
    step: float,
    steps: int,
    executor: ThreadPoolExecutor | None = None,
) -> tuple[Floats, Floats]:
    """Momentum and attitude of n free tops after `steps` steps of length `step`.

    Parameters
    ----------
    moments : (n, 3) or (3,) array
        Principal moments.
    momentum : (n, 3) array
        In body axes.
    attitude : (n, 4) or (4,) array
        Body to space.
    step : float
        May be negative. The two rotations of a step, (1/I_i - 1/I3) |L| step, must not exceed ½ rad for any body.
    steps : int
        Number of steps.
    executor : ThreadPoolExecutor, optional
        Its threads share the bodies (the compiled loop releases the interpreter lock).

    Returns
    -------
    (n, 3) array, (n, 4) array
        Momentum in body axes and attitude, coherent units.

    Raises
    ------
    ValueError
        Shapes that do not fit; a step that is too long.

    Notes
    -----
    Order 2 in the step, bounded error of the energy; see the head of this module.

    >>> momentum, attitude = propagate([0.6, 0.8, 1.0], np.array([[1.8, 0.4, -0.9]]), [1, 0, 0, 0], 0.01, 1000)
    >>> momentum[0].round(4).tolist()  # exact: 1.76596, -0.69546, 0.77955
    [1.766, -0.6955, 0.7796]
    """
    from rotor.classical.integrators._kernels import LANES, advance_blocks

    moments, momentum = checked_bodies(moments, momentum)
    if steps < 0:
        raise ValueError(f"number of steps: expected 0 or more; got {steps} (a negative step goes back in time)")
    n = len(momentum)
    attitude = np.ascontiguousarray(np.broadcast_to(normalised(attitude), (n, 4)))
    rates, axes = (np.ascontiguousarray(np.broadcast_to(a, (n, a.shape[-1]))) for a in rates_and_axes(moments))
    check_turn(rates, momentum, step)
    out = momentum.copy(), attitude.copy()
    if steps == 0:
        return out
    over_blocks(advance_blocks, -(-n // LANES), (step, steps, rates, axes, (momentum, attitude), out), executor)
    return out


def checked_bodies(moments: ArrayLike, momentum: ArrayLike) -> tuple[Floats, Floats]:
    """Moments (n, 3) or (3,) and momenta (n, 3) of many bodies, or a ValueError."""
    checked = checked_moments(moments)
    momenta = np.ascontiguousarray(checked_momentum(momentum, checked))
    if momenta.ndim != 2:
        raise ValueError(f"the momenta of many bodies have shape (n, 3); got {momenta.shape}")
    return checked, momenta


def over_blocks(kernel: Any, blocks: int, arguments: tuple[Any, ...], executor: ThreadPoolExecutor | None) -> None:
    """Call kernel((first, last), *arguments) for all blocks at once, or for parts of them by the threads of an executor.

    kernel: a compiled loop that releases the interpreter lock and changes arrays in place.
    """
    if executor is None:
        kernel((0, blocks), *arguments)
        return
    # more parts than processors, so that none waits long for the last
    edges = np.linspace(0, blocks, min(blocks, 64) + 1).astype(int).tolist()
    jobs = [executor.submit(kernel, part, *arguments) for part in pairwise(edges)]
    for job in jobs:
        job.result()


def rates_and_axes(moments: Floats) -> tuple[Floats, Floats]:
    """Rates per |L| of the inner, the outer turn and the sphere (n, 3), and the quaternions (n, 4) to their axes."""
    inverse = np.atleast_2d(acting_inverse(moments))
    order = turned_axes(inverse)
    outer, inner, third = np.take_along_axis(inverse, order, axis=-1).T
    frames = np.eye(3)[order]
    frames[:, 2] *= np.linalg.det(frames)[:, None]  # a rotation, not a reflection; L3 enters through its square only
    return np.stack([inner - third, outer - third, third], axis=-1), from_matrix(frames)


def check_turn(rates: Floats, momentum: Floats, step: float) -> None:
    from rotor.classical.integrators._kernels import WIDEST_TURN

    size = np.linalg.norm(momentum, axis=-1)
    turn = abs(step) * float(np.max(size * np.max(np.abs(rates[:, :2]), axis=-1), initial=0.0))
    if not turn <= WIDEST_TURN:  # the polynomials of sine and cosine reach no further; nan fails too
        raise ValueError(
            f"a step of {step:g} could turn a body by {turn:.3g} rad about one axis, more than {WIDEST_TURN}; "
            "take a shorter step"
        )
