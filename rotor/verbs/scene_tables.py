"""Tables of a verb's scene, made from its declaration."""

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
)  # order of the tables


def keyed(verb: Verb) -> dict[str, Field]:
    """The inputs of a verb that a scene may hold, by dotted key."""
    return {field.key: field for field in verb.fields.values() if field.key}


def entries_before(verb: Verb) -> list[Any]:
    """Name, type and default of scene keys outside tables: the subject, and lists of tables."""
    entries: list[Any] = []
    for name, type_, default in verb.subject.scene_fields():
        entries.append((name, type_) if default is NODEFAULT else (name, type_, default))
    taken = {entry[0] for entry in entries}
    return entries + entries_of(
        tuple(field for field in keyed(verb).values() if not field.table and field.key not in taken)
    )


def tables_of(verb: Verb) -> dict[str, Any]:
    """The tables of a verb's scene, outputs last."""
    grouped: dict[str, list[Field]] = {}
    taken = {"molecule", *(name for name, _, _ in verb.subject.scene_fields())}
    for field in keyed(verb).values():
        if field.table.partition(".")[0] not in taken and field.table:
            grouped.setdefault(field.table, []).append(field)
    outputs = tuple(grouped.pop("outputs", ()))
    tables = {table: section_class(table, tuple(grouped[table]), verb.name) for table in sorted(grouped, key=_place)}
    return tables | {
        "outputs": outputs_class(verb.name, tuple(output for output in verb.outputs if output.scene), outputs)
    }


def _place(table: str) -> int:
    return ORDER.index(table) if table in ORDER else len(ORDER)
