"""Compiled turns between body and space for rows of unit quaternions, for effects and the Lie-group method."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from rotor.arrays import Floats

SERIES_BELOW = 1e-2  # rad: below this angle (1 - (θ/2) cot(θ/2))/θ² is summed as a series


@njit(cache=True, inline="always")
def _seen(w: float, x: float, y: float, z: float, v1: float, v2: float, v3: float) -> Any:
    """v turned by (w, x, y, z): v + 2 (w u + r x u), u = r x v; with -x, -y, -z turned back."""
    u1, u2, u3 = 2.0 * (y * v3 - z * v2), 2.0 * (z * v1 - x * v3), 2.0 * (x * v2 - y * v1)
    return v1 + w * u1 + (y * u3 - z * u2), v2 + w * u2 + (z * u1 - x * u3), v3 + w * u3 + (x * u2 - y * u1)


@njit(cache=True, nogil=True)
def seen_from_body(attitude: Floats, vector: Floats) -> Floats:
    """One vector (3,) of space in the axes of each body, (n, 3) for attitudes (n, 4)."""
    out = np.empty((attitude.shape[0], 3))
    for i in range(attitude.shape[0]):
        w, x, y, z = attitude[i]
        out[i] = _seen(w, -x, -y, -z, vector[0], vector[1], vector[2])
    return out


@njit(cache=True, nogil=True)
def lever(attitude: Floats, arm: Floats, force: Floats) -> Floats:
    """arm x force in body axes (n, 3), for an arm (3,) of the body and a force (3,) of space."""
    out = np.empty((attitude.shape[0], 3))
    a1, a2, a3 = arm[0], arm[1], arm[2]
    for i in range(attitude.shape[0]):
        w, x, y, z = attitude[i]
        f1, f2, f3 = _seen(w, -x, -y, -z, force[0], force[1], force[2])
        out[i] = a2 * f3 - a3 * f2, a3 * f1 - a1 * f3, a1 * f2 - a2 * f1
    return out


@njit(cache=True, nogil=True)
def placed(attitude: Floats, change: Floats, space: Floats, here: Floats, momentum: Floats) -> None:
    """here = attitude exp(u), and L in body axes, from change (n, 6) = (change of L in space, u)."""
    for i in range(attitude.shape[0]):
        w, x, y, z = attitude[i]
        u1, u2, u3 = change[i, 3:]
        half = 0.5 * math.sqrt(u1 * u1 + u2 * u2 + u3 * u3)
        c, s = math.cos(half), (0.5 * math.sin(half) / half if half > 0.0 else 0.5)
        u1, u2, u3 = s * u1, s * u2, s * u3
        w, x, y, z = (
            w * c - x * u1 - y * u2 - z * u3,
            x * c + w * u1 + y * u3 - z * u2,
            y * c + w * u2 + z * u1 - x * u3,
            z * c + w * u3 + x * u2 - y * u1,
        )
        here[i] = w, x, y, z
        momentum[i] = _seen(
            w, -x, -y, -z, space[i, 0] + change[i, 0], space[i, 1] + change[i, 1], space[i, 2] + change[i, 2]
        )


@njit(cache=True, nogil=True)
def turning(change: Floats, omega: Floats, out: Floats) -> None:
    """out[:, 3:] = du/dt = ω + ½ u x ω + (1 - (θ/2) cot(θ/2))/θ² u x (u x ω), θ = |u|, for u = change[:, 3:]."""
    for i in range(change.shape[0]):
        u1, u2, u3 = change[i, 3:]
        w1, w2, w3 = omega[i]
        square = u1 * u1 + u2 * u2 + u3 * u3
        if square > SERIES_BELOW**2:
            half = 0.5 * math.sqrt(square)
            factor = (1.0 - half / math.tan(half)) / square
        else:
            factor = 1.0 / 12.0 + square / 720.0 + square * square / 30240.0
        a1, a2, a3 = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3, u1 * w2 - u2 * w1
        out[i, 3] = w1 + 0.5 * a1 + factor * (u2 * a3 - u3 * a2)
        out[i, 4] = w2 + 0.5 * a2 + factor * (u3 * a1 - u1 * a3)
        out[i, 5] = w3 + 0.5 * a3 + factor * (u1 * a2 - u2 * a1)


@njit(cache=True, nogil=True)
def to_space(attitude: Floats, vectors: Floats, out: Floats) -> None:
    """out[:, :3] = vectors (n, 3) of the bodies, seen from space."""
    for i in range(attitude.shape[0]):
        w, x, y, z = attitude[i]
        out[i, 0], out[i, 1], out[i, 2] = _seen(w, x, y, z, vectors[i, 0], vectors[i, 1], vectors[i, 2])
