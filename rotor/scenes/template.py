"""Scene files to begin with: every key of a kind with what it means, those that need no change left as comments."""

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

    Raises ValueError, with the kinds that there are, for another one.

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
    """What a template has switched on, by dotted name."""
    found = dict(verb_of(kind).start)
    if isinstance(found.get("molecule"), str):
        found["molecule.source"] = found.pop("molecule")
    return found


def _lines(structure: Any, kind: str, place: str) -> Iterator[str]:
    """Lines of a table: its keys, then the tables in it."""
    hints = get_type_hints(structure, include_extras=True)
    inner: list[tuple[str, Any, bool]] = []
    for one in msgspec.structs.fields(structure):
        if one.name == "schema":
            continue
        structures = structures_in(hints[one.name])
        if structures and one.name != "accuracy":
            inner.append(
                (one.name, structures[0], one.name == "body" or (_is_list(hints[one.name]) and not one.required))
            )
        elif one.name == "sweep" and not place:
            yield f"# sweep = {_text(sweep_example(kind))}  # example: values by dotted name; every combination is run"
        else:
            yield _key_line(one, hints[one.name], _start(kind).get(f"{place}{one.name}"))
    for name, table, absent in inner:
        many = _is_list(hints[name])
        hash_ = "# " if absent else ""
        yield f"\n{hash_}[[{name}]]" if many else f"\n{hash_}[{name}]"
        if many and name in TAGS:
            yield _in_comment(TAGS[name]) if absent else TAGS[name]
        lines = _lines(table, kind, f"{place}{name}.")
        yield from map(_in_comment, lines) if absent else lines


def sweep_example(kind: str) -> dict[str, list[str]]:
    """What a template sweeps: temperatures where the kind has one, else the first input of its start."""
    verb = verb_of(kind)
    if kelvin := next(
        (name for name in ("conditions.temperature", "conditions.excitation") if name in verb.fields), ""
    ):
        return {kelvin: ["10 K", "100 K", "300 K"]}
    name, value = next((name, value) for name, value in verb.start.items() if isinstance(value, str))
    stem, dot, suffix = value.partition(".")
    return {name: ["CO", "HCl"] if name == "molecule" else [value, f"{stem}2{dot}{suffix}"]}


def _is_list(hint: Any) -> bool:
    """Whether a type is that of a list of tables."""
    inner = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return get_origin(inner) is list


def _in_comment(line: str) -> str:
    """A line of a table that is an example itself."""
    text = line if "# example:" in line else line.replace("  # ", "  # example: ", 1)
    return text if text.startswith("#") else f"# {text}"


def _key_line(one: Any, hint: Any, start: Any) -> str:
    """A key with its value and description: in force where it has a start, else a comment."""
    meta = next((item for item in get_args(hint) if isinstance(item, msgspec.Meta)), None)
    about = meta.description if meta is not None else ""
    example = (meta.examples or [None])[0] if meta is not None else None
    if start is not None:
        return f"{one.name} = {_text(start)}  # {about}"
    default = (
        one.default_factory() if one.default is msgspec.NODEFAULT and callable(one.default_factory) else one.default
    )
    if default is msgspec.NODEFAULT or default is None or default == [] or default == {}:
        return f"# {one.name} = {_text(example)}  # example: {about}"
    return f"# {one.name} = {_text(default)}  # {about}"


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_quoted(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    return toml_value(value)


def _quoted(key: str) -> str:
    return f'"{key}"' if "." in key else key
