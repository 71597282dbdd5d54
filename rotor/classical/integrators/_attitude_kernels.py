"""Compiled turns between body and space for rows of unit quaternions, for effects and the Lie-group method."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.geometry._kernels import conjugate, cross, exponential, product, quaternion_at, turned, vector_at
from rotor.kernels import kernel

COSINE = tuple((-1) ** n / math.factorial(2 * n) for n in range(9))
SINE = tuple(0.5 * (-1) ** n / math.factorial(2 * n + 1) for n in range(8))
BERNOULLI = (
    1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600, 3617 / 10670622842880000,
    43867 / 5109094217170944000, 174611 / 802857662698291200000, 77683 / 14101100039391805440000,
)  # fmt: skip  # |B_2k|/(2k)! for k = 1, 2, ...
# rad: below this angle cosine, sine and (1 - (θ/2) cot(θ/2))/θ² are summed as series, without a call
SERIES_BELOW = 1.0


@kernel(nogil=True)
def seen_from_body(attitude: Floats, vector: Floats) -> Floats:
    """One vector (3,) of space in the axes of each body, (n, 3) for attitudes (n, 4)."""
    out, v = np.empty((attitude.shape[0], 3)), (vector[0], vector[1], vector[2])
    for i in range(attitude.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = turned(conjugate(quaternion_at(attitude, i)), v)
    return out


@kernel(nogil=True)
def lever(attitude: Floats, arm: Floats, force: Floats) -> Floats:
    """arm x force in body axes (n, 3), for an arm (3,) of the body and a force (3,) of space."""
    out, a, f = np.empty((attitude.shape[0], 3)), (arm[0], arm[1], arm[2]), (force[0], force[1], force[2])
    for i in range(attitude.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = cross(a, turned(conjugate(quaternion_at(attitude, i)), f))
    return out


@kernel(inline="always")
def half_angle_terms(u: Any) -> Any:
    """cos(θ/2), sin(θ/2)/θ and (1 - (θ/2) cot(θ/2))/θ² of a rotation vector, θ = |u|.

    With y = θ²/4 the series are Σ (-y)^n/(2n)!, ½ Σ (-y)^n/(2n+1)! and Σ |B_2k|/(2k)! θ^(2k-2), B_2k Bernoulli's numbers; the terms
    left out are below 1e-17 at θ = 1. They are summed in halves that do not wait for each other.
    """
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    if square < SERIES_BELOW**2:  # closed forms divide by θ², which cancels for small angles
        c, s, b, y, y2, t2 = COSINE, SINE, BERNOULLI, 0.25 * square, 0.0625 * square * square, square * square
        y4, t4 = y2 * y2, t2 * t2
        cosine = (c[4] + c[5] * y) + (c[6] + c[7] * y) * y2 + c[8] * y4
        cosine = (c[0] + c[1] * y) + (c[2] + c[3] * y) * y2 + cosine * y4
        half_sinc = (s[4] + s[5] * y) + (s[6] + s[7] * y) * y2
        half_sinc = (s[0] + s[1] * y) + (s[2] + s[3] * y) * y2 + half_sinc * y4
        factor = (b[4] + b[5] * square) + (b[6] + b[7] * square) * t2 + ((b[8] + b[9] * square) + b[10] * t2) * t4
        factor = (b[0] + b[1] * square) + (b[2] + b[3] * square) * t2 + factor * t4
        return cosine, half_sinc, factor
    half = 0.5 * math.sqrt(square)  # half angles: quaternions need them
    cosine, sine = math.cos(half), math.sin(half)
    return cosine, 0.5 * sine / half, (1.0 - half * cosine / sine) / square


@kernel(inline="always")
def ahead(q: Any, u: Any) -> Any:
    """q exp(u)."""
    cosine, half_sinc, _ = half_angle_terms(u)
    return product(q, exponential(cosine, half_sinc, u))


@kernel(inline="always")
def rotation_vector_rate(u: Any, omega: Any, factor: Any) -> Any:
    """du/dt = ω + ½ u x ω + f u x (u x ω), f = (1 - (θ/2) cot(θ/2))/θ², θ = |u|: the last of `half_angle_terms`."""
    a = cross(u, omega)
    b = cross(u, a)
    return (
        omega[0] + 0.5 * a[0] + factor * b[0],
        omega[1] + 0.5 * a[1] + factor * b[1],
        omega[2] + 0.5 * a[2] + factor * b[2],
    )


@kernel(nogil=True)
def placed(attitude: Floats, change: Floats, space: Floats, here: Floats, momentum: Floats) -> None:
    """here = attitude exp(u), and L in body axes, from change (n, 6) = (change of L in space, u)."""
    for i in range(attitude.shape[0]):
        q = ahead(quaternion_at(attitude, i), (change[i, 3], change[i, 4], change[i, 5]))
        here[i, 0], here[i, 1], here[i, 2], here[i, 3] = q
        now = (space[i, 0] + change[i, 0], space[i, 1] + change[i, 1], space[i, 2] + change[i, 2])
        momentum[i, 0], momentum[i, 1], momentum[i, 2] = turned(conjugate(q), now)


@kernel(nogil=True)
def turning(change: Floats, omega: Floats, out: Floats) -> None:
    """out[:, 3:] = du/dt of `rotation_vector_rate` for u = change[:, 3:]."""
    for i in range(change.shape[0]):
        u = (change[i, 3], change[i, 4], change[i, 5])
        _, _, factor = half_angle_terms(u)
        out[i, 3], out[i, 4], out[i, 5] = rotation_vector_rate(u, vector_at(omega, i), factor)


@kernel(nogil=True)
def to_space(attitude: Floats, vectors: Floats, out: Floats) -> None:
    """out[:, :3] = vectors (n, 3) of the bodies, seen from space."""
    for i in range(attitude.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = turned(quaternion_at(attitude, i), vector_at(vectors, i))
