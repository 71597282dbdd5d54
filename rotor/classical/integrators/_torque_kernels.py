"""Compiled sum of the torques of `rotor.classical.torque_form` on one body."""

from __future__ import annotations

import math
from typing import Any

from rotor.arrays import Floats
from rotor.classical.torque_form import BODY_FIXED, INDUCED, LEVER, LINEAR, SPACE_FIXED, TURNING
from rotor.geometry._kernels import conjugate, cross, turned
from rotor.kernels import kernel


@kernel()
def _seen(q: Any, x: float, y: float, z: float) -> Any:
    """A vector of space in the axes of a body of attitude q."""
    return turned(conjugate(q), (x, y, z))


@kernel(inline="always")
def times_matrix(p: Any, k: int, v: Any) -> Any:
    """The first nine parameters of torque k, a matrix by rows, times a vector."""
    return (
        p[k, 0] * v[0] + p[k, 1] * v[1] + p[k, 2] * v[2],
        p[k, 3] * v[0] + p[k, 4] * v[1] + p[k, 5] * v[2],
        p[k, 6] * v[0] + p[k, 7] * v[1] + p[k, 8] * v[2],
    )


@kernel(inline="always")
def scaled(factor: Any, v: Any) -> Any:
    """factor v."""
    return factor * v[0], factor * v[1], factor * v[2]


@kernel(inline="always")
def swing(p: Any, k: int, time: float) -> Any:
    """cos(Ω t + φ) of torque k; 1, without evaluating the cosine, for a constant vector."""
    return math.cos(p[k, 3] * time + p[k, 4]) if p[k, 3] != 0.0 or p[k, 4] != 0.0 else 1.0


@kernel(inline="always")
def turning_axis(p: Any, k: int, time: float) -> Any:
    """(cos φ, sin φ, 0) of torque k with φ = φ0 + Ω t + β t²/2."""
    angle = p[k, 9] + (p[k, 10] + 0.5 * p[k, 11] * time) * time
    return math.cos(angle), math.sin(angle), 0.0


@kernel(inline="always")
def torque_at(codes: Any, p: Floats, time: float, q: Any, omega: Any) -> Any:
    """Sum of the torques in body axes on a body with attitude q and angular velocity omega (used by drag only).

    codes (k,) and p (k, WIDTH), their parameters; elements by index, since a view of a row costs as much as a torque.
    """
    x, y, z = 0.0, 0.0, 0.0
    for k in range(codes.shape[0]):
        code = codes[k]
        if code == LEVER:
            t = cross((p[k, 0], p[k, 1], p[k, 2]), _seen(q, p[k, 3], p[k, 4], p[k, 5]))
        elif code == BODY_FIXED:
            t = scaled(swing(p, k, time), (p[k, 0], p[k, 1], p[k, 2]))
        elif code == SPACE_FIXED:
            t = scaled(swing(p, k, time), _seen(q, p[k, 0], p[k, 1], p[k, 2]))
        elif code == INDUCED:
            field = _seen(q, p[k, 9], p[k, 10], p[k, 11])
            t = cross(times_matrix(p, k, field), field)
        elif code == TURNING:
            field = _seen(q, *turning_axis(p, k, time))
            t = cross(times_matrix(p, k, field), field)
        elif code == LINEAR:
            t = scaled(-1.0, times_matrix(p, k, omega))
        else:
            speed = math.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])
            t = (-p[k, 0] * speed * omega[0], -p[k, 1] * speed * omega[1], -p[k, 2] * speed * omega[2])
        x, y, z = x + t[0], y + t[1], z + t[2]
    return x, y, z
