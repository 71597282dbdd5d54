"""Compiled evaluation of the free motion: two phases by double-double products, then a few terms of theta series.

Every function takes plain numbers and rows of `theta.Rows`; the formulas are in the head of `theta.py`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical._kernels import two_product, two_sum
from rotor.classical.free.theta import CIRCULATING, SEPARATRIX, STEADY, Rows
from rotor.geometry._kernels import product
from rotor.kernels import kernel


@kernel(inline="always")
def _phase(t: float, rate_hi: float, rate_lo: float, start_hi: float, start_lo: float) -> Any:
    """t rate + start as an unevaluated sum of two doubles."""
    p, p_low = two_product(t, rate_hi)
    s, s_low = two_sum(p, start_hi)
    return s, s_low + ((p_low + t * rate_lo) + start_lo)


@kernel(inline="always")
def _nearest(hi: float, lo: float) -> Any:
    """The sign (-1)^j of the nearest whole number j, and what is left, in [-½, ½]."""
    j = np.rint(hi)
    rest = (hi - j) + lo  # whole parts cancel exactly, so that the phase keeps the digits of both doubles
    more = np.rint(rest)
    half = 0.5 * (j - 2.0 * np.rint(0.5 * j)) + 0.5 * more  # j modulo 2 is the parity of the half turns
    odd = half != np.rint(half)
    return -1.0 if odd else 1.0, rest - more


@kernel()
def _circulating(r: float, c: Any) -> Any:
    """L in its frame and (α, β) for z = πr, by the series in q and q²."""
    z = math.pi * r
    s1, c1 = math.sin(z), math.cos(z)
    c2, s2 = (c1 - s1) * (c1 + s1), 2.0 * s1 * c1
    c4, s4 = (c2 - s2) * (c2 + s2), 2.0 * s2 * c2
    c6, s6 = c4 * c2 - s4 * s2, s4 * c2 + c4 * s2
    c3, s3 = c2 * c1 - s2 * s1, s2 * c1 + c2 * s1
    c5, s5 = c4 * c1 - s4 * s1, s4 * c1 + c4 * s1
    c7, s7 = c6 * c1 - s6 * s1, s6 * c1 + c6 * s1
    even, odd = 1.0 + c[7] * c4 + c[9] * (c4 - s4) * (c4 + s4), c[6] * c2 + c[8] * c6
    m = 1.0 / (even - odd)
    m1 = c[0] * (c1 + c[3] * c3 + c[4] * c5 + c[5] * c7) * m
    m2 = c[1] * (s1 - c[3] * s3 + c[4] * s5 - c[5] * s7) * m
    m3 = c[2] * (even + odd) * m
    w = 1.0 - c[10] * c2 + c[11] * c4 - c[12] * c6
    k = -c[13] * s2 + c[14] * s4 - c[15] * s6
    x = c[16] * s1 - c[17] * s3 + c[18] * s5
    y = -(c[19] * c1 - c[20] * c3 + c[21] * c5)
    return m1, m2, m3, w, x, y, k


@kernel()
def _near_separatrix(v: float, c: Any) -> Any:
    """L in its frame and (α, β) for v = πu/2K', by the transformed series, everything scaled by e^-|v|."""
    side = -1.0 if v < 0.0 else 1.0
    h = math.exp(-abs(v))
    h2 = h * h
    h3, h4, h5 = h2 * h, h2 * h2, h2 * h2 * h
    h7, h9 = h4 * h3, h4 * h5
    root = c[4] / h if c[4] > 0.0 else 0.0  # √q' e^|v|, at most 1
    g = root * root
    b1, b2, b3 = c[3] * g, c[6] * g * g, c[5] * g * g
    cosh = (1.0 + h2) + b1 * (1.0 + h4 * h2) + b2 * (1.0 + h5 * h5)
    sinh = (1.0 - h2) - b1 * (1.0 - h4 * h2) + b2 * (1.0 - h5 * h5)
    even = 1.0 + b3 * (1.0 + h4 * h4)
    odd = g * (1.0 + h4) + c[8] * g * g * g * (1.0 + h5 * h7)
    m = 1.0 / cosh
    m1 = c[0] * (even - odd) * 2.0 * h * m
    m2 = c[1] * side * sinh * m
    m3 = c[2] * (even + odd) * 2.0 * h * m
    f1, f2 = c[4] * root, c[5] * g
    f3, f4 = c[7] * g * root, c[9] * g * g
    p1, p3, p5, p7, p9 = 1.0 + h, f1 * (1.0 + h3), f2 * (1.0 + h5), f3 * (1.0 + h7), f4 * (1.0 + h9)
    n1, n3, n5, n7, n9 = 1.0 - h, f1 * (1.0 - h3), f2 * (1.0 - h5), f3 * (1.0 - h7), f4 * (1.0 - h9)
    w = c[10] * p1 + c[11] * p3 + c[12] * p5 + c[13] * p7 + c[14] * p9
    k = -side * (c[15] * n1 + c[16] * n3 + c[17] * n5 + c[18] * n7 + c[19] * n9)
    x = side * (c[10] * n1 - c[11] * n3 + c[12] * n5 - c[13] * n7 + c[14] * n9)
    y = -(c[15] * p1 - c[16] * p3 + c[17] * p5 - c[18] * p7 + c[19] * p9)
    return m1, m2, m3, w, x, y, k


@kernel(inline="always")
def _placed(left: Any, right: Any, w: float, x: float, y: float, z: float, half_turn: float, out: Any) -> None:
    """left e^{i half turn} (α, β) right at unit length."""
    scale = 1.0 / math.sqrt((w * w + z * z) + (x * x + y * y))
    about_l = (scale * math.cos(half_turn), 0.0, 0.0, scale * math.sin(half_turn))
    q = product(product(left, product(about_l, (w, x, y, z))), right)
    out[0], out[1], out[2], out[3] = q


@kernel(nogil=True)
def evaluate(rows: Rows, times: Floats, momentum: Floats, attitude: Floats) -> None:
    """Momentum (n, t, 3) and attitude (n, t, 4) of n bodies at t times."""
    for b in range(rows.kind.shape[0]):
        kind, rate, c, sign, axis = rows.kind[b], rows.rates[b], rows.series[b], rows.signs[b], rows.axes[b]
        for i in range(times.shape[0]):
            t = times[i]
            hi, lo = _phase(t, rate[4], rate[5], 0.0, 0.0)
            _, turn = _nearest(hi, lo)
            half_turn = 2.0 * math.pi * turn
            if kind == STEADY:
                for k in range(3):
                    momentum[b, i, k] = rows.momentum0[b, k]
                _placed(rows.left[b], rows.right[b], 1.0, 0.0, 0.0, 0.0, half_turn, attitude[b, i])
                continue
            hi, lo = _phase(t, rate[0], rate[1], rate[2], rate[3])
            if kind == SEPARATRIX:
                parity, v = 1.0, hi + lo
                m1, m2, m3, w, x, y, z = _near_separatrix(v, c)
            else:
                parity, r = _nearest(hi, lo)
                if kind == CIRCULATING:
                    m1, m2, m3, w, x, y, z = _circulating(r, c)
                else:
                    m1, m2, m3, w, x, y, z = _near_separatrix(r * rows.shift[b, 0], c)
                    half_turn += r * rows.shift[b, 1]
            momentum[b, i, axis[0]] = sign[0] * parity * m1
            momentum[b, i, axis[1]] = sign[1] * parity * m2
            momentum[b, i, axis[2]] = sign[2] * m3
            _placed(rows.left[b], rows.right[b], w, parity * x, parity * y, z, half_turn, attitude[b, i])
