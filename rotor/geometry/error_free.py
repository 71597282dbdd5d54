"""Exact rounding errors of sums and products of doubles.

The functions accept floats or arrays; `_kernels.py` compiles them for kernels.

T. J. Dekker, Numer. Math. 18, 224 (1971); D. E. Knuth, The Art of Computer Programming, volume 2, section 4.2.2.
"""

from __future__ import annotations

from typing import Any

SPLITTER = 134217729.0  # 2^27 + 1


def halves(a: Any) -> Any:
    """a split into a number of 26 bits and the remainder (Veltkamp); overflows for |a| above 1e300.

    >>> halves(1.0 + 2.0**-30) == (1.0, 2.0**-30)
    True
    """
    c = SPLITTER * a
    high = c - (c - a)
    return high, a - high


def two_sum(a: Any, b: Any) -> Any:
    """The rounded sum and its rounding error (Knuth).

    >>> two_sum(1.0, 1e-20)
    (1.0, 1e-20)
    """
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(a: Any, b: Any) -> Any:
    """The rounded product and its rounding error (Dekker).

    >>> two_product(1.0 + 2.0**-30, 1.0 - 2.0**-30) == (1.0, -(2.0**-60))
    True
    """
    a_high, a_low = halves(a)
    b_high, b_low = halves(b)
    p = a * b
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


def two_square(a: Any) -> Any:
    """The rounded square and its rounding error, with one splitting.

    >>> two_square(1.0 + 2.0**-30) == (1.0 + 2.0**-29, 2.0**-60)
    True
    """
    high, low = halves(a)
    p = a * a
    return p, ((high * high - p) + 2.0 * high * low) + low * low
