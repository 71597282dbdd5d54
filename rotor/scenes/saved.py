"""The scene of an answered request."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.requests.fill import Entries, nested
from rotor.scenes.scene import KINDS
from rotor.scenes.scene_file import scene_of
from rotor.verbs.scene_tables import keyed
from rotor.verbs.verb import Verb


def saved_scene(
    verb: Verb, request: Any, subject: Any, folder: Path, outputs: Mapping[str, Any], entries: Entries
) -> Any:
    """The scene of an answered request. outputs: files by name. entries: may hold settings of these files."""
    flat = {
        **verb.saved(request, subject, folder),
        **{f"outputs.{name}": _plain(value) for name, value in outputs.items()},
    }
    for key, field in keyed(verb).items():
        if field.table == "outputs" and entries.has(field):
            flat[key] = field.write(field.read(entries.of(field), entries.style))
    order = {name: place for place, name in enumerate(KINDS[verb.name].__struct_fields__)}
    tables = nested(flat)
    content = dict(sorted(tables.items(), key=lambda item: order.get(item[0], 0)))
    return scene_of({"schema": 1, "kind": verb.name, **content}, "scene")


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
