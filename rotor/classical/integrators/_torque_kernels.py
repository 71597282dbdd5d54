"""Compiled sum of the torques of `rotor.classical.torque_form` on one body."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from rotor.arrays import Floats
from rotor.classical.torque_form import BODY_FIXED, INDUCED, LEVER, LINEAR, SPACE_FIXED
from rotor.geometry._kernels import conjugate, cross, turned


@njit(cache=True)
def _seen(q: Any, x: float, y: float, z: float) -> Any:
    """A vector of space in the axes of a body of attitude q."""
    return turned(conjugate(q), (x, y, z))


@njit(cache=True, inline="always")
def times_matrix(p: Any, v: Any) -> Any:
    """Rows of three parameters, the first nine, times a vector."""
    return (
        p[0] * v[0] + p[1] * v[1] + p[2] * v[2],
        p[3] * v[0] + p[4] * v[1] + p[5] * v[2],
        p[6] * v[0] + p[7] * v[1] + p[8] * v[2],
    )


@njit(cache=True, inline="always")
def scaled(factor: Any, v: Any) -> Any:
    """factor v."""
    return factor * v[0], factor * v[1], factor * v[2]


@njit(cache=True, inline="always")
def swing(p: Any, time: float) -> Any:
    """cos(Ω t + φ); 1 without a call for the vector that is constant."""
    return math.cos(p[3] * time + p[4]) if p[3] != 0.0 or p[4] != 0.0 else 1.0


@njit(cache=True)
def torque_at(codes: Any, parameters: Floats, time: float, q: Any, omega: Any) -> Any:
    """Sum of the torques in body axes on a body of attitude q that turns at omega (looked at by drag alone)."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(codes.shape[0]):
        code, p = codes[k], parameters[k]
        if code == LEVER:
            t = cross((p[0], p[1], p[2]), _seen(q, p[3], p[4], p[5]))
        elif code == BODY_FIXED:
            t = scaled(swing(p, time), (p[0], p[1], p[2]))
        elif code == SPACE_FIXED:
            t = scaled(swing(p, time), _seen(q, p[0], p[1], p[2]))
        elif code == INDUCED:
            field = _seen(q, p[9], p[10], p[11])
            t = cross(times_matrix(p, field), field)
        elif code == LINEAR:
            t = scaled(-1.0, times_matrix(p, omega))
        else:
            speed = math.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])
            t = (-p[0] * speed * omega[0], -p[1] * speed * omega[1], -p[2] * speed * omega[2])
        x, y, z = x + t[0], y + t[1], z + t[2]
    return x, y, z
