"""Values of a scene: checked by the types of their keys, in the order of the keys, without defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, get_args, get_origin

from rotor.requests.choices import Choices, nearest
from rotor.requests.field import REQUIRED, Field
from rotor.scenes.keys import Keys, keys_of, kinds_in, shown_default

WORDS = {
    int: "a whole number", float: "a number", str: "a text", bool: "true or false", list: "a list", tuple: "a list", dict: "a table",
}  # fmt: skip


class UnknownKeyError(ValueError):
    """A table has no such key. place: of the table; empty before the first table."""

    def __init__(self, key: str, value: Any, place: str, keys: Keys) -> None:
        super().__init__(key)
        self.key, self.value, self.place, self.keys = key, value, place, keys

    def text(self, elsewhere: str) -> str:
        """The message. elsewhere: where a scene has such a key; empty if nowhere."""
        inside = self.place if self.place.endswith("]") else f"[{self.place}]"
        table = inside if self.place else "a scene of this kind"
        other = "" if isinstance(self.value, Mapping) else elsewhere
        return f"{table} has no key {self.key!r}{other or '; ' + nearest(self.key, self.keys)}"


def checked_table(keys: Keys, values: Any, place: str) -> dict[str, Any]:
    """The values of a table; None counts as left out.

    Raises ValueError for an unknown key (UnknownKeyError), a value of a wrong type, and a missing key.
    """
    if not isinstance(values, Mapping):
        raise _wrong_type(place, values, (dict,))
    for key, value in values.items():
        if key not in keys:
            raise UnknownKeyError(key, value, place, keys)
    table = {}
    for key, field in keys.items():
        if (value := values.get(key)) is not None:
            value = checked_value(field, value, f"{place}.{key}" if place else key)
            if value != shown_default(field):
                table[key] = value
        elif field.default is REQUIRED:
            raise ValueError(f"{place}{': ' if place else ''}the key {key!r} is missing")
    return table


def checked_value(field: Field, value: Any, place: str) -> Any:
    """The value of a key; ValueError, with its place, for a value of a wrong type."""
    if not isinstance(field.reader, Choices):
        return _typed(value, (*kinds_in(field.reader.scene_type), *([str] if field.none else [])), place)
    if not isinstance(value, list | tuple):
        raise _wrong_type(place, value, (list,))
    return [_chosen(field.reader, item, f"{place}[{number}]") for number, item in enumerate(value)]


def _chosen(choices: Choices, item: Any, place: str) -> dict[str, Any]:
    """A table of a list whose tables are of several kinds."""
    kinds, word = choices.load(), choices.word
    kind = item.get(word) if isinstance(item, Mapping) else None
    if isinstance(item, Mapping) and kind is None:
        raise ValueError(f"{place}: the key {word!r} is missing")
    if isinstance(kind, str) and kind not in kinds:
        raise ValueError(f"{place}.{word}: {kind!r} is none; {nearest(kind, kinds)}")
    if not isinstance(kind, str):
        raise _wrong_type(f"{place}.{word}", kind, (str,)) if kind is not None else _wrong_type(place, item, (dict,))
    rest = {key: value for key, value in item.items() if key != word}
    return {word: kind, **checked_table(keys_of(kinds[kind]), rest, place)}


def _typed(value: Any, kinds: tuple[Any, ...], place: str) -> Any:
    """The value as the first of these types that it has."""
    for kind in kinds:
        base, inner = get_origin(kind) or kind, get_args(kind)
        if base is Any:
            return value
        if is_dataclass(base) and isinstance(value, Mapping):
            return checked_table(keys_of(base), value, place)
        if base is list and isinstance(value, list | tuple):
            return [_typed(item, kinds_in(inner[0]), f"{place}[{number}]") for number, item in enumerate(value)]
        if base is dict and isinstance(value, Mapping):
            return {name: _typed(item, kinds_in(inner[1]), f"{place}.{name}") for name, item in value.items()}
        if base is float and isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if base is int and isinstance(value, float) and value.is_integer():
            return int(value)
        if isinstance(base, type) and isinstance(value, base) and isinstance(value, bool) == (base is bool):
            return value
    raise _wrong_type(place, value, kinds)


def _wrong_type(place: str, value: Any, kinds: tuple[Any, ...]) -> ValueError:
    """The error for a value of none of these types."""
    allowed = dict.fromkeys(WORDS.get(get_origin(kind) or kind, "a table") for kind in kinds)
    decimal = isinstance(value, float) and float not in kinds
    found = "a number with a decimal point" if decimal else WORDS.get(type(value), type(value).__name__)
    return ValueError(f"{place}: expected {' or '.join(allowed)}, found {found}")
