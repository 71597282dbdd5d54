"""Measured lines for SPFIT, .lin: quantum numbers in twelve fields of three, then frequency, error and weight.

States of more than six quantum numbers (NLINE below 0 in the .par file) have twice as many fields as a state has numbers. A lower
state whose first number is below 0 is none: the line is an energy from the zero of the Hamiltonian.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import distinct
from rotor.formats.spcat.text.fields import BLANK, read_whole
from rotor.formats.spcat.text.freeform import Line, encode, number, read_lines, read_words
from rotor.table import counted
from rotor.units import MHZ_PER_CM

QUANTA_FIELDS = 12  # at least
MOST_QUANTA = 10  # of a state
_REMARK_FROM = 2  # numbers: words in place of the weight are a remark
NO_ERROR_MHZ = 0.01  # error of a line without a stated error, as in SPFIT
_NUMBER, _BETWEEN, _END = r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)", r"(?:[ \t]*,[ \t]*|[ \t]+)", r"[ \t]*(?:/|$)"
_AS_USUAL = re.compile(  # one to three numbers and nothing that must be looked at again
    rf"[ \t]*{_NUMBER}(?:{_END}|{_BETWEEN}{_NUMBER}(?:{_END}|{_BETWEEN}{_NUMBER}(?=[ \t,/]|$)))", re.ASCII
)
_ROTATION = ("j", "n", "k", "ka", "kc", "v")


@dataclass(frozen=True, eq=False)
class LineList:
    """Measured lines, columns of equal length n.

    quanta (n, 12 or more): upper state, then at once the lower one; -32768 where blank. frequency, error (n,): as written,
    MHz or, where the error is negative, cm⁻¹. weight (n,): share within a blend. texts: lines as they were read,
    with the blank lines before them. rest: what follows the last line. per_state: quantum numbers of each state where some
    line lacks one, which is -32768 then; 0 where every line has as many as it needs. defaulted: lines without an error.
    """

    quanta: NDArray[np.int16]
    frequency: NDArray[np.float64]
    error: NDArray[np.float64]
    weight: NDArray[np.float64]
    texts: Mapping[int, str] = field(default_factory=dict)
    rest: str = ""
    per_state: int = 0
    defaulted: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        n = len(self.frequency)
        shapes = {name: np.shape(getattr(self, name)) for name in ("quanta", "frequency", "error", "weight")}
        if shapes != {"quanta": (n, self.fields), "frequency": (n,), "error": (n,), "weight": (n,)} or not (
            QUANTA_FIELDS <= self.fields <= 2 * MOST_QUANTA
        ):
            raise ValueError(f"columns of shapes {shapes}; expected quanta (n, {QUANTA_FIELDS}) and the others (n,)")

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def fields(self) -> int:
        """Fields of quantum numbers in a line."""
        return int(np.shape(self.quanta)[-1])

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of quantum numbers of a state of each line, (n,)."""
        return np.asarray((self.quanta != BLANK).sum(axis=1) // 2)

    @property
    def frequency_mhz(self) -> NDArray[np.float64]:
        """Frequencies in MHz, (n,)."""
        return np.where(self.error < 0, self.frequency * MHZ_PER_CM, self.frequency)

    @property
    def error_mhz(self) -> NDArray[np.float64]:
        """Measurement errors in MHz, (n,), not negative."""
        return np.where(self.error < 0, -self.error * MHZ_PER_CM, self.error)

    def states(self) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
        """Quantum numbers of the upper and the lower states, two arrays (n, 6 or more), blanks -32768."""
        upper, lower = (np.full((len(self), self.fields // 2), BLANK, dtype=np.int16) for _ in range(2))
        if count := self.per_state:
            upper[:, :count], lower[:, :count] = self.quanta[:, :count], self.quanta[:, count : 2 * count]
            return upper, lower
        counts = self.counts
        for count in distinct(counts).tolist():
            rows = counts == count
            upper[rows, :count] = self.quanta[rows, :count]
            lower[rows, :count] = self.quanta[rows, count : 2 * count]
        return upper, lower

    def blends(self) -> NDArray[np.int64]:
        """Which blend each line belongs to, (n,), counted from 0; a line alone is a blend of one.

        As in SPFIT (`linein`): a line is in the blend of the one before it where their frequencies differ by less than 1e-8 and
        their errors by less than 1e-7, both in the unit of the file. A line of the same frequency behind a blend, with an error
        more than twice as large, is no line: it says how wide the blend may be, and has -1.

        >>> lines = np.array([[5.0, 0.1], [5.0, 0.1], [5.0, 0.3], [7.0, 0.1]])
        >>> LineList(np.zeros((4, 12), dtype=np.int16), lines[:, 0], lines[:, 1], np.ones(4)).blends()
        array([ 0,  0, -1,  1])
        """
        groups = np.empty(len(self), dtype=np.int64)
        near, alike = (each.tolist() for each in like_line_before(self.frequency, self.error))
        if not any(near):
            return np.arange(len(self), dtype=np.int64)
        count, blend = 0, -1  # lines of the present blend, 0 behind its width
        for i in range(len(self)):
            follows = count > 0 and near[i - 1]
            if follows and alike[i - 1]:
                count += 1
                groups[i] = blend
            elif follows and count > 1 and self.error[i] * self.error[i - 1] > 2 * self.error[i - 1] ** 2:
                count = 0
                groups[i] = -1
            else:
                count, blend = 1, blend + 1
                groups[i] = blend
        return groups


def like_line_before(
    frequency: NDArray[np.float64], error: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether the second of n lines and those behind it have the frequency, and the error, of the line before, two arrays (n - 1,)."""
    near = np.abs(np.diff(frequency)) < 1e-14 * np.abs(frequency[1:]) + 1e-8
    return near, np.abs(np.diff(error)) < 1e-7


# behind a blank line, where SPFIT reads nothing
EXCLUDED = "lines that do not count, as rotor fit --reject left them out:"


def excluded_lines(lines: LineList, per_state: int = 0) -> LineList | None:
    """The lines behind the list that are marked as excluded, None where there are none."""
    _, mark, behind = lines.rest.partition(EXCLUDED)
    return read_lin(behind.lstrip("\r\n").encode(), per_state) if mark else None


def with_excluded(lines: LineList, excluded: LineList) -> LineList:
    """The lines with others behind a blank line, which end the list for SPFIT and are marked as excluded here."""
    return replace(lines, rest=f"\n{EXCLUDED}\n{format_lin(excluded).decode()}")


def read_lin(source: str | os.PathLike[str] | bytes, per_state: int = 0, most: int | None = None) -> LineList:
    """The lines in a .lin file, or in the bytes of one.

    As in the field's program a blank line ends the list, unless it stands at the beginning; text behind it is preserved; a
    missing error is 0.01 MHz, a missing weight 1. per_state: how many quantum numbers a state has, for lines that lack some;
    unless given, as many as in the other lines; more than six take more than twelve fields. most: how many lines count (NLINE):
    behind these one that is no line ends the list. Raises ValueError with file, line,
    column and the rule that is broken; nothing is skipped in silence.
    """
    lines, width = read_lines(source), max(QUANTA_FIELDS, 2 * per_state)
    first = next((i for i, line in enumerate(lines) if not line.blank), len(lines))
    end = next((i for i, line in enumerate(lines) if i > first and line.blank), len(lines))
    if most is not None:
        end = next((i for i in range(first + most, end) if not _is_line(lines[i], width)), end)
    listed = lines[first:end]
    texts = {i: line.text for i, line in enumerate(listed)}
    if texts:
        texts[0] = "".join(line.text for line in lines[:first]) + texts[0]
    plain = [_plain(line) for line in listed]
    fields = [_fields(line, width) for line in plain]
    missing = next((i for i, row in enumerate(fields) if _is_incomplete(row, per_state)), None)
    if missing is None:
        per_state = 0
    else:
        per_state = per_state or max((_leading(row) // 2 for row in fields if _leading(row) % 2 == 0), default=0)
        if not per_state:
            count = _leading(fields[missing])
            raise listed[missing].error(
                3 * count,
                f"{count} quantum numbers; the two states need equally many; complete the line, or give "
                "a line with all numbers or the constants of a fit, from which the missing ones follow",
            )
    measured = [_numbers(line, width) for line in plain]
    quanta = np.array([_row(row, per_state, width) for row in fields], dtype=np.int16).reshape(-1, width)
    columns = np.array([numbers for numbers, _ in measured], dtype=np.float64).reshape(-1, 3)
    rest = "".join(line.text for line in lines[end if texts else 0 :])
    without_error = frozenset(i for i, (_, words) in enumerate(measured) if words < 2)
    frequency, error, weight = columns.T
    return LineList(quanta, frequency, error, weight, texts, rest, per_state, without_error)


def _row(fields: tuple[int, ...], per_state: int, width: int) -> tuple[int, ...]:
    """The quantum numbers of a line before the first blank one, or with blanks among so many of each state."""
    present = fields[: 2 * per_state or _leading(fields)]
    return present + (BLANK,) * (width - len(present))


def _is_line(line: Line, width: int) -> bool:
    try:
        _fields(_plain(line), width)
        _numbers(_plain(line), width)
    except ValueError:
        return False
    return True


def with_defaults(lines: LineList, names: Sequence[str]) -> LineList:
    """The lines with SPFIT's values for quantum numbers that are missing, and no zeros behind those that are needed.

    0 for those of rotation and state; for a sum of angular momenta the sum before it, which is N for the first
    (`deflin` and `getlin` in H. M. Pickett's program). names: of the quantum numbers of a state, rotation and state first.
    """
    lines = without_zeros_behind(lines, len(names))
    if lines.per_state != len(names):
        return lines
    rotation = sum(name in _ROTATION for name in names)
    quanta = lines.quanta.copy()
    for start in (0, len(names)):
        for k in range(len(names)):
            before = 0 if k < rotation else quanta[:, start] if k == rotation else quanta[:, start + k - 1]
            quanta[:, start + k] = np.where(quanta[:, start + k] == BLANK, before, quanta[:, start + k])
    changed = np.flatnonzero((quanta != lines.quanta).any(axis=1)).tolist()
    return replace(lines, quanta=quanta, per_state=0, defaulted=lines.defaulted | set(changed))


def without_v(lines: LineList, per_state: int) -> LineList:
    """Lines of one state without its number: with v = 0 behind `per_state` quantum numbers of rotation, and nothing but zeros further on.

    F of a spin cannot be 0 in both states of all lines: 0 - 0 is no line. Other lists stay as they are.
    """
    stripped, width = without_zeros_behind(lines, per_state + 1).quanta, 2 * (per_state + 1)
    v = stripped[:, [per_state, width - 1]]
    if lines.per_state or not len(lines) or not ((stripped != BLANK).sum(axis=1) == width).all() or v.any():
        return lines
    quanta = np.full_like(lines.quanta, BLANK)
    quanta[:, : 2 * per_state] = np.delete(stripped[:, :width], [per_state, width - 1], axis=1)
    return replace(lines, quanta=quanta)


def without_zeros_behind(lines: LineList, per_state: int) -> LineList:
    """The lines without the zeros that fill the fields behind the quantum numbers of both states, which SPFIT does not look at.

    Programs that write .lin files for other programs too fill all twelve fields so. Other numbers there stay.
    """
    behind = lines.quanta[:, 2 * per_state :]
    filled = ((behind == 0) | (behind == BLANK)).all(axis=1) & (behind == 0).any(axis=1)
    if lines.per_state or not filled.any():
        return lines
    quanta = lines.quanta.copy()
    quanta[filled, 2 * per_state :] = BLANK
    return replace(lines, quanta=quanta)


def remark_notes(lines: LineList, blends: NDArray[np.int64]) -> list[str]:
    """What a user must know of blended lines that have words where the weight may stand; in other lines it has no bearing."""
    counts = np.bincount(blends[blends >= 0], minlength=1)
    shared = np.flatnonzero((blends >= 0) & (counts[blends] > 1)).tolist()
    width = lines.fields
    blended = []
    for i in shared:
        body = lines.texts.get(i, "").rstrip("\r\n").rpartition("\n")[2]
        words, at = read_words(Line(body, i, ""), 3 * width, 3, _REMARK_FROM)
        if len(words) == _REMARK_FROM and at < len(body) and body[at] != "/":
            blended.append(i)
    if not blended:
        return []
    return [
        f"{len(blended)} blended lines have words where their weight may stand, the first is line {blended[0] + 1}: their weight is 1, "
        "where SPFIT takes the next digits; write the weight, or / before the words"
    ]


def default_note(lines: LineList) -> str:
    """What a user must know of lines that lack something."""
    return (
        f"{counted(len(lines.defaulted), 'line lacks', 'lines lack')} quantum numbers or an error: "
        f"SPFIT's defaults are taken (F as the sum before it, "
        f"others 0; {NO_ERROR_MHZ} MHz)"
    )


def _plain(line: Line) -> Line:
    """The line without its end and a byte order mark."""
    return Line(line.body.removeprefix("\ufeff"), line.number, line.file)


def _numbers(line: Line, width: int) -> tuple[tuple[float, float, float], int]:
    """Frequency, error and weight behind so many fields of quantum numbers of a plain line, and how many of them are written."""
    if match := _AS_USUAL.match(line.text, 3 * width):
        texts = [text for text in match.groups() if text is not None]
        values = [float(text) for text in texts]
        if all(map(math.isfinite, values)):
            frequency, error, weight = (*values, *(NO_ERROR_MHZ, 1.0)[len(values) - 1 :])
            return (frequency, error, weight), len(values)
    words, _ = read_words(line, 3 * width, 3, _REMARK_FROM)
    frequency = number(line, words, 0, f"the frequency (from column {3 * width + 1} on)")
    error = number(line, words, 1, "the error of the frequency", NO_ERROR_MHZ)
    return (frequency, error, number(line, words, 2, "the weight", 1.0)), len(words)


def _leading(fields: tuple[int, ...]) -> int:
    """Quantum numbers before the first blank field."""
    return fields.index(BLANK) if BLANK in fields else len(fields)


def _is_incomplete(fields: tuple[int, ...], per_state: int) -> bool:
    """Whether a line lacks quantum numbers: an odd count before a blank, or a blank among as many as there should be.

    A lower state that begins with a number below 0 is none and needs no more of them.
    """
    count = _leading(fields)
    if per_state and per_state < len(fields) < 2 * per_state and fields[per_state] < 0:
        return True
    return bool(count % 2) or not count or (count < len(fields) <= 2 * per_state)


def _fields(line: Line, width: int) -> tuple[int, ...]:
    """The fields of three columns up to the last quantum number, blank ones among them; an annotation behind a blank ends them."""
    text, quanta = line.text[: 3 * width].rstrip(" "), list[int]()
    try:
        return tuple([_field(text[column : column + 3]) for column in range(0, len(text), 3)])
    except ValueError:  # what is wrong, or where an annotation begins
        pass
    for column in range(0, len(text), 3):
        part = text[column : column + 3]
        try:
            quanta.append(_field(part))
        except ValueError as error:
            if BLANK in quanta:
                break
            rule = "quantum numbers fill three columns each, from the first column on"
            raise line.error(column, f"quantum number reads {part!r}; {error}; {rule}") from None
    while quanta and quanta[-1] == BLANK:
        quanta.pop()
    return tuple(quanta)


@lru_cache(maxsize=4096)
def _field(part: str) -> int:
    return read_whole(part) if part.strip(" ") else BLANK


def format_lin(lines: LineList) -> bytes:
    """The text of a line list; each line as it was read, as long as it says the same."""
    return encode([*(_line_text(lines, index) for index in range(len(lines))), lines.rest])


def _line_text(lines: LineList, index: int) -> str:
    row, stored = tuple(lines.quanta[index].tolist()), lines.texts.get(index, "")
    numbers = float(lines.frequency[index]), float(lines.error[index]), float(lines.weight[index])
    if stored:
        line = _plain(Line(stored.rstrip("\r\n").rpartition("\n")[2], index, "stored text"))
        if row == _row(_fields(line, lines.fields), lines.per_state, lines.fields) and (
            numbers == _numbers(line, lines.fields)[0]
        ):
            return stored
    quanta = row[: 2 * lines.per_state] or tuple(q for q in row if q != BLANK)
    if not quanta or len(quanta) % 2 or any(q != BLANK and not -99 <= q <= 999 for q in quanta):
        raise ValueError(
            f"line {index + 1} cannot be written: quantum numbers {quanta}; as many for the upper as for "
            "the lower state, from -99 to 999, fit the format"
        )
    spelled = "".join("   " if q == BLANK else f"{q:3d}" for q in quanta)
    return f"{spelled:<{3 * lines.fields}} {numbers[0]!r:>16} {numbers[1]!r:>10} {numbers[2]!r}\n"


def line_list(quanta_upper: Any, quanta_lower: Any, frequency_mhz: Any, error_mhz: Any, weight: Any = 1.0) -> LineList:
    """A line list from quantum numbers of both states, frequencies and errors.

    quanta_upper, quanta_lower (n, k): k up to 10. frequency_mhz (n,): measured. error_mhz (n,) or a number: not negative. weight (n,) or a
    number: shares in blends.
    Raises ValueError for shapes that do not fit each other, and errors below 0.

    >>> print(format_lin(line_list([[1]], [[0]], [115271.2018], 0.0005)).decode(), end="")
      1  0                                    115271.2018     0.0005 1.0
    """
    upper, lower = np.asarray(quanta_upper), np.asarray(quanta_lower)
    frequency = np.asarray(frequency_mhz, dtype=np.float64)
    if upper.shape != lower.shape or upper.ndim != 2 or upper.shape[1] > MOST_QUANTA or len(upper) != len(frequency):
        raise ValueError(f"quantum numbers of shapes {upper.shape}, {lower.shape} for {len(frequency)} lines; (n, k)")
    quanta = np.full((len(upper), max(QUANTA_FIELDS, 2 * upper.shape[1])), BLANK, dtype=np.int16)
    quanta[:, : 2 * upper.shape[1]] = np.concatenate([upper, lower], axis=1)
    error, share = (np.broadcast_to(np.asarray(v, dtype=np.float64), frequency.shape) for v in (error_mhz, weight))
    if (error < 0).any():
        raise ValueError("errors in MHz are not negative; in the file a minus sign means cm⁻¹")
    return LineList(quanta, frequency, error, share)
