"""Wigner's 3j, 6j and 9j symbols for arrays of quantum numbers, integer or half-integer, to J = 1000 and beyond.

3j and 6j are Racah's finite sums (https://functions.wolfram.com 07.39.06.0003, https://dlmf.nist.gov/34.4 eq. 34.4.2):

    (j1 j2 j3; m1 m2 m3)  = (-1)^(j1-j2-m3) √[Δ²(j1 j2 j3) ∏ (ji+mi)! (ji-mi)!] Σ_t (-1)^t / ∏ (x-t)! ∏ (t-y)!
    {j1 j2 j3; l1 l2 l3}  = √[Δ² Δ² Δ² Δ²] Σ_t (-1)^t (t+1)! / ∏ (x-t)! ∏ (t-y)!
    Δ²(a b c)             = (a+b-c)! (a-b+c)! (-a+b+c)! / (a+b+c+1)!

with three x and three y, or three x and four y. Factorials come from a table of correctly rounded mantissas and their
exponents of two. The terms over the first one are added in floating point for whole arrays; where they cancel by more
than `CANCELLATION`, the sum is made once more, exactly, in Python's integers. So every symbol is right to some 1e-15 of
itself, and what is zero is zero. With one small number among j1, j2, j3 there are few terms, and any J is fast; three
large J go to the integers one by one (about 20 ms at J = 1000).

Arguments are the quantum numbers themselves (2.5 for 5/2), scalars or arrays that broadcast. A symbol that breaks a
triangle rule, or |m| ≤ j, or m1 + m2 + m3 = 0, is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import prod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints

Scaled = tuple[Floats, Ints]  # mantissas and exponents of 2

CANCELLATION = 32.0  # Σ|term| / |Σ term| above which the sum is made in integers


# The symbols


def three_j(j1: ArrayLike, j2: ArrayLike, j3: ArrayLike, m1: ArrayLike, m2: ArrayLike, m3: ArrayLike) -> Floats:
    """Wigner's 3j symbols (j1 j2 j3; m1 m2 m3) of arrays that broadcast, right to some 1e-15 of themselves; 0 where a rule forbids them.

    Raises ValueError for a number that is not a multiple of ½, a negative j, and an m that does not belong to its j.

    >>> round(float(three_j(2, 1, 1, 0, 0, 0)) ** 2 * 15, 12)
    2.0
    >>> three_j(0.5, 0.5, [0, 1], 0.5, -0.5, 0).round(6).tolist()
    [0.707107, 0.408248]
    """
    arguments = _doubled(j1, j2, j3, m1, m2, m3)
    j, m = arguments[:3], arguments[3:]
    _refuse_negative(j)
    if ((j + m) % 2).any():
        raise ValueError("a 3j symbol: m is a half-integer where its j is one, and an integer where j is one")
    allowed = _triangle(*j) & (m.sum(axis=0) == 0) & (np.abs(m) <= j).all(axis=0)
    return _where(allowed, arguments, _three_j)


def six_j(j1: ArrayLike, j2: ArrayLike, j3: ArrayLike, l1: ArrayLike, l2: ArrayLike, l3: ArrayLike) -> Floats:
    """Wigner's 6j symbols {j1 j2 j3; l1 l2 l3} of arrays that broadcast, right to some 1e-15 of themselves; 0 where a rule forbids them.

    Raises ValueError for a number that is negative or not a multiple of ½.

    >>> round(float(six_j(1, 1, 1, 1, 1, 1)) * 6, 12)
    1.0
    """
    arguments = _doubled(j1, j2, j3, l1, l2, l3)
    _refuse_negative(arguments)
    a, b, c, d, e, f = arguments
    allowed = _triangle(a, b, c) & _triangle(a, e, f) & _triangle(d, b, f) & _triangle(d, e, c)
    return _where(allowed, arguments, _six_j)


def nine_j(rows: ArrayLike) -> Floats:
    """Wigner's 9j symbols of arrays (..., 3, 3), rows as they are printed.

    Σ_x (-1)^2x (2x+1) {j11 j21 j31; j32 j33 x} {j12 j22 j32; j21 x j23} {j13 j23 j33; x j11 j12} (DLMF 34.6.2).

    >>> round(float(nine_j([[1, 1, 0], [1, 1, 0], [0, 0, 0]])), 12)  # with zeros: one over √(3 · 3)
    0.333333333333
    """
    table = np.asarray(rows, dtype=float)
    if table.shape[-2:] != (3, 3):
        raise ValueError(f"a 9j symbol has rows (..., 3, 3), found the shape {table.shape}")
    (a, b, c), (d, e, f), (g, h, i) = (tuple(table[..., row, column] for column in range(3)) for row in range(3))
    _refuse_negative(_doubled(*table.reshape(-1, 9).T))
    least = np.max(np.abs([a - i, d - h, b - f]), axis=0)
    terms = np.min([a + i, d + h, b + f], axis=0) - least
    total = np.zeros(table.shape[:-2])
    for x in (least + step for step in range(int(terms.max(initial=-1)) + 1)):  # beyond the last term symbols are 0
        term = six_j(a, d, g, h, i, x) * six_j(b, e, h, d, x, f) * six_j(c, f, i, x, a, b)
        total += np.where(2 * x % 2, -1.0, 1.0) * (2 * x + 1) * term
    return np.asarray(total)


# Arguments


def _doubled(*numbers: ArrayLike) -> Ints:
    """Twice the arguments as integers, (number of arguments, ...) after broadcasting."""
    twice = 2 * np.stack(np.broadcast_arrays(*[np.asarray(number, dtype=float) for number in numbers]))
    whole = np.rint(twice)
    if not np.array_equal(whole, twice):
        wrong = twice[whole != twice].flat[0] / 2
        raise ValueError(f"quantum number {wrong}: angular momenta are multiples of 1/2")
    return np.asarray(whole, dtype=np.int64)


def _refuse_negative(j: Ints) -> None:
    if (j < 0).any():
        raise ValueError(f"quantum number {j.min() / 2}: an angular momentum is 0 or more")


def _triangle(a: Ints, b: Ints, c: Ints) -> NDArray[np.bool_]:
    return np.asarray((np.abs(a - b) <= c) & (c <= a + b) & ((a + b + c) % 2 == 0))


def _where(allowed: NDArray[np.bool_], arguments: Ints, sums: Callable[[Ints], Floats]) -> Floats:
    """`sums` of the allowed arguments, 0 of the others."""
    out = np.zeros(allowed.shape)
    if allowed.any():
        out[allowed] = sums(arguments[:, allowed])
    return out


# Racah's sums, of arguments (6, n) that all are allowed


def _three_j(arguments: Ints) -> Floats:
    a, b, c, p, q, r = arguments
    falling = [(a + b - c) // 2, (a - p) // 2, (b + q) // 2]
    rising = [0 * a, (b - c - p) // 2, (a - c + q) // 2]
    triangle, whole = _delta(a, b, c)
    pairs = [(j + side * m) // 2 for j, m in ((a, p), (b, q), (c, r)) for side in (1, -1)]
    sign = np.where((a - b - r) // 2 % 2, -1.0, 1.0)
    return sign * _racah(falling, rising, False, triangle + pairs, [whole])


def _six_j(arguments: Ints) -> Floats:
    a, b, c, d, e, f = arguments
    falling = [(a + b + d + e) // 2, (b + c + e + f) // 2, (c + a + f + d) // 2]
    rising = [(a + b + c) // 2, (a + e + f) // 2, (d + b + f) // 2, (d + e + c) // 2]
    triangles = [_delta(*three) for three in ((a, b, c), (a, e, f), (d, b, f), (d, e, c))]
    above = [number for numbers, _ in triangles for number in numbers]
    return _racah(falling, rising, True, above, [whole for _, whole in triangles])


def _delta(a: Ints, b: Ints, c: Ints) -> tuple[list[Ints], Ints]:
    """Whose factorials make Δ²: three above, one below."""
    return [(a + b - c) // 2, (a - b + c) // 2, (b + c - a) // 2], (a + b + c) // 2 + 1


def _racah(falling: list[Ints], rising: list[Ints], growing: bool, above: list[Ints], below: list[Ints]) -> Floats:
    """√(∏ above!/∏ below!) Σ_t (-1)^t [(t+1)!] / ∏ (x-t)! ∏ (t-y)!, (t+1)! where `growing`: first term times a sum of ratios."""
    t, last = np.max(rising, axis=0), np.min(falling, axis=0)
    first, power = _factorials([t + 1] if growing else [], [x - t for x in falling] + [t - y for y in rising])
    root, twice = _factorials(above, below)
    odd = twice % 2

    total, safe = _sum_of_ratios(falling, rising, growing, t, last)
    power += (twice - odd) // 2
    for place in np.flatnonzero(~safe):
        x, y = ([int(array[place]) for array in arrays] for arrays in (falling, rising))
        total[place], shift = _exact_sum_of_ratios(x, y, growing, int(t[place]), int(last[place]))
        power[place] += shift
    return np.asarray(np.ldexp(np.where(t % 2, -1.0, 1.0) * first * total * np.sqrt(np.ldexp(root, odd)), power))


@lru_cache(maxsize=4)
def _factorial_table(size: int) -> Scaled:
    """n! = mantissa · 2^exponent, every mantissa correctly rounded, for n below `size`."""
    mantissas, exponents, value = np.empty(size), np.empty(size, dtype=np.int64), 1
    for n in range(size):
        value *= n or 1
        exponents[n] = value.bit_length()
        mantissas[n] = value / (1 << value.bit_length())
    return mantissas, exponents


def _factorials(above: list[Ints], below: list[Ints]) -> Scaled:
    """∏ above! / ∏ below! as mantissa and exponent."""
    largest = max(int(array.max()) for array in above + below)
    mantissas, exponents = _factorial_table(1 << (largest + 1).bit_length())
    mantissa, exponent = np.ones(len(below[0])), np.zeros(len(below[0]), dtype=np.int64)
    for numbers in above:
        mantissa *= mantissas[numbers]
        exponent += exponents[numbers]
    for numbers in below:
        mantissa /= mantissas[numbers]
        exponent -= exponents[numbers]
    return mantissa, exponent


def _sum_of_ratios(
    falling: list[Ints], rising: list[Ints], growing: bool, t: Ints, last: Ints
) -> tuple[Floats, NDArray[np.bool_]]:
    """Σ of the terms from t to `last` over the first, in floating point, and where cancellation leaves its digits safe.

    One ratio is -[(t+2)] ∏ (x-t) / ∏ (t+1-y).
    """
    ratio, total, size = np.ones(len(t)), np.ones(len(t)), np.ones(len(t))
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is not safe
        for step in range(int((last - t).max())):
            at = t + step
            ratio *= -np.prod([np.maximum(x - at, 0).astype(float) for x in falling], axis=0)
            ratio /= np.prod([at + 1.0 - y for y in rising], axis=0)
            if growing:
                ratio *= at + 2.0
            total += ratio
            size += np.abs(ratio)
        return total, size * (last - t + 1) <= CANCELLATION * np.abs(total)


def _exact_sum_of_ratios(falling: list[int], rising: list[int], growing: bool, t: int, last: int) -> tuple[float, int]:
    """The sum of ratios of a single symbol in integers, by Horner's rule from the last ratio, as mantissa and exponent."""
    n, d = 1, 1
    for at in range(last - 1, t - 1, -1):
        up = -prod(x - at for x in falling) * (at + 2 if growing else 1)
        down = prod(at + 1 - y for y in rising)
        n, d = down * d + up * n, down * d
    shift = n.bit_length() - d.bit_length()
    return (n / (d << shift) if shift >= 0 else (n << -shift) / d), shift
