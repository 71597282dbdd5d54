"""The 80-column catalogue, .cat: lines as columns of numbers, read and written character for character."""

from __future__ import annotations

import gzip
import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Indices
from rotor.formats.atomic_write import open_atomic
from rotor.formats.packed import load
from rotor.formats.spcat.text.catalogue import Catalogue, Layout
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.freeform import Line
from rotor.formats.spcat.text.line import error_cap, quanta_width, read_record, spell_record
from rotor.formats.spcat.text.rows import (
    ENERGY,
    ERROR,
    FREQUENCY,
    LGINT,
    QNFMT,
    QUANTA,
    Columns,
    Mask,
    StateTexts,
    Text,
    put_rows,
    take_rows,
)

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
        plain &= columns.frequency_mhz < 99999999.0
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
    wide = columns.frequency_mhz >= 99999999.0
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
