"""Scene files in TOML: reading with checks, writing, JSON Schema.

An unknown key is an error that names the nearest valid key. msgspec checks types; the requests check ranges.
"""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec

from rotor.requests.choices import nearest
from rotor.scenes.scene import KINDS, SCHEMA, Scene

_TYPES = {
    "int": "a whole number", "float": "a number", "str": "a text", "bool": "true or false", "array": "a list", "object": "a table",
    "null": "nothing",
}  # fmt: skip  # types of msgspec in words
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

    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"').molecule
    'CO'
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


def scene_of(content: Mapping[str, Any], where: str = "scene") -> Scene:
    """The scene of nested tables, as parsed from TOML.

    Raises ValueError for an unknown version or kind, unknown keys and wrong types.
    """
    kind = _kind_of(content.get("schema"), content.get("kind"), where)
    rest = {key: value for key, value in content.items() if key != "kind"}
    _refuse_unknown_keys(rest, kind, where, "", kind)
    try:
        scene: Scene = msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        raise ValueError(f"{where}: {_said(error)}") from None
    return scene


def _kind_of(schema: Any, kind: Any, where: str) -> type[Scene]:
    if schema != SCHEMA:
        problem = "it has none" if schema is None else f"this one has {schema!r}"
        raise ValueError(f"{where}: expected schema = {SCHEMA}, the version of the format, and {problem}")
    if not isinstance(kind, str) or kind not in KINDS:
        problem = "it has none" if kind is None else f"{kind!r} is none; {nearest(str(kind), KINDS)}"
        raise ValueError(f"{where}: expected kind, one of {', '.join(KINDS)}; {problem}")
    return KINDS[kind]


def _refuse_unknown_keys(content: Mapping[str, Any], kind: Any, where: str, place: str, scene: type[Scene]) -> None:
    """Refuse keys that a table does not have, and say where the scene has such a key."""
    hints = get_type_hints(kind)
    for key, value in content.items():
        if kind.__struct_config__.tag_field == key:
            continue
        if key not in kind.__struct_fields__:
            table = "a scene of this kind" if not place else place if place.endswith("]") else f"[{place}]"
            elsewhere = "" if isinstance(value, Mapping) else _other_place(key, scene)
            raise ValueError(
                f"{where}: {table} has no key {key!r}{elsewhere or '; ' + nearest(key, kind.__struct_fields__)}"
            )
        if not isinstance(value, Mapping | list):
            continue
        inside = f"{place}.{key}" if place else key
        _refuse_unknown_tags(hints[key], value, where, inside)
        for structure, item, number in _tables_in(hints[key], value):
            _refuse_unknown_keys(item, structure, where, inside + number, scene)


def _other_place(key: str, scene: type[Scene]) -> str:
    """Where a scene has a key of this name, outside lists of tables; empty if nowhere."""
    if key in scene.__struct_fields__:
        return "; it stands before the first table"
    tables = [
        name
        for name, hint in get_type_hints(scene).items()
        if get_origin(hint) is not list and any(key in structure.__struct_fields__ for structure in structures_in(hint))
    ]
    return f"; it is a key of {' and '.join(f'[{name}]' for name in tables)}" if tables else ""


def _refuse_unknown_tags(hint: Any, value: Any, where: str, place: str) -> None:
    """Refuse an unknown effect or pulse shape, and name the nearest."""
    tag_fields = {
        structure.__struct_config__.tag: structure.__struct_config__.tag_field for structure in structures_in(hint)
    }
    for number, item in enumerate(value if isinstance(value, list) else ()):
        for word in {word for word in tag_fields.values() if word is not None and isinstance(item, Mapping)}:
            if isinstance(item.get(word), str) and item[word] not in tag_fields:
                raise ValueError(
                    f"{where}: {place}[{number}].{word}: {item[word]!r} is none; {nearest(item[word], tag_fields)}"
                )


def _tables_in(hint: Any, value: Any) -> list[tuple[Any, Mapping[str, Any], str]]:
    """Tables in a value: each with its structure and its place in a list, such as [0]."""
    structures = structures_in(hint)
    if isinstance(value, Mapping) and len(structures) == 1:
        return [(structures[0], value, "")]
    by_tag = {structure.__struct_config__.tag: structure for structure in structures}
    if not structures or not isinstance(value, list):
        return []
    word = structures[0].__struct_config__.tag_field
    tables = [(item, f"[{number}]") for number, item in enumerate(value) if isinstance(item, Mapping)]
    if word is None:
        return [(structures[0], item, number) for item, number in tables]
    return [
        (by_tag[tag], item, number)
        for item, number in tables
        if isinstance(tag := item.get(word), str) and tag in by_tag
    ]


def structures_in(hint: Any) -> list[Any]:
    """The msgspec structures that a type allows."""
    if isinstance(hint, type) and issubclass(hint, msgspec.Struct):
        return [hint]
    return [structure for part in get_args(hint) for structure in structures_in(part)]


def _said(error: msgspec.ValidationError) -> str:
    """Message of msgspec with the key first: "Expected `int`, got `str` - at `$.numerics.jmax`"."""
    text = str(error)
    match = re.fullmatch(r"(.*) - at `\$\.?(.*)`", text)
    return f"{match[2]}: {_plain(match[1])}" if match else _plain(text)


def _plain(text: str) -> str:
    """Message of msgspec in the words of scene files: "Expected `int | null`, got `str`" is "expected a whole number, found a text".

    >>> _plain("Object missing required field `pulses`")
    "the key 'pulses' is missing"
    """
    if missing := re.fullmatch(r"Object missing required field `(.*)`", text):
        return f"the key {missing[1]!r} is missing"
    if types := re.fullmatch(r"Expected `(.*)`, got `(.*)`", text):
        allowed = [_TYPES.get(name, name) for name in types[1].split(" | ") if name != "null"]
        decimal = types[2] == "float" and "float" not in types[1]
        value = "a number with a decimal point" if decimal else _TYPES.get(types[2], types[2])
        return f"expected {' or '.join(allowed)}, found {value}"
    return text[:1].lower() + text[1:].replace("`", "")


def scene_text(scene: Scene) -> str:
    """The scene as TOML. Defaults are left out; numbers read back as the same doubles.

    >>> from rotor.scenes.scene import LevelsScene
    >>> print(scene_text(LevelsScene(molecule="CO")), end="")
    schema = 1
    kind = "levels"
    molecule = "CO"
    """
    content: dict[str, Any] = msgspec.to_builtins(scene)
    head = {"schema": scene.schema, "kind": content.pop("kind")}
    content.pop("schema", None)
    return "".join(_lines_of(head | content, ()))


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
    return str(value)


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as TOML, completely or not at all."""
    from rotor.formats.atomic_write import open_atomic

    with open_atomic(path, "w", encoding="utf-8", newline="\n") as handle:
        handle.write(scene_text(scene))


def json_schema() -> dict[str, Any]:
    """JSON Schema of all kinds of scene, for completion in editors."""
    schemas: Any = Union[tuple(KINDS.values())]  # noqa: UP007  # the types are known only at run time
    schema: dict[str, Any] = msgspec.json.schema(schemas)
    return {"title": "A scene of rotor", **schema}
