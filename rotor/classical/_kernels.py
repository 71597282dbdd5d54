"""Compiled free steps of very many tops: blocks of 128 bodies side by side, written so that they vectorise.

A block is ten runs of 128 numbers in one flat array: L1 L2 L3, qw qx qy qz, 1/I1 1/I2 1/I3. The offsets between the
runs are constants of the program, so the compiler knows that they do not overlap and handles four or eight bodies with
one instruction; sine and cosine are polynomials for the same reason.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from rotor.rotations import Array

LANES = 128
RUNS = 10
WIDEST_TURN = 0.5  # rad per step: half of it is the largest argument of the polynomials below


@njit(cache=True, inline="always", fastmath={"contract"})
def _sine_cosine(x: Any) -> Any:
    """Taylor polynomials, |x| <= ¼: truncated at x¹³/13! = 2e-18 and x¹⁴/14! = 4e-20.

    Summed by pairs (Estrin): the chain of operations that wait for each other decides the speed.
    """
    y = x * x
    z = y * y
    s = (1.0 / 6.0 - y * (1.0 / 120.0)) + z * ((1.0 / 5040.0 - y * (1.0 / 362880.0)) + z * (1.0 / 39916800.0))
    low = (0.5 - y * (1.0 / 24.0)) + z * (1.0 / 720.0 - y * (1.0 / 40320.0))
    c = low + z * z * (1.0 / 3628800.0 - y * (1.0 / 479001600.0))
    return x - x * y * s, 1.0 - y * c


@njit(cache=True, inline="always", fastmath={"contract"})
def _turned(mk: Any, ma: Any, mb: Any, w: Any, qk: Any, qa: Any, qb: Any, rate: Any) -> Any:
    """L_a, L_b and q after a turn by 2 rate L_k about axis k, (k, a, b) cyclic."""
    s, c = _sine_cosine(rate * mk)
    sine, cosine = 2.0 * s * c, 1.0 - 2.0 * s * s
    ma, mb = cosine * ma + sine * mb, cosine * mb - sine * ma
    return ma, mb, c * w - s * qk, c * qk + s * w, c * qa + s * qb, c * qb - s * qa


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def advance_blocks(data: Array, first: int, last: int, step: float, steps: int) -> None:
    """`steps` steps R1 R2 R3 R2 R1 of blocks first to last - 1; the outer halves of neighbouring steps are merged."""
    if steps == 0:
        return
    for block in range(first, last):
        row = data[block * RUNS * LANES : (block + 1) * RUNS * LANES]
        _first_axis(row, 0.25 * step)
        for _ in range(steps - 1):
            _inner_axes(row, 0.25 * step, 0.5 * step)
        _inner_axes(row, 0.25 * step, 0.25 * step)


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _first_axis(row: Array, quarter: float) -> None:
    for i in range(LANES):
        m1, m2, m3, rate = row[i], row[LANES + i], row[2 * LANES + i], quarter * row[7 * LANES + i]
        w, x, y, z = row[3 * LANES + i], row[4 * LANES + i], row[5 * LANES + i], row[6 * LANES + i]
        m2, m3, w, x, y, z = _turned(m1, m2, m3, w, x, y, z, rate)
        row[LANES + i], row[2 * LANES + i] = m2, m3
        row[3 * LANES + i], row[4 * LANES + i], row[5 * LANES + i], row[6 * LANES + i] = w, x, y, z


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _inner_axes(row: Array, quarter: float, outer: float) -> None:
    """R2 R3 R2 of a step and the turn about axis 1 that ends it, by 2 outer L1/I1."""
    for i in range(LANES):
        m1, m2, m3 = row[i], row[LANES + i], row[2 * LANES + i]
        w, x, y, z = row[3 * LANES + i], row[4 * LANES + i], row[5 * LANES + i], row[6 * LANES + i]
        i1, i2, i3 = row[7 * LANES + i], row[8 * LANES + i], row[9 * LANES + i]
        m3, m1, w, y, z, x = _turned(m2, m3, m1, w, y, z, x, quarter * i2)
        m1, m2, w, z, x, y = _turned(m3, m1, m2, w, z, x, y, 2.0 * quarter * i3)
        m3, m1, w, y, z, x = _turned(m2, m3, m1, w, y, z, x, quarter * i2)
        m2, m3, w, x, y, z = _turned(m1, m2, m3, w, x, y, z, outer * i1)
        row[i], row[LANES + i], row[2 * LANES + i] = m1, m2, m3
        row[3 * LANES + i], row[4 * LANES + i], row[5 * LANES + i], row[6 * LANES + i] = w, x, y, z
