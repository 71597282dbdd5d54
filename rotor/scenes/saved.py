"""The scene of an answered request."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.requests.fill import nested
from rotor.scenes.scene import KINDS
from rotor.scenes.scene_file import scene_of
from rotor.verbs.calculation import Outcome
from rotor.verbs.scene_tables import keyed


def saved_scene(outcome: Outcome, folder: Path, outputs: Mapping[str, Any]) -> Any:
    """The scene of an answered request, in a folder. outputs: files by name; their settings are among the inputs."""
    verb, entries = outcome.verb, outcome.calculation.entries
    flat = {
        **verb.saved(outcome.request, outcome.subject, folder),
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
