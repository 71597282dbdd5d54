"""A field of a request, and the readers of its value: how it is read from text or a number, checked and written back.

Text comes from the command line, text or TOML values from a scene, any value from Python. Errors quote what was typed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import MISSING
from decimal import Decimal
from numbers import Real
from typing import Any

from rotor.frozen import dataclass
from rotor.units import LEAST_KELVIN, MOST_KELVIN, MOST_POINTS, parse_grid, parse_quantity, parse_range

MOST_WHOLE = 10**15  # up to here a double holds every whole number
INFINITE = (0.0, math.inf)


class InsideError(ValueError):
    """Error inside a value; its text begins with the place, such as `[0].peak`."""


class Reader:
    """A kind of value. metavar: of its option. scene_type: type in a scene file. many: whether its option may be repeated."""

    metavar: str = "TEXT"
    scene_type: Any = str
    many: bool = False
    unit: str = ""

    def read(self, raw: Any) -> Any:
        """The value of a text, a TOML value or a Python value; ValueError, without the field's name, for anything else."""
        return raw

    def write(self, value: Any) -> Any:
        """The value as a scene file holds it; `read` inverts it."""
        return value

    def show(self, value: Any) -> str:
        """The default as the help of an option shows it."""
        return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True, eq=False, repr=False)
class Rule:
    """Fields or files, by identity, that go with a field: at least one of `needs`, none of `excludes`. why: the reason in errors."""

    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Field:
    """Declaration of a field.

    reader: reads, writes and checks a value, with unit and bounds.
    help: one line, without a full stop.
    key: table and key in a scene, such as "conditions.temperature"; a key without a table stands before the first table; "" for none.
    option: name on the command line; None derives it from the key, "" means none; without a leading "-" it is an argument by position.
    hidden: another option sets this field together with others (`rotor.verbs.common.verb.Extra`).
    none: the word that stands for None.
    common: whether --help lists the option; --help-all lists all.
    example: value in a template if the default is None.
    typed: the default as a user would type it, if that differs.
    panel: heading in --help.
    knob: how fine an approximation is (`rotor.requests.knob`).
    rule: other fields or files that it needs or excludes.
    name, default: filled in by `declared_fields`.
    """

    reader: Reader
    help: str
    key: str = ""
    option: str | None = None
    hidden: bool = False
    none: str | None = None
    common: bool = False
    example: Any = None
    typed: Any = None
    panel: str = ""
    metavar: str = ""
    knob: Any = None
    rule: Rule | None = None
    name: str = ""
    default: Any = None

    @property
    def table(self) -> str:
        """The table in a scene; empty for a key before the first table."""
        return self.key.rpartition(".")[0]

    @property
    def last(self) -> str:
        """The key inside its table."""
        return self.key.rpartition(".")[2]

    @property
    def flag(self) -> str:
        """The option, derived from the key where none is given; empty where there is none."""
        if self.option is not None:
            return self.option
        return "--" + (self.last or self.name).replace("_", "-")

    @property
    def identity(self) -> str:
        """The name of a value in `Entries`, whatever its origin: the key, or the field's name if it has no key."""
        return self.key or self.name

    @property
    def default_text(self) -> str:
        """The default in the help of the option; empty for one that needs no words."""
        if self.typed is not None:
            return str(self.typed)
        if self.default in (None, MISSING, (), "", {}) or isinstance(self.default, bool):
            return ""
        return self.reader.show(self.default)

    def called(self, style: str) -> str:
        """The field's name in errors; style is "option", "key" or "name"."""
        names = {"option": self.flag, "key": self.key, "name": self.name}
        return names[style] or self.flag or self.key or self.name

    def read(self, raw: Any, style: str) -> Any:
        """Read a value; a ValueError names the field in the given style."""
        word = isinstance(raw, str) and raw.strip().lower() == self.none
        if raw is None or word:
            return None
        try:
            return self.reader.read(raw)
        except InsideError as error:
            raise ValueError(f"{self.called(style)}{error}") from None
        except ValueError as error:
            none = f", or {self.none!r}" if self.none and isinstance(raw, str) else ""
            raise ValueError(f"{self.called(style)}: {error}{none}") from None

    def write(self, value: Any) -> Any:
        """The value as a scene holds it; None is left out."""
        return self.none if value is None else self.reader.write(value)


class Listed(Reader):
    """Several values, which a scene holds as a list. item: type of each."""

    item: Any = str
    between = ","

    def write(self, value: Any) -> list[Any]:
        """The values as a list."""
        return [self.item(part) for part in value]

    def show(self, value: Any) -> str:
        """The values between commas."""
        return self.between.join(f"{part:g}" if isinstance(part, float) else str(part) for part in value)


