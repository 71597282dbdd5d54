"""Lists of objects of several kinds, such as [[pulses]] with shape = "gaussian"; each kind is a dataclass of declared fields."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.field import REQUIRED, all_fields, undeclared
from rotor.requests.fill import Entries, equal, read_instance, written_fields
from rotor.requests.readers import InsideError, Reader


@dataclass(frozen=True, eq=False)
class Choices(Reader):
    """Reader of a list of objects of several kinds: tables of a scene, lines of text on the command line, or the objects themselves.

    word: the key that names the kind. load: returns the dataclasses by kind.
    """

    word: str
    load: Callable[[], Mapping[str, type]]
    metavar: str = "TEXT"
    many = True

    def read(self, raw: Any) -> tuple[Any, ...]:
        """Objects from tables, text lines or objects; an error in a table gives its number and key."""
        items = raw if isinstance(raw, list | tuple) else (raw,)
        return tuple(self._read(item, number) for number, item in enumerate(items))

    def _read(self, item: Any, number: int) -> Any:
        if isinstance(item, str):
            return self._read_line(item)
        if not isinstance(item, Mapping):
            return item
        try:
            kind, values = self.load()[str(item[self.word])], {k: v for k, v in item.items() if k != self.word}
            return read_instance(kind, Entries(values, "key"))
        except ValueError as error:
            text = str(error)
            inside = text.partition(":")[0] in item
            raise InsideError(f"[{number}].{text}" if inside else f"[{number}]: {text}") from None

    def _read_line(self, line: str) -> Any:
        """Object from a line such as `linear drag coefficients=0.1,0.1,0.2`: commas separate numbers, semicolons rows."""
        name, texts = _words(line)
        kinds = self.load()
        if name not in kinds:
            raise ValueError(
                f"{line!r}: no {self.word} is named {name!r}; {nearest(name, kinds)} (a name, then key=value)"
            )
        fields = {field.last: field for field in all_fields(kinds[name]).values()}
        for key in texts:
            if key not in fields:
                raise ValueError(f"{line!r}: {name} has no {key!r}; {nearest(key, fields)}")
        if missing := [key for key, field in fields.items() if field.default is REQUIRED and key not in texts]:
            usage = ", ".join(f"{key} ({field.help})" for key, field in fields.items())
            raise ValueError(f"{line!r}: {missing[0]} is missing; give {usage}")
        values = {}
        for key, text in texts.items():
            try:
                values[fields[key].name] = fields[key].reader.read(text)
            except ValueError as error:
                rule = str(error).partition(": ")[2]
                raise ValueError(f"{line!r}: {key}={text}: {rule}") from None
        return kinds[name](**values)

    def line(self, thing: Any) -> str:
        """The line of text of an object; the name of its class if a line cannot hold it."""
        try:
            table = self.write([thing])[0]
        except ValueError:
            return type(thing).__name__
        parts = [f"{key}={_line_text(value)}" for key, value in table.items() if key != self.word]
        return " ".join([table[self.word], *parts])

    def write(self, value: Any) -> list[dict[str, Any]]:
        """Tables for a scene; ValueError for an object that a table cannot hold."""
        names: dict[Any, str] = {kind: name for name, kind in self.load().items()}
        if other := next((thing for thing in value if type(thing) not in names), None):
            raise ValueError(f"a scene holds no {type(other).__name__}; there are {', '.join(names.values())}")
        for thing in value:
            kind: Any = type(thing)
            if any(not equal(getattr(thing, field.name), field.default) for field in undeclared(kind)):
                raise ValueError(f"a scene holds no {type(thing).__name__} of this form")
        return [{self.word: names[type(thing)], **written_fields(thing)} for thing in value]


def _line_text(value: Any) -> str:
    """Text with commas between numbers and semicolons between rows; a diagonal matrix is written as its diagonal."""
    if not isinstance(value, list):
        return f"{value:g}" if isinstance(value, float) else str(value)
    if not all(isinstance(row, list) for row in value):
        return ",".join(f"{number:g}" for number in value)
    if all(element == 0 for i, row in enumerate(value) for k, element in enumerate(row) if i != k) and len(
        value
    ) == len(value[0]):
        return ",".join(f"{row[i]:g}" for i, row in enumerate(value))
    return ";".join(map(_line_text, value))


def _words(line: str) -> tuple[str, dict[str, str]]:
    """The kind at the start of a line, and the text of each parameter."""
    name: list[str] = []
    texts: dict[str, str] = {}
    key = ""
    for word in line.split():
        before, equals, after = word.partition("=")
        if equals:
            key = before
            if not key or key in texts:
                raise ValueError(f"{line!r}: expected each parameter once, as name=value")
            texts[key] = after
        elif texts:
            texts[key] += word
        else:
            name.append(word)
    return " ".join(name), texts


def nearest(word: str, names: Iterable[str]) -> str:
    """Part of an error message: the name most similar to a mistyped word, or all names.

    >>> nearest("watr", ["water", "ammonia"])
    "the nearest is 'water'"
    """
    names = list(names)
    near = difflib.get_close_matches(word, names, n=1, cutoff=0.5)
    return f"the nearest is {near[0]!r}" if near else f"there are {', '.join(names)}"
