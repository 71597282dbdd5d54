"""Elliptic integrals to 31 digits: complete ones by the arithmetic-geometric mean, the first kind by duplication.

All functions use the complementary parameter mc = k'² = 1 - k² instead of k², to avoid cancellation for k near 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.classical.free.double_double import DoubleDouble

MAX_ROUNDS = 100  # a bound: the mean converges quadratically, duplication by a factor of 4 a round


@dataclass(frozen=True)
class Complete:
    """Complete integrals for parameters (mc, p).

    mean: M(1, k'), so that K = π / (2 M).
    third: RJ(0, mc, 1, p) / (3 K), so that Π(n)/K = 1 + n third at p = 1 - n.
    """

    mean: DoubleDouble
    third: DoubleDouble


def complete(mc: DoubleDouble, p: DoubleDouble) -> Complete:
    """M(1, √mc) and RJ(0, mc, 1, p)/(3K) for 0 < mc <= 1, p > 0, both by one run of the mean.

    With a, g the two means, p_0 = √p, p_{n+1} = (p_n² + a_n g_n)/(2 p_n), ε_n = (p_n² - a_n g_n)/(p_n² + a_n g_n) and
    Q_0 = 1, Q_{n+1} = ½ Q_n ε_n:  Π(n)/K = 1 + n/(2(1 - n)) Σ Q  (NIST DLMF 19.8.5 to 19.8.7), p = 1 - n.

    >>> round(float(complete(DoubleDouble.exact(0.5), DoubleDouble.exact(2.0)).mean.hi), 12)  # π / (2 · 1.854074677301)
    0.847213084794
    """
    a, g, root = DoubleDouble.exact(np.ones_like(mc.hi)), mc.sqrt(), p.sqrt()
    q = total = a
    for _ in range(MAX_ROUNDS):
        square, product = root * root, a * g
        q = q * (square - product) / (square + product) * 0.5
        root = (square + product) / (root + root)
        total = total + q
        a, g = (a + g).scaled(0.5), product.sqrt()
        # both doubles hold 1e-32; convergence is quadratic
        if np.all(np.abs(q.hi) < 1e-33 * np.abs(total.hi)) and np.all(np.abs((a - g).hi) < 1e-31 * a.hi):
            return Complete(a, total / (p + p))
    raise ValueError(
        f"the arithmetic-geometric mean did not settle in {MAX_ROUNDS} rounds for mc = {mc.hi}, p = {p.hi}"
    )


def carlson_rf(x: DoubleDouble, y: DoubleDouble, z: DoubleDouble) -> DoubleDouble:
    """RF(x, y, z) = ½ ∫ dt / √((t+x)(t+y)(t+z)), at most one argument zero, by duplication.

    B. C. Carlson, Numer. Algorithms 10, 13 (1995); the remainder series NIST DLMF 19.36.1 to the fifth order, whose
    neglected terms of the sixth order are below 1e-32 when the arguments agree to 2e-6.

    >>> one = DoubleDouble.exact(1.0)
    >>> float(carlson_rf(DoubleDouble.exact(0.0), one, one).hi) == np.pi / 2
    True
    """
    for _ in range(MAX_ROUNDS):
        mean = (x + y + z) / 3.0
        spread = np.maximum(np.abs((x - mean).hi), np.abs((y - mean).hi))
        if np.all(spread < 1e-6 * mean.hi):  # the series below has an error of order spread⁶
            return _rf_series(mean, x, y)
        rx, ry, rz = x.sqrt(), y.sqrt(), z.sqrt()
        shift = rx * ry + rx * rz + ry * rz
        x, y, z = ((v + shift).scaled(0.25) for v in (x, y, z))
    raise ValueError(f"Carlson's duplication did not settle in {MAX_ROUNDS} rounds")


def _rf_series(mean: DoubleDouble, x: DoubleDouble, y: DoubleDouble) -> DoubleDouble:
    dx, dy = 1.0 - x / mean, 1.0 - y / mean
    dz = -(dx + dy)
    e2, e3 = dx * dy - dz * dz, dx * dy * dz
    # Carlson's expansion to fifth order (DLMF 19.36.1)
    series = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - e2 * e3 * 3.0 / 44.0
    return series / mean.sqrt()
