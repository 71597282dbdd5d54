"""Compiled steps of the geometric integrators on rows (L1, L2, L3, qw, qx, qy, qz), with compensated sums.

Rounding errors must not accumulate in one direction, or energy, |L| and |q| drift in proportion to the number of steps. Three measures
prevent this. A rotation is applied as an increment, and the rounding error of each sum is added to the next one (Kahan 1965, with
Knuth's exact sum). The sine and 1 - cosine of a rotation are consistent beyond double precision (`_versed`), so that even 10⁸ equal
rotations do not change lengths. The rotation of the Moser-Veselov map solves its equation beyond double precision (`_refined`), and
the moments of the map are on a grid on which their differences are exact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical._kernels import halves, remainders, symmetric_steps, two_product, two_square, two_sum
from rotor.geometry._kernels import cross, exponential, product
from rotor.kernels import kernel

NEWTON_SWEEPS = 40  # a bound: convergence is quadratic where the step has a root near the guess


@kernel(inline="always")
def _add(row: Any, lost: Any, i: int, increment: float) -> None:
    row[i], lost[i] = two_sum(row[i], increment + lost[i])


@kernel(inline="always")
def _squared_length(x: float, y: float, z: float) -> Any:
    """x² + y² + z² as the sum of two doubles."""
    (a, al), (b, bl), (c, cl) = two_square(x), two_square(y), two_square(z)
    s, rest = two_sum(a, b)
    total, more = two_sum(s, c)
    return total, (rest + more) + (al + bl + cl)


@kernel(inline="always")
def _versed(square: float, square_low: float, cosine: float) -> Any:
    """v + l = 1 - cosine with (1 - v - l)² + sine² = 1, from the sine's square in two doubles and a rounded cosine."""
    v = square / (1.0 + cosine) if cosine > 0.0 else 1.0 - cosine
    v2, v2_low = two_square(v)
    rest = ((square - 2.0 * v) + v2) + (v2_low + square_low)
    # a Newton step for v; it divides by the cosine, so not near a right angle
    return v, rest / (2.0 * cosine) if cosine > 0.1 else 0.0


@kernel(inline="always")
def _turn_momentum(row: Any, lost: Any, a: int, b: int, sine: float, cosine: float) -> None:
    """Components a, b of L as seen from a body that turns about the third axis."""
    sine2, sine2_low = two_square(sine)
    v, low = _versed(sine2, sine2_low, cosine)
    ma, mb = row[a], row[b]
    lost[a] -= low * ma
    lost[b] -= low * mb
    _add(row, lost, a, sine * mb - v * ma)
    _add(row, lost, b, -sine * ma - v * mb)


@kernel(inline="always")
def _turn_attitude(row: Any, lost: Any, cosine: float, x: float, y: float, z: float) -> None:
    """q (cosine, x, y, z), added as an increment."""
    sine2, sine2_low = _squared_length(x, y, z)
    v, low = _versed(sine2, sine2_low, cosine)
    change = product((row[3], row[4], row[5], row[6]), (-v, x, y, z))
    for i in range(3, 7):
        lost[i] -= low * row[i]
    _add(row, lost, 3, change[0])
    _add(row, lost, 4, change[1])
    _add(row, lost, 5, change[2])
    _add(row, lost, 6, change[3])


@kernel()
def _turn(row: Any, lost: Any, k: int, a: int, b: int, angle: float) -> None:
    """The body turns by `angle` about its axis k of (k, a, b) = a cyclic order of (0, 1, 2)."""
    s, c = math.sin(0.5 * angle), math.cos(0.5 * angle)
    _turn_momentum(row, lost, a, b, 2.0 * s * c, 1.0 - 2.0 * s * s)
    x, y, z = (s if k == 0 else 0.0), (s if k == 1 else 0.0), (s if k == 2 else 0.0)
    _turn_attitude(row, lost, c, x, y, z)


@kernel()
def _turn_about(row: Any, lost: Any, x: float, y: float, z: float) -> None:
    """The body turns by the rotation vector (x, y, z), L staying where it is in the body."""
    half = 0.5 * math.sqrt(x * x + y * y + z * z)
    scale = 0.5 * math.sin(half) / half if half > 0.0 else 0.5  # sin(x)/x tends to 1
    c, x, y, z = exponential(math.cos(half), scale, (x, y, z))
    _turn_attitude(row, lost, c, x, y, z)


