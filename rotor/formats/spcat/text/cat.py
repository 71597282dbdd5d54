"""The 80-column catalogue, .cat: lines as columns of numbers, read and written character for character."""

from __future__ import annotations

import gzip
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Indices
from rotor.formats.atomic_write import open_atomic
from rotor.formats.packed import load
from rotor.formats.spcat.text import fields
from rotor.formats.spcat.text.catalogue import WIDE_MHZ, Catalogue, Layout
from rotor.formats.spcat.text.fields import BLANK
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
    Mask,
    StateTexts,
    Text,
    put_rows,
    take_rows,
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
    wide = decimals[0] == 4 and record.frequency_mhz >= WIDE_MHZ
    places = iter((3, 3, 3, decimals[3]) if wide else decimals)
    if not math.isnan(record.error_mhz):
        record = record._replace(error_mhz=min(record.error_mhz, error_cap(decimals[1])))
    numbers = [field.spelled(value, places) for field, value in zip(_FIELDS, record, strict=False)]
    return "".join((*numbers, *map(fields.spell_quantum, record.quanta_upper + record.quanta_lower)))


_CHUNK = 1 << 14  # lines handled at once: about 1 MB of text, which fits a processor's cache
_BOM = b"\xef\xbb\xbf"
_BLANKS = b" \t\r\n\x1a"  # a line of these alone is blank; ^Z ended files under DOS


class Between(NamedTuple):
    """The states that lines are between, (n,) rows of their texts."""

    states: StateTexts
    upper: Indices
    lower: Indices


def _capped(columns: Columns, decimals: tuple[int, int, int, int]) -> Columns:
    return columns._replace(error_mhz=np.minimum(columns.error_mhz, error_cap(decimals[1])))


def _length(layout: Layout, width: int) -> int:
    if layout.line_length is not None:
        return layout.line_length
    return 80 if width == 6 else QUANTA + 4 * width


def _plain_rows(text: Text, columns: Columns, layout: Layout, between: Between | None = None) -> Mask:
    """Fill rows (n, full length and line end); true where a row is the line, nothing but blanks cut off its end."""
    width = columns.quanta_upper.shape[1]
    length = _length(layout, width)
    full = max(length, QUANTA + 4 * width)
    capped = _capped(columns, layout.decimals)
    if between is None:
        plain = put_rows(text[:, :full], capped, layout.decimals)
    else:
        plain = between.states.put_rows(text, capped, layout.decimals, between.upper, between.lower)
    plain &= (columns.qnfmt >= 0) & (np.maximum(columns.qnfmt % 10, 6) == width)
    if layout.decimals[0] == 4:
        plain &= columns.frequency_mhz < WIDE_MHZ
    if length < full:
        plain &= (text[:, length:full] == ord(" ")).all(axis=1)
    text[:, length : length + len(layout.newline)] = np.frombuffer(layout.newline, dtype=np.uint8)
    return plain


def _wide_rows(rows: Text, columns: Columns, layout: Layout, plain: Mask) -> None:
    """Fill the rows of numbers that need a decimal less, and mark them plain: long lists have many such lines.

    The program prints FREQ, ERR and LGINT with three decimals where FREQ is wide; LGINT below -99.9999 has three.
    """
    if layout.decimals != (4, 4, 4, 4):
        return
    wide = columns.frequency_mhz >= WIDE_MHZ
    for chosen, decimals in ((wide, (3, 3, 3, 4)), (~wide & (columns.lgint <= -99.99995), (4, 4, 3, 4))):
        index = np.flatnonzero(chosen & ~plain)
        if len(index):
            text = np.empty((len(index), rows.shape[1]), dtype=np.uint8)
            chosen_columns: list[Any] = [column[index] for column in columns]
            part = _capped(Columns(*chosen_columns), layout.decimals)
            plain[index] = _plain_rows(text, part, replace(layout, decimals=decimals))
            rows[index] = text


