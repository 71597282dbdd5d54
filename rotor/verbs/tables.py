"""Structures of scene tables, made from declarations: keys, types, descriptions and defaults."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Union

import msgspec
from msgspec import Meta, Struct

from rotor.requests.choices import Choices
from rotor.requests.field import REQUIRED, Field, all_fields
from rotor.requests.readers import Each, Flag, NameList, Names, Quantity, Text
from rotor.verbs.outputs import Output


class Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A table of a scene file."""


def described(text: str, example: Any = None) -> Meta:
    """Description of a key, with an example if its default is None."""
    return Meta(description=text, examples=None if example is None else [example])


TITLES = {
    "body": "A rigid body instead of a molecule, in any coherent units.",
    "lines": "The measured lines.",
    "parameters": "Free parameters; a .par file states its own.",
    "molecule": "The molecule; either `source` or `constants`.",
    "effects": "Terms of the Hamiltonian besides the rigid rotor.",
    "conditions": "The conditions.",
    "observables": "What is computed.",
    "numerics": "Numerical settings; those left out are chosen.",
    "vibration": "Vibrational states in the partition function; one of the two.",
    "outputs": "Files to write.",
    "magnetic": "Tensors on which a magnetic field acts; by default those in the molecule's file, table [magnetic].",
}


_STRUCTURES: dict[tuple[Any, ...], Any] = {}


def section_class(table: str, inputs: tuple[Field, ...], owner: str = "") -> Any:
    """The structure of a table; equal inputs share one structure. owner: the kind of scene, for the name."""
    key = (table, inputs)
    if key not in _STRUCTURES:
        _STRUCTURES[key] = _structure(table, entries_of(inputs), owner)
    return _STRUCTURES[key]


@cache
def structures_of(choices: Choices) -> dict[str, Any]:
    """Structures of the items in a list of tables, by kind."""
    structures = {}
    for name, kind in choices.load().items():
        title = "".join(word.capitalize() for word in name.split())
        entries = entries_of(tuple(all_fields(kind).values()))
        about = (kind.__doc__ or "").splitlines()[0]
        structures[name] = defined(f"{title}Section", entries, about, tag=name, tag_field=choices.word)
    return structures


def _type_of(field: Field) -> Any:
    """The type of a key in a scene."""
    if isinstance(field.reader, Choices):
        tables: Any = Union[tuple(structures_of(field.reader).values())]  # noqa: UP007  # the types are known only at run time
        return list[tables]
    return field.reader.scene_type


def entries_of(inputs: tuple[Field, ...]) -> list[Any]:
    """Name, type and default of each key of a table; required keys have no default."""
    return [_entry(field)[:2] if field.default is REQUIRED else _entry(field) for field in inputs]


def _structure(table: str, entries: list[Any], owner: str) -> Any:
    name = owner.capitalize() + table.rpartition(".")[2].capitalize()
    return defined(name, entries, TITLES.get(table, "Settings."))


def defined(name: str, entries: list[Any], about: str, **tag: Any) -> Any:
    """The structure of a table with these keys. tag: key and value that tell it from others."""
    settings: dict[str, Any] = {"frozen": True, "kw_only": True, "forbid_unknown_fields": True, "omit_defaults": True}
    structure = msgspec.defstruct(name, entries, bases=(Section,), module=__name__, **settings, **tag)
    structure.__doc__ = about
    return structure


def _entry(field: Field) -> tuple[str, Any, Any]:
    help_ = field.help[:1].lower() + field.help[1:] if field.help[1:2].islower() else field.help
    kind, default = _type_of(field), _default(field)
    if field.none:
        kind |= str
    if default is None and field.default is not REQUIRED:
        kind |= None
    if isinstance(default, list | dict):
        return field.last, Annotated[kind, described(help_, field.example)], _default_factory(default)
    return field.last, Annotated[kind, described(help_, field.example)], default


def _default_factory(default: Any) -> Any:
    """Default of a list or table; msgspec requires a factory, so that objects do not share it."""
    return msgspec.field(default_factory=(lambda: default) if default else type(default))


def _default(field: Field) -> Any:
    """Default value as a template shows it."""
    if field.typed is not None:
        return field.typed
    if field.default is REQUIRED:
        return field.example
    if isinstance(field.default, tuple) and isinstance(field.reader, Names | NameList | Choices):
        return list(field.default)
    if field.default is None or isinstance(field.reader, Flag | Text):
        return field.default
    # a tuple is left out of the scene: a missing key means the same
    if isinstance(field.default, tuple) and not isinstance(field.reader, Each):
        return None
    if isinstance(field.reader, Quantity) and field.reader.unit:
        return field.reader.show(field.default)
    return field.reader.write(field.default)


@cache
def outputs_class(kind: str, files: tuple[Output, ...], settings: tuple[Field, ...]) -> Any:
    """The structure of [outputs]: files, and settings of these files."""
    entries: list[Any] = []
    for output in files:
        if output.many:
            entries.append(
                (
                    output.name,
                    Annotated[list[str], described(output.help, [output.example])],
                    msgspec.field(default_factory=list),
                )
            )
        else:
            entries.append((output.name, Annotated[str | None, described(output.help, output.example)], None))
    names = [output.name for output in files]
    if "parquet" in names:
        after = names.index("parquet") + 1
        entries.insert(after, ("json", Annotated[str | None, described("Write the table as JSON", "out.json")], None))
    return _structure("outputs", [*entries, *map(_entry, settings)], kind)
