"""Energy levels as SPCAT lists them, .egy: block, energy, mixing, degeneracy and quantum numbers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.formats.atomic_write import DoesNotFitError
from rotor.formats.spcat.text.fields import BLANK, read_decimal, read_whole
from rotor.formats.spcat.text.freeform import Line, encode, read_lines
from rotor.frozen import dataclass

_COLON = 63  # where the quantum numbers' colon stands


class Level(NamedTuple):
    """The numbers of one level; the names are those of `LevelList`."""

    block: int
    rank: int
    energy_cm: float
    error_cm: float
    mixing: float
    degeneracy: int
    quanta: tuple[int, ...]
    pattern: int | None = None


@dataclass(frozen=True, eq=False)
class LevelList:
    """Levels, columns of equal length n.

    block, rank (n,): block of the program's Hamiltonian and place in it (see `block_numbers`). energy_cm, error_cm (n,): cm⁻¹. mixing (n,):
    weight of the function that labels the level. degeneracy (n,): of M and of nuclear spins. quanta (n, w): -32768 if blank. pattern (n,):
    the number that replaces the coupling pattern in a .cat file of more than six quantum numbers, in brackets here; -32768 if blank.
    texts: text that differs from what would be written from the numbers (derivatives and vectors among the levels, other spacing), with
    what precedes the level. rest: text after the last level.
    """

    block: NDArray[np.int32]
    rank: NDArray[np.int32]
    energy_cm: NDArray[np.float64]
    error_cm: NDArray[np.float64]
    mixing: NDArray[np.float64]
    degeneracy: NDArray[np.int32]
    quanta: NDArray[np.int16]
    texts: Mapping[int, str] = field(default_factory=dict)
    rest: str = ""
    pattern: NDArray[np.int16] | None = None

    def __len__(self) -> int:
        return len(self.block)

    def level(self, index: int) -> Level:
        """The numbers of one level."""
        columns = (self.block, self.rank, self.energy_cm, self.error_cm, self.mixing, self.degeneracy)
        quanta = tuple(q for q in self.quanta[index].tolist() if q != BLANK)
        pattern = BLANK if self.pattern is None else int(self.pattern[index])
        return Level._make(
            [*(column[index].item() for column in columns), quanta, None if pattern == BLANK else pattern]
        )


_FIELDS: tuple[tuple[str, slice, Callable[[str], float], float], ...] = (  # what is too large for columns is last
    ("IBLK", slice(0, 6), read_whole, 10**6),
    ("INDX", slice(6, 11), read_whole, 10**4),
    ("EGY", slice(11, 29), read_decimal, 1e9),
    ("ERR", slice(29, 47), read_decimal, 1e10),
    ("PMIX", slice(47, 58), read_decimal, 1e3),
    ("the degeneracy", slice(58, 63), read_whole, 10**4),
)


def read_egy(source: str | os.PathLike[str] | bytes) -> LevelList:
    """The levels in an .egy file, packed or not, or in the bytes of one.

    A line without the colon before its quantum numbers is none of a level; it must be of a table of derivatives or
    of a vector, which are preserved, not read. Raises ValueError with file, line, column and the rule that is broken.
    """
    levels: list[Level] = []
    texts: dict[int, str] = {}
    before = ""
    for line in read_lines(source):
        if line.blank or line.text.startswith(" " * 8):
            before += line.text
            continue
        level = read_level(line)
        if before or _plain_text(level) != line.text:
            texts[len(levels)] = before + line.text
        levels.append(level)
        before = ""
    return _level_list(levels, texts, before)


def _level_list(levels: list[Level], texts: dict[int, str], rest: str) -> LevelList:
    width = max((len(level.quanta) for level in levels), default=0)
    quanta = np.full((len(levels), width), BLANK, dtype=np.int16)
    for row, level in zip(quanta, levels, strict=True):
        row[: len(level.quanta)] = level.quanta
    columns = list(zip(*(level[:6] for level in levels), strict=True)) or [()] * 6
    whole = [np.array(columns[i], dtype=np.int32) for i in (0, 1, 5)]
    real = [np.array(columns[i], dtype=np.float64) for i in (2, 3, 4)]
    pattern = np.array([BLANK if level.pattern is None else level.pattern for level in levels], dtype=np.int16)
    stated_pattern = pattern if (pattern != BLANK).any() else None
    return LevelList(whole[0], whole[1], real[0], real[1], real[2], whole[2], quanta, texts, rest, stated_pattern)


def read_level(line: Line) -> Level:
    """The numbers of one line of the file."""
    text = line.body
    if text[_COLON : _COLON + 1] != ":":
        raise line.error(_COLON, "a level has a colon here, before its quantum numbers")
    numbers = [line.read(part, name, read) for name, part, read, _ in _FIELDS]
    start, pattern = _COLON + 1, None
    if text[start : start + 1] == "(" and text[start + 4 : start + 5] == ")":
        pattern = line.read(slice(start + 1, start + 4), "the number in brackets", read_whole)
        start += 5
    columns = range(start, len(text), 3)
    quanta = tuple(line.read(slice(at, min(at + 3, len(text))), "quantum number", read_whole) for at in columns)
    return Level._make([*numbers, quanta, pattern])


def format_level(level: Level) -> str:
    """The line of a level as SPCAT writes it; DoesNotFitError for numbers that do not fit its columns."""
    text = _plain_text(level)
    wide = [f"quantum number {q}" for q in level.quanta if not -99 <= q <= 999]
    numbers = zip(_FIELDS, level[:6], strict=True)
    wide += [f"{name} = {value:.10g}" for (name, *_, limit), value in numbers if not abs(value) < limit]
    if wide or text.find(":") != _COLON:
        quanta = " ".join(map(str, level.quanta))
        raise DoesNotFitError(
            f"level {quanta}: {wide[0] if wide else 'a number'} does not fit the columns of an .egy file"
        )
    return text


def _plain_text(level: Level) -> str:
    energy = round(level.energy_cm, 6) + 0.0  # 0.0 where round-off below zero would print as -0.000000
    numbers = f"{energy:17.6f} {level.error_cm:17.6f} {level.mixing:10.6f} {level.degeneracy:4d}"
    pattern = "" if level.pattern is None else f"({level.pattern:3d})"
    return f"{level.block:6d} {level.rank:4d} {numbers}:{pattern}" + "".join(f"{q:3d}" for q in level.quanta) + "\n"


def format_egy(levels: LevelList) -> bytes:
    """The text of a level list; each line as it was read, as long as it says the same."""
    texts = []
    for index in range(len(levels)):
        level, stored = levels.level(index), levels.texts.get(index, "")
        last = stored.rstrip("\r\n").rpartition("\n")[2]
        texts.append(
            stored if stored and read_level(Line(last, index, "stored text")) == level else format_level(level)
        )
    return encode([*texts, levels.rest])
