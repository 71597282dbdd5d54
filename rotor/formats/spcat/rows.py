"""Catalogue lines as a matrix of characters, whole columns at a time: the plain form of `_kernels`."""

from __future__ import annotations

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


def quantum_table() -> Text:
    """Two characters for each quantum number, (630, 2): row 0 is blank, row i spells QUANTUM_RANGE[0] + i - 1."""
    values = [BLANK, *range(QUANTUM_RANGE[0], QUANTUM_RANGE[1] + 1)]
    return np.frombuffer("".join(map(spell_quantum, values)).encode(), dtype=np.uint8).reshape(-1, 2)


def degeneracy_table() -> Text:
    """Three characters for each degeneracy from 0 to 3599, (3600, 3)."""
    return np.frombuffer("".join(map(spell_degeneracy, range(3600))).encode(), dtype=np.uint8).reshape(-1, 3)


_QUANTA = quantum_table()
_DEGENERACIES = degeneracy_table()


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
    """Whole numbers with their sign, right-justified; false where they need more room than `out` has."""
    left, sign = magnitude, negative
    for column in range(out.shape[1] - 1, -1, -1):
        left, digit = np.divmod(left, 10)
        out[:, column] = _ZERO + digit
        if column != out.shape[1] - 1:
            beyond = (left == 0) & (digit == 0)
            out[beyond, column] = np.where(sign[beyond], _MINUS, _BLANK)
            sign = sign & ~beyond
    return (left == 0) & ~sign


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
    legal = (row >= 0) & (row < len(_QUANTA)) & ((row > 0) | (quanta == BLANK))
    out[:] = _QUANTA[np.where(legal, row, 0)].reshape(out.shape)
    return np.asarray(legal.all(axis=1))


def put_rows(out: Text, columns: Columns, decimals: tuple[int, int, int, int]) -> Mask:
    """Fill `out` (n, length), length at least 55 + 4 quanta, with the lines of `columns`.

    True for each line whose numbers all fit their fields as they are; what `out` holds elsewhere is undefined.
    """
    width = 2 * columns.quanta_upper.shape[1]
    out[:] = _BLANK
    g_upper = columns.g_upper
    known = (g_upper >= 0) & (g_upper < len(_DEGENERACIES))
    out[:, DEGENERACY] = _DEGENERACIES[np.where(known, g_upper, 0)]
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


def _code_table() -> NDArray[np.int16]:
    """The quantum number of every pair of characters, by 256 first + second; 0 where the pair says none."""
    table = np.zeros(65536, dtype=np.int16)
    codes = _QUANTA.astype(np.int64) @ [256, 1]
    table[codes] = [BLANK, *range(QUANTUM_RANGE[0], QUANTUM_RANGE[1] + 1)]
    return table


_CODES = _code_table()


def _field_weights(decimals: tuple[int, int, int, int]) -> NDArray[np.float64]:
    """(8, 55) powers of ten: weights @ digits are the eight numbers of a line in units of their last digit."""
    fields = ((FREQUENCY, decimals[0]), (ERROR, decimals[1]), (LGINT, decimals[2]), (ENERGY, decimals[3]))
    weights = np.zeros((8, QUANTA))
    for row, (field, places) in enumerate(fields):
        point = field.stop - 1 - places
        weights[row, field.start : point] = 10.0 ** np.arange(point + places - field.start - 1, places - 1, -1)
        weights[row, point + 1 : field.stop] = 10.0 ** np.arange(places - 1, -1, -1)
    for row, field in enumerate((DR, DEGENERACY, TAG, QNFMT), start=4):
        weights[row, field] = 10.0 ** np.arange(field.stop - field.start - 1, -1, -1)
    return weights


def take_rows(text: Text, width: int, decimals: tuple[int, int, int, int]) -> Columns:
    """The numbers of lines `text` (n, 55 + 4 width at least), taken to be as `put_rows` writes them.

    Nothing is checked here: whoever calls puts the numbers into rows again and compares the characters.
    """
    head = np.ascontiguousarray(text[:, :QUANTA].T)
    digits = head - _ZERO
    digits[digits > 9] = 0
    letters = head[DEGENERACY.start] - ord("A")
    digits[DEGENERACY.start][letters < 26] = letters[letters < 26] + 10
    numbers = _field_weights(decimals) @ digits.astype(np.float64)  # exact: whole numbers below 2^53
    for row, field in enumerate((FREQUENCY, ERROR, LGINT, ENERGY, DR, DEGENERACY, TAG, QNFMT)):
        np.negative(numbers[row], out=numbers[row], where=(head[field] == _MINUS).any(axis=0))
    scaled = [numbers[i] / 10.0 ** decimals[i] for i in range(4)]
    pairs = text[:, QUANTA : QUANTA + 4 * width].astype(np.int64)
    quanta = _CODES[256 * pairs[:, ::2] + pairs[:, 1::2]]
    dr, g_upper, tag, qnfmt = (numbers[i].astype(np.int32) for i in range(4, 8))
    return Columns(
        scaled[0], scaled[1], scaled[2], dr.astype(np.int16), scaled[3], g_upper, tag, qnfmt,
        quanta[:, :width], quanta[:, width:],
    )  # fmt: skip