@dataclass(frozen=True, eq=False, repr=False)
class Text(Reader):
    """A text. words: the allowed words; any text if empty."""

    words: Collection[str] = ()
    metavar: str = "TEXT"

    def read(self, raw: Any) -> str:
        """The text."""
        self.check(raw)
        return str(raw)

    def check(self, value: Any) -> None:
        """ValueError for a value that is no text or none of the words."""
        if not isinstance(value, str):
            raise ValueError(f"{value!r}: expected a text")
        if self.words and value not in self.words:
            raise ValueError(f"{value!r}: expected one of {', '.join(self.words)}")


@dataclass(frozen=True, eq=False, repr=False)
class Flag(Reader):
    """True or false. off: whether the option --no-... exists too."""

    off: bool = False
    scene_type = bool

    def read(self, raw: Any) -> bool:
        """The truth value."""
        if not isinstance(raw, bool):
            raise ValueError(f"{raw!r}: expected true or false")
        return raw


@dataclass(frozen=True, eq=False, repr=False)
class Whole(Reader):
    """A whole number between bounds."""

    least: int | None = None
    most: int | None = None
    metavar: str = "N"
    scene_type = int

    def read(self, raw: Any) -> int:
        """The number."""
        value = raw
        if isinstance(raw, str) and re.fullmatch(r"\s*[+-]?[0-9]{1,4000}\s*", raw):  # int() takes 1_000, too
            value = int(raw)
        elif isinstance(raw, str) and re.fullmatch(r"\s*[+-]?[0-9]{1,9}(\.[0-9]{1,9})?[eE]\+?[0-9]{1,2}\s*", raw):
            number = Decimal(raw.strip())
            value = int(number) if number == number.to_integral_value() else raw
        if isinstance(value, bool) or not hasattr(value, "__index__"):
            raise ValueError(f"{raw!r:.60}: expected a whole number")
        if abs(value) > MOST_WHOLE:
            raise ValueError(f"a number of {len(str(abs(value)))} digits; expected at most {MOST_WHOLE}")
        self.check(value)
        return int(value)

    def check(self, value: int) -> None:
        """ValueError for a value that is not whole or is out of bounds."""
        if isinstance(value, bool) or not hasattr(value, "__index__"):
            raise ValueError(f"{value!r}: expected a whole number, of type int")
        low, high = self.least, self.most
        if (low is not None and value < low) or (high is not None and value > high):
            bounds = f"of {low} or more" if high is None else f"from {low} to {high}"
            raise ValueError(f"{value}: expected a whole number {bounds}")


