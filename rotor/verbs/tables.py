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


def _type_of(field: Field) -> Any:
    """The type of a key."""
    if isinstance(field.reader, Choices):
        tables: Any = Union[tuple(structures_of(field.reader).values())]  # noqa: UP007  # of types that are known when it runs
        return list[tables]
    return field.reader.scene_type


def entries_of(inputs: tuple[Field, ...]) -> list[Any]:
    """Name, type and default of every key of a table; keys that must be given have no default."""
    return [_entry(field)[:2] if field.default is REQUIRED else _entry(field) for field in inputs]


def _structure(table: str, entries: list[Any], owner: str) -> Any:
    name = owner.capitalize() + table.rpartition(".")[2].capitalize()
    made = msgspec.defstruct(
        name, entries, bases=(Section,), frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True,
        module=__name__,
    )  # fmt: skip
    made.__doc__ = TITLES.get(table, "Settings.")
    return made


def _entry(field: Field) -> tuple[str, Any, Any]:
    help_ = field.help[:1].lower() + field.help[1:] if field.help[1:2].islower() else field.help
    kind, default = _type_of(field), _default(field)
    if field.none:
        kind |= str
    if default is None and field.default is not REQUIRED:
        kind |= None
    if isinstance(default, list | dict):
        return field.last, Annotated[kind, said(help_, field.example)], _made_anew(default)
    return field.last, Annotated[kind, said(help_, field.example)], default


def _made_anew(default: Any) -> Any:
    """An empty list or table is a default that a file leaves out."""
    return msgspec.field(default_factory=(lambda: default) if default else type(default))


def _default(field: Field) -> Any:
    """What a template shows."""
    if field.typed is not None:
        return field.typed
    if field.default is REQUIRED:
        return field.example
    if isinstance(field.default, tuple) and isinstance(field.reader, Names | NameList | Choices):
        return list(field.default)
    if field.default is None or isinstance(field.reader, Flag | Text):
        return field.default
    if isinstance(field.default, tuple) and not isinstance(
        field.reader, Each
    ):  # a file that says nothing means the same
        return None
    if isinstance(field.reader, Quantity) and field.reader.unit:
        return field.reader.show(field.default)
    return field.reader.write(field.default)


@cache
def outputs_class(kind: str, files: tuple[Output, ...], settings: tuple[Field, ...]) -> Any:
    """The structure of [outputs]: files, and settings of files."""
    entries: list[Any] = []
    for output in files:
        if output.many:
            entries.append(
                (
                    output.name,
                    Annotated[list[str], said(output.help, [output.example])],
                    msgspec.field(default_factory=list),
                )
            )
        else:
            entries.append((output.name, Annotated[str | None, said(output.help, output.example)], None))
    names = [output.name for output in files]
    if "parquet" in names:
        after = names.index("parquet") + 1
        entries.insert(after, ("json", Annotated[str | None, said("Write the table as JSON", "out.json")], None))
    return _structure("outputs", [*entries, *map(_entry, settings)], kind)
