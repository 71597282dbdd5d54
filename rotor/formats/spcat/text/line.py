"""One catalogue line, read and spelled with care: for lines that are not as the field's program writes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from rotor.formats.spcat.text import fields
from rotor.formats.spcat.text.freeform import Line
from rotor.formats.spcat.text.rows import (
    DEGENERACY,
    DR,
    ENERGY,
    ERROR,
    FREQUENCY,
    LGINT,
    QNFMT,
    QUANTA,
    TAG,
    Columns,
)


class _Field(NamedTuple):
    """A fixed field: its name in errors, its columns, how it is read, and whether it may be blank, which stands for 0."""

    name: str
    part: slice
    read: Callable[[str], Any]
    may_be_blank: bool = False

    @property
    def with_columns(self) -> str:
        """The name with the columns, counted from 1."""
        return f"{self.name} (columns {self.part.start + 1} to {self.part.stop})"

    def number(self, text: str) -> Any:
        """The number in the text of the field."""
        return 0 if self.may_be_blank and not text.strip(" ") else self.read(text)

    def spelled(self, value: Any, places: Iterator[int]) -> str:
        """The text of a number; places: decimals of this field and those behind it, if they have some."""
        width = self.part.stop - self.part.start
        try:
            if self.read is fields.read_decimal:
                return fields.spell_decimal(value, width, next(places))
            return fields.spell_degeneracy(value) if self.name == "GUP" else fields.spell_whole(value, width)
        except ValueError as error:
            raise ValueError(f"{self.name}: {error}") from None


_FIELDS = (
    _Field("FREQ", FREQUENCY, fields.read_decimal),
    _Field("ERR", ERROR, fields.read_decimal, True),
    _Field("LGINT", LGINT, fields.read_decimal),
    _Field("DR", DR, fields.read_whole, True),
    _Field("ELO", ENERGY, fields.read_decimal),
    _Field("GUP", DEGENERACY, fields.read_degeneracy),
    _Field("TAG", TAG, fields.read_whole, True),
    _Field("QNFMT", QNFMT, fields.read_whole),
)


def quanta_width(qnfmt: int) -> int:
    """Columns of quantum numbers a state takes: six, or more when the last digit of QNFMT says so."""
    return max(6, qnfmt % 10)


def error_cap(decimals: int) -> float:
    """The largest error that is written, 999.9999 for four decimals: larger ones, undetermined ones too, read so."""
    return (10**7 - 1) / 10.0**decimals


def read_record(line: Line) -> Columns:
    """The numbers of a line without its end.

    Raises ValueError with file, line, column, the field and the rule that is broken.
    """
    if len(line.text) < QUANTA:
        raise line.error(
            len(line.text), f"the line ends; FREQ to QNFMT fill columns 1 to {QUANTA}, quantum numbers follow"
        )
    numbers = [line.read(field.part, field.with_columns, field.number) for field in _FIELDS]
    qnfmt = numbers[-1]
    if qnfmt < 0:
        raise line.error(QNFMT.start, f"QNFMT is {qnfmt}; it counts quantum numbers and is not negative")
    upper = _read_state(line, QUANTA, qnfmt, may_be_blank=False)
    lower = _read_state(line, QUANTA + 2 * quanta_width(qnfmt), qnfmt, may_be_blank=True)
    return Columns._make([*numbers, upper, lower])


def _read_state(line: Line, start: int, qnfmt: int, *, may_be_blank: bool) -> tuple[int, ...]:
    """The quantum numbers of a state; a lower state that is blank altogether is one that the catalogue does not label."""
    columns = range(start, start + 2 * quanta_width(qnfmt), 2)
    quanta = [line.read(slice(column, column + 2), "quantum number", fields.read_quantum) for column in columns]
    blank = quanta.index(fields.BLANK) if fields.BLANK in quanta else len(quanta)
    if blank < qnfmt % 10 and not (may_be_blank and set(quanta) == {fields.BLANK}):
        raise line.error(
            columns[blank], f"blank, but QNFMT {qnfmt} says that {qnfmt % 10} quantum numbers follow for each state"
        )
    return tuple(quanta)


def spell_record(record: Columns, decimals: tuple[int, int, int, int]) -> str:
    """The line of a record, without its end; numbers too wide for their decimals are given with as many as fit.

    A frequency beyond 99999999 MHz has three decimals, and error and intensity with it, as the field's program
    writes them. Raises ValueError that names the field and the rule.
    """
    wide = decimals[0] == 4 and record.frequency_mhz >= 99999999.0
    places = iter((3, 3, 3, decimals[3]) if wide else decimals)
    if not math.isnan(record.error_mhz):
        record = record._replace(error_mhz=min(record.error_mhz, error_cap(decimals[1])))
    numbers = [field.spelled(value, places) for field, value in zip(_FIELDS, record, strict=False)]
    return "".join((*numbers, *map(fields.spell_quantum, record.quanta_upper + record.quanta_lower)))
