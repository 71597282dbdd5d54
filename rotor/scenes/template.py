"""Templates of scene files: every key of a kind with its meaning; keys with usable defaults are comments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_origin

from rotor.formats.toml import toml_value
from rotor.requests.choices import Choices
from rotor.requests.readers import Field
from rotor.scenes.scene import SCHEMA, Keys, about, declared_keys, inner_tables, shown_default, tables_of
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.verb import Verb, verb_of

EXAMPLES = {
    "pulses": ("gaussian", "or switched, kick, table, thz"),
    "effects": ("constant torque", "of a body: see docs/scenes.md"),
}  # the kind that the template shows of a list of several kinds, and where the others are


def template(kind: str) -> str:
    """A commented scene file of a kind.

    Raises ValueError, with all kinds, for an unknown kind.

    >>> template("levels").splitlines()[3]
    'kind = "levels"'
    """
    if kind not in SCENE_VERBS:
        raise ValueError(f"kind {kind!r}: there are {', '.join(SCENE_VERBS)}")
    verb = verb_of(kind)
    head = [
        f"# A scene of rotor: {verb.about[:1].lower()}{verb.about[1:]}",
        "# Keys that begin with # have the default shown, or none where it is an example. 'rotor run FILE' runs the scene.",
        f"schema = {SCHEMA}",
        f'kind = "{kind}"',
    ]
    return "\n".join([*head, *_lines(verb), ""])


def _lines(verb: Verb) -> Iterator[str]:
    """Lines of a scene: keys before the first table, then the tables."""
    tables = dict(tables_of(verb))
    start = {name if name != "molecule" else "molecule.source": value for name, value in verb.start.items()}
    inner: dict[str, Field] = {}
    for key, field in tables.pop("").items():
        if key == "sweep":
            yield f"# sweep = {toml_value(sweep_example(verb))}  # example: {about(field)}"
        elif key == "accuracy" or not inner_tables(field):
            yield _key_line(key, field, None)
        else:
            inner[key] = field
    for key, field in inner.items():
        kinds, tag = inner_tables(field), []
        kind, others = EXAMPLES.get(key, (next(iter(kinds)), ""))
        if isinstance(field.reader, Choices):
            tag = [f"{field.reader.word} = {toml_value(kind)}  # {others}"]
        is_example = _is_list(field) and shown_default(field) is not None
        yield from _table(
            f"[[{key}]]" if _is_list(field) else f"[{key}]",
            [*tag, *_key_lines(declared_keys(kinds[kind]), key, start)],
            is_example,
        )
    for name, keys in tables.items():
        yield from _table(f"[{name}]", _key_lines(keys, name, start), name == "body")


def _is_list(field: Field) -> bool:
    """Whether a field holds a list of tables."""
    return isinstance(field.reader, Choices) or get_origin(field.reader.scene_type) is list


def _table(heading: str, lines: list[str], is_example: bool) -> Iterator[str]:
    """Lines of a table; an example is a comment."""
    yield f"\n{'# ' if is_example else ''}{heading}"
    yield from map(_in_comment, lines) if is_example else lines


def _key_lines(keys: Keys, table: str, start: Mapping[str, Any]) -> list[str]:
    return [_key_line(key, field, start.get(f"{table}.{key}")) for key, field in keys.items()]


def sweep_example(verb: Verb) -> dict[str, list[str]]:
    """Example of a sweep: temperatures if the kind has them, else the first text input of its template."""
    if kelvin := next(
        (name for name in ("conditions.temperature", "conditions.excitation") if name in verb.fields), ""
    ):
        return {kelvin: ["10 K", "100 K", "300 K"]}
    name, value = next((name, value) for name, value in verb.start.items() if isinstance(value, str))
    stem, dot, suffix = value.partition(".")
    return {name: ["CO", "HCl"] if name == "molecule" else [value, f"{stem}2{dot}{suffix}"]}


def _in_comment(line: str) -> str:
    """A line of a table that is shown as an example, turned into a comment."""
    text = line if "# example:" in line else line.replace("  # ", "  # example: ", 1)
    return text if text.startswith("#") else f"# {text}"


def _key_line(key: str, field: Field, start: Any) -> str:
    """A key with value and description: active if the template sets it, else a comment."""
    default = shown_default(field)
    if start is not None:
        return f"{key} = {toml_value(start)}  # {about(field)}"
    if default in (None, [], {}):
        return f"# {key} = {toml_value(field.example)}  # example: {about(field)}"
    return f"# {key} = {toml_value(default)}  # {about(field)}"
