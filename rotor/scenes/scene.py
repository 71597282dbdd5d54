"""A scene: a simulation as data, its keys from the declaration of its verb, and scene files in TOML.

No physics is imported here: names and types of a scene are checked by the declaration of its verb, values by the request. What
computes a scene is imported by name when it runs.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import is_dataclass
from functools import cache
from importlib import import_module
from types import UnionType
from typing import TYPE_CHECKING, Any, get_args, get_origin

from rotor.formats.toml import parse_toml, read_toml, toml_key, toml_value
from rotor.frozen import dataclass
from rotor.requests.accuracy import Stated, TotalAccuracy
from rotor.requests.choices import Choices, nearest
from rotor.requests.field import REQUIRED, all_fields
from rotor.requests.fill import Entries
from rotor.requests.lists import Each, NameList
from rotor.requests.readers import Custom, Field, Flag, Names, Quantity, Text
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.outputs import Output
from rotor.verbs.common.verb import Verb, verb_of

if TYPE_CHECKING:
    from rotor.requests.plan import Plan
    from rotor.verbs.common.calculation import Outcome

SCHEMA = 1
Keys = Mapping[str, Field]  # fields of a table by key
ORDER = ("body", "lines", "parameters", "magnetic", "effects", "conditions", "observables", "vibration", "numerics")
TITLE = Field(Text(), "a line for reports", "title", example="Water in the microwave region", default="")
SWEEP = Field(
    Custom(dict, scene_type=dict[str, list[Any]]), "values by dotted name; every combination is run", "sweep",
    example={"conditions.temperature": ["10 K", "100 K", "300 K"]},
)  # fmt: skip
JSON = Field(Text(), "Write the table as JSON", "outputs.json", example="out.json")

_WORDS = {
    int: "a whole number", float: "a number", str: "a text", bool: "true or false", list: "a list", tuple: "a list", dict: "a table",
}  # fmt: skip  # types as errors name them


@dataclass(frozen=True)
class Scene:
    """A scene, made by `scene_of`. kind: name of the verb. content: keys and tables as in the file, without schema, kind and defaults."""

    kind: str
    content: Mapping[str, Any]

    @property
    def title(self) -> str:
        """The line for reports."""
        return str(self.content.get("title", ""))

    @property
    def sweep(self) -> Mapping[str, list[Any]]:
        """Swept values by dotted name."""
        swept: Mapping[str, list[Any]] = self.content.get("sweep", {})
        return swept

    @property
    def outputs(self) -> Mapping[str, Any]:
        """The files to write, and their settings."""
        outputs: Mapping[str, Any] = self.content.get("outputs", {})
        return outputs

    @property
    def accuracy(self) -> Stated:
        """The requested accuracy; None without one."""
        stated: Stated = self.content.get("accuracy")
        return stated

    @property
    def entries(self) -> Entries:
        """The inputs of the verb."""
        molecule, values = self.content.get("molecule"), dict[str, Any]()
        content = {**self.content, "molecule": {"source": molecule}} if isinstance(molecule, str) else self.content
        for key in keyed(verb_of(self.kind)):
            inner: Any = content
            for name in key.split("."):
                inner = inner.get(name) if isinstance(inner, Mapping) else None
            if inner is not None:
                values[key] = inner
        return Entries(values, "key")

    @property
    def heading(self) -> str:
        """The title, or the kind in words."""
        return self.title or f"a scene of the kind {self.kind}"

    def replaced(self, **content: Any) -> Scene:
        """The scene with other keys or whole tables."""
        return scene_of({"schema": SCHEMA, "kind": self.kind, **self.content, **content})

    def run(
        self,
        *,
        folder: str | os.PathLike[str] = ".",
        out: str | os.PathLike[str] = ".",
        executor: Executor | None = None,
    ) -> Outcome:
        """Run the scene, see `rotor.scenes.run.run_scene`."""
        outcome: Outcome = import_module("rotor.scenes.run").run_scene(self, folder=folder, out=out, executor=executor)
        return outcome

    def plan(self, *, folder: str | os.PathLike[str] = ".") -> Plan:
        """Plan of the scene with neglected effects, see `rotor.scenes.plan.plan_of`."""
        plan: Plan = import_module("rotor.scenes.plan").plan_of(self, folder)
        return plan


def make_scene(kind: str, **content: Any) -> Scene:
    """A scene from its keys and tables.

    Parameters
    ----------
    kind : str
        Name of a verb with scenes: "spectrum", "levels", ...
    **content
        Keys of the scene, and its tables as mappings, as in a scene file.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        For an unknown kind or key, and for a value of a wrong type.

    Examples
    --------
    >>> make_scene("levels", molecule="CO", observables={"jmax": 3}).run().table.energy_cm.round(3).tolist()
    [0.0, 3.845, 11.535, 23.069]
    """
    return scene_of({"schema": SCHEMA, "kind": kind, **content})


def scene_of(content: Mapping[str, Any], where: str = "scene") -> Scene:
    """The scene of nested tables, as parsed from TOML.

    Raises ValueError for an unknown version or kind, unknown keys and wrong types.
    """
    verb = _kind_verb(content.get("schema"), content.get("kind"), where)
    tables = tables_of(verb)
    values = {key: value for key, value in content.items() if key not in ("schema", "kind")}
    try:
        for key, value in values.items():
            if key not in tables and key not in tables[""]:
                raise UnknownKeyError(key, value, "", [*tables[""], *tables])
        inner = {name: checked_table(keys, values.get(name) or {}, name) for name, keys in tables.items() if name}
        head = checked_table(tables[""], {key: value for key, value in values.items() if key not in inner}, "")
    except UnknownKeyError as error:
        raise ValueError(f"{where}: {error.text(_other_place(error.key, verb))}") from None
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    return Scene(verb.name, head | {name: table for name, table in inner.items() if table})


def _kind_verb(schema: Any, kind: Any, where: str) -> Verb:
    if schema != SCHEMA:
        problem = "it has none" if schema is None else f"this one has {schema!r}"
        raise ValueError(f"{where}: expected schema = {SCHEMA}, the version of the format, and {problem}")
    if not isinstance(kind, str) or kind not in SCENE_VERBS:
        problem = "it has none" if kind is None else f"{kind!r} is none; {nearest(str(kind), SCENE_VERBS)}"
        raise ValueError(f"{where}: expected kind, one of {', '.join(SCENE_VERBS)}; {problem}")
    return verb_of(kind)


def _other_place(key: str, verb: Verb) -> str:
    """Where a scene has a key of this name, outside lists of tables; empty if nowhere."""
    tables = dict(tables_of(verb))
    first = tables.pop("")
    if key in first or key in tables:
        return "; it stands before the first table"
    tables |= {name: declared_keys(part) for name, field in first.items() for part in inner_tables(field).values()}
    places = [name for name, keys in tables.items() if key in keys]
    return f"; it is a key of {' and '.join(f'[{name}]' for name in places)}" if places else ""


def read_scene(path: str | os.PathLike[str]) -> Scene:
    """The scene of a file.

    Raises ValueError, with file and key, for invalid TOML, unknown keys and wrong types.
    """
    return scene_of(read_toml(path), str(path))


def checked_scene(scene: Any) -> None:
    """TypeError for what is no scene, such as the path of one."""
    if not isinstance(scene, Scene):
        raise TypeError(f"{scene!r:.60}: expected a scene: read_scene reads one from its file, make_scene makes one")


def parse_scene(text: str, where: str = "scene") -> Scene:
    """The scene of a TOML text; `where` names the text in errors.

    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"').content
    {'molecule': 'CO'}
    >>> parse_scene('schema = 1\\nkind = "levels"\\nmolecule = "CO"\\n[observables]\\nj_max = 3')
    Traceback (most recent call last):
        ...
    ValueError: scene: [observables] has no key 'j_max'; the nearest is 'jmax'
    """
    return scene_of(parse_toml(text, where), where)


def scene_text(scene: Scene) -> str:
    """The scene as TOML. Defaults are left out; numbers read back as the same doubles.

    >>> print(scene_text(make_scene("levels", molecule="CO")), end="")
    schema = 1
    kind = "levels"
    molecule = "CO"
    """
    return "".join(_lines_of({"schema": SCHEMA, "kind": scene.kind, **scene.content}, ()))


def _lines_of(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Lines of a table: values first, then inner tables."""
    plain = {key: value for key, value in table.items() if not _is_table(value)}
    lines = [f"{toml_key(key)} = {toml_value(value)}\n" for key, value in plain.items() if value is not None]
    for key, value in table.items():
        inner = (*path, key)
        name = ".".join(toml_key(part) for part in inner)
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


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as TOML, completely or not at all."""
    from rotor.formats.atomic_write import open_atomic

    with open_atomic(path, "w", encoding="utf-8", newline="\n") as handle:
        handle.write(scene_text(scene))


def keyed(verb: Verb) -> Keys:
    """The inputs of a verb that a scene may hold, by dotted key."""
    fields = (*verb.subject.scene_fields, *verb.fields.values())
    return {field.key: field for field in fields if field.key}


@cache
def tables_of(verb: Verb) -> Mapping[str, Keys]:
    """Keys by table, outputs last; "" has the keys before the first table."""
    grouped: dict[str, dict[str, Field]] = {"": {"title": TITLE, "sweep": SWEEP}}
    for field in keyed(verb).values():
        if field.table != "molecule":  # `molecule` itself is a key before the first table
            grouped.setdefault(field.table, {})[field.last] = field
    if verb.accuracy:
        reader = Custom(str, scene_type=str | float | TotalAccuracy)
        grouped[""]["accuracy"] = Field(reader, verb.accuracy, "accuracy", example=verb.accuracy_example)
    order = {table: place for place, table in enumerate(("", *ORDER))}
    settings = grouped.pop("outputs", {})
    tables = dict(sorted(grouped.items(), key=lambda item: order.get(item[0], len(order))))
    return {**tables, "outputs": _file_keys(verb.outputs) | settings}


def _file_keys(outputs: tuple[Output, ...]) -> dict[str, Field]:
    """Keys of the files that a scene writes; verbs with Parquet write the table as JSON too."""
    files = {}
    for output in outputs:
        if output.scene:
            files[output.name] = output.field
        if output.name == "parquet":
            files["json"] = JSON
    return files


def declared_keys(structure: Any) -> Keys:
    """Keys of a table that a dataclass of declared fields describes."""
    return {field.last: field for field in all_fields(structure).values()}


def inner_tables(field: Field) -> dict[str, Any]:
    """Dataclasses of the tables that a field may hold, by the word that tells them apart; empty for a plain value."""
    if isinstance(field.reader, Choices):
        return dict(field.reader.load())
    parts = (part for kind in kinds_in(field.reader.scene_type) for part in (kind, *get_args(kind)))
    inner = next(filter(is_dataclass, parts), None)
    return {} if inner is None else {"": inner}


def kinds_in(hint: Any) -> tuple[Any, ...]:
    """The alternatives of a type."""
    return get_args(hint) if isinstance(hint, UnionType) else (hint,)


def value_kinds(field: Field) -> tuple[Any, ...]:
    """The types that a value of a field may have, that of its word for None among them."""
    return (*kinds_in(field.reader.scene_type), *([str] if field.none else []))


def about(field: Field) -> str:
    """The help of a field as a description: it begins with a small letter, unless it begins with a symbol or an acronym."""
    return field.help[:1].lower() + field.help[1:] if field.help[1:2].islower() else field.help


def shown_default(field: Field) -> Any:
    """The default as a scene holds it; None if a missing key alone stands for it."""
    if field.typed is not None:
        return field.typed
    default, reader = field.default, field.reader
    if default is None or default is REQUIRED or isinstance(reader, Flag | Text):
        return None if default is REQUIRED else default
    if isinstance(default, tuple) and not isinstance(reader, Each):
        return list(default) if isinstance(reader, Names | NameList | Choices) else None
    return reader.show(default) if isinstance(reader, Quantity) and reader.unit else reader.write(default)


class UnknownKeyError(ValueError):
    """A table has no such key. place: of the table; empty before the first table. names: of the keys that it has."""

    def __init__(self, key: str, value: Any, place: str, names: Iterable[str]) -> None:
        super().__init__(key)
        self.key, self.value, self.place, self.names = key, value, place, names

    def text(self, elsewhere: str) -> str:
        """The message. elsewhere: where a scene has such a key; empty if nowhere."""
        inside = self.place if self.place.endswith("]") else f"[{self.place}]"
        table = inside if self.place else "a scene of this kind"
        other = "" if isinstance(self.value, Mapping) else elsewhere
        return f"{table} has no key {self.key!r}{other or '; ' + nearest(self.key, self.names)}"


def checked_table(keys: Keys, values: Any, place: str) -> dict[str, Any]:
    """The values of a table; None counts as left out.

    Raises ValueError for an unknown key (UnknownKeyError), a value of a wrong type, and a missing key.
    """
    if not isinstance(values, Mapping):
        raise _wrong_type(place, values, (dict,))
    for key, value in values.items():
        if key not in keys:
            raise UnknownKeyError(key, value, place, keys)
    table = {}
    for key, field in keys.items():
        if (value := values.get(key)) is not None:
            where = f"{place}.{key}" if place else key
            reader = field.reader
            value = (
                _chosen(reader, value, where)
                if isinstance(reader, Choices)
                else _typed(value, value_kinds(field), where)
            )
            if value != shown_default(field):
                table[key] = value
        elif field.default is REQUIRED:
            raise ValueError(f"{place}{': ' if place else ''}the key {key!r} is missing")
    return table


def _chosen(choices: Choices, values: Any, place: str) -> list[dict[str, Any]]:
    """A list whose tables are of several kinds."""
    if not isinstance(values, list | tuple):
        raise _wrong_type(place, values, (list,))
    return [_chosen_table(choices, item, f"{place}[{number}]") for number, item in enumerate(values)]


def _chosen_table(choices: Choices, item: Any, place: str) -> dict[str, Any]:
    """A table of such a list."""
    kinds, word = choices.load(), choices.word
    kind = item.get(word) if isinstance(item, Mapping) else None
    if isinstance(item, Mapping) and kind is None:
        raise ValueError(f"{place}: the key {word!r} is missing")
    if isinstance(kind, str) and kind not in kinds:
        raise ValueError(f"{place}.{word}: {kind!r} is none; {nearest(kind, kinds)}")
    if not isinstance(kind, str):
        raise _wrong_type(f"{place}.{word}", kind, (str,)) if kind is not None else _wrong_type(place, item, (dict,))
    rest = {key: value for key, value in item.items() if key != word}
    return {word: kind, **checked_table(declared_keys(kinds[kind]), rest, place)}


def _typed(value: Any, kinds: tuple[Any, ...], place: str) -> Any:
    """The value as the first of these types that it has."""
    for kind in kinds:
        base, inner = get_origin(kind) or kind, get_args(kind)
        if base is Any:
            return value
        if is_dataclass(base) and isinstance(value, Mapping):
            return checked_table(declared_keys(base), value, place)
        if base is list and isinstance(value, list | tuple):
            return [_typed(item, kinds_in(inner[0]), f"{place}[{number}]") for number, item in enumerate(value)]
        if base is dict and isinstance(value, Mapping):
            return {name: _typed(item, kinds_in(inner[1]), f"{place}.{name}") for name, item in value.items()}
        if base is float and isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if base is int and isinstance(value, float) and value.is_integer():
            return int(value)
        if isinstance(base, type) and isinstance(value, base) and isinstance(value, bool) == (base is bool):
            return value
    raise _wrong_type(place, value, kinds)


def _wrong_type(place: str, value: Any, kinds: tuple[Any, ...]) -> ValueError:
    """The error for a value of none of these types."""
    allowed = dict.fromkeys(_WORDS.get(get_origin(kind) or kind, "a table") for kind in kinds)
    decimal = isinstance(value, float) and float not in kinds
    actual = "a number with a decimal point" if decimal else _WORDS.get(type(value), type(value).__name__)
    return ValueError(f"{place}: expected {' or '.join(allowed)}, found {actual}")
