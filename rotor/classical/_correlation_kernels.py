"""Compiled sums behind correlation functions of a free gas: exact attitudes, one body after another, never kept.

Measured (`benchmarks/bench_gas.py`): 0.15 µs for one body at one time, of which 0.12 µs are the attitude itself. The plain
forms stand in `tests/test_ensembles.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from rotor.classical._free_kernels import evaluate
from rotor.classical._kernels import LANES, advance_blocks
from rotor.classical.theta import Rows
from rotor.rotations import Array


@njit(cache=True, inline="always")
def _turned_vector(w: float, x: float, y: float, z: float, e: Array) -> Any:
    """e · R e = 1 - 2 |v x e|² for the rotation (w, v) and a unit vector e."""
    a, b, c = y * e[2] - z * e[1], z * e[0] - x * e[2], x * e[1] - y * e[0]
    return 1.0 - 2.0 * (a * a + b * b + c * c)


@njit(cache=True, inline="always")
def _turned_tensor(w: float, x: float, y: float, z: float, axes: Array, beta: Array) -> Any:
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


@njit(cache=True, nogil=True)
def add_bodies(rows: Rows, times: Array, vector: Array, axes: Array, beta: Array, sums: Array) -> None:
    """Add u(0)·u(t) and β(0):β(t) and their squares, over all bodies of `rows`, to sums (4, times)."""
    momentum, attitude = np.empty((1, times.size, 3)), np.empty((1, times.size, 4))
    for b in range(rows.kind.shape[0]):
        one = Rows(
            rows.kind[b : b + 1], rows.rates[b : b + 1], rows.shift[b : b + 1], rows.series[b : b + 1],
            rows.axes[b : b + 1], rows.signs[b : b + 1], rows.left[b : b + 1], rows.right[b : b + 1],
            rows.momentum0[b : b + 1],
        )  # fmt: skip
        evaluate(one, times, momentum, attitude)
        for i in range(times.size):
            w, x, y, z = attitude[0, i, 0], attitude[0, i, 1], attitude[0, i, 2], attitude[0, i, 3]
            first, second = _turned_vector(w, x, y, z, vector), _turned_tensor(w, x, y, z, axes, beta)
            sums[0, i] += first
            sums[1, i] += first * first
            sums[2, i] += second
            sums[3, i] += second * second


@njit(cache=True, nogil=True)
def add_stepped(
    momentum: Array,
    step: float,
    steps: int,
    rates: Array,
    turns: Array,
    vector: Array,
    axes: Array,
    beta: Array,
    sums: Array,
) -> None:
    """The same four sums for bodies (n, 3) that start upright, `steps` steps of `_kernels.py` between two times.

    A block of bodies is followed through all times before the next one, so that its state stays in the nearest cache.
    """
    attitude = np.empty((len(momentum), 4))
    attitude[:, 0], attitude[:, 1:] = 1.0, 0.0
    for block in range(-(-len(momentum) // LANES)):
        first, last = block * LANES, min((block + 1) * LANES, len(momentum))
        for i in range(sums.shape[1]):
            if i > 0:
                state = (momentum, attitude)
                advance_blocks((block, block + 1), step, steps, rates, turns, state, state)
            for b in range(first, last):
                w, x, y, z = attitude[b, 0], attitude[b, 1], attitude[b, 2], attitude[b, 3]
                one, two = _turned_vector(w, x, y, z, vector), _turned_tensor(w, x, y, z, axes, beta)
                sums[0, i] += one
                sums[1, i] += one * one
                sums[2, i] += two
                sums[3, i] += two * two
