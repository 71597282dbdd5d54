"""Catalogue lines as a matrix of characters, whole columns at a time: the plain form of `_kernels`."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.formats.spcat.fields import BLANK, QUANTUM_RANGE, spell_degeneracy, spell_quantum

Text = NDArray[np.uint8]
Mask = NDArray[np.bool_]

FREQUENCY, ERROR, LGINT, DR = slice(0, 13), slice(13, 21), slice(21, 29), slice(29, 31)
ENERGY, DEGENERACY, TAG, QNFMT = slice(31, 41), slice(41, 44), slice(44, 51), slice(51, 55)
QUANTA = 55  # where the quantum numbers begin

_BLANK, _MINUS, _POINT, _ZERO = (ord(c) for c in " -.0")


class Columns(NamedTuple):
    """The numbers of some lines, column by column; the names are those of `Catalogue`."""

    frequency_mhz: NDArray[np.float64]
    error_mhz: NDArray[np.float64]
    lgint: NDArray[np.float64]
    dr: NDArray[np.int16]
    energy_lower_cm: NDArray[np.float64]
    g_upper: NDArray[np.int32]
    tag: NDArray[np.int32]
    qnfmt: NDArray[np.int32]
    quanta_upper: NDArray[np.int16]
    quanta_lower: NDArray[np.int16]


@cache
def quantum_table() -> Text:
    """Two characters for each quantum number, (630, 2): row 0 is blank, row i spells QUANTUM_RANGE[0] + i - 1."""
    values = [BLANK, *range(QUANTUM_RANGE[0], QUANTUM_RANGE[1] + 1)]
    return np.frombuffer("".join(map(spell_quantum, values)).encode(), dtype=np.uint8).reshape(-1, 2)


@cache
def degeneracy_table() -> Text:
    """Three characters for each degeneracy from 0 to 3599, (3600, 3)."""
    return np.frombuffer("".join(map(spell_degeneracy, range(3600))).encode(), dtype=np.uint8).reshape(-1, 3)


def round_decimal(values: NDArray[np.float64], decimals: int) -> tuple[NDArray[np.int64], Mask]:
    """|values| in units of the last decimal, rounded as printf does, and whether they are small enough for that.

    printf rounds the exact binary value, ties to even. The product a s of a value and 10^decimals is p + e with p
    its nearest double and e the rest, which Dekker's splitting gives exactly (Numer. Math. 18, 224 (1971)): the
    sign of (p - floor(p) - 1/2) + e decides.
    """
    scale = 10.0**decimals
    a = np.abs(values)
    fits = a < 2.0**52 / scale  # false for nan
    a = np.where(fits, a, 0.0)
    product = a * scale
    split = a * 134217729.0  # 2^27 + 1: the upper 26 bits of a, times scale < 2^27, are exact
    upper = split - (split - a)
    rest = (upper * scale - product) + (a - upper) * scale
    whole = np.floor(product)
    above_half = (product - whole - 0.5) + rest
    magnitude = whole.astype(np.int64)
    return magnitude + ((above_half > 0) | ((above_half == 0) & (magnitude % 2 == 1))), fits


def _put_digits(out: Text, magnitude: NDArray[np.int64], negative: Mask) -> Mask:
    """Whole numbers with their sign, right-justified; false where they need more space than `out` has."""
    left, sign = magnitude, negative
    for column in range(out.shape[1] - 1, -1, -1):
        left, digit = np.divmod(left, 10)
        out[:, column] = _ZERO + digit
        if column != out.shape[1] - 1:
            beyond = (left == 0) & (digit == 0)
            out[beyond, column] = np.where(sign[beyond], _MINUS, _BLANK)
            sign = sign & ~beyond
    return np.asarray((left == 0) & ~sign)


def _put_decimal(out: Text, values: NDArray[np.float64], decimals: int) -> Mask:
    magnitude, fits = round_decimal(values, decimals)
    whole = magnitude
    for column in range(out.shape[1] - 1, out.shape[1] - 1 - decimals, -1):
        whole, digit = np.divmod(whole, 10)
        out[:, column] = _ZERO + digit
    point = out.shape[1] - 1 - decimals
    out[:, point] = _POINT
    return fits & _put_digits(out[:, :point], whole, np.signbit(values))


def _put_whole(out: Text, values: NDArray[np.integer]) -> Mask:
    wide = values.astype(np.int64)
    return _put_digits(out, np.abs(wide), wide < 0)


def _put_quanta(out: Text, quanta: NDArray[np.int16]) -> Mask:
    row = quanta.astype(np.int64) - QUANTUM_RANGE[0] + 1
    row[quanta == BLANK] = 0
    legal = (row >= 0) & (row < len(quantum_table())) & ((row > 0) | (quanta == BLANK))
    out[:] = quantum_table()[np.where(legal, row, 0)].reshape(out.shape)
    return np.asarray(legal.all(axis=1))


def put_rows(out: Text, columns: Columns, decimals: tuple[int, int, int, int]) -> Mask:
    """Fill `out` (n, length), length at least 55 + 4 quanta, with the lines of `columns`.

    True for each line whose numbers all fit their fields as they are; what `out` holds elsewhere is undefined.
    """
    width = 2 * columns.quanta_upper.shape[1]
    out[:] = _BLANK
    g_upper = columns.g_upper
    known = (g_upper >= 0) & (g_upper < len(degeneracy_table()))
    out[:, DEGENERACY] = degeneracy_table()[np.where(known, g_upper, 0)]
    plain = known & _put_decimal(out[:, FREQUENCY], columns.frequency_mhz, decimals[0])
    plain &= _put_decimal(out[:, ERROR], columns.error_mhz, decimals[1])
    plain &= _put_decimal(out[:, LGINT], columns.lgint, decimals[2])
    plain &= _put_decimal(out[:, ENERGY], columns.energy_lower_cm, decimals[3])
    plain &= _put_whole(out[:, DR], columns.dr)
    plain &= _put_whole(out[:, TAG], columns.tag)
    plain &= _put_whole(out[:, QNFMT], columns.qnfmt)
    plain &= _put_quanta(out[:, QUANTA : QUANTA + width], columns.quanta_upper)
    plain &= _put_quanta(out[:, QUANTA + width : QUANTA + 2 * width], columns.quanta_lower)
    return plain


@cache
def _code_table() -> NDArray[np.int16]:
    """The quantum number of every pair of characters, by 256 first + second; 0 where the pair says none."""
    table = np.zeros(65536, dtype=np.int16)
    codes = quantum_table().astype(np.int64) @ [256, 1]
    table[codes] = [BLANK, *range(QUANTUM_RANGE[0], QUANTUM_RANGE[1] + 1)]
    return table


def _take_number(digits: Text, characters: Text, field: slice, decimals: int | None = None) -> NDArray[np.int64]:
    """The whole number in rows `field` of the turned text, its point (before `decimals` digits) left out."""
    point = -1 if decimals is None else field.stop - 1 - decimals
    number = np.zeros(digits.shape[1], dtype=np.int64)
    for row in range(field.start, field.stop):
        if row != point:
            number *= 10
            number += digits[row]
    np.negative(number, out=number, where=(characters[field] == _MINUS).any(axis=0))
    return number


def take_rows(text: Text, width: int, decimals: tuple[int, int, int, int]) -> Columns:
    """The numbers of lines `text` (n, 55 + 4 width at least), taken to be as `put_rows` writes them.

    Nothing is checked here: the caller puts the numbers into rows again and compares the characters.
    """
    head = np.ascontiguousarray(text[:, :QUANTA].T)
    digits = head - _ZERO
    digits[digits > 9] = 0
    letters = head[DEGENERACY.start] - ord("A")
    digits[DEGENERACY.start][letters < 26] = letters[letters < 26] + 10
    pairs = text[:, QUANTA : QUANTA + 4 * width].astype(np.int64)
    quanta = _code_table()[256 * pairs[:, ::2] + pairs[:, 1::2]]
    frequency, error, lgint, energy = (
        _take_number(digits, head, field, places) / 10.0**places
        for field, places in zip((FREQUENCY, ERROR, LGINT, ENERGY), decimals, strict=True)
    )
    dr, g_upper, tag, qnfmt = (_take_number(digits, head, field) for field in (DR, DEGENERACY, TAG, QNFMT))
    return Columns(
        frequency_mhz=frequency,
        error_mhz=error,
        lgint=lgint,
        dr=dr.astype(np.int16),
        energy_lower_cm=energy,
        g_upper=g_upper.astype(np.int32),
        tag=tag.astype(np.int32),
        qnfmt=qnfmt.astype(np.int32),
        quanta_upper=quanta[:, :width],
        quanta_lower=quanta[:, width:],
    )
