"""The structure of a scene of each kind, made from the declaration of its verb: tables with keys, types, descriptions and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import msgspec

from rotor.requests.field import Field
from rotor.requests.fill import Given, flattened, nested
from rotor.verbs.tables import outputs_class, said, section_class
from rotor.verbs.verb import Verb, verb_of


def keyed(verb: Verb) -> dict[str, Field]:
    """The inputs of a verb that stand in a scene, by dotted key."""
    return {one.key: one for one in verb.fields.values() if one.key}


@cache
def scene_class(kind: str) -> Any:
    """The structure of a kind of scene."""
    from rotor.scenes.scene import Scene

    verb = verb_of(kind)
    found: list[Any] = []
    for name, type_, default in verb.subject.scene_fields():
        found.append((name, type_) if default is msgspec.NODEFAULT else (name, type_, default))
    if verb.accuracy:
        meta = said(verb.accuracy, verb.accuracy_example)
        found.append(("accuracy", Annotated[str | float | None, meta], None))
    found += [(table, structure, structure()) for table, structure in tables_of(verb).items()]
    scene = msgspec.defstruct(
        f"{kind.capitalize()}Scene", found, bases=(Scene,), frozen=True, kw_only=True, tag=kind, tag_field="kind",
        forbid_unknown_fields=True, omit_defaults=True, module=__name__,
    )  # fmt: skip
    scene.__doc__ = verb.about
    return scene


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


ORDER = ("body", "magnetic", "effects", "conditions", "observables", "vibration", "numerics")  # of tables


def _place(table: str) -> int:
    return ORDER.index(table) if table in ORDER else len(ORDER)


def given_of(scene: Any, verb: Verb) -> Given:
    """What a scene gives, by key; what has its default is not among it."""
    content: dict[str, Any] = msgspec.to_builtins(scene)
    tables = verb.subject.tables(content)
    return Given(flattened(tables, [*keyed(verb), *verb.subject.tables_read]), "key")


def saved_scene(verb: Verb, request: Any, subject: Any, folder: Path, outputs: Mapping[str, Any], given: Given) -> Any:
    """The scene of a request that was answered. outputs: files by name. given: settings of files among it."""
    from rotor.scenes.scene_file import scene_of

    flat = {
        **verb.saved(request, subject, folder),
        **{f"outputs.{name}": _plain(value) for name, value in outputs.items()},
    }
    for key, one in keyed(verb).items():
        if one.table == "outputs" and given.has(one):
            flat[key] = one.write(one.read(given.of(one), given.style))
    order = {name: place for place, name in enumerate(scene_class(verb.name).__struct_fields__)}
    tables = nested(flat)
    content = dict(sorted(tables.items(), key=lambda item: order.get(item[0], 0)))
    return scene_of({"schema": 1, "kind": verb.name, **content}, "scene")


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
