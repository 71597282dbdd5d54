"""One catalogue line, read and spelled with care: for lines that are not as the field's program writes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from rotor.formats.spcat.text import fields
from rotor.formats.spcat.text.rows import QUANTA


class Record(NamedTuple):
    """The numbers of one line; the names are those of `Catalogue`."""

    frequency_mhz: float
    error_mhz: float
    lgint: float
    dr: int
    energy_lower_cm: float
    g_upper: int
    tag: int
    qnfmt: int
    quanta_upper: tuple[int, ...]
    quanta_lower: tuple[int, ...]


class _Field(NamedTuple):
    name: str
    start: int
    stop: int
    read: Callable[[str], Any]
    may_be_blank: bool


_FIELDS = (
    _Field("FREQ", 0, 13, fields.read_decimal, False),
    _Field("ERR", 13, 21, fields.read_decimal, True),
    _Field("LGINT", 21, 29, fields.read_decimal, False),
    _Field("DR", 29, 31, fields.read_whole, True),
    _Field("ELO", 31, 41, fields.read_decimal, False),
    _Field("GUP", 41, 44, fields.read_degeneracy, True),
    _Field("TAG", 44, 51, fields.read_whole, True),
    _Field("QNFMT", 51, 55, fields.read_whole, False),
)


def quanta_width(qnfmt: int) -> int:
    """Columns of quantum numbers a state takes: six, or more when the last digit of QNFMT says so."""
    return max(6, qnfmt % 10)


def error_cap(decimals: int) -> float:
    """The largest error that is written, 999.9999 for four decimals: larger ones, undetermined ones too, read so."""
    return (10**7 - 1) / 10.0**decimals


def read_record(text: str) -> Record:
    """The numbers of a line without its end.

    Raises ValueError that names the column, the field and the rule; the caller adds file and line.
    """
    if len(text) < QUANTA:
        raise ValueError(
            f"the line ends after column {len(text)}; FREQ to QNFMT fill columns 1 to {QUANTA}, quantum numbers follow"
        )
    numbers = [_read_field(text, field) for field in _FIELDS]
    qnfmt = numbers[-1]
    if qnfmt < 0:
        raise ValueError(f"columns 52-55: QNFMT is {qnfmt}; it counts quantum numbers and is not negative")
    upper = _read_state(text, QUANTA, qnfmt, may_be_blank=False)
    lower = _read_state(text, QUANTA + 2 * quanta_width(qnfmt), qnfmt, may_be_blank=True)
    return Record._make([*numbers, upper, lower])


def _read_field(text: str, field: _Field) -> Any:
    part = text[field.start : field.stop]
    if field.may_be_blank and not part.strip(" "):
        return 0
    try:
        return field.read(part)
    except ValueError as error:
        raise ValueError(f"columns {field.start + 1}-{field.stop}: {field.name} reads {part!r}; {error}") from None


def _read_state(text: str, start: int, qnfmt: int, *, may_be_blank: bool) -> tuple[int, ...]:
    """The quantum numbers of a state; a lower state that is blank altogether is one that the catalogue does not label."""
    width, quanta = quanta_width(qnfmt), []
    if may_be_blank and not text[start : start + 2 * width].strip(" "):
        return (fields.BLANK,) * width
    for index in range(width):
        column = start + 2 * index
        part = text[column : column + 2]
        try:
            quanta.append(fields.read_quantum(part if part.strip(" ") else "  "))
        except ValueError as error:
            raise ValueError(f"columns {column + 1}-{column + 2}: quantum number reads {part!r}; {error}") from None
        if quanta[-1] == fields.BLANK and index < qnfmt % 10:
            raise ValueError(
                f"columns {column + 1}-{column + 2}: blank, but QNFMT {qnfmt} says that {qnfmt % 10} quantum numbers "
                "follow for each state"
            )
    return tuple(quanta)


def spell_record(record: Record, decimals: tuple[int, int, int, int]) -> str:
    """The line of a record, without its end; numbers too wide for their decimals are given with as many as fit.

    A frequency beyond 99999999 MHz has three decimals, and error and intensity with it, as the field's program
    writes them. Raises ValueError that names the field and the rule.
    """
    wide = decimals[0] == 4 and record.frequency_mhz >= 99999999.0
    places = (3, 3, 3, decimals[3]) if wide else decimals
    error_mhz = min(record.error_mhz, error_cap(decimals[1])) if not math.isnan(record.error_mhz) else record.error_mhz
    parts = [
        _spell("FREQ", lambda: fields.spell_decimal(record.frequency_mhz, 13, places[0])),
        _spell("ERR", lambda: fields.spell_decimal(error_mhz, 8, places[1])),
        _spell("LGINT", lambda: fields.spell_decimal(record.lgint, 8, places[2])),
        _spell("DR", lambda: _spell_whole(record.dr, 2)),
        _spell("ELO", lambda: fields.spell_decimal(record.energy_lower_cm, 10, places[3])),
        _spell("GUP", lambda: fields.spell_degeneracy(record.g_upper)),
        _spell("TAG", lambda: _spell_whole(record.tag, 7)),
        _spell("QNFMT", lambda: _spell_whole(record.qnfmt, 4)),
        _spell("upper state", lambda: "".join(map(fields.spell_quantum, record.quanta_upper))),
        _spell("lower state", lambda: "".join(map(fields.spell_quantum, record.quanta_lower))),
    ]
    return "".join(parts)


def _spell(name: str, spelled: Callable[[], str]) -> str:
    try:
        return spelled()
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _spell_whole(value: int, width: int) -> str:
    text = f"{value:{width}d}"
    if len(text) > width:
        raise ValueError(f"{value} does not fit a field of {width} characters")
    return text
