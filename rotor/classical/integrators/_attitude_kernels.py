"""Compiled turns between body and space for rows of unit quaternions, for effects and the Lie-group method."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from rotor.arrays import Floats
from rotor.geometry._kernels import conjugate, cross, exponential, product, quaternion_at, turned, vector_at

SERIES_BELOW = 1e-2  # rad: below this angle (1 - (θ/2) cot(θ/2))/θ² is summed as a series


@njit(cache=True, nogil=True)
def seen_from_body(attitude: Floats, vector: Floats) -> Floats:
    """One vector (3,) of space in the axes of each body, (n, 3) for attitudes (n, 4)."""
    out, v = np.empty((attitude.shape[0], 3)), (vector[0], vector[1], vector[2])
    for i in range(attitude.shape[0]):
        out[i] = turned(conjugate(quaternion_at(attitude, i)), v)
    return out


@njit(cache=True, nogil=True)
def lever(attitude: Floats, arm: Floats, force: Floats) -> Floats:
    """arm x force in body axes (n, 3), for an arm (3,) of the body and a force (3,) of space."""
    out, a, f = np.empty((attitude.shape[0], 3)), (arm[0], arm[1], arm[2]), (force[0], force[1], force[2])
    for i in range(attitude.shape[0]):
        out[i] = cross(a, turned(conjugate(quaternion_at(attitude, i)), f))
    return out


@njit(cache=True, inline="always")
def ahead(q: Any, u: Any) -> Any:
    """q exp(u)."""
    half = 0.5 * math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    half_sinc = 0.5 * math.sin(half) / half if half > 0.0 else 0.5
    return product(q, exponential(math.cos(half), half_sinc, u))


@njit(cache=True, inline="always")
def turning_of(u: Any, omega: Any) -> Any:
    """du/dt = ω + ½ u x ω + (1 - (θ/2) cot(θ/2))/θ² u x (u x ω), θ = |u|."""
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    if square > SERIES_BELOW**2:
        half = 0.5 * math.sqrt(square)
        factor = (1.0 - half * math.cos(half) / math.sin(half)) / square
    else:
        factor = 1.0 / 12.0 + square / 720.0 + square * square / 30240.0
    a = cross(u, omega)
    b = cross(u, a)
    return (
        omega[0] + 0.5 * a[0] + factor * b[0],
        omega[1] + 0.5 * a[1] + factor * b[1],
        omega[2] + 0.5 * a[2] + factor * b[2],
    )


@njit(cache=True, nogil=True)
def placed(attitude: Floats, change: Floats, space: Floats, here: Floats, momentum: Floats) -> None:
    """here = attitude exp(u), and L in body axes, from change (n, 6) = (change of L in space, u)."""
    for i in range(attitude.shape[0]):
        q = ahead(quaternion_at(attitude, i), (change[i, 3], change[i, 4], change[i, 5]))
        here[i] = q
        now = (space[i, 0] + change[i, 0], space[i, 1] + change[i, 1], space[i, 2] + change[i, 2])
        momentum[i] = turned(conjugate(q), now)


@njit(cache=True, nogil=True)
def turning(change: Floats, omega: Floats, out: Floats) -> None:
    """out[:, 3:] = du/dt of `turning_of` for u = change[:, 3:]."""
    for i in range(change.shape[0]):
        out[i, 3], out[i, 4], out[i, 5] = turning_of((change[i, 3], change[i, 4], change[i, 5]), vector_at(omega, i))


@njit(cache=True, nogil=True)
def to_space(attitude: Floats, vectors: Floats, out: Floats) -> None:
    """out[:, :3] = vectors (n, 3) of the bodies, seen from space."""
    for i in range(attitude.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = turned(quaternion_at(attitude, i), vector_at(vectors, i))
