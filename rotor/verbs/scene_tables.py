"""The tables of a verb's scene, from its declaration."""

from __future__ import annotations

from typing import Any

from rotor.requests.field import Field
from rotor.verbs.tables import outputs_class, section_class
from rotor.verbs.verb import Verb

ORDER = ("body", "magnetic", "effects", "conditions", "observables", "vibration", "numerics")  # of tables


def keyed(verb: Verb) -> dict[str, Field]:
    """The inputs of a verb that stand in a scene, by dotted key."""
    return {one.key: one for one in verb.fields.values() if one.key}


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
