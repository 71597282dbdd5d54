"""Measured lines for SPFIT, .lin: quantum numbers in twelve fields of three, then frequency, error and weight."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.formats.atomic_write import open_atomic
from rotor.formats.spcat.fields import BLANK, read_whole
from rotor.formats.spcat.freeform import Line, encode, number, read_lines, read_words
from rotor.units import MHZ_PER_CM

QUANTA_FIELDS = 12
_WIDTH = 3 * QUANTA_FIELDS


class Measured(NamedTuple):
    """The numbers of one line: quantum numbers of the upper state, then of the lower, and the rest as in the file."""

    quanta: tuple[int, ...]
    frequency: float
    error: float
    weight: float


@dataclass(frozen=True, eq=False)
class LineList:
    """Measured lines, columns of equal length n.

    quanta (n, 12): upper state, then at once the lower one; -32768 where blank. frequency, error (n,): as written,
    MHz or, where the error is negative, cm⁻¹. weight (n,): share within a blend. texts: lines as they were read,
    with the blank lines before them. rest: what follows the last line.
    """

    quanta: NDArray[np.int16]
    frequency: NDArray[np.float64]
    error: NDArray[np.float64]
    weight: NDArray[np.float64]
    texts: Mapping[int, str] = field(default_factory=dict)
    rest: str = ""

    def __post_init__(self) -> None:
        n = len(self.frequency)
        shapes = {name: np.shape(getattr(self, name)) for name in ("quanta", "frequency", "error", "weight")}
        if shapes != {"quanta": (n, QUANTA_FIELDS), "frequency": (n,), "error": (n,), "weight": (n,)}:
            raise ValueError(f"columns of shapes {shapes}; expected quanta (n, {QUANTA_FIELDS}) and the others (n,)")

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def frequency_mhz(self) -> NDArray[np.float64]:
        """Frequencies in MHz, (n,)."""
        return np.where(self.error < 0, self.frequency * MHZ_PER_CM, self.frequency)

    @property
    def error_mhz(self) -> NDArray[np.float64]:
        """Measurement errors in MHz, (n,), not negative."""
        return np.where(self.error < 0, -self.error * MHZ_PER_CM, self.error)

    def states(self) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
        """Quantum numbers of the upper and the lower states, two arrays (n, 6), blanks -32768."""
        upper, lower = (np.full((len(self), QUANTA_FIELDS // 2), BLANK, dtype=np.int16) for _ in range(2))
        counts = (self.quanta != BLANK).sum(axis=1) // 2
        for count in np.unique(counts).tolist():
            rows = counts == count
            upper[rows, :count] = self.quanta[rows, :count]
            lower[rows, :count] = self.quanta[rows, count : 2 * count]
        return upper, lower

    def blends(self) -> NDArray[np.int64]:
        """Which blend each line belongs to, (n,), counted from 0; a line alone is a blend of one.

        Lines of one frequency and error that follow each other are one blend. A line of the same frequency behind a
        blend, with an error at least twice as large, is no line: it says how wide the blend may be, and has -1.

        >>> lines = np.array([[5.0, 0.1], [5.0, 0.1], [5.0, 0.3], [7.0, 0.1]])
        >>> LineList(np.zeros((4, 12), dtype=np.int16), lines[:, 0], lines[:, 1], np.ones(4)).blends()
        array([ 0,  0, -1,  1])
        """
        groups = np.empty(len(self), dtype=np.int64)
        first, blend = 0, -1
        for i in range(len(self)):
            alike = i > 0 and self.frequency[i] == self.frequency[first]
            if alike and self.error[i] == self.error[first]:
                groups[i] = blend
            elif alike and i - first > 1 and abs(self.error[i]) >= 2 * abs(self.error[first]):
                groups[i] = -1
            else:
                first, blend = i, blend + 1
                groups[i] = blend
        return groups

    def measured(self, index: int) -> Measured:
        """The numbers of one line."""
        quanta = tuple(q for q in self.quanta[index].tolist() if q != BLANK)
        return Measured(quanta, float(self.frequency[index]), float(self.error[index]), float(self.weight[index]))


def read_lin(source: str | os.PathLike[str] | bytes) -> LineList:
    """The lines in a .lin file, or in the bytes of one.

    As in the field's program a blank line ends the list, unless it stands at the beginning; text behind it is preserved.
    Raises ValueError with file, line, column and the rule that is broken; nothing is skipped in silence.
    """
    lines = read_lines(source)
    first = next((i for i, line in enumerate(lines) if not line.blank), len(lines))
    end = next((i for i, line in enumerate(lines) if i > first and line.blank), len(lines))
    measured = [read_measured(line) for line in lines[first:end]]
    texts = {i: line.text for i, line in enumerate(lines[first:end])}
    if texts:
        texts[0] = "".join(line.text for line in lines[:first]) + texts[0]
    quanta = np.full((len(measured), QUANTA_FIELDS), BLANK, dtype=np.int16)
    for row, line in zip(quanta, measured, strict=True):
        row[: len(line.quanta)] = line.quanta
    columns = np.array([line[1:] for line in measured], dtype=np.float64).reshape(-1, 3)
    rest = "".join(line.text for line in lines[end if texts else 0 :])
    return LineList(quanta, columns[:, 0], columns[:, 1], columns[:, 2], texts, rest)


def read_measured(line: Line) -> Measured:
    """The numbers of one line of the file."""
    body = line.body.removeprefix("\ufeff")
    quanta = _quanta(line._replace(text=body), body[:_WIDTH])
    words, _ = read_words(line._replace(text=body), _WIDTH, 3)
    frequency = number(line, words, 0, "the frequency (from column 37 on)")
    error = number(line, words, 1, "the error of the frequency")
    return Measured(quanta, frequency, error, number(line, words, 2, "the weight", 1.0))


def _quanta(line: Line, text: str) -> tuple[int, ...]:
    """The quantum numbers up to the first blank field; what stands behind it in the 36 columns is an annotation."""
    quanta: list[int] = []
    for column in range(0, min(_WIDTH, len(text)), 3):
        part = text[column : column + 3]
        if not part.strip(" "):
            break
        try:
            quanta.append(read_whole(part))
        except ValueError as error:
            raise line.error(column, f"quantum number reads {part!r}; {error}") from None
    if not quanta or len(quanta) % 2:
        raise line.error(
            3 * len(quanta), f"{len(quanta)} quantum numbers; expected as many for the upper state as for the lower"
        )
    return tuple(quanta)


def format_lin(lines: LineList) -> bytes:
    """The text of a line list; each line as it was read, as long as it says the same."""
    return encode([*(_line_text(lines, index) for index in range(len(lines))), lines.rest])


def _line_text(lines: LineList, index: int) -> str:
    measured, stored = lines.measured(index), lines.texts.get(index, "")
    if stored and read_measured(Line(stored.rstrip("\r\n").rpartition("\n")[2], index, "stored text")) == measured:
        return stored
    wrong = next((q for q in measured.quanta if not -99 <= q <= 999), None)
    if wrong is not None or not measured.quanta or len(measured.quanta) % 2:
        raise ValueError(
            f"line {index + 1} cannot be written: quantum numbers {measured.quanta}; as many for the upper as for "
            "the lower state, from -99 to 999, fit the format"
        )
    quanta = "".join(f"{q:3d}" for q in measured.quanta)
    return f"{quanta:<{_WIDTH}} {measured.frequency!r:>16} {measured.error!r:>10} {measured.weight!r}\n"


def write_lin(lines: LineList, path: str | os.PathLike[str]) -> None:
    """Write a .lin file; an existing one is replaced at the end or not at all."""
    with open_atomic(path) as handle:
        handle.write(format_lin(lines))


def line_list(quanta_upper: Any, quanta_lower: Any, frequency_mhz: Any, error_mhz: Any, weight: Any = 1.0) -> LineList:
    """A line list from quantum numbers (n, k) of both states, k up to 6, frequencies and errors in MHz.

    >>> print(format_lin(line_list([[1]], [[0]], [115271.2018], 0.0005)).decode(), end="")
      1  0                                    115271.2018     0.0005 1.0
    """
    upper, lower = np.asarray(quanta_upper), np.asarray(quanta_lower)
    frequency = np.asarray(frequency_mhz, dtype=np.float64)
    if upper.shape != lower.shape or upper.ndim != 2 or upper.shape[1] > 6 or len(upper) != len(frequency):
        raise ValueError(f"quantum numbers of shapes {upper.shape}, {lower.shape} for {len(frequency)} lines; (n, k)")
    quanta = np.full((len(upper), QUANTA_FIELDS), BLANK, dtype=np.int16)
    quanta[:, : 2 * upper.shape[1]] = np.concatenate([upper, lower], axis=1)
    error, share = (np.broadcast_to(np.asarray(v, dtype=np.float64), frequency.shape) for v in (error_mhz, weight))
    if (error < 0).any():
        raise ValueError("errors in MHz are not negative; in the file a minus sign means cm⁻¹")
    return LineList(quanta, frequency, error, share)
