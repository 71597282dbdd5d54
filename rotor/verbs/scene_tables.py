"""The tables of a verb's scene, from its declaration."""

from __future__ import annotations

from typing import Any

from msgspec import NODEFAULT

from rotor.requests.field import Field
from rotor.verbs.tables import entries_of, outputs_class, section_class
from rotor.verbs.verb import Verb

ORDER = (
    "body",
    "lines",
    "parameters",
    "magnetic",
    "effects",
    "conditions",
    "observables",
    "vibration",
    "numerics",
)  # of tables


def keyed(verb: Verb) -> dict[str, Field]:
    """The inputs of a verb that stand in a scene, by dotted key."""
    return {one.key: one for one in verb.fields.values() if one.key}


def entries_before(verb: Verb) -> list[Any]:
    """Name, type and default of the keys of a scene that stand in no table: what is computed of, and lists of tables."""
    found: list[Any] = []
    for name, type_, default in verb.subject.scene_fields():
        found.append((name, type_) if default is NODEFAULT else (name, type_, default))
    taken = {entry[0] for entry in found}
    return found + entries_of(tuple(one for one in keyed(verb).values() if not one.table and one.key not in taken))


def tables_of(verb: Verb) -> dict[str, Any]:
    """The tables of a verb's scene, outputs last."""
    grouped: dict[str, list[Field]] = {}
    taken = {"molecule", *(name for name, _, _ in verb.subject.scene_fields())}
    for one in keyed(verb).values():
        if one.table.partition(".")[0] not in taken and one.table:
            grouped.setdefault(one.table, []).append(one)
    outputs = tuple(grouped.pop("outputs", ()))
    tables = {table: section_class(table, tuple(grouped[table]), verb.name) for table in sorted(grouped, key=_place)}
    return tables | {"outputs": outputs_class(verb.name, tuple(one for one in verb.outputs if one.scene), outputs)}


def _place(table: str) -> int:
    return ORDER.index(table) if table in ORDER else len(ORDER)
