"""Lines of the input files: cut without loss, numbers in free form, errors that say file, line and column."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, fields
from types import MappingProxyType
from typing import Any, NamedTuple

from rotor.formats.packed import load

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d+(?:\.0*)?\Z", re.ASCII)
_REMARK = re.compile(r"(?![OoIl]\.?\d)[^\d.+\-,/\s]")
MOST = 1e100  # of values: squares of larger numbers may overflow
_GAP = " \t\r\n"


class Line(NamedTuple):
    """A line with its end, and where it stands."""

    text: str
    number: int
    file: str

    @property
    def body(self) -> str:
        """The text without its end."""
        return self.text.rstrip("\r\n")

    @property
    def blank(self) -> bool:
        """Whether there is nothing on it."""
        return not self.text.strip(_GAP + "\x1a")

    def error(self, column: int, message: str) -> ValueError:
        """The error to raise for what stands from `column` on, which counts from 0 here and from 1 in the message."""
        return ValueError(f"{self.file}, line {self.number}, column {column + 1}: {message}")

    def read(self, part: slice, name: str, read: Callable[[str], Any]) -> Any:
        """What a fixed field says, called `name` in errors; ValueError with file, line and column."""
        text = self.text[part]
        try:
            return read(text)
        except ValueError as error:
            raise self.error(part.start, f"{name} reads {text!r}; {error}") from None


def read_lines(source: str | os.PathLike[str] | bytes) -> list[Line]:
    """The lines of a file or of its bytes, ends included; bytes that are no UTF-8 survive a round trip.

    Lines end with a line feed, a carriage return before it or not; one anywhere else is an error.
    """
    data, name = load(source)
    text = data.decode("utf-8", "surrogateescape")
    pieces = text.split("\n")
    ended = [piece + "\n" for piece in pieces[:-1]] + ([pieces[-1]] if pieces[-1] else [])
    lines = [Line(piece, number, name) for number, piece in enumerate(ended, 1)]
    for line in lines if "\r" in text else ():
        if "\r" in line.body:
            raise line.error(line.body.index("\r"), "a carriage return inside a line; end lines with line feeds")
    return lines


def encode(texts: Sequence[str]) -> bytes:
    """The bytes of a file, the inverse of `read_lines`; every piece but the last ends with a line break."""
    pieces = [text for text in texts if text]
    ended = [text if text.endswith("\n") else text + "\n" for text in pieces[:-1]]
    return "".join(ended + pieces[-1:]).encode("utf-8", "surrogateescape")


class Word(NamedTuple):
    """One number as it is written, None where a comma stands for a default, and where it begins."""

    text: str | None
    column: int


def read_words(
    line: Line, start: int, count: int, remark_from: int | None = None, *, abutting: bool = False
) -> tuple[list[Word], int]:
    """At most `count` numbers from column `start` on, and where what follows them begins.

    start: column, from 0. count: how many numbers at most. remark_from: after this many numbers a word ends the list even without a slash
    before it. A letter that looks like a digit (O.5, l0) does not count as a word. abutting: whether a number may begin with its point or
    sign directly after another, as in full fixed columns: 0.01000.0 is 0.01000 and .0, as SPFIT reads it.
    Raises ValueError with file, line and column, for what is no number.
    Numbers are separated by blanks or a comma; two commas in a row leave a default, one before the first number does not, as the field's
    programs read such lines; a slash ends the list. Anything else where a number may stand is an error: the field's programs skip it in
    silence and take the next digits, those of a comment for instance.
    """
    text, at, words = line.body, start, list[Word]()
    pending_comma = False
    while len(words) < count:
        at = _after_gap(text, at)
        if at >= len(text) or text[at] == "/":
            break
        if text[at] == ",":
            if pending_comma:
                words.append(Word(None, at))
            pending_comma = True
            at += 1
            continue
        if remark_from is not None and len(words) >= remark_from and _REMARK.match(text, at):
            break
        match = _NUMBER.match(text, at)
        if not match or not (_ends(text, match.end()) or (abutting and text[match.end()] in "+-.")):
            wrong = re.split(r"[\s,/]", text[at:], maxsplit=1)[0]
            raise line.error(
                at, f"{wrong!r} is no number; numbers are parted by blanks or commas, a comment begins with /"
            )
        words.append(Word(match[0], at))
        pending_comma = False
        at = match.end()
    return words, at


def read_code(line: Line, start: int = 0) -> tuple[list[Word], int]:
    """The whole number that a line begins with from column `start` on, none where a comma stands there, and where the rest begins.

    One comma behind it belongs to it.
    """
    text = line.body
    at = _after_gap(text, start)
    words, at = read_words(line, at, 1) if text[at : at + 1] not in (",", "/") else ([], at)
    at = _after_gap(text, at)
    return words or [Word(None, at)], at + (text[at : at + 1] == ",")


def _after_gap(text: str, at: int) -> int:
    """The place behind blanks."""
    while at < len(text) and text[at] in _GAP:
        at += 1
    return at


def _ends(text: str, at: int) -> bool:
    return at == len(text) or text[at] in _GAP + ",/"


@contextmanager
def expecting(rule: str) -> Iterator[None]:
    """Reading what has a rule, which errors state behind what is wrong."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{error}; {rule}") from None


