"""Declared fields of a request, each written once where it stands.

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
from rotor.requests.readers import Field, Reader

MOLECULE, SPINS, CONDITIONS, OBSERVABLES, NUMERICS, OUTPUT, PICTURE = PANELS = (
    "Molecule", "States and spins", "Conditions", "What to compute", "Numerics", "Output", "Picture",
)  # fmt: skip
_PANEL_OF_TABLE = {
    "molecule": MOLECULE, "effects": SPINS, "conditions": CONDITIONS, "vibration": CONDITIONS, "observables": OBSERVABLES,
    "numerics": NUMERICS, "outputs": OUTPUT, "family": MOLECULE, "lines": CONDITIONS, "magnetic": CONDITIONS,
}  # fmt: skip
OUTPUTS = "outputs."  # table of the files of a scene
_DECLARED, _PART = "declared", "part"
REQUIRED: Any = MISSING  # the default of a field that must be given


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


def panel_of(field: Field) -> str:
    """The panel of --help in which a field's option stands."""
    return field.panel or _PANEL_OF_TABLE.get(field.table.partition(".")[0], OBSERVABLES)


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