def _odd_line(catalogue: Catalogue, index: int) -> bytes:
    """A line with its stored spelling, or whose numbers do not fit the usual columns."""
    record, layout = _within_format(catalogue.record(index), index), catalogue.layout
    stored = layout.spelling.get(index)
    line = next((line for line in (stored or b"").split(b"\n") if line.strip()), b"")  # behind blank ones
    if stored is not None and read_record(Line(line.rstrip(b"\r").decode("ascii"), 0, "stored text")) == record:
        ends = stored.endswith(b"\n") or index == len(catalogue) - 1
        return stored if ends else stored + layout.newline
    try:
        text = spell_record(record, layout.decimals)
    except ValueError as error:
        raise ValueError(f"line {index + 1} cannot be written: {error}") from None
    length = _length(layout, len(record.quanta_upper))
    return text.rstrip(" ").ljust(length).encode() + layout.newline


def _within_format(record: Columns, index: int) -> Columns:
    """The record with as many columns of quantum numbers as its QNFMT can hold."""
    width = quanta_width(record.qnfmt)
    states = [(*state, *(BLANK,) * width) for state in record[-2:]]
    if any(q != BLANK for state in states for q in state[width:]):
        raise ValueError(
            f"line {index + 1} cannot be written: QNFMT {record.qnfmt} can hold {width} quantum numbers a state, "
            "more are given; its last digit says how many"
        )
    return record._replace(quanta_upper=states[0][:width], quanta_lower=states[1][:width])


def state_texts(catalogue: Catalogue) -> StateTexts:
    """The texts of states from a catalogue with a line from each state to itself."""
    text = _empty_rows(catalogue, len(catalogue))
    return StateTexts(text, _plain_rows(text, catalogue.rows(0, len(catalogue)), catalogue.layout))


def _empty_rows(catalogue: Catalogue, count: int) -> Text:
    layout, width = catalogue.layout, catalogue.quanta_upper.shape[1]
    space = max(_length(layout, width), QUANTA + 4 * width) + len(layout.newline)
    return np.empty((count, space), dtype=np.uint8)


def format_chunks(catalogue: Catalogue, between: Between | None = None) -> Iterator[bytes]:
    """The text of a catalogue in pieces of some thousand lines, for lists larger than memory should hold twice.

    between: the states of the lines, of which a list has few beside its lines.
    """
    layout = catalogue.layout
    end = _length(layout, catalogue.quanta_upper.shape[1]) + len(layout.newline)
    buffer = _empty_rows(catalogue, min(_CHUNK, len(catalogue)))
    spelled = np.fromiter(layout.spelling, dtype=np.int64, count=len(layout.spelling))
    yield layout.beginning
    for start in range(0, len(catalogue), _CHUNK):
        stop = min(start + _CHUNK, len(catalogue))
        rows = buffer[: stop - start]
        columns = catalogue.rows(start, stop)
        here = between and between._replace(upper=between.upper[start:stop], lower=between.lower[start:stop])
        plain = _plain_rows(rows, columns, layout, here)
        _wide_rows(rows, columns, layout, plain)
        plain[spelled[(spelled >= start) & (spelled < stop)] - start] = False
        yield from _with_odd_lines(catalogue, start, rows[:, :end], plain)
    yield layout.ending


def _with_odd_lines(catalogue: Catalogue, start: int, rows: Text, plain: Mask) -> Iterator[bytes]:
    """Text of `rows`, the lines from `start` on, with each that is not plain replaced by its own form."""
    done = 0
    for odd in np.flatnonzero(~plain).tolist():
        yield rows[done:odd].tobytes()
        yield _odd_line(catalogue, start + odd)
        done = odd + 1
    yield rows[done:].tobytes()


