"""Free steps of very many independent tops, 10⁵ to 10⁶ at once: throughput before everything else.

The method is `RotationSplitting` of order 2 (see there what it keeps) without compensated sums, on blocks of bodies
that stay in the nearest cache while all their steps are made. |L| and |q| wander by rounding, about 1e-16 √steps; the
energy stays bounded. Where the exact state at a few times is wanted, `free.free_motion` is cheaper still.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from rotor.classical.euler import checked_moments, checked_momentum, inverse_moments
from rotor.rotations import Array, normalised


def advance(
    moments: ArrayLike,
    momentum: ArrayLike,
    attitude: ArrayLike,
    step: float,
    steps: int,
    executor: ThreadPoolExecutor | None = None,
) -> tuple[Array, Array]:
    """Momentum (n, 3) and attitude (n, 4) of n free tops after `steps` steps of length `step`.

    moments (n, 3) or (3,), momentum (n, 3) in body axes, attitude (n, 4) or (4,); coherent units; `step` may be
    negative. A step may turn no body by more than ½ rad about any axis. Threads of `executor` share the bodies (the
    compiled loop releases the interpreter lock).

    Linear rotors are refused, see `RotationSplitting`.

    >>> momentum, attitude = advance([0.6, 0.8, 1.0], np.array([[1.8, 0.4, -0.9]]), [1, 0, 0, 0], 0.01, 1000)
    >>> momentum[0].round(3).tolist()  # exact: 1.766, -0.695, 0.780
    [1.766, -0.695, 0.78]
    """
    from rotor.classical._kernels import LANES, RUNS, advance_blocks

    data, n = packed(moments, momentum, attitude, step)
    if steps < 0:
        raise ValueError(f"the number of steps is not negative; got {steps} (to go back, give a negative step)")
    blocks = data.size // (RUNS * LANES)
    if executor is None:
        advance_blocks(data, 0, blocks, step, steps)
    else:
        edges = np.linspace(0, blocks, min(blocks, 64) + 1).astype(int)
        jobs = [executor.submit(advance_blocks, data, a, b, step, steps) for a, b in pairwise(edges)]
        for job in jobs:
            job.result()
    runs = data.reshape(blocks, RUNS, LANES).transpose(0, 2, 1).reshape(-1, RUNS)[:n]
    return np.ascontiguousarray(runs[:, :3]), np.ascontiguousarray(runs[:, 3:7])


def packed(moments: ArrayLike, momentum: ArrayLike, attitude: ArrayLike, step: float) -> tuple[Array, int]:
    """The flat blocks of the kernel and the number of bodies; the last block is filled with bodies at rest."""
    from rotor.classical._kernels import LANES, RUNS, WIDEST_TURN

    moments = checked_moments(moments)
    momentum = checked_momentum(momentum, moments)
    if np.any(moments == 0.0):
        raise ValueError("linear rotors cannot be advanced by turns about three axes; use SymmetricTopSplitting")
    if momentum.ndim != 2:
        raise ValueError(f"the momenta of many tops have shape (n, 3); got {momentum.shape}")
    turn = abs(step) * float(np.max(np.linalg.norm(momentum, axis=-1) / np.min(moments, axis=-1), initial=0.0))
    if not turn <= WIDEST_TURN:
        raise ValueError(
            f"a step of {step:g} could turn a body by {turn:.3g} rad about one axis, more than {WIDEST_TURN}; "
            "take a shorter step"
        )
    n = len(momentum)
    lanes = np.zeros((-(-n // LANES) * LANES, RUNS))
    lanes[:, 3], lanes[:, 7:] = 1.0, 1.0
    lanes[:n, :3], lanes[:n, 3:7], lanes[:n, 7:] = momentum, normalised(attitude), inverse_moments(moments)
    return lanes.reshape(-1, LANES, RUNS).transpose(0, 2, 1).reshape(-1), n
