"""Compiled free steps of very many tops, in blocks of 128 bodies for vectorisation.

A block has six runs of 128 numbers in one array: the quaternion w, x, y, z from the body to a frame whose third axis is L, and the rates
of two rotations. The offsets between the runs are compile-time constants, so that the compiler can prove that they do not overlap and
treats four or eight bodies per instruction; sine and cosine are polynomials for the same reason. A step takes some sixty multiplications
and additions; L is not stored, since it is R^T (0, 0, |L|).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical._kernels import symmetric_steps
from rotor.geometry._kernels import conjugate, half_third_row, matrix, product, quaternion_at, to_third
from rotor.kernels import kernel

WHOLE_STEP = (1.0,)  # fractions of a step of order 2
LANES = 128
RUNS = 6
FINITE = {"contract", "nnan", "ninf", "nsz"}  # products with zeros of a quaternion are optimised away
WIDEST_TURN = 0.5  # rad per step: half of it is the largest argument of the polynomials below


@kernel(inline="always", fastmath={"contract"})
def sine_series(y: Any) -> Any:
    """(x - sin x)/x³ and (1 - cos x)/x² by y = x², |x| <= ¼: Taylor polynomials, truncated at x¹³/13! = 2e-18 and x¹⁴/14!."""
    # Horner's rule; for the angles allowed here the next terms are below the last digit
    s = 1 / 6 - y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y * (1 / 39916800))))
    return s, 1 / 2 - y * (1 / 24 - y * (1 / 720 - y * (1 / 40320 - y * (1 / 3628800 - y * (1 / 479001600)))))


@kernel(inline="always", fastmath={"contract"})
def sine_cosine(x: Any) -> Any:
    """sin x and cos x, |x| <= ¼."""
    y = x * x
    s, c = sine_series(y)
    return x - x * y * s, 1.0 - y * c


@kernel(fastmath=FINITE, error_model="numpy")
def block_turns(row: Floats, inner: float, outer: float) -> None:
    """The inner turn of a block, about axis 2 of its frame, then the outer one, about axis 1: q becomes q exp(½ angle e).

    With L along the third axis of the space frame, L2 = 2 |L| (yz + wx) and L1 = 2 |L| (xz - wy).
    """
    for i in range(LANES):
        q = row[i], row[LANES + i], row[2 * LANES + i], row[3 * LANES + i]
        s, c = sine_cosine(inner * row[4 * LANES + i] * half_third_row(q)[1])
        q = product(q, (c, 0.0, s, 0.0))
        s, c = sine_cosine(outer * row[5 * LANES + i] * half_third_row(q)[0])
        row[i], row[LANES + i], row[2 * LANES + i], row[3 * LANES + i] = product(q, (c, s, 0.0, 0.0))


@kernel(inline="always")
def _length(v: Any) -> Any:
    """|v|, without overflow of the squares."""
    size = max(abs(v[0]), abs(v[1]), abs(v[2]))  # scaled by the largest component, so that squares do not overflow
    scale = 1.0 / size if size > 0.0 else 1.0
    a, b, c = scale * v[0], scale * v[1], scale * v[2]
    return size * math.sqrt(a * a + b * b + c * c)


@kernel(inline="always")
def _upright(v: Any, size: float) -> Any:
    """A rotation that takes v of length `size` to the third axis."""
    return to_third((v[0] / size, v[1] / size, v[2] / size) if size > 0.0 else (0.0, 0.0, 1.0))


@kernel(nogil=True, fastmath={"contract"}, error_model="numpy")
def advance_blocks(blocks: Any, step: float, steps: int, rates: Floats, axes: Floats, state: Any, out: Any) -> None:
    """`steps` >= 1 steps of the bodies in blocks first to last - 1.

    rates (n, 3): of the inner and the outer turn and of the turn about L, per |L|. axes (n, 4): quaternions from body
    axes to (outer, inner, third). state, out: momentum (n, 3) and attitude (n, 4) before and after.
    """
    (first, last), (momentum, attitude), (new_momentum, new_attitude) = blocks, state, out
    row, left, size = np.zeros(RUNS * LANES), np.empty((LANES, 4)), np.empty(LANES)
    for block in range(first, last):
        begin, count = block * LANES, min(LANES, len(momentum) - block * LANES)
        for i in range(count):
            body = begin + i
            size[i] = _length(momentum[body])
            tilt = _upright(momentum[body], size[i])
            row[i], row[LANES + i], row[2 * LANES + i], row[3 * LANES + i] = product(tilt, conjugate(axes[body]))
            row[4 * LANES + i], row[5 * LANES + i] = size[i] * rates[body, 0], size[i] * rates[body, 1]
            half = 0.5 * size[i] * rates[body, 2] * step * steps
            about_l = (math.cos(half), 0.0, 0.0, math.sin(half))
            left[i, 0], left[i, 1], left[i, 2], left[i, 3] = product(
                product(quaternion_at(attitude, body), conjugate(tilt)), about_l
            )
        symmetric_steps(block_turns, row, WHOLE_STEP, step, steps)
        for i in range(count):
            body = begin + i
            q = product((row[i], row[LANES + i], row[2 * LANES + i], row[3 * LANES + i]), axes[body])
            l1, l2, l3 = matrix(q)[2]
            new_momentum[body, 0], new_momentum[body, 1], new_momentum[body, 2] = (
                size[i] * l1,
                size[i] * l2,
                size[i] * l3,
            )
            new_attitude[body, 0], new_attitude[body, 1], new_attitude[body, 2], new_attitude[body, 3] = product(
                quaternion_at(left, i), q
            )
