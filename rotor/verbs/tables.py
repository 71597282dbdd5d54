"""Tables of scene files as structures, made from declarations: keys, types, descriptions and defaults."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Union

import msgspec
from msgspec import Meta, Struct

from rotor.requests.choices import Choices
from rotor.requests.field import REQUIRED, Field, all_fields
from rotor.requests.readers import Each, Flag, NameList, Names, Quantity, Text
from rotor.verbs.verb import Output


class Section(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A table of a scene file."""


def said(text: str, example: Any = None) -> Meta:
    """The description of a field, and an example where its default is nothing."""
    return Meta(description=text, examples=None if example is None else [example])


TITLES = {
    "body": "A rigid body instead of a molecule, in any coherent units.",
    "lines": "The measured lines.",
    "parameters": "What is free; a .par file says so itself.",
    "molecule": "Which molecule; either `source` or `constants`.",
    "effects": "What the Hamiltonian consists of besides the rigid rotor.",
    "conditions": "The conditions.",
    "observables": "What is computed.",
    "numerics": "Knobs; what is left out is chosen.",
    "vibration": "Vibrational states that the partition function counts; one of the two.",
    "outputs": "Files to write.",
    "magnetic": "What a magnetic field acts on; by default what the file of the molecule has in its table [magnetic].",
}


_MADE: dict[tuple[Any, ...], Any] = {}


def section_class(table: str, inputs: tuple[Field, ...], owner: str = "") -> Any:
    """The structure of a table; the same inputs have the same structure. owner: the kind of scene, for the name."""
    key = (table, inputs)
    if key not in _MADE:
        _MADE[key] = _structure(table, entries_of(inputs), owner)
    return _MADE[key]


@cache
def structures_of(choices: Choices) -> dict[str, Any]:
    """The structure of the table of each kind of a list."""
    made = {}
    for name, kind in choices.load().items():
        title = "".join(word.capitalize() for word in name.split())
        entries = entries_of(tuple(all_fields(kind).values()))
        made[name] = msgspec.defstruct(
            f"{title}Section", entries, bases=(Section,), frozen=True, kw_only=True, tag=name, tag_field=choices.word,
            forbid_unknown_fields=True, omit_defaults=True, module=__name__,
        )  # fmt: skip
        made[name].__doc__ = (kind.__doc__ or "").splitlines()[0]
    return made


def _type_of(one: Field) -> Any:
    """The type of a key."""
    if isinstance(one.reader, Choices):
        tables: Any = Union[tuple(structures_of(one.reader).values())]  # noqa: UP007  # of types that are known when it runs
        return list[tables]
    return one.reader.scene_type


def entries_of(inputs: tuple[Field, ...]) -> list[Any]:
    """Name, type and default of every key of a table; keys that must be given have no default."""
    return [_entry(one)[:2] if one.default is REQUIRED else _entry(one) for one in inputs]


def _structure(table: str, entries: list[Any], owner: str) -> Any:
    name = owner.capitalize() + table.rpartition(".")[2].capitalize()
    made = msgspec.defstruct(
        name, entries, bases=(Section,), frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True,
        module=__name__,
    )  # fmt: skip
    made.__doc__ = TITLES.get(table, "Settings.")
    return made


def _entry(one: Field) -> tuple[str, Any, Any]:
    help_ = one.help[:1].lower() + one.help[1:] if one.help[1:2].islower() else one.help
    kind, default = _type_of(one), _default(one)
    if one.none:
        kind |= str
    if default is None and one.default is not REQUIRED:
        kind |= None
    if isinstance(default, list | dict):
        return one.last, Annotated[kind, said(help_, one.example)], _made_anew(default)
    return one.last, Annotated[kind, said(help_, one.example)], default


def _made_anew(default: Any) -> Any:
    """An empty list or table is a default that a file leaves out."""
    return msgspec.field(default_factory=(lambda: default) if default else type(default))


def _default(one: Field) -> Any:
    """What a template shows."""
    if one.typed is not None:
        return one.typed
    if one.default is REQUIRED:
        return one.example
    if isinstance(one.default, tuple) and isinstance(one.reader, Names | NameList | Choices):
        return list(one.default)
    if one.default is None or isinstance(one.reader, Flag | Text):
        return one.default
    if isinstance(one.default, tuple) and not isinstance(one.reader, Each):  # a file that says nothing means the same
        return None
    if isinstance(one.reader, Quantity) and one.reader.unit:
        return one.reader.show(one.default)
    return one.reader.write(one.default)


@cache
def outputs_class(kind: str, files: tuple[Output, ...], settings: tuple[Field, ...]) -> Any:
    """The structure of [outputs]: files, and settings of files."""
    entries: list[Any] = []
    for one in files:
        if one.many:
            entries.append(
                (one.name, Annotated[list[str], said(one.help, [one.example])], msgspec.field(default_factory=list))
            )
        else:
            entries.append((one.name, Annotated[str | None, said(one.help, one.example)], None))
    names = [one.name for one in files]
    if "parquet" in names:
        after = names.index("parquet") + 1
        entries.insert(after, ("json", Annotated[str | None, said("Write the table as JSON", "out.json")], None))
    return _structure("outputs", [*entries, *map(_entry, settings)], kind)
