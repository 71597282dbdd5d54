"""Keys of a scene, from the declaration of its verb: fields by table and key, and values checked by the types of their fields."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import is_dataclass
from functools import cache
from types import UnionType
from typing import Any, get_args, get_origin

from rotor.requests.accuracy import TotalAccuracy
from rotor.requests.choices import Choices, nearest
from rotor.requests.field import REQUIRED, Field, all_fields
from rotor.requests.readers import Custom, Each, Flag, NameList, Names, Quantity, Text
from rotor.verbs.outputs import Output
from rotor.verbs.verb import Verb

Keys = Mapping[str, Field]  # fields of a table by key
ORDER = ("body", "lines", "parameters", "magnetic", "effects", "conditions", "observables", "vibration", "numerics")
TITLE = Field(Text(), "a line for reports", "title", example="Water in the microwave region", default="")
SWEEP = Field(
    Custom(dict, scene_type=dict[str, list[Any]]), "values by dotted name; every combination is run", "sweep",
    example={"conditions.temperature": ["10 K", "100 K", "300 K"]},
)  # fmt: skip
JSON = Field(Text(), "Write the table as JSON", "outputs.json", example="out.json")

_WORDS = {
    int: "a whole number", float: "a number", str: "a text", bool: "true or false", list: "a list", tuple: "a list", dict: "a table",
}  # fmt: skip  # types as errors name them


def keyed(verb: Verb) -> Keys:
    """The inputs of a verb that a scene may hold, by dotted key."""
    fields = (*verb.subject.scene_fields, *verb.fields.values())
    return {field.key: field for field in fields if field.key}


@cache
def tables_of(verb: Verb) -> Mapping[str, Keys]:
    """Keys by table, outputs last; "" has the keys before the first table."""
    grouped: dict[str, dict[str, Field]] = {"": {"title": TITLE, "sweep": SWEEP}}
    for field in keyed(verb).values():
        if field.table != "molecule":  # `molecule` itself is a key before the first table
            grouped.setdefault(field.table, {})[field.last] = field
    if verb.accuracy:
        reader = Custom(str, scene_type=str | float | TotalAccuracy)
        grouped[""]["accuracy"] = Field(reader, verb.accuracy, "accuracy", example=verb.accuracy_example)
    order = {table: place for place, table in enumerate(("", *ORDER))}
    settings = grouped.pop("outputs", {})
    tables = dict(sorted(grouped.items(), key=lambda item: order.get(item[0], len(order))))
    return {**tables, "outputs": _file_keys(verb.outputs) | settings}


def _file_keys(outputs: tuple[Output, ...]) -> dict[str, Field]:
    """Keys of the files that a scene writes; verbs with Parquet write the table as JSON too."""
    files = {}
    for output in outputs:
        if output.scene:
            files[output.name] = output.field
        if output.name == "parquet":
            files["json"] = JSON
    return files


def declared_keys(structure: Any) -> Keys:
    """Keys of a table that a dataclass of declared fields describes."""
    return {field.last: field for field in all_fields(structure).values()}


def inner_tables(field: Field) -> dict[str, Any]:
    """Dataclasses of the tables that a field may hold, by the word that tells them apart; empty for a plain value."""
    if isinstance(field.reader, Choices):
        return dict(field.reader.load())
    parts = (part for kind in kinds_in(field.reader.scene_type) for part in (kind, *get_args(kind)))
    inner = next(filter(is_dataclass, parts), None)
    return {} if inner is None else {"": inner}


def is_list(field: Field) -> bool:
    """Whether a field holds a list of tables."""
    return isinstance(field.reader, Choices) or get_origin(field.reader.scene_type) is list


def kinds_in(hint: Any) -> tuple[Any, ...]:
    """The alternatives of a type."""
    return get_args(hint) if isinstance(hint, UnionType) else (hint,)


def value_kinds(field: Field) -> tuple[Any, ...]:
    """The types that a value of a field may have, that of its word for None among them."""
    return (*kinds_in(field.reader.scene_type), *([str] if field.none else []))


def about(field: Field) -> str:
    """The help of a field as a description: it begins with a small letter, unless it begins with a symbol or an acronym."""
    return field.help[:1].lower() + field.help[1:] if field.help[1:2].islower() else field.help


def shown_default(field: Field) -> Any:
    """The default as a scene holds it; None if a missing key alone stands for it."""
    if field.typed is not None:
        return field.typed
    default, reader = field.default, field.reader
    if default is None or default is REQUIRED or isinstance(reader, Flag | Text):
        return None if default is REQUIRED else default
    if isinstance(default, tuple) and not isinstance(reader, Each):
        return list(default) if isinstance(reader, Names | NameList | Choices) else None
    return reader.show(default) if isinstance(reader, Quantity) and reader.unit else reader.write(default)


class UnknownKeyError(ValueError):
    """A table has no such key. place: of the table; empty before the first table. names: of the keys that it has."""

    def __init__(self, key: str, value: Any, place: str, names: Iterable[str]) -> None:
        super().__init__(key)
        self.key, self.value, self.place, self.names = key, value, place, names

    def text(self, elsewhere: str) -> str:
        """The message. elsewhere: where a scene has such a key; empty if nowhere."""
        inside = self.place if self.place.endswith("]") else f"[{self.place}]"
        table = inside if self.place else "a scene of this kind"
        other = "" if isinstance(self.value, Mapping) else elsewhere
        return f"{table} has no key {self.key!r}{other or '; ' + nearest(self.key, self.names)}"


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
            where = f"{place}.{key}" if place else key
            reader = field.reader
            value = (
                _chosen(reader, value, where)
                if isinstance(reader, Choices)
                else _typed(value, value_kinds(field), where)
            )
            if value != shown_default(field):
                table[key] = value
        elif field.default is REQUIRED:
            raise ValueError(f"{place}{': ' if place else ''}the key {key!r} is missing")
    return table


def _chosen(choices: Choices, values: Any, place: str) -> list[dict[str, Any]]:
    """A list whose tables are of several kinds."""
    if not isinstance(values, list | tuple):
        raise _wrong_type(place, values, (list,))
    return [_chosen_table(choices, item, f"{place}[{number}]") for number, item in enumerate(values)]


def _chosen_table(choices: Choices, item: Any, place: str) -> dict[str, Any]:
    """A table of such a list."""
    kinds, word = choices.load(), choices.word
    kind = item.get(word) if isinstance(item, Mapping) else None
    if isinstance(item, Mapping) and kind is None:
        raise ValueError(f"{place}: the key {word!r} is missing")
    if isinstance(kind, str) and kind not in kinds:
        raise ValueError(f"{place}.{word}: {kind!r} is none; {nearest(kind, kinds)}")
    if not isinstance(kind, str):
        raise _wrong_type(f"{place}.{word}", kind, (str,)) if kind is not None else _wrong_type(place, item, (dict,))
    rest = {key: value for key, value in item.items() if key != word}
    return {word: kind, **checked_table(declared_keys(kinds[kind]), rest, place)}


def _typed(value: Any, kinds: tuple[Any, ...], place: str) -> Any:
    """The value as the first of these types that it has."""
    for kind in kinds:
        base, inner = get_origin(kind) or kind, get_args(kind)
        if base is Any:
            return value
        if is_dataclass(base) and isinstance(value, Mapping):
            return checked_table(declared_keys(base), value, place)
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
    allowed = dict.fromkeys(_WORDS.get(get_origin(kind) or kind, "a table") for kind in kinds)
    decimal = isinstance(value, float) and float not in kinds
    actual = "a number with a decimal point" if decimal else _WORDS.get(type(value), type(value).__name__)
    return ValueError(f"{place}: expected {' or '.join(allowed)}, found {actual}")
