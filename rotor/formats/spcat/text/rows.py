"""Catalogue lines as a matrix of characters: whole columns at a time, four digits of each number at a time from tables."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Indices
from rotor.formats.spcat.text.fields import BLANK, QUANTUM_RANGE, spell_quantum
from rotor.frozen import dataclass
from rotor.geometry.error_free import halves

Text = NDArray[np.uint8]
Mask = NDArray[np.bool_]

FREQUENCY, ERROR, LGINT, DR = slice(0, 13), slice(13, 21), slice(21, 29), slice(29, 31)
ENERGY, DEGENERACY, TAG, QNFMT = slice(31, 41), slice(41, 44), slice(44, 51), slice(51, 55)
QUANTA = 55  # where the quantum numbers begin

_BLANK, _MINUS, _POINT, _ZERO = (ord(c) for c in " -.0")
_TENS = 10 ** np.arange(1, 18)  # the least numbers of two digits, three, ...


class Columns(NamedTuple):
    """The numbers of some lines, column by column, or those of one line; the names are those of `Catalogue`, which says more."""

    frequency_mhz: Any
    error_mhz: Any
    lgint: Any
    dr: Any
    energy_lower_cm: Any
    g_upper: Any
    tag: Any
    qnfmt: Any
    quanta_upper: Any
    quanta_lower: Any


@cache
def quantum_table() -> Text:
    """Two characters for each quantum number, (630, 2): row 0 is blank, row i spells QUANTUM_RANGE[0] + i - 1."""
    values = [BLANK, *range(QUANTUM_RANGE[0], QUANTUM_RANGE[1] + 1)]
    return np.frombuffer("".join(map(spell_quantum, values)).encode(), dtype=np.uint8).reshape(-1, 2)


@cache
def degeneracy_table() -> Text:
    """Three characters for each degeneracy from 0 to 3599, (3600, 3): the texts of `spell_degeneracy`."""
    letters = np.repeat(np.arange(ord("A"), ord("Z") + 1, dtype=np.uint8), 100)[:, None]
    beyond = np.hstack([letters, np.tile(_group_table(2, True)[:100], (26, 1))])
    return np.concatenate([_group_table(3, True)[1000:], beyond])


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
    upper, lower = halves(a)  # 26 bits of a, times scale < 2^27, are exact
    rest = (upper * scale - product) + lower * scale
    whole = np.floor(product)
    above_half = (product - whole - 0.5) + rest
    magnitude = whole.astype(np.int64)
    return magnitude + ((above_half > 0) | ((above_half == 0) & (magnitude % 2 == 1))), fits


@cache
def _group_table(size: int, last: bool) -> Text:
    """Texts of `size` digits, (2 · 10^size, size): first with zeros in front, for numbers that go on before them, then with blanks.

    0 with blanks is written 0 in the last group of a number, else as blanks.
    """
    values, units = np.arange(10**size)[:, None], 10 ** np.arange(size - 1, -1, -1)
    digits = (values // units % 10 + _ZERO).astype(np.uint8)
    leading = values < units
    if last:
        leading[:, -1] = False
    return np.concatenate([digits, np.where(leading, np.uint8(_BLANK), digits)])


def _put_group(out: Text, table: Text, index: NDArray[np.int64]) -> None:
    """Rows of a table of characters into `out`; four or two characters go as one number."""
    kind = {4: np.uint32, 2: np.uint16}.get(out.shape[1])
    if kind is None:
        out[:] = table.take(index, axis=0)
    else:
        out.view(kind)[:, 0] = table.view(kind)[:, 0][index]


def _put_natural(out: Text, magnitude: NDArray[np.int64]) -> Mask:
    """Whole numbers without a sign, right-justified, four digits at a time; false where they need more columns."""
    left, stop = magnitude, out.shape[1]
    while stop > 0:
        size = min(4, stop)
        higher = left // 10**size
        index = left - higher * 10**size + (higher == 0) * 10**size
        _put_group(out[:, stop - size : stop], _group_table(size, stop == out.shape[1]), index)
        left, stop = higher, stop - size
    return np.asarray(left == 0)


@cache
def _signed_table(size: int) -> Text:
    """Texts of `size` characters, (2 · 10^size, size): numbers without a sign, then the same with a minus where it has a place."""
    natural = _group_table(size, True)[10**size :]
    signed = natural.copy()
    _put_signs(signed, np.arange(10**size), np.arange(10 ** (size - 1)))
    return np.concatenate([natural, signed])


def _put_signs(out: Text, magnitude: NDArray[np.int64], rows: NDArray[np.int64]) -> Mask:
    """A minus before the first digit of some rows; false where it has no place."""
    place = out.shape[1] - 2 - np.searchsorted(_TENS, magnitude[rows], side="right")
    out[rows[place >= 0], place[place >= 0]] = _MINUS
    return np.asarray(place >= 0)


def _put_signed(out: Text, magnitude: NDArray[np.int64], negative: Mask) -> Mask:
    """Whole numbers with their sign, right-justified; false where they need more columns than `out` has."""
    if (size := out.shape[1]) <= 3:
        fits = magnitude < np.where(negative, 10 ** (size - 1), 10**size)
        _put_group(out, _signed_table(size), np.where(fits, magnitude + negative * 10**size, 0))
        return np.asarray(fits)
    fits = _put_natural(out, magnitude)
    if not negative.any():
        return fits
    rows = np.flatnonzero(negative)
    fits[rows] &= _put_signs(out, magnitude, rows)
    return fits


def _put_decimal(out: Text, values: NDArray[np.float64], decimals: int) -> Mask:
    magnitude, fits = round_decimal(values, decimals)
    whole = magnitude // 10**decimals
    part, stop = magnitude - whole * 10**decimals, out.shape[1]
    for size in [4] * (decimals // 4) + [decimals % 4] * (decimals % 4 > 0):
        higher = part // 10**size
        _put_group(out[:, stop - size : stop], _group_table(size, True), part - higher * 10**size)
        part, stop = higher, stop - size
    out[:, stop - 1] = _POINT
    return fits & _put_signed(out[:, : stop - 1], whole, np.signbit(values))


def _put_whole(out: Text, values: NDArray[np.integer]) -> Mask:
    wide = values.astype(np.int64)
    return _put_signed(out, np.abs(wide), wide < 0)


def _put_quantum(out: Text, values: NDArray[np.int16]) -> Mask:
    """Two characters for a quantum number of each state."""
    index = values.astype(np.int64) - (QUANTUM_RANGE[0] - 1)
    index[index == 0] = -1  # row 0 is that of blanks
    index[values == BLANK] = 0
    return _put_rows_of(out, index, quantum_table())


def _put_rows_of(out: Text, index: NDArray[np.integer], table: Text) -> Mask:
    """Rows of a table of characters; false where it has none."""
    fits = (index >= 0) & (index < len(table))
    _put_group(out, table, np.where(fits, index, 0))
    return np.asarray(fits)


def _put_field(out: Text, values: NDArray[Any], put: Callable[[Text, Any], Mask]) -> Mask | bool:
    """A column in its field; one that has a single value is spelled once."""
    if (values[0] != values[-1]).any() or (values != values[0]).any():
        return put(out, values)
    once = np.empty((1, out.shape[1]), dtype=np.uint8)
    fits = bool(put(once, values[:1])[0])
    out[:] = once
    return fits


def put_rows(out: Text, columns: Columns, decimals: tuple[int, int, int, int]) -> Mask:
    """Fill `out` (n, length), length at least 55 + 4 quanta, with the lines of `columns`.

    True for each line whose numbers all fit their fields as they are; what `out` holds elsewhere is undefined.
    """
    plain = np.ones(len(out), dtype=np.bool_)
    if not len(out):
        return plain
    numbers = zip((FREQUENCY, ERROR, LGINT, ENERGY), (*columns[:3], columns.energy_lower_cm), decimals, strict=True)
    for field, values, places in numbers:
        plain &= _put_field(out[:, field], values, partial(_put_decimal, decimals=places))
    for field, whole in ((DR, columns.dr), (TAG, columns.tag), (QNFMT, columns.qnfmt)):
        plain &= _put_field(out[:, field], whole, _put_whole)
    plain &= _put_field(out[:, DEGENERACY], columns.g_upper, partial(_put_rows_of, table=degeneracy_table()))
    start = QUANTA
    for quanta in (columns.quanta_upper, columns.quanta_lower):
        for column in range(quanta.shape[1]):
            plain &= _put_field(out[:, start : start + 2], quanta[:, column], _put_quantum)
            start += 2
    out[:, start:] = _BLANK
    return plain


@dataclass(frozen=True, eq=False)
class StateTexts:
    """Lines of one state each, as characters: a line between two of them has the fields of both.

    texts: (states, length), each with the state as upper and as lower one. plain: (states,) whether the numbers fit their fields.
    """

    texts: Text
    plain: Mask

    def put_rows(
        self, out: Text, columns: Columns, decimals: tuple[int, int, int, int], upper: Indices, lower: Indices
    ) -> Mask:
        """`put_rows` for lines between the states `upper` and `lower`: only numbers of the line itself are converted."""
        np.take(self.texts, lower, axis=0, out=out, mode="clip")
        for field in (DEGENERACY, slice(QUANTA, QUANTA + 2 * columns.quanta_upper.shape[1])):
            out[:, field] = self.texts[:, field].take(upper, axis=0)
        plain = self.plain[upper] & self.plain[lower]
        for field, values, places in zip((FREQUENCY, ERROR, LGINT), columns[:3], decimals, strict=False):
            plain &= _put_field(out[:, field], values, partial(_put_decimal, decimals=places))
        return np.asarray(plain)


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