@kernel(nogil=True)
def rotations(state: Floats, carry: Floats, inverse: Floats, step: float, fractions: Floats, steps: int) -> None:
    """Steps R1 R2 R3 R2 R1 of half, half, whole, half, half turns about the body's axes, composed with `fractions`."""
    for body in range(state.shape[0]):
        row, lost = state[body], carry[body]
        i0, i1, i2 = inverse[body, 0], inverse[body, 1], inverse[body, 2]
        for _ in range(steps):
            for fraction in fractions:
                h = fraction * step
                # palindromic: half turns about x and y around a whole turn about z make order 2
                _turn(row, lost, 0, 1, 2, 0.5 * h * i0 * row[0])
                _turn(row, lost, 1, 2, 0, 0.5 * h * i1 * row[1])
                _turn(row, lost, 2, 0, 1, h * i2 * row[2])
                _turn(row, lost, 1, 2, 0, 0.5 * h * i1 * row[1])
                _turn(row, lost, 0, 1, 2, 0.5 * h * i0 * row[0])


@kernel(inline="always")
def _turns(body: Any, inner: float, outer: float) -> None:
    """The inner turn of one body for a time, then the outer one; body = row, lost, rates and axes of (outer, inner)."""
    row, lost, (outer_rate, inner_rate), (a, b) = body
    if inner != 0.0:
        _turn(row, lost, b, (b + 1) % 3, (b + 2) % 3, inner * inner_rate * row[b])
    _turn(row, lost, a, (a + 1) % 3, (a + 2) % 3, outer * outer_rate * row[a])


@kernel()
def symmetric_drift(row: Any, lost: Any, inverse: Any, axes: Any, step: float, fractions: Any, steps: int) -> None:
    """Steps of `strang.py` of one body; inverse moments (3,), axes (3,) of (outer, inner, sphere)."""
    a, b, equal = axes[0], axes[1], inverse[axes[2]]
    rates = remainders(inverse[a], inverse[b], equal)
    symmetric_steps(_turns, (row, lost, rates, (a, b)), fractions, step, steps)
    whole = steps * step * equal
    _turn_about(row, lost, whole * row[0], whole * row[1], whole * row[2])


@kernel(nogil=True)
def symmetric(
    state: Floats, carry: Floats, inverse: Floats, axes: Any, step: float, fractions: Floats, steps: int
) -> None:
    """Steps of `strang.py` of each body of rows (n, 7)."""
    for body in range(state.shape[0]):
        symmetric_drift(state[body], carry[body], inverse[body], axes[body], step, fractions, steps)


@kernel(inline="always")
def _slopes(m: Any, j: Any, d: Any, x: Any) -> Any:
    """Derivatives of (1 + |x|²) m + d (x2 x3, x3 x1, x1 x2) - j x by x, in rows."""
    return (
        (2 * m[0] * x[0] - j[0], 2 * m[0] * x[1] + d[0] * x[2], 2 * m[0] * x[2] + d[0] * x[1]),
        (2 * m[1] * x[0] + d[1] * x[2], 2 * m[1] * x[1] - j[1], 2 * m[1] * x[2] + d[1] * x[0]),
        (2 * m[2] * x[0] + d[2] * x[1], 2 * m[2] * x[1] + d[2] * x[0], 2 * m[2] * x[2] - j[2]),
    )


@kernel(inline="always")
def _correction(a: Any, f: Any) -> Any:
    """-a⁻¹ f of a 3x3 matrix, by Cramer's rule."""
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = a
    k1, k2, k3 = a22 * a33 - a23 * a32, a23 * a31 - a21 * a33, a21 * a32 - a22 * a31
    scale = -1.0 / (a11 * k1 + a12 * k2 + a13 * k3)
    return (
        scale * (f[0] * k1 + f[1] * (a13 * a32 - a12 * a33) + f[2] * (a12 * a23 - a13 * a22)),
        scale * (f[0] * k2 + f[1] * (a11 * a33 - a13 * a31) + f[2] * (a13 * a21 - a11 * a23)),
        scale * (f[0] * k3 + f[1] * (a12 * a31 - a11 * a32) + f[2] * (a11 * a22 - a12 * a21)),
    )


