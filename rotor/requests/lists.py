"""Readers of several values: numbers, names, numbers by name, arrays, one number for each thing."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from numbers import Real
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.readers import Listed, Quantity, Reader
from rotor.units import parse_grid


@dataclass(frozen=True, eq=False, repr=False)
class Numbers(Listed):
    """Numbers in a unit, from a text with commas or a list. counts: allowed lengths; any length if empty."""

    unit: str = ""
    counts: Collection[int] = ()
    example: str = "0,0,1"
    metavar: str = "LIST"
    scene_type = list[float]
    item = float

    def read(self, raw: Any) -> tuple[float, ...]:
        """The numbers."""
        if isinstance(raw, str):
            values = tuple(parse_grid(raw, self.unit).tolist()) if ":" not in raw else ()
        else:
            values = tuple(map(float, [raw] if isinstance(raw, Real) else raw))
        if (self.counts and len(values) not in self.counts) or not values or not all(map(math.isfinite, values)):
            words = {1: "one", 3: "three", 4: "four"}
            count = " or ".join(words.get(n, str(n)) for n in self.counts)
            raise ValueError(f"{raw!r}: expected {count + ' ' if count else ''}finite numbers, such as {self.example}")
        return values


_COMMAS = re.compile(r",(?![^()\[\]]*[)\]])")  # commas inside brackets belong to a name


@dataclass(frozen=True, eq=False, repr=False)
class NameList(Listed):
    """Distinct names, from a text with commas or a list. words: the allowed names; any if empty. Commas in brackets belong to a name."""

    words: Collection[str] = ()
    metavar: str = "LIST"
    scene_type: Any = list[str]

    def read(self, raw: Any) -> tuple[str, ...]:
        """The names."""
        names = [name.strip() for name in _COMMAS.split(raw)] if isinstance(raw, str) else list(raw)
        if self.words and not set(names) <= set(self.words):
            raise ValueError(f"{raw!r}: expected each of {', '.join(self.words)} once at most")
        if not names or not all(names):
            raise ValueError(f"{raw!r}: names parted by commas are needed, such as A,B,C,DeltaJ")
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise ValueError(f"{raw!r}: {twice} is named twice; once is enough")
        return tuple(names)


@dataclass(frozen=True, eq=False, repr=False)
class Pairs(Reader):
    """Numbers by name, from `ee=1,eo=3` or a table. number: type of the values. what: what the names stand for."""

    number: type = int
    what: str = "class"
    example: str = "ee=1"
    metavar: str = "LIST"
    lower: bool = False

    @property
    def scene_type(self) -> Any:
        """A table of numbers."""
        return dict[str, int] if self.number is int else dict[str, float]

    def read(self, raw: Any) -> dict[str, Any]:
        """The numbers by name."""
        if isinstance(raw, Mapping):
            return {str(name): self.number(value) for name, value in raw.items()}
        table: dict[str, Any] = {}
        for item in raw.split(","):
            name, _, number = (part.strip() for part in item.partition("="))
            name = name.lower() if self.lower else name
            if not name or not self._is_number(number) or name in table:
                rule = f"{self.what}=number, each {self.what} once, such as {self.example}"
                raise ValueError(f"{item.strip()!r} in {raw!r}: expected {rule}")
            table[name] = self.number(number)
        return table

    def _is_number(self, text: str) -> bool:
        pattern = r"\d+" if self.number is int else r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
        return re.fullmatch(pattern, text) is not None


@dataclass(frozen=True, eq=False, repr=False)
class Array(Reader):
    """A vector or matrix: commas separate numbers, semicolons rows. Its owner checks the shape."""

    scene_type: Any = list[float]
    metavar: str = "LIST"

    def read(self, raw: Any) -> Any:
        """Numbers from a text; lists and arrays are passed on."""
        if not isinstance(raw, str):
            return raw
        try:
            rows = [[float(number) for number in row.split(",")] for row in raw.split(";")]
        except ValueError:
            raise ValueError(f"{raw!r}: expected numbers, separated by commas; rows by semicolons") from None
        return rows if ";" in raw else rows[0]

    def write(self, value: Any) -> Any:
        """The numbers as lists."""
        return value.tolist() if hasattr(value, "tolist") else list(value)


@dataclass(frozen=True, eq=False, repr=False)
class Each(Quantity):
    """Numbers with a unit, separated by commas: one for all things or one for each. A scene holds one for all."""

    def read(self, raw: Any) -> Any:
        """The numbers in `unit`."""
        if isinstance(raw, list | tuple):
            return tuple(super(Each, self).read(part) for part in raw)
        parts = raw.split(",") if isinstance(raw, str) else [raw]
        return tuple(super(Each, self).read(part) for part in parts)

    def check(self, value: Any, typed: Any = None) -> None:
        """ValueError for a number out of bounds."""
        for number in value if isinstance(value, tuple) else (value,):
            super().check(number, typed)

    def write(self, value: Any) -> Any:
        """The first number with its unit."""
        return super().write(value[0])

    def show(self, value: Any) -> str:
        """The first number with its unit."""
        return super().show(value[0])


def whole_range(text: str) -> tuple[int, int]:
    """First and last of a range of whole numbers.

    >>> whole_range("2:5"), whole_range("3")
    ((2, 5), (3, 3))
    """
    parts = [part.strip() for part in text.split(":")]
    if len(parts) > 2 or not all(part.isdecimal() for part in parts):
        raise ValueError(f"{text!r}: expected a whole number or a range of them, such as 2:5")
    first, last = int(parts[0]), int(parts[-1])
    if first > last:
        raise ValueError(f"{text!r}: expected a range that rises, but {first} is above {last}")
    return first, last
