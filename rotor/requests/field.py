"""Declaration of a request's field, written once where the field stands.

    @dataclass(frozen=True)
    class RamanRequest:
        top: Top
        temperature_k: float = declared(300.0, Quantity("K", above=0), "Temperature", "conditions.temperature")

From it follow the command-line option, the key of a scene, the line of a template, the JSON Schema, `--save-scene`, the check of the
request, the names in errors, and the reference page. A field that is made from several options is a `part`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import MISSING, fields, is_dataclass
from dataclasses import field as dataclass_field
from functools import cache
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.readers import InsideError, Reader

MOLECULE, SPINS, CONDITIONS, OBSERVABLES, NUMERICS, OUTPUT, PICTURE = PANELS = (
    "Molecule", "States and spins", "Conditions", "What to compute", "Numerics", "Output", "Picture",
)  # fmt: skip
_PANEL_OF_TABLE = {
    "molecule": MOLECULE, "effects": SPINS, "conditions": CONDITIONS, "vibration": CONDITIONS, "observables": OBSERVABLES,
    "numerics": NUMERICS, "outputs": OUTPUT,
}  # fmt: skip
OUTPUTS = "outputs."  # table of the files of a scene
_DECLARED, _PART = "declared", "part"
REQUIRED: Any = MISSING  # the default of a field that must be given


@dataclass(frozen=True, eq=False, repr=False)
class Rule:
    """Fields or files, by identity, that go with a field: at least one of `needs`, none of `excludes`. why: the reason in errors."""

    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Field:
    """Declaration of a field.

    reader: reads, writes and checks a value, with unit and bounds.
    help: one line, without a full stop.
    key: table and key in a scene, such as "conditions.temperature"; a key without a table stands before the first table; "" for none.
    option: name on the command line; None derives it from the key, "" means none; without a leading "-" it is an argument by position.
    hidden: another option sets this field together with others (`rotor.verbs.verb.Extra`).
    none: the word that stands for None.
    common: whether --help lists the option; --help-all lists all.
    example: value in a template if the default is None.
    typed: the default as a user would type it, if that differs.
    panel: heading in --help.
    knob: how fine an approximation is (`rotor.requests.knob`).
    rule: other fields or files that it needs or excludes.
    name, default: filled in by `declared_fields`.
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
    rule: Rule | None = None
    name: str = ""
    default: Any = None

    @property
    def table(self) -> str:
        """The table in a scene; empty for a key before the first table."""
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
        """The name of a value in `Entries`, whatever its origin: the key, or the field's name if it has no key."""
        return self.key or self.name

    @property
    def default_text(self) -> str:
        """The default in the help of the option; empty for one that needs no words."""
        if self.typed is not None:
            return str(self.typed)
        if self.default in (None, REQUIRED, (), "", {}) or isinstance(self.default, bool):
            return ""
        return self.reader.show(self.default)

    def called(self, style: str) -> str:
        """The field's name in errors; style is "option", "key" or "name"."""
        names = {"option": self.flag, "key": self.key, "name": self.name}
        return names[style] or self.flag or self.key or self.name

    def read(self, raw: Any, style: str) -> Any:
        """Read a value; a ValueError names the field in the given style."""
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
        """The value as a scene holds it; None is left out."""
        return self.none if value is None else self.reader.write(value)


@dataclass(frozen=True, eq=False, repr=False)
class Part:
    """A field of a request that is made from several declared values, which stand in their own dataclass.

    inputs: that dataclass.
    make: returns the field's value from an instance of `inputs` and the subject (a molecule, ...).
    split: the inverse: returns an instance of `inputs` from the value and the request, or None if all inputs are left out.
    whole: either all inputs must be given or none. single: at most one may be given. why: the rule as an error states it.
    """

    inputs: type
    make: Callable[[Any, Any], Any]
    split: Callable[[Any, Any], Any]
    whole: bool = False
    single: bool = False
    why: str = ""


def declared(default: Any, reader: Reader, help: str, key: str = "", **more: Any) -> Any:
    """A dataclass field with its declaration (`Field`)."""
    metadata = {_DECLARED: Field(reader, help, key, default=default, **more)}
    if default is REQUIRED:
        return dataclass_field(metadata=metadata)
    if isinstance(default, list | dict):
        return dataclass_field(default_factory=lambda: default, metadata=metadata)
    return dataclass_field(default=default, metadata=metadata)


def part(
    inputs: type, make: Callable[[Any, Any], Any], split: Callable[[Any, Any], Any], default: Any = None, **more: Any
) -> Any:
    """A dataclass field that is made from several declared values (`Part`); default: of the field."""
    metadata = {_PART: Part(inputs, make, split, **more)}
    return (
        dataclass_field(metadata=metadata)
        if default is REQUIRED
        else dataclass_field(default=default, metadata=metadata)
    )


def identical(value: Any, _: Any) -> Any:
    """Identity, as `make` and `split` of a part whose value is its inputs."""
    return value


@cache
def declared_fields(structure: Any) -> dict[str, Field]:
    """The declared fields of a dataclass by name, without those of its parts."""
    from dataclasses import replace

    assert is_dataclass(structure)
    return {
        item.name: replace(item.metadata[_DECLARED], name=item.name)
        for item in fields(structure)
        if _DECLARED in item.metadata
    }


@cache
def undeclared(structure: Any) -> list[Any]:
    """The fields of a dataclass that are neither declared nor parts; no file holds them."""
    return [item for item in fields(structure) if not item.metadata.keys() & {_DECLARED, _PART}]


@cache
def parts_of(structure: Any) -> dict[str, Part]:
    """The parts of a dataclass by name."""
    return {item.name: item.metadata[_PART] for item in fields(structure) if _PART in item.metadata}


@cache
def all_fields(structure: Any) -> dict[str, Field]:
    """All declared fields of a request by identity, including those of its parts, in order of definition."""
    by_identity: dict[str, Field] = {}
    for item in fields(structure):
        if _DECLARED in item.metadata:
            field = declared_fields(structure)[item.name]
            by_identity[field.identity] = field
        elif _PART in item.metadata:
            inner: Any = parts_of(structure)[item.name].inputs
            by_identity |= all_fields(inner)
    return by_identity


def check_fields(request: Any) -> None:
    """Raise ValueError, with the field's name, if a value of a request is out of its declared bounds."""
    structure: Any = type(request)
    for name, field in declared_fields(structure).items():
        value, check = getattr(request, name), getattr(field.reader, "check", None)
        try:
            if check is not None and not (value is None and (field.default is None or field.none)):
                check(value)
        except TypeError:
            raise ValueError(f"{name}: {value!r}: expected a number") from None
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None


def changed_fields(instance: Any, names: Iterable[str] = ()) -> list[Field]:
    """The declared fields of a dataclass, all or those with these names, that differ from their defaults."""
    structure: Any = type(instance)
    fields = declared_fields(structure)
    return [fields[name] for name in names or fields if getattr(instance, name) != fields[name].default]