@kernel(inline="always")
def _residual(m: Any, lost: Any, j: Any, d: Any, x: Any) -> Any:
    """(1 + |x|²) (m + lost) + d (x2 x3, x3 x1, x1 x2) - j x for x of 26 bits: products exact, 1e-16 of the difference."""
    (s, s_low), square = two_sum(x[0] * x[0], x[1] * x[1]), x[2] * x[2]
    s, s_rest = two_sum(s, square)
    n, n_low = two_sum(1.0, s)
    n_low += s_low + s_rest
    return (
        _row_residual(m[0], lost[0], j[0], d[0], n, n_low, x[0], x[1] * x[2]),
        _row_residual(m[1], lost[1], j[1], d[1], n, n_low, x[1], x[2] * x[0]),
        _row_residual(m[2], lost[2], j[2], d[2], n, n_low, x[2], x[0] * x[1]),
    )


@kernel(inline="always")
def _row_residual(m: float, lost: float, j: float, d: float, n: float, n_low: float, x: float, xx: float) -> Any:
    (p, p_low), (q, q_low), (r, r_low) = two_product(n, m), two_product(d, xx), two_product(j, x)
    s, s_low = two_sum(p, q)
    return (s - r) + (s_low + ((p_low + q_low) - r_low) + (n_low * m + n * lost))


@kernel(inline="always")
def _near_root(m: Any, j: Any, d: Any, guess: Any) -> Any:
    """Newton from `guess` until the root is known to about 1e-9, and whether it settled."""
    x = guess
    for _ in range(NEWTON_SWEEPS):
        n = 1.0 + (x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        f1 = (n * m[0] + d[0] * x[1] * x[2]) - j[0] * x[0]
        f2 = (n * m[1] + d[1] * x[2] * x[0]) - j[1] * x[1]
        f3 = (n * m[2] + d[2] * x[0] * x[1]) - j[2] * x[2]
        e = _correction(_slopes(m, j, d, x), (f1, f2, f3))
        x, change = (x[0] + e[0], x[1] + e[1], x[2] + e[2]), abs(e[0]) + abs(e[1]) + abs(e[2])
        if change < 1e-5 * (abs(x[0]) + abs(x[1]) + abs(x[2])) + 1e-300:  # quadratic: x is now off by about its square
            return x, True
        if not change < 1e6:  # also nan
            break
    return x, False


@kernel(inline="always")
def _refined(m: Any, lost: Any, j: Any, d: Any, near: Any) -> Any:
    """The root near `near` as x + low, with a relative error of about 1e-24.

    A root rounded to double precision changes the energy by 4e-19 per step, in one direction. Therefore x is truncated to 26 bits, for
    which the residual f is known to 24 digits, and the remainder r solves a r + |r|² m + d (r2 r3, r3 r1, r1 r2) = -f with the slopes a
    at x. This is exact, since the equation is quadratic.
    """
    x = (halves(near[0])[0], halves(near[1])[0], halves(near[2])[0])
    a, f = _slopes(m, j, d, x), _residual(m, lost, j, d, x)
    r = _correction(a, f)
    s = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    b1, b2, b3 = s * m[0] + d[0] * r[1] * r[2], s * m[1] + d[1] * r[2] * r[0], s * m[2] + d[2] * r[0] * r[1]
    r = _correction(a, (f[0] + b1, f[1] + b2, f[2] + b3))
    y = (x[0] + r[0], x[1] + r[1], x[2] + r[2])
    return y, ((x[0] - y[0]) + r[0], (x[1] - y[1]) + r[1], (x[2] - y[2]) + r[2])


@kernel(inline="always")
def _cayley(row: Any, lost: Any, x: Any) -> None:
    """The body turns by the quaternion (1, x)/√(1 + |x|²), L staying where it is in space."""
    square, square_low = _squared_length(x[0], x[1], x[2])
    y = cross(x, (row[0], row[1], row[2]))
    back = cross(x, y)
    push = 2.0 / (1.0 + square)
    p, p_low = two_product(push, square)
    low = (((2.0 - push) - p) - p_low - push * square_low) / (1.0 + square)
    for i in range(3):
        lost[i] += low * (back[i] - y[i])
        _add(row, lost, i, push * (back[i] - y[i]))
    scale = 1.0 / math.sqrt(1.0 + square)
    _turn_attitude(row, lost, scale, scale * x[0], scale * x[1], scale * x[2])


@kernel(inline="always")
def _nudge(row: Any, lost: Any, x: Any, low: Any) -> None:
    """The additional rotation of x + low relative to x: (1, x + low) ∝ (1, x) (1, e) with e = (low - x × low)/(1 + |x|²)."""
    scale = 1.0 / (1.0 + (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]))
    t = cross(x, low)
    e = (scale * (low[0] - t[0]), scale * (low[1] - t[1]), scale * (low[2] - t[2]))
    momentum_change = cross((row[0], row[1], row[2]), e)
    attitude_change = product((row[3], row[4], row[5], row[6]), (0.0, e[0], e[1], e[2]))
    for i in range(3):
        lost[i] += 2.0 * momentum_change[i]
    for i in range(4):
        lost[3 + i] += attitude_change[i]