def format_lines(catalogue: Catalogue) -> bytes:
    """The text of a catalogue, each line ended as its layout says.

    Numbers are rounded as C's printf does. Raises ValueError, with line, field and rule, for what has no place in
    the format.
    """
    return b"".join(format_chunks(catalogue))


def write_cat(catalogue: Catalogue, path: str | os.PathLike[str]) -> None:
    """Write a catalogue, packed when `path` ends in .gz; an existing file is replaced at the end or not at all."""
    with open_atomic(path) as handle:
        if os.fspath(path).endswith(".gz"):
            with gzip.GzipFile(filename="", fileobj=handle, mode="wb", mtime=0) as packed:
                packed.writelines(format_chunks(catalogue))
        else:
            handle.writelines(format_chunks(catalogue))


def read_cat(source: str | os.PathLike[str] | bytes) -> Catalogue:
    """The catalogue in a file, packed with gzip or not, or in the bytes of one.

    Raises ValueError with file, line, columns and the rule that is broken; OSError where the file cannot be opened.
    """
    text, name = load(source)
    beginning = _BOM if text.startswith(_BOM) else b""
    lines = _split_lines(text, len(beginning))
    layout = replace(_guess_layout(text, lines), beginning=beginning)
    columns, is_plain = _read_plain(text, lines, layout)
    return _assembled(text, name, lines, layout, columns, is_plain)


class _Lines(NamedTuple):
    """Where the lines of a text begin and end, their ends included, and which length is the most common."""

    starts: NDArray[np.int64]
    stops: NDArray[np.int64]
    length: int


def _split_lines(text: bytes, begin: int) -> _Lines:
    stops = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n")) + 1
    if len(text) > (stops[-1] if len(stops) else begin):
        stops = np.append(stops, len(text))
    starts = np.concatenate(([begin], stops[:-1])).astype(np.int64)[: len(stops)]
    length = int(np.bincount(stops - starts).argmax()) if len(stops) else 0
    return _Lines(starts, stops, length)


def _typical_line(text: bytes, lines: _Lines) -> bytes:
    """The first line of the most common length, its end included."""
    if not len(lines.starts):
        return b""
    first = int(np.argmax(lines.stops - lines.starts == lines.length))
    return text[lines.starts[first] : lines.stops[first]]


def _guess_layout(text: bytes, lines: _Lines) -> Layout:
    """The layout of a typical line; a wrong guess costs time, nothing else."""
    line = _typical_line(text, lines)
    newline = b"\r\n" if line.endswith(b"\r\n") else b"\n"
    decimals = [_decimals_in(line, part) for part in (FREQUENCY, ERROR, LGINT, ENERGY)]
    length = max(lines.length - len(newline), 0) if line else None
    return Layout(length, newline, (decimals[0], decimals[1], decimals[2], decimals[3]))


def _decimals_in(line: bytes, part: slice) -> int:
    point = line.find(b".", part.start, part.stop)
    places = part.stop - 1 - point
    return places if point >= 0 and places < 7 else 4


