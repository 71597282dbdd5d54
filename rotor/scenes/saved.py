"""The scene of an answered request."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.requests.fill import nested
from rotor.scenes.keys import keyed
from rotor.scenes.scene import SCHEMA, Scene, scene_of
from rotor.verbs.calculation import Outcome


def saved_scene(outcome: Outcome, folder: Path, outputs: Mapping[str, Any]) -> Scene:
    """The scene of an answered request, in a folder. outputs: files by name; their settings are among the inputs."""
    verb, entries = outcome.verb, outcome.calculation.entries
    flat = {
        **verb.saved(outcome.request, outcome.subject, folder),
        **{f"outputs.{name}": value for name, value in outputs.items()},
    }
    for key, field in keyed(verb).items():
        if field.table == "outputs" and entries.has(field):
            flat[key] = field.write(field.read(entries.of(field), entries.style))
    return scene_of({"schema": SCHEMA, "kind": verb.name, **nested(flat)})
