"""How these files spell numbers: two-character quantum numbers, letters for hundreds, fixed and free fields."""

from __future__ import annotations

import math
import re

BLANK = -32768  # a quantum number that is not there
QUANTUM_RANGE = (-269, 359)
DEGENERACY_MAX = 3599

_FIXED = re.compile(r" *([+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d{1,3})?) *\Z", re.ASCII)
_WHOLE = re.compile(r" *([+-]?\d+) *\Z", re.ASCII)


def spell_quantum(value: int) -> str:
    """Two characters for one quantum number.

    Tens beyond 90 are letters, A0 = 100 to Z9 = 359; below -9 they are lower-case, a0 = -10 to z9 = -269.

    >>> [spell_quantum(q) for q in (7, 42, 100, 359, -3, -10, BLANK)]
    [' 7', '42', 'A0', 'Z9', '-3', 'a0', '  ']
    """
    if value == BLANK:
        return "  "
    if not QUANTUM_RANGE[0] <= value <= QUANTUM_RANGE[1]:
        lowest, highest = QUANTUM_RANGE
        raise ValueError(f"quantum number {value} does not fit two characters; {lowest} to {highest} do")
    tens, unit = divmod(abs(value), 10)
    if value < 0:
        return ("-" if tens == 0 else chr(ord("a") + tens - 1)) + str(unit)
    return (f"{tens or ' '}" if tens < 10 else chr(ord("A") + tens - 10)) + str(unit)


def read_quantum(text: str) -> int:
    """The quantum number of two characters, `BLANK` for blanks; the inverse of `spell_quantum`."""
    if not text.strip(" "):
        return BLANK
    lead, unit = text[:1], text[1:]
    if len(unit) == 1 and unit in "0123456789":
        if lead in "0123456789 ":
            return int(text)
        if lead == "-":
            return -int(unit)
        if "A" <= lead <= "Z":
            return 10 * (ord(lead) - ord("A") + 10) + int(unit)
        if "a" <= lead <= "z":
            return -10 * (ord(lead) - ord("a") + 1) - int(unit)
    raise ValueError("a quantum number is two characters, the second a digit: ' 7', '42', '-3', 'A0' = 100, 'a0' = -10")


def spell_degeneracy(value: int) -> str:
    """Three characters for an upper-state degeneracy; hundreds beyond 900 are letters, A00 = 1000 to Z99 = 3599.

    >>> [spell_degeneracy(g) for g in (3, 1002, 3599)]
    ['  3', 'A02', 'Z99']
    """
    if not 0 <= value <= DEGENERACY_MAX:
        raise ValueError(
            f"a degeneracy of {value} does not fit three characters; 0 to {DEGENERACY_MAX} do: "
            "divide the spin weights by their common divisor, here and in Q"
        )
    return f"{value:3d}" if value < 1000 else chr(ord("A") + value // 100 - 10) + f"{value % 100:02d}"


def read_degeneracy(text: str) -> int:
    """The degeneracy of three characters, 0 when blank; the inverse of `spell_degeneracy`."""
    if not text.strip(" "):
        return 0
    if len(text) == 3 and "A" <= text[0] <= "Z" and text[1:].isdecimal() and text.isascii():
        return 100 * (ord(text[0]) - ord("A") + 10) + int(text[1:])
    value = read_whole(text)
    if value < 0:
        raise ValueError("a degeneracy is not negative")
    return value


def spell_decimal(value: float, width: int, decimals: int) -> str:
    """A number right-justified in `width` characters with `decimals` decimals, or as many as fit.

    >>> spell_decimal(-12.3456, 8, 4), spell_decimal(-123.45678, 8, 4)
    ('-12.3456', '-123.457')
    """
    if math.isfinite(value):
        for places in range(decimals, -1, -1):
            text = f"{value:{width}.{places}f}"
            if len(text) <= width:
                return text
    raise ValueError(f"{value!r} does not fit a field of {width} characters")


def spell_whole(value: int, width: int) -> str:
    """A whole number right-justified in `width` characters."""
    if len(text := f"{value:{width}d}") > width:
        raise ValueError(f"{value} does not fit a field of {width} characters")
    return text


def read_decimal(text: str) -> float:
    """The number in a fixed field; blanks may stand around it, `D` exponents are those of Fortran."""
    match = _FIXED.match(text)
    if not match:
        raise ValueError("expected a number such as '12.3456', without a blank inside")
    value = float(match[1].replace("d", "e").replace("D", "e"))
    if not math.isfinite(value):
        raise ValueError("the number is too large")
    return value


def read_whole(text: str) -> int:
    """The whole number in a fixed field; blanks may stand around it."""
    match = _WHOLE.match(text)
    if not match:
        raise ValueError("expected a whole number, without a blank inside")
    return int(match[1])