@dataclass(frozen=True, eq=False, repr=False)
class Quantity(Reader):
    """A number with a unit. above, below: exclusive bounds; least, most: inclusive bounds."""

    unit: str = ""
    above: float | None = None
    below: float | None = None
    least: float | None = None
    most: float | None = None
    metavar: str = "X"
    scene_type = float | str

    def read(self, raw: Any) -> float:
        """The number in `unit`."""
        if isinstance(raw, bool) or not isinstance(raw, str | Real):
            raise ValueError(f"{raw!r}: expected a number{' with a unit' if self.unit else ''}")
        if isinstance(raw, str) and ":" in raw:
            raise ValueError(f"{raw!r}: expected a single value, not a range; the sweep of a scene goes over several")
        value = parse_quantity(raw, "fraction" if self.is_fraction else self.unit)
        self.check(value, raw)
        return value

    @property
    def is_fraction(self) -> bool:
        """Whether the value is a dimensionless number between 0 and 1, which may be given in percent."""
        low, high = self._ends
        return not self.unit and low is not None and high is not None and 0 <= low < high <= 1

    def check(self, value: float, typed: Any = None) -> None:
        """ValueError for a number out of bounds; typed: the text to quote."""
        finite = math.isfinite(value)  # a TypeError for a text
        text = typed if isinstance(typed, str) else f"{value:g}"
        if not finite:
            raise ValueError(f"{text}: expected a finite number")
        low, high = self._ends
        if (low is not None and (value < low or value == self.above)) or (
            high is not None and (value > high or value == self.below)
        ):
            raise ValueError(f"{text}: expected {self._rule()}")
        if self.unit == "K" and value > MOST_KELVIN:
            raise ValueError(f"{text!r}: expected a temperature up to {MOST_KELVIN:g} K; no molecule lasts beyond")
        if self.unit == "K" and 0 < value < LEAST_KELVIN:  # 0 is left to the bounds of the field
            raise ValueError(f"{text!r}: expected a temperature of {LEAST_KELVIN:g} K or more")

    @property
    def _ends(self) -> tuple[float | None, float | None]:
        """Both bounds, inclusive or not."""
        return self.least if self.above is None else self.above, self.most if self.below is None else self.below

    def _rule(self) -> str:
        (low, high), unit = self._ends, f" {self.unit}" if self.unit else ""
        if low is None:
            return f"a number up to {high:g}{unit}"
        if high is None:
            return f"a finite number {f'above {low:g}{unit}' if self.least is None else f'of {low:g}{unit} or more'}"
        if self.above is not None:
            return (
                f"a number {f'between {low:g} and' if self.most is None else f'above {low:g} and up to'} {high:g}{unit}"
            )
        return f"a number from {low:g} to {'' if self.below is None else 'below '}{high:g}{unit}"

    def write(self, value: float) -> Any:
        """The number with its unit; the same double is read back."""
        return f"{float(value)!r} {self.unit}" if self.unit else value

    def show(self, value: float) -> str:
        """The number with its unit."""
        return f"{value:g} {self.unit}".rstrip()


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Listed):
    """Numbers in a unit, from start:stop:count, a text with commas, or a list. points: the count if the text gives none."""

    unit: str = ""
    points: int | None = None
    most_points: int = MOST_POINTS
    each: Quantity | None = None
    metavar: str = "GRID"
    scene_type = list[float] | str
    item = float

    def read(self, raw: Any) -> tuple[float, ...]:
        """The numbers."""
        if isinstance(raw, str):
            count = raw.rpartition(":")[2].strip()
            if raw.count(":") == 2 and count.isdecimal() and (len(count) > 18 or int(count) > self.most_points):
                raise ValueError(f"{raw!r}: at most {self.most_points} numbers; ask for fewer")
            values = tuple(parse_grid(raw, self.unit, self.points).tolist())
        elif isinstance(raw, Real) and not isinstance(raw, bool):
            values = (float(raw),)
        else:
            values = tuple(map(float, raw))
        try:
            self.check(values)
        except ValueError as error:
            rule = str(error).partition(": ")[2]
            raise ValueError(f"{raw!r:.60}: {rule}" if isinstance(raw, str) else str(error)) from None
        return values

    def check(self, value: Sequence[float]) -> None:
        """ValueError for no numbers or too many, and for one that is not finite or out of bounds."""
        if not 0 < len(value) <= self.most_points:
            raise ValueError(f"{len(value)} numbers: expected 1 to {self.most_points}")
        if (other := next((number for number in value if not math.isfinite(number)), None)) is not None:
            raise ValueError(f"{other}: expected finite numbers")
        if self.each is not None:
            self.each.check(min(value))
            self.each.check(max(value))

    def show(self, value: Any) -> str:
        """Count, first and last number."""
        return f"{len(value)} from {value[0]:g} to {value[-1]:g} {self.unit}".rstrip()


@dataclass(frozen=True, eq=False, repr=False)
class Range(Reader):
    """A range first:last in a unit; (0, infinity) is the full range."""

    unit: str = "MHz"
    metavar: str = "A:B"

    def read(self, raw: Any) -> tuple[float, float]:
        """Both ends."""
        if isinstance(raw, str):
            return parse_range(raw, self.unit)
        first, last = map(float, raw)
        if not first < last:
            raise ValueError(f"{first:g} to {last:g} {self.unit}: expected a range that rises")
        return first, last

    def write(self, value: tuple[float, float]) -> str:
        """Both ends with the unit."""
        return f"{value[0]!r}:{value[1]!r} {self.unit}"

    def show(self, value: tuple[float, float]) -> str:
        """Both ends; empty for the full range."""
        return "" if value == INFINITE else self.write(value)


@dataclass(frozen=True, eq=False, repr=False)
class Names(Listed):
    """Texts: an option that may be repeated, a list in a scene."""

    metavar: str = "NAME"
    scene_type = list[str]
    many: bool = True
    between = ", "

    def read(self, raw: Any) -> tuple[str, ...]:
        """The texts."""
        return (raw,) if isinstance(raw, str) else tuple(raw)


@dataclass(frozen=True, eq=False, repr=False)
class Custom(Reader):
    """A value that is read and written by two functions."""

    reading: Callable[[Any], Any]
    writing: Callable[[Any], Any] = lambda value: value
    metavar: str = "TEXT"
    scene_type: Any = str

    def read(self, raw: Any) -> Any:
        """The value that `reading` returns."""
        return self.reading(raw)

    def write(self, value: Any) -> Any:
        """The value that `writing` returns."""
        return self.writing(value)