def number(
    line: Line,
    words: Sequence[Word],
    index: int,
    name: str,
    default: float | None = None,
    most: float = sys.float_info.max,
) -> float:
    """The number `index` of a line, called `name` in errors, with an exponent E or D; its default where it is left out.

    Raises ValueError, with file, line and column, where it is missing and has no default, and where it exceeds `most`.
    """
    word = _present(line, words, index, name, default is not None)
    if word.text is None:
        return default or 0.0
    value = float(word.text.replace("D", "E").replace("d", "e"))
    if not abs(value) <= most:
        raise line.error(word.column, f"{name} = {word.text} is too large: expected at most {most:.0e}")
    return value


def whole(line: Line, words: Sequence[Word], index: int, name: str, default: int | None = None) -> int:
    """The integer `index` of a line, with at most 30 digits; a decimal point and what follows it are ignored. See `number`."""
    word = _present(line, words, index, name, default is not None)
    if word.text is None:
        return default or 0
    if not _WHOLE.match(word.text) or len(word.text) > 30:
        raise line.error(word.column, f"{name} = {word.text}: expected a whole number")
    return int(word.text.split(".")[0])


def _present(line: Line, words: Sequence[Word], index: int, name: str, optional: bool) -> Word:
    """A word of the line; its error where it is missing and not optional."""
    word = words[index] if index < len(words) else Word(None, len(line.body))
    if word.text is None and not optional:
        raise line.error(word.column, f"{name} is missing")
    return word


def numbers(
    line: Line, words: Sequence[Word], defaults: Mapping[str, Any], names: Mapping[str, str] = MappingProxyType({})
) -> dict[str, Any]:
    """The numbers of a line by key, integers where the default is one; a default of MISSING must be stated.

    names: of numbers in errors, by default the key in capital letters.
    """
    values = {}
    for index, (key, default) in enumerate(defaults.items()):
        read = number if isinstance(default, float) else whole
        values[key] = read(line, words, index, names.get(key, key.upper()), None if default is MISSING else default)
    return values


def default_values(record: type) -> dict[str, Any]:
    """The numbers of a record and their defaults."""
    return {each.name: each.default for each in fields(record) if each.compare and not isinstance(each.default, str)}


def as_read(thing: Any, read: Callable[[Line], Any]) -> str:
    """The text from which a thing was read if reading it gives the thing, else nothing."""
    text: str = thing.text
    return text if text and read(Line(text, 0, "stored text")) == thing else ""


def read_title(line: Line) -> str:
    """The title in the first line of a file; programs write a date far to the right."""
    return " ".join(line.body.removeprefix("\ufeff").split())


def title_text(title: str, stored: str) -> str:
    """The line of a title, as it was read if it says the same."""
    return stored if stored and read_title(Line(stored, 1, "")) == title else one_line(title)


def one_line(text: str) -> str:
    """A line of a title or of a parameter; ValueError for a text of several lines."""
    if "\n" in text or "\r" in text:
        raise ValueError(f"{text!r}: a title or label is one line")
    return text + "\n"


def spell(value: float) -> str:
    """A number with 16 digits, or 17 where it takes as many to say it exactly.

    >>> spell(9192.631770), spell(0.1 + 0.2)
    ('9.192631770000000E+03', '3.0000000000000004E-01')
    """
    text = f"{value:.15E}"
    return text if float(text) == value else f"{value:.16E}"
