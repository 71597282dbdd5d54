"""Keys of a scene, from the declaration of its verb: fields by table and key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from functools import cache
from types import UnionType
from typing import Any, get_args, get_origin

from rotor.requests.accuracy import TotalAccuracy
from rotor.requests.choices import Choices
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
            reader, example = (Names(), [output.example]) if output.many else (Text(), output.example)
            default = () if output.many else None
            files[output.name] = Field(reader, output.help, f"outputs.{output.name}", example=example, default=default)
        if output.name == "parquet":
            files["json"] = JSON
    return files


def keys_of(structure: Any) -> Keys:
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
