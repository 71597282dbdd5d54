"""Compiled inertia and torque of bodies that roll on a plane; the plain form is `rotor.classical.effects.rolling`.

Parameters (k, 17) of k contacts: m, m g, μ of space, centre, S² by rows.
"""

from __future__ import annotations

import math
from typing import Any

from rotor.arrays import Floats
from rotor.geometry._kernels import conjugate, cross, turned
from rotor.kernels import kernel


@kernel()
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel()
def _stretched(p: Floats, k: int, v: Any) -> Any:
    """S² v."""
    return (
        p[k, 8] * v[0] + p[k, 9] * v[1] + p[k, 10] * v[2],
        p[k, 11] * v[0] + p[k, 12] * v[1] + p[k, 13] * v[2],
        p[k, 14] * v[0] + p[k, 15] * v[1] + p[k, 16] * v[2],
    )


@kernel()
def _support(p: Floats, k: int, q: Any) -> Any:
    """x, μ, S²μ and √(μᵀS²μ) in body axes."""
    down = turned(conjugate(q), (p[k, 2], p[k, 3], p[k, 4]))
    far = _stretched(p, k, down)
    height = math.sqrt(_dot(down, far))
    x = (p[k, 5] + far[0] / height, p[k, 6] + far[1] / height, p[k, 7] + far[2] / height)
    return x, down, far, height


@kernel()
def rolling_omega(p: Floats, q: Any, relative: Any, inverse: Any) -> Any:
    """ω from (I + Σ m (x² - x xᵀ)) ω = L - h, by cofactors; inverse: 1/I_i."""
    a, b, c, d, e, f = 1.0 / inverse[0], 1.0 / inverse[1], 1.0 / inverse[2], 0.0, 0.0, 0.0  # 11, 22, 33, 12, 13, 23
    for k in range(p.shape[0]):
        x, m = _support(p, k, q)[0], p[k, 0]
        a += m * (x[1] * x[1] + x[2] * x[2])
        b += m * (x[0] * x[0] + x[2] * x[2])
        c += m * (x[0] * x[0] + x[1] * x[1])
        d -= m * x[0] * x[1]
        e -= m * x[0] * x[2]
        f -= m * x[1] * x[2]
    first, second, third = b * c - f * f, e * f - c * d, d * f - b * e
    whole = a * first + d * second + e * third
    rows = (first, second, third), (second, a * c - e * e, d * e - a * f), (third, d * e - a * f, a * b - d * d)
    return _dot(rows[0], relative) / whole, _dot(rows[1], relative) / whole, _dot(rows[2], relative) / whole


@kernel()
def rolling_torque(p: Floats, q: Any, omega: Any) -> Any:
    """Σ m [g μ x x - x' x (x x ω)] in body axes."""
    t0, t1, t2 = 0.0, 0.0, 0.0
    for k in range(p.shape[0]):
        x, down, far, height = _support(p, k, q)
        down_rate = cross(down, omega)
        far_rate = _stretched(p, k, down_rate)
        share = _dot(far, down_rate) / (height * height)
        rate = (
            (far_rate[0] - far[0] * share) / height,
            (far_rate[1] - far[1] * share) / height,
            (far_rate[2] - far[2] * share) / height,
        )
        bend, pull = cross(rate, cross(x, omega)), cross(down, x)
        t0 += p[k, 1] * pull[0] - p[k, 0] * bend[0]
        t1 += p[k, 1] * pull[1] - p[k, 0] * bend[1]
        t2 += p[k, 1] * pull[2] - p[k, 0] * bend[2]
    return t0, t1, t2
