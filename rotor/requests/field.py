"""What is known of a field of a request, said once where the field stands.

    @dataclass(frozen=True)
    class RamanRequest:
        top: Top
        temperature_k: float = declared(300.0, Quantity("K", above=0), "Temperature", "conditions.temperature")

From it follow the option with its text and panel, the key of a scene, the line of a template, the JSON Schema, `--save-scene`, the check
of the request, the names in errors, and the reference page. A field that several options make together is a `part`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from dataclasses import field as dataclass_field
from functools import cache
from typing import Any

from rotor.requests.readers import InsideError, Reader

MOLECULE, SPINS, CONDITIONS, OBSERVABLES, NUMERICS, OUTPUT, PICTURE = PANELS = (
    "Molecule", "States and spins", "Conditions", "What to compute", "Numerics", "Output", "Picture",
)  # fmt: skip
_PANEL_OF_TABLE = {
    "molecule": MOLECULE, "effects": SPINS, "conditions": CONDITIONS, "vibration": CONDITIONS, "observables": OBSERVABLES,
    "numerics": NUMERICS, "outputs": OUTPUT,
}  # fmt: skip
_DECLARED, _PART = "declared", "part"
REQUIRED: Any = MISSING  # the default of a field that must be given


@dataclass(frozen=True, eq=False, repr=False)
class Field:
    """What is known of a field.

    reader: how a value is read and written, with its unit and bounds. help: one line, without a full stop. key: table and key of a scene;
    without a table a key that stands before the first; "" is not in a scene. option: on the command line; None: derived from the key, "":
    none; one that does not begin with "-" stands without a name. hidden: the option is one that stands for several fields, see
    `rotor.verbs.verb.Extra`. none: the word for None. common: whether --help shows the option; --help-all shows all. example: of a
    template, where the default is nothing. typed: the default as a person writes it, where it is not plain. panel: heading in --help.
    knob: of an approximation, see `rotor.requests.knob`. name, default: filled in.
    """

    reader: Reader
    help: str
    key: str = ""
    option: str | None = None
    hidden: bool = False
    none: str | None = None
    common: bool = False
    example: Any = None
    typed: Any = None
    panel: str = ""
    metavar: str = ""
    knob: Any = None
    name: str = ""
    default: Any = None

    @property
    def table(self) -> str:
        """The table of a scene; empty for a key before the first one."""
        return self.key.rpartition(".")[0]

    @property
    def last(self) -> str:
        """The key inside its table."""
        return self.key.rpartition(".")[2]

    @property
    def flag(self) -> str:
        """The option, derived from the key where none is given; empty where there is none."""
        if self.option is not None:
            return self.option
        return "--" + (self.last or self.name).replace("_", "-")

    @property
    def heading(self) -> str:
        """The panel of --help."""
        return self.panel or _PANEL_OF_TABLE.get(self.table.partition(".")[0], OBSERVABLES)

    @property
    def identity(self) -> str:
        """By what a value is known, whether typed, in a file or from Python: the key, else the name."""
        return self.key or self.name

    def called(self, style: str) -> str:
        """How errors call it: style is "option", "key" or "name"."""
        names = {"option": self.flag, "key": self.key, "name": self.name}
        return names[style] or self.flag or self.key or self.name

    def read(self, raw: Any, style: str) -> Any:
        """The value of what was given; a ValueError calls the field by the name that the user knows."""
        word = isinstance(raw, str) and raw.strip().lower() == self.none
        if raw is None or word:
            return None
        try:
            return self.reader.read(raw)
        except InsideError as error:
            raise ValueError(f"{self.called(style)}{error}") from None
        except ValueError as error:
            none = f", or {self.none!r}" if self.none and isinstance(raw, str) else ""
            raise ValueError(f"{self.called(style)}: {error}{none}") from None

    def write(self, value: Any) -> Any:
        """What a scene holds of a value; None where it is left out."""
        return self.none if value is None else self.reader.write(value)

    def check(self, value: Any) -> None:
        """ValueError, with the field's name, for a value that the reader's bounds exclude."""
        check = getattr(self.reader, "check", None)
        if value is None or check is None:
            return
        try:
            check(value)
        except TypeError:
            raise ValueError(f"{self.name}: {value!r}: expected a number") from None
        except ValueError as error:
            raise ValueError(f"{self.name}: {error}") from None


@dataclass(frozen=True, eq=False, repr=False)
class Part:
    """A field of a request that is made from several declared values, which stand in a dataclass of their own.

    inputs: that dataclass. make: the value of the field from an instance and the subject (a molecule, ...). split: the instance that
    gives a value back, from the value and the request; None where all is left out. whole: all of the inputs or none of them; single: at
    most one of them; why: what an error says of that.
    """

    inputs: type
    make: Callable[[Any, Any], Any]
    split: Callable[[Any, Any], Any]
    whole: bool = False
    single: bool = False
    why: str = ""


def declared(default: Any, reader: Reader, help: str, key: str = "", **more: Any) -> Any:
    """A field of a dataclass with its declaration."""
    metadata = {_DECLARED: Field(reader, help, key, default=default, **more)}
    if default is REQUIRED:
        return dataclass_field(metadata=metadata)
    if isinstance(default, list | dict):
        return dataclass_field(default_factory=lambda: default, metadata=metadata)
    return dataclass_field(default=default, metadata=metadata)


def part(
    inputs: type, make: Callable[[Any, Any], Any], split: Callable[[Any, Any], Any], default: Any = None, **more: Any
) -> Any:
    """A field of a dataclass that several declared values make; default: of the field."""
    metadata = {_PART: Part(inputs, make, split, **more)}
    return (
        dataclass_field(metadata=metadata)
        if default is REQUIRED
        else dataclass_field(default=default, metadata=metadata)
    )


def identical(value: Any, _: Any) -> Any:
    """The `make` and `split` of a part whose inputs are its value."""
    return value


@cache
def own_fields(structure: Any) -> dict[str, Field]:
    """The declared fields of a dataclass by their names, parts left out."""
    from dataclasses import replace

    assert is_dataclass(structure)
    return {
        item.name: replace(item.metadata[_DECLARED], name=item.name)
        for item in fields(structure)
        if _DECLARED in item.metadata
    }


@cache
def undeclared(structure: Any) -> list[Any]:
    """The fields of a dataclass that no file holds."""
    return [item for item in fields(structure) if not item.metadata.keys() & {_DECLARED, _PART}]


@cache
def parts_of(structure: Any) -> dict[str, Part]:
    """The parts of a dataclass by their names."""
    return {item.name: item.metadata[_PART] for item in fields(structure) if _PART in item.metadata}


@cache
def all_fields(structure: Any) -> dict[str, Field]:
    """Every declared field of a request by its identity, those of its parts among them, in the order in which they stand."""
    by_identity: dict[str, Field] = {}
    for item in fields(structure):
        if _DECLARED in item.metadata:
            field = own_fields(structure)[item.name]
            by_identity[field.identity] = field
        elif _PART in item.metadata:
            inner: Any = parts_of(structure)[item.name].inputs
            by_identity |= all_fields(inner)
    return by_identity


def check_fields(request: Any) -> None:
    """ValueError, with the name of the field, for a value of a request that the bounds of its declaration exclude."""
    structure: Any = type(request)
    for name, field in own_fields(structure).items():
        field.check(getattr(request, name))


def names_of(structure: Any, style: str) -> Iterator[tuple[str, str]]:
    """Name of every field of a request, and how errors call it."""
    for field in all_fields(structure).values():
        yield field.name, field.called(style)
