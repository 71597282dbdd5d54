"""Compiled steps of the geometric integrators on rows (L1, L2, L3, qw, qx, qy, qz), with compensated sums.

Rounding must not pile up in one direction, or energy, |L| and |q| drift in proportion to the number of steps. Three
things keep it from that. A rotation is applied as its increment, and what rounding loses of each sum is carried into
the next one (Kahan 1965, with Knuth's exact sum). The sine and 1 - cosine of a turn belong together to beyond double
precision (`_versed`), so that even the same turn made 10⁸ times neither stretches nor shrinks. The turn of the
Moser-Veselov map is the root of its equation to beyond double precision (`_refined`), and the moments of the map lie on
a grid on which their differences are exact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from rotor.arrays import Floats

NEWTON_SWEEPS = 40
SPLITTER = 134217729.0  # 2^27 + 1


@njit(cache=True, inline="always")
def _add(row: Any, lost: Any, i: int, increment: float) -> None:
    old = row[i]
    y = increment + lost[i]
    s = old + y
    b = s - old
    lost[i] = (old - (s - b)) + (y - b)
    row[i] = s


@njit(cache=True, inline="always")
def _halves(x: float) -> Any:
    """x as the sum of a number of 26 bits and the rest (Veltkamp)."""
    t = SPLITTER * x
    high = t - (t - x)
    return high, x - high


@njit(cache=True, inline="always")
def _product(a: float, b: float) -> Any:
    """a b as the sum of two doubles (Dekker)."""
    (ah, al), (bh, bl), p = _halves(a), _halves(b), a * b
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@njit(cache=True, inline="always")
def _sum(a: float, b: float) -> Any:
    """a + b as the sum of two doubles (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@njit(cache=True, inline="always")
def _square(x: float) -> Any:
    """x² as the sum of two doubles."""
    high, low = _halves(x)
    p = x * x
    return p, ((high * high - p) + 2.0 * high * low) + low * low


@njit(cache=True, inline="always")
def _squared_length(x: float, y: float, z: float) -> Any:
    """x² + y² + z² as the sum of two doubles."""
    (a, al), (b, bl), (c, cl) = _square(x), _square(y), _square(z)
    s, rest = _sum(a, b)
    total, more = _sum(s, c)
    return total, (rest + more) + (al + bl + cl)


@njit(cache=True, inline="always")
def _versed(square: float, square_low: float, cosine: float) -> Any:
    """v + l = 1 - cosine with (1 - v - l)² + sine² = 1, from the sine's square in two doubles and a rounded cosine."""
    v = square / (1.0 + cosine) if cosine > 0.0 else 1.0 - cosine
    v2, v2_low = _square(v)
    rest = ((square - 2.0 * v) + v2) + (v2_low + square_low)
    return v, rest / (2.0 * cosine) if cosine > 0.1 else 0.0


@njit(cache=True, inline="always")
def _turn_momentum(row: Any, lost: Any, a: int, b: int, sine: float, cosine: float) -> None:
    """Components a, b of L as seen from a body that turns about the third axis."""
    square, square_low = _square(sine)
    v, low = _versed(square, square_low, cosine)
    ma, mb = row[a], row[b]
    lost[a] -= low * ma
    lost[b] -= low * mb
    _add(row, lost, a, sine * mb - v * ma)
    _add(row, lost, b, -sine * ma - v * mb)


@njit(cache=True, inline="always")
def _turn_attitude(row: Any, lost: Any, cosine: float, x: float, y: float, z: float) -> None:
    """q (cosine, x, y, z), added as an increment."""
    square, square_low = _squared_length(x, y, z)
    v, low = _versed(square, square_low, cosine)
    qw, qx, qy, qz = row[3], row[4], row[5], row[6]
    for i in range(3, 7):
        lost[i] -= low * row[i]
    _add(row, lost, 3, -v * qw - qx * x - qy * y - qz * z)
    _add(row, lost, 4, -v * qx + qw * x + qy * z - qz * y)
    _add(row, lost, 5, -v * qy + qw * y + qz * x - qx * z)
    _add(row, lost, 6, -v * qz + qw * z + qx * y - qy * x)


@njit(cache=True, inline="always")
def _turn(row: Any, lost: Any, k: int, a: int, b: int, angle: float) -> None:
    """The body turns by `angle` about its axis k of (k, a, b) = a cyclic order of (0, 1, 2)."""
    s, c = math.sin(0.5 * angle), math.cos(0.5 * angle)
    _turn_momentum(row, lost, a, b, 2.0 * s * c, 1.0 - 2.0 * s * s)
    x, y, z = (s if k == 0 else 0.0), (s if k == 1 else 0.0), (s if k == 2 else 0.0)
    _turn_attitude(row, lost, c, x, y, z)


@njit(cache=True, inline="always")
def _turn_about(row: Any, lost: Any, x: float, y: float, z: float) -> None:
    """The body turns by the rotation vector (x, y, z), L staying where it is in the body."""
    half = 0.5 * math.sqrt(x * x + y * y + z * z)
    scale = 0.5 * math.sin(half) / half if half > 0.0 else 0.5
    _turn_attitude(row, lost, math.cos(half), scale * x, scale * y, scale * z)


@njit(cache=True, nogil=True)
def rotations(state: Floats, carry: Floats, inverse: Floats, step: float, fractions: Floats, steps: int) -> None:
    """Steps R1 R2 R3 R2 R1 of half, half, whole, half, half turns about the body's axes, composed with `fractions`."""
    for body in range(state.shape[0]):
        row, lost = state[body], carry[body]
        i0, i1, i2 = inverse[body, 0], inverse[body, 1], inverse[body, 2]
        for _ in range(steps):
            for fraction in fractions:
                h = fraction * step
                _turn(row, lost, 0, 1, 2, 0.5 * h * i0 * row[0])
                _turn(row, lost, 1, 2, 0, 0.5 * h * i1 * row[1])
                _turn(row, lost, 2, 0, 1, h * i2 * row[2])
                _turn(row, lost, 1, 2, 0, 0.5 * h * i1 * row[1])
                _turn(row, lost, 0, 1, 2, 0.5 * h * i0 * row[0])


@njit(cache=True, nogil=True)
def symmetric(
    state: Floats, carry: Floats, inverse: Floats, axes: Any, step: float, fractions: Floats, steps: int
) -> None:
    """Strang steps of half an outer turn, an inner turn, half an outer turn; axes (n, 3) of (outer, inner, sphere).

    The flow of the sphere commutes with the turns: it is made at the end, for all steps at once.
    """
    for body in range(state.shape[0]):
        row, lost = state[body], carry[body]
        a, b, equal = axes[body, 0], axes[body, 1], inverse[body, axes[body, 2]]
        outer, inner = inverse[body, a] - equal, inverse[body, b] - equal
        a1, a2, b1, b2 = (a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3
        for _ in range(steps):
            for fraction in fractions:
                h = fraction * step
                _turn(row, lost, a, a1, a2, 0.5 * h * outer * row[a])
                _turn(row, lost, b, b1, b2, h * inner * row[b])
                _turn(row, lost, a, a1, a2, 0.5 * h * outer * row[a])
        whole = steps * step * equal
        _turn_about(row, lost, whole * row[0], whole * row[1], whole * row[2])


@njit(cache=True, inline="always")
def _slopes(m: Any, j: Any, d: Any, x: Any) -> Any:
    """Derivatives of (1 + |x|²) m + d (x2 x3, x3 x1, x1 x2) - j x by x, in rows."""
    return (
        (2 * m[0] * x[0] - j[0], 2 * m[0] * x[1] + d[0] * x[2], 2 * m[0] * x[2] + d[0] * x[1]),
        (2 * m[1] * x[0] + d[1] * x[2], 2 * m[1] * x[1] - j[1], 2 * m[1] * x[2] + d[1] * x[0]),
        (2 * m[2] * x[0] + d[2] * x[1], 2 * m[2] * x[1] + d[2] * x[0], 2 * m[2] * x[2] - j[2]),
    )


@njit(cache=True, inline="always")
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


@njit(cache=True, inline="always")
def _residual(m: Any, lost: Any, j: Any, d: Any, x: Any) -> Any:
    """(1 + |x|²) (m + lost) + d (x2 x3, x3 x1, x1 x2) - j x for x of 26 bits: products exact, 1e-16 of the difference."""
    (s, s_low), square = _sum(x[0] * x[0], x[1] * x[1]), x[2] * x[2]
    s, s_rest = _sum(s, square)
    n, n_low = _sum(1.0, s)
    n_low += s_low + s_rest
    return (
        _row_residual(m[0], lost[0], j[0], d[0], n, n_low, x[0], x[1] * x[2]),
        _row_residual(m[1], lost[1], j[1], d[1], n, n_low, x[1], x[2] * x[0]),
        _row_residual(m[2], lost[2], j[2], d[2], n, n_low, x[2], x[0] * x[1]),
    )


@njit(cache=True, inline="always")
def _row_residual(m: float, lost: float, j: float, d: float, n: float, n_low: float, x: float, xx: float) -> Any:
    (p, p_low), (q, q_low), (r, r_low) = _product(n, m), _product(d, xx), _product(j, x)
    s, s_low = _sum(p, q)
    return (s - r) + (s_low + ((p_low + q_low) - r_low) + (n_low * m + n * lost))


@njit(cache=True, inline="always")
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
        if change < 1e-5 * (abs(x[0]) + abs(x[1]) + abs(x[2])) + 1e-300:
            return x, True
        if not change < 1e6:
            break
    return x, False


@njit(cache=True, inline="always")
def _refined(m: Any, lost: Any, j: Any, d: Any, near: Any) -> Any:
    """The root near `near` as x + low, to some 1e-24 of itself.

    A root that is only rounded leaves 4e-19 of the energy behind in each step, in one direction. So x is cut to 26 bits,
    where its residual f is known to 24 digits, and the rest r solves a r + |r|² m + d (r2 r3, r3 r1, r1 r2) = -f, a the
    slopes at x: the equation is quadratic, there are no further terms.
    """
    x = (_halves(near[0])[0], _halves(near[1])[0], _halves(near[2])[0])
    a, f = _slopes(m, j, d, x), _residual(m, lost, j, d, x)
    r = _correction(a, f)
    s = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    b1, b2, b3 = s * m[0] + d[0] * r[1] * r[2], s * m[1] + d[1] * r[2] * r[0], s * m[2] + d[2] * r[0] * r[1]
    r = _correction(a, (f[0] + b1, f[1] + b2, f[2] + b3))
    y = (x[0] + r[0], x[1] + r[1], x[2] + r[2])
    return y, ((x[0] - y[0]) + r[0], (x[1] - y[1]) + r[1], (x[2] - y[2]) + r[2])


@njit(cache=True, inline="always")
def _cayley(row: Any, lost: Any, x: Any) -> None:
    """The body turns by the quaternion (1, x)/√(1 + |x|²), L staying where it is in space."""
    square, square_low = _squared_length(x[0], x[1], x[2])
    m1, m2, m3 = row[0], row[1], row[2]
    y1, y2, y3 = x[1] * m3 - x[2] * m2, x[2] * m1 - x[0] * m3, x[0] * m2 - x[1] * m1
    push = 2.0 / (1.0 + square)
    z1, z2, z3 = x[1] * y3 - x[2] * y2 - y1, x[2] * y1 - x[0] * y3 - y2, x[0] * y2 - x[1] * y1 - y3
    product, product_low = _product(push, square)
    low = (((2.0 - push) - product) - product_low - push * square_low) / (1.0 + square)
    lost[0] += low * z1
    lost[1] += low * z2
    lost[2] += low * z3
    _add(row, lost, 0, push * z1)
    _add(row, lost, 1, push * z2)
    _add(row, lost, 2, push * z3)
    scale = 1.0 / math.sqrt(1.0 + square)
    _turn_attitude(row, lost, scale, scale * x[0], scale * x[1], scale * x[2])


@njit(cache=True, inline="always")
def _nudge(row: Any, lost: Any, x: Any, low: Any) -> None:
    """What x + low turns beyond x: (1, x + low) is (1, x) (1, e) at another length, e = (low - x × low)/(1 + |x|²)."""
    scale = 1.0 / (1.0 + (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]))
    e1 = scale * (low[0] - x[1] * low[2] + x[2] * low[1])
    e2 = scale * (low[1] - x[2] * low[0] + x[0] * low[2])
    e3 = scale * (low[2] - x[0] * low[1] + x[1] * low[0])
    m1, m2, m3, w, q1, q2, q3 = row
    lost[0] += 2.0 * (m2 * e3 - m3 * e2)
    lost[1] += 2.0 * (m3 * e1 - m1 * e3)
    lost[2] += 2.0 * (m1 * e2 - m2 * e1)
    lost[3] -= q1 * e1 + q2 * e2 + q3 * e3
    lost[4] += w * e1 + q2 * e3 - q3 * e2
    lost[5] += w * e2 + q3 * e1 - q1 * e3
    lost[6] += w * e3 + q1 * e2 - q2 * e1


@njit(cache=True, nogil=True)
def moser_veselov(state: Floats, carry: Floats, scaled: Floats, steps: int) -> int:
    """Steps of the discrete Moser-Veselov map with moments `scaled` = 2J/h (n, 3); the body that failed, or -1."""
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


@njit(cache=True, nogil=True)
def turn_uniformly(state: Floats, carry: Floats, vectors: Floats) -> None:
    """Each body turns by its rotation vector (n, 3) in body axes while L stays where it is in space."""
    for body in range(state.shape[0]):
        row, lost = state[body], carry[body]
        x, y, z = vectors[body, 0], vectors[body, 1], vectors[body, 2]
        angle = math.sqrt(x * x + y * y + z * z)
        _turn_about(row, lost, x, y, z)
        if angle == 0.0:
            continue
        sine = math.sin(angle)
        square, square_low = _square(sine)
        v, _ = _versed(square, square_low, math.cos(angle))
        x, y, z = x / angle, y / angle, z / angle
        m1, m2, m3 = row[0], row[1], row[2]
        u1, u2, u3 = m2 * z - m3 * y, m3 * x - m1 * z, m1 * y - m2 * x
        _add(row, lost, 0, sine * u1 + v * (u2 * z - u3 * y))
        _add(row, lost, 1, sine * u2 + v * (u3 * x - u1 * z))
        _add(row, lost, 2, sine * u3 + v * (u1 * y - u2 * x))


@njit(cache=True, nogil=True)
def kick(state: Floats, carry: Floats, torque: Floats, time: float) -> None:
    """L gains torque (n, 3) times time."""
    for body in range(state.shape[0]):
        for i in range(3):
            _add(state[body], carry[body], i, time * torque[body, i])


def rows(momentum: Floats, attitude: Floats) -> Floats:
    """Rows (n, 7) for the functions above."""
    return np.ascontiguousarray(np.concatenate([momentum, attitude], axis=-1))
