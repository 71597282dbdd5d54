"""Compiled sums of correlation functions of a free gas from exact attitudes, which are not stored.

Measured (`benchmarks/bench_gas.py`): 0.09 µs per body and time, nearly all for the attitude; 0.006 µs per body for a step of a block of
128 bodies. The plain forms are in `tests/classical/gas/test_ensembles.py`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical._kernels import symmetric_steps
from rotor.classical.free._kernels import evaluate
from rotor.classical.free.theta import Rows
from rotor.classical.integrators._kernels import FINITE, LANES, WHOLE_STEP, _length, _upright, block_turns
from rotor.geometry._kernels import conjugate, product
from rotor.kernels import kernel


@kernel(inline="always")
def _turned_vector(w: float, x: float, y: float, z: float, e: Floats) -> Any:
    """e · R e = 1 - 2 |v x e|² for the rotation (w, v) and a unit vector e."""
    a, b, c = y * e[2] - z * e[1], z * e[0] - x * e[2], x * e[1] - y * e[0]
    return 1.0 - 2.0 * (a * a + b * b + c * c)


@kernel(inline="always")
def _turned_tensor(w: float, x: float, y: float, z: float, axes: Floats, beta: Floats) -> Any:
    """Σ_ij β_i β_j R_ij², the rotation seen from the tensor's principal axes (rows), Σ β_i = 0, Σ β_i² = 1.

    With Σ_i R_ij² = Σ_j R_ij² = 1 and β3 = -β1 - β2, four of the nine squares are enough.
    """
    u = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
    v = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
    t = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
    xx, xy = 1.0 - 2.0 * (v * v + t * t), 2.0 * (u * v - w * t)
    yx, yy = 2.0 * (u * v + w * t), 1.0 - 2.0 * (u * u + t * t)
    xx, xy, yx, yy = xx * xx, xy * xy, yx * yx, yy * yy
    p, q = beta[0] - beta[2], beta[1] - beta[2]
    # β_i = β_3 + (p, q, 0): what is constant along rows or columns sums to multiples of β_3
    rest = 3.0 * beta[2] * beta[2] + 2.0 * beta[2] * (p + q)
    return rest + p * p * xx + q * q * yy + p * q * (xy + yx)


@kernel(nogil=True)
def add_bodies(rows: Rows, times: Floats, vector: Floats, axes: Floats, beta: Floats, sums: Floats) -> None:
    """Add u(0)·u(t) and β(0):β(t) and their squares, over all bodies of `rows`, to sums (4, times)."""
    momentum, attitude = np.empty((1, times.size, 3)), np.empty((1, times.size, 4))
    for b in range(rows.kind.shape[0]):  # one body at a time: slices keep the layout of `Rows`
        body = Rows(
            rows.kind[b : b + 1], rows.rates[b : b + 1], rows.shift[b : b + 1], rows.series[b : b + 1],
            rows.axes[b : b + 1], rows.signs[b : b + 1], rows.left[b : b + 1], rows.right[b : b + 1],
            rows.momentum0[b : b + 1],
        )  # fmt: skip
        evaluate(body, times, momentum, attitude)
        for i in range(times.size):
            w, x, y, z = attitude[0, i, 0], attitude[0, i, 1], attitude[0, i, 2], attitude[0, i, 3]
            first, second = _turned_vector(w, x, y, z, vector), _turned_tensor(w, x, y, z, axes, beta)
            sums[0, i] += first
            sums[1, i] += first * first
            sums[2, i] += second
            sums[3, i] += second * second


@kernel(nogil=True, fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def add_stepped(
    momentum: Floats,
    step: float,
    steps: int,
    rates: Floats,
    turn: Floats,
    vector: Floats,
    axes: Floats,
    beta: Floats,
    sums: Floats,
) -> None:
    """The four sums of `add_bodies` for bodies (n, 3) that start upright, `steps` steps of `_kernels.py` between two times.

    rates (3,), turn (4,): those of `_kernels.py`; vector, axes: in its frame, rotated by `turn`. A block is propagated through all
    times before the next one. Its six runs are followed by q from the frame of L to space, and by cosine and sine of half the rotation
    about L between two times; with all in one array the loops vectorise.
    """
    row = np.zeros(12 * LANES)
    for block in range(-(-len(momentum) // LANES)):  # blocks, the last one shorter
        here = min(LANES, len(momentum) - block * LANES)
        for k in range(here):
            size = _length(momentum[block * LANES + k])
            tilt = _upright(momentum[block * LANES + k], size)
            row[k], row[LANES + k], row[2 * LANES + k], row[3 * LANES + k] = product(tilt, conjugate(turn))
            row[4 * LANES + k], row[5 * LANES + k] = size * rates[0], size * rates[1]
            back = product(turn, conjugate(tilt))
            row[6 * LANES + k], row[7 * LANES + k], row[8 * LANES + k], row[9 * LANES + k] = back
            half = 0.5 * size * rates[2] * step * steps  # half the angle, as quaternions need
            row[10 * LANES + k], row[11 * LANES + k] = math.cos(half), math.sin(half)
        for i in range(sums.shape[1]):
            if i > 0:
                symmetric_steps(block_turns, row, WHOLE_STEP, step, steps)
                _turn_about_l(row)
            _add_block(row, here, vector, axes, beta, sums[:, i])


@kernel(fastmath=FINITE, error_model="numpy")
def _turn_about_l(row: Floats) -> None:
    """q from the frame of L to space, times (c, 0, 0, s)."""
    for k in range(LANES):
        q = row[6 * LANES + k], row[7 * LANES + k], row[8 * LANES + k], row[9 * LANES + k]
        q = product(q, (row[10 * LANES + k], 0.0, 0.0, row[11 * LANES + k]))
        row[6 * LANES + k], row[7 * LANES + k], row[8 * LANES + k], row[9 * LANES + k] = q


@kernel(fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")
def _add_block(row: Floats, here: int, vector: Floats, axes: Floats, beta: Floats, out: Floats) -> None:
    """Sums over the bodies of a block, seen in the frame of `add_stepped`."""
    s1 = s2 = s3 = s4 = 0.0
    for k in range(here):
        p = row[6 * LANES + k], row[7 * LANES + k], row[8 * LANES + k], row[9 * LANES + k]
        w, x, y, z = product(p, (row[k], row[LANES + k], row[2 * LANES + k], row[3 * LANES + k]))
        turned, two = _turned_vector(w, x, y, z, vector), _turned_tensor(w, x, y, z, axes, beta)
        s1, s2, s3, s4 = s1 + turned, s2 + turned * turned, s3 + two, s4 + two * two
    out[0] += s1
    out[1] += s2
    out[2] += s3
    out[3] += s4
