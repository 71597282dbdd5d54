"""Templates of scene files: every key of a kind with its meaning; keys with usable defaults are comments."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec

from rotor.scenes.scene import KINDS, SCHEMA
from rotor.scenes.scene_file import structures_in, toml_value
from rotor.verbs.verb import verb_of

TAGS = {
    "pulses": 'shape = "gaussian"  # or switched, kick, table, thz',
    "effects": 'effect = "constant torque"  # of a body: see docs/scenes.md',
}


def template(kind: str) -> str:
    """A commented scene file of a kind.

    Raises ValueError, with all kinds, for an unknown kind.

    >>> template("levels").splitlines()[3]
    'kind = "levels"'
    """
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r}: there are {', '.join(KINDS)}")
    about = (KINDS[kind].__doc__ or "").splitlines()[0]
    head = [
        f"# A scene of rotor: {about[:1].lower()}{about[1:]}",
        "# Keys that begin with # have the default shown, or none where it is an example. 'rotor run FILE' runs the scene.",
        f"schema = {SCHEMA}",
        f'kind = "{kind}"',
    ]
    return "\n".join([*head, *_lines(KINDS[kind], kind, ""), ""])


@cache
def _start(kind: str) -> dict[str, Any]:
    """Values that a template sets, by dotted name."""
    start = dict(verb_of(kind).start)
    if isinstance(start.get("molecule"), str):
        start["molecule.source"] = start.pop("molecule")
    return start


def _lines(structure: Any, kind: str, place: str) -> Iterator[str]:
    """Lines of a table: keys first, then inner tables."""
    hints = get_type_hints(structure, include_extras=True)
    inner: list[tuple[str, Any, bool]] = []
    for field in msgspec.structs.fields(structure):
        if field.name == "schema":
            continue
        structures = structures_in(hints[field.name])
        if structures and field.name != "accuracy":
            inner.append(
                (
                    field.name,
                    structures[0],
                    field.name == "body" or (_is_list(hints[field.name]) and not field.required),
                )
            )
        elif field.name == "sweep" and not place:
            yield f"# sweep = {_text(sweep_example(kind))}  # example: values by dotted name; every combination is run"
        else:
            yield _key_line(field, hints[field.name], _start(kind).get(f"{place}{field.name}"))
    for name, table, absent in inner:
        many = _is_list(hints[name])
        hash_ = "# " if absent else ""
        yield f"\n{hash_}[[{name}]]" if many else f"\n{hash_}[{name}]"
        if many and name in TAGS:
            yield _in_comment(TAGS[name]) if absent else TAGS[name]
        lines = _lines(table, kind, f"{place}{name}.")
        yield from map(_in_comment, lines) if absent else lines


def sweep_example(kind: str) -> dict[str, list[str]]:
    """Example of a sweep: temperatures if the kind has them, else the first text input of its template."""
    verb = verb_of(kind)
    if kelvin := next(
        (name for name in ("conditions.temperature", "conditions.excitation") if name in verb.fields), ""
    ):
        return {kelvin: ["10 K", "100 K", "300 K"]}
    name, value = next((name, value) for name, value in verb.start.items() if isinstance(value, str))
    stem, dot, suffix = value.partition(".")
    return {name: ["CO", "HCl"] if name == "molecule" else [value, f"{stem}2{dot}{suffix}"]}


def _is_list(hint: Any) -> bool:
    """Whether a type is a list of tables."""
    inner = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return get_origin(inner) is list


def _in_comment(line: str) -> str:
    """A line of a table that is shown as an example, turned into a comment."""
    text = line if "# example:" in line else line.replace("  # ", "  # example: ", 1)
    return text if text.startswith("#") else f"# {text}"


def _key_line(field: Any, hint: Any, start: Any) -> str:
    """A key with value and description: active if the template sets it, else a comment."""
    meta = next((item for item in get_args(hint) if isinstance(item, msgspec.Meta)), None)
    about = meta.description if meta is not None else ""
    example = (meta.examples or [None])[0] if meta is not None else None
    if start is not None:
        return f"{field.name} = {_text(start)}  # {about}"
    default = (
        field.default_factory()
        if field.default is msgspec.NODEFAULT and callable(field.default_factory)
        else field.default
    )
    if default is msgspec.NODEFAULT or default is None or default == [] or default == {}:
        return f"# {field.name} = {_text(example)}  # example: {about}"
    return f"# {field.name} = {_text(default)}  # {about}"


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_quoted(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    return toml_value(value)


def _quoted(key: str) -> str:
    return f'"{key}"' if "." in key else key