def _read_plain(text: bytes, lines: _Lines, layout: Layout) -> tuple[Columns, Mask]:
    """The numbers of all lines, and which lines are just what those numbers would be written as."""
    is_plain = np.zeros(len(lines.starts), dtype=np.bool_)
    count = _typical_line(text, lines)[QNFMT][-1:]
    width = quanta_width(int(count)) if count.isdigit() else 6
    parts = [take_rows(np.empty((0, QUANTA + 4 * width), dtype=np.uint8), width, layout.decimals)]
    for start in range(0, len(is_plain), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        rows, regular = _character_rows(text, lines, chunk)
        padded = np.full((len(rows), max(lines.length, QUANTA + 4 * width) + 2), ord(" "), dtype=np.uint8)
        padded[:, : layout.line_length] = rows[:, : layout.line_length]
        columns = take_rows(padded, width, layout.decimals)
        plain = _plain_rows(padded, columns, layout)
        plain &= (padded[:, : lines.length] == rows).all(axis=1) & _quanta_present(columns)
        is_plain[chunk] = regular & plain
        parts.append(columns)
    return Columns._make(np.concatenate(column) for column in zip(*parts, strict=True)), is_plain


def _character_rows(text: bytes, lines: _Lines, chunk: slice) -> tuple[Text, Mask]:
    """The lines of a chunk as rows of characters; those of another length are blank and marked false."""
    starts, stops = lines.starts[chunk], lines.stops[chunk]
    regular = stops - starts == lines.length
    characters = np.frombuffer(text, dtype=np.uint8)
    if regular.all():
        return characters[starts[0] : stops[-1]].reshape(-1, lines.length), regular
    rows = np.full((len(starts), lines.length), ord(" "), dtype=np.uint8)
    rows[regular] = characters[starts[regular, None] + np.arange(lines.length)]
    return rows, regular


def _quanta_present(columns: Columns) -> Mask:
    """Whether each line has as many quantum numbers as its QNFMT says."""
    width = columns.quanta_upper.shape[1]
    needed = np.arange(width) < (columns.qnfmt % 10)[:, None]
    blank = (columns.quanta_upper == BLANK) | (columns.quanta_lower == BLANK)
    return ~np.asarray((needed & blank).any(axis=1))


def _assembled(text: bytes, name: str, lines: _Lines, layout: Layout, columns: Columns, is_plain: Mask) -> Catalogue:
    """The catalogue; lines that are not plain are read one by one, and blank lines belong to the line that follows."""
    records: dict[int, Columns] = {}
    for number in np.flatnonzero(~is_plain).tolist():
        line = text[lines.starts[number] : lines.stops[number]]
        if line.strip(_BLANKS):
            records[number] = _careful_record(line, number + 1, name)
            if text.endswith(line) and set(records[number].quanta_lower) == {BLANK}:
                raise ValueError(
                    f"{name}, line {number + 1}: the file ends without a lower state and a line end; it was cut"
                )
    columns = _with_records(columns, records)

    stored = is_plain.copy()
    stored[list(records)] = True
    numbers, stops = np.flatnonzero(stored), lines.stops[stored]
    begins = np.concatenate(([len(layout.beginning)], stops[:-1]))[: len(stops)]
    odd = ~is_plain[stored] | (begins < lines.starts[stored])
    spelling = {i: text[begins[i] : stops[i]] for i in np.flatnonzero(odd).tolist()}
    ending = text[stops[-1] if len(stops) else len(layout.beginning) :]
    whole = columns if len(numbers) == len(is_plain) else Columns._make(column[numbers] for column in columns)
    return Catalogue(*whole, layout=replace(layout, spelling=spelling, ending=ending))


def _careful_record(text: bytes, number: int, name: str) -> Columns:
    body = text.removesuffix(b"\n").removesuffix(b"\r")
    line = Line(body.decode("latin1"), number, name)
    strange = next((i for i, c in enumerate(body) if not 32 <= c < 127), None)
    if strange is not None:
        raise line.error(strange, f"byte {body[strange]:#04x}; expected plain ASCII, no tab")
    return read_record(line)


def _with_records(columns: Columns, records: dict[int, Columns]) -> Columns:
    """The columns with the lines of `records` set, wider where one of them has more quantum numbers."""
    width = max([columns.quanta_upper.shape[1], *(len(record.quanta_upper) for record in records.values())])
    wider = ((0, 0), (0, width - columns.quanta_upper.shape[1]))
    upper, lower = (np.pad(side, wider, constant_values=BLANK) for side in (columns.quanta_upper, columns.quanta_lower))
    columns = columns._replace(quanta_upper=upper, quanta_lower=lower)
    for number, record in records.items():
        for name, value in record._asdict().items():
            getattr(columns, name)[number] = (*value, *(BLANK,) * width)[:width] if isinstance(value, tuple) else value
    return columns