@kernel(nogil=True)
def moser_veselov(state: Floats, carry: Floats, scaled: Floats, steps: int) -> int:
    """Steps of the discrete Moser-Veselov map with moments `scaled` = 2J/h (n, 3); return the index of a failed body, or -1."""
    for body in range(state.shape[0]):
        row, lost = state[body], carry[body]
        j1, j2, j3 = scaled[body, 0], scaled[body, 1], scaled[body, 2]
        j, d = (j1, j2, j3), (j2 - j3, j3 - j1, j1 - j2)
        x = (row[0] / j1, row[1] / j2, row[2] / j3)
        before, far = x, x
        for done in range(steps):
            guess = x
            if done > 2:
                guess = (
                    3 * (x[0] - before[0]) + far[0],
                    3 * (x[1] - before[1]) + far[1],
                    3 * (x[2] - before[2]) + far[2],
                )
            far, before = before, x
            m = (row[0], row[1], row[2])
            x, settled = _near_root(m, j, d, guess)
            if not settled:
                return body
            x, low = _refined(m, lost, j, d, x)
            _cayley(row, lost, x)
            _nudge(row, lost, x, low)
    return -1


@kernel()
def turn_body(row: Any, lost: Any, x: float, y: float, z: float) -> None:
    """The body turns by the rotation vector (x, y, z) in body axes while L stays where it is in space."""
    angle = math.sqrt(x * x + y * y + z * z)
    _turn_about(row, lost, x, y, z)
    if angle > 0.0:
        sine = math.sin(angle)
        sine2, sine2_low = two_square(sine)
        v, _ = _versed(sine2, sine2_low, math.cos(angle))
        n = (x / angle, y / angle, z / angle)
        across = cross((row[0], row[1], row[2]), n)
        inward = cross(across, n)
        _add(row, lost, 0, sine * across[0] + v * inward[0])
        _add(row, lost, 1, sine * across[1] + v * inward[1])
        _add(row, lost, 2, sine * across[2] + v * inward[2])


@kernel(nogil=True)
def turn_uniformly(state: Floats, carry: Floats, vectors: Floats) -> None:
    """Each body turns by its rotation vector (n, 3) in body axes while L stays where it is in space."""
    for body in range(state.shape[0]):
        turn_body(state[body], carry[body], vectors[body, 0], vectors[body, 1], vectors[body, 2])


@kernel()
def kick_body(row: Any, lost: Any, torque: Any, time: float) -> None:
    """L gains torque times time."""
    _add(row, lost, 0, time * torque[0])
    _add(row, lost, 1, time * torque[1])
    _add(row, lost, 2, time * torque[2])


@kernel(nogil=True)
def kick(state: Floats, carry: Floats, torque: Floats, time: float) -> None:
    """L of each body gains its torque (n, 3) times time."""
    for body in range(state.shape[0]):
        # components, as in `_driven_kernels`: one signature of `kick_body`
        kick_body(state[body], carry[body], (torque[body, 0], torque[body, 1], torque[body, 2]), time)


def rows(momentum: Floats, attitude: Floats) -> Floats:
    """Rows (n, 7) for the functions above."""
    return np.ascontiguousarray(np.concatenate([momentum, attitude], axis=-1))
