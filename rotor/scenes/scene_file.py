"""Scene files in TOML: reading and writing."""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.scenes.scene import SCHEMA, Scene, scene_of

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def read_scene(path: str | os.PathLike[str]) -> Scene:
    """The scene of a file.

    Raises ValueError, with file and key, for invalid TOML, unknown keys and wrong types.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: a scene file is UTF-8 text: {error}") from None
    return parse_scene(text, str(path))


def parse_scene(text: str, where: str = "scene") -> Scene:
    """The scene of a TOML text; `where` names the text in errors.

    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"').content
    {'molecule': 'CO'}
    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"\\n[observables]\\nj_max = 3')
    Traceback (most recent call last):
        ...
    ValueError: scene: [observables] has no key 'j_max'; the nearest is 'jmax'
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where}: not a TOML file: {error}") from None
    return scene_of(content, where)


def scene_text(scene: Scene) -> str:
    """The scene as TOML. Defaults are left out; numbers read back as the same doubles.

    >>> from rotor.scenes.scene import LevelsScene
    >>> print(scene_text(LevelsScene(molecule="CO")), end="")
    schema = 1
    kind = "levels"
    molecule = "CO"
    """
    return "".join(_lines_of({"schema": SCHEMA, "kind": scene.kind, **scene.content}, ()))


def _lines_of(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Lines of a table: values first, then inner tables."""
    plain = {key: value for key, value in table.items() if not _is_table(value)}
    lines = [f"{_key(key)} = {toml_value(value)}\n" for key, value in plain.items() if value is not None]
    for key, value in table.items():
        inner = (*path, key)
        name = ".".join(_key(part) for part in inner)
        if isinstance(value, Mapping) and _is_table(value):
            lines += [f"\n[{name}]\n", *_lines_of(value, inner)]
        elif _is_table(value):
            for item in value:
                lines += [f"\n[[{name}]]\n", *_lines_of(item, inner)]
    return lines


def _is_table(value: Any) -> bool:
    if isinstance(value, Mapping):
        return True
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def toml_value(value: Any) -> str:
    """A value in TOML; a float reads back as the same double."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan")
    if isinstance(value, list):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    return str(value)


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as TOML, completely or not at all."""
    from rotor.formats.atomic_write import open_atomic

    with open_atomic(path, "w", encoding="utf-8", newline="\n") as handle:
        handle.write(scene_text(scene))
