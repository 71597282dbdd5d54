"""JSON Schema of scene files, for completion in editors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, get_args, get_origin

from rotor.requests.choices import Choices
from rotor.requests.field import REQUIRED
from rotor.requests.readers import Field
from rotor.scenes.scene import SCHEMA, Keys, about, declared_keys, kinds_in, shown_default, tables_of, value_kinds
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.verb import verb_of

TITLES = {
    "body": "A rigid body instead of a molecule, in any coherent units.",
    "lines": "The measured lines.",
    "parameters": "Free parameters; a .par file states its own.",
    "effects": "Terms of the Hamiltonian besides the rigid rotor.",
    "conditions": "The conditions.",
    "observables": "What is computed.",
    "numerics": "Numerical settings; those left out are chosen.",
    "vibration": "Vibrational states in the partition function; one of the two.",
    "outputs": "Files to write.",
    "magnetic": "Tensors on which a magnetic field acts; by default those in the molecule's file, table [magnetic].",
}
_PLAIN = {int: "integer", float: "number", str: "string", bool: "boolean"}


def json_schema() -> dict[str, Any]:
    """JSON Schema of all kinds of scene."""
    kinds = {kind: _scene_schema(kind) for kind in SCENE_VERBS}
    mapping = {kind: f"#/$defs/{kind}" for kind in kinds}
    discriminator = {"propertyName": "kind", "mapping": mapping}
    return {
        "title": "A scene of rotor",
        "anyOf": [{"$ref": place} for place in mapping.values()],
        "discriminator": discriminator,
        "$defs": kinds,
    }


def _scene_schema(kind: str) -> dict[str, Any]:
    """Schema of a kind of scene."""
    verb = verb_of(kind)
    tables = {name: keys for name, keys in tables_of(verb).items() if name}
    schema = table_schema(tables_of(verb)[""], verb.about, ("kind", kind))
    schema["properties"]["schema"] = {"description": "version of this format", "const": SCHEMA}
    schema["properties"] |= {name: table_schema(keys, TITLES.get(name, "Settings.")) for name, keys in tables.items()}
    return schema


def table_schema(keys: Keys, description: str, tag: tuple[str, str] | None = None) -> dict[str, Any]:
    """Schema of a table. tag: key and value that tell it from others."""
    tagged = {} if tag is None else {tag[0]: {"enum": [tag[1]]}}
    required = [*tagged, *(key for key, field in keys.items() if field.default is REQUIRED)]
    properties = tagged | {key: _field_schema(field) for key, field in keys.items()}
    return {
        "type": "object",
        "description": description,
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }


def _structure_schema(structure: Any, tag: tuple[str, str] | None = None) -> dict[str, Any]:
    """Schema of a table that a dataclass of declared fields describes, with the first line of its text."""
    return table_schema(declared_keys(structure), (structure.__doc__ or "").splitlines()[0], tag)


def _field_schema(field: Field) -> dict[str, Any]:
    """Schema of a key: its type, description, default and example."""
    described: dict[str, Any] = {"description": about(field)}
    if (default := shown_default(field)) is not None:
        described["default"] = default
    if field.example is not None:
        described["examples"] = [field.example]
    if not isinstance(field.reader, Choices):
        return _type_schema(value_kinds(field)) | described
    word = field.reader.word
    kinds = {name: _structure_schema(kind, (word, name)) for name, kind in field.reader.load().items()}
    return {"type": "array", "items": {"anyOf": list(kinds.values())}} | described


def _type_schema(kinds: tuple[Any, ...]) -> dict[str, Any]:
    """Schema of alternatives of types."""
    schemas: list[Mapping[str, Any]] = []
    for kind in dict.fromkeys(kinds):
        base, inner = get_origin(kind) or kind, get_args(kind)
        if base is Any:
            schemas.append({})
        elif is_dataclass(base):
            schemas.append(_structure_schema(base))
        elif base is list:
            schemas.append({"type": "array", "items": _type_schema(kinds_in(inner[0]))})
        elif base is dict:
            schemas.append({"type": "object", "additionalProperties": _type_schema(kinds_in(inner[1]))})
        else:
            schemas.append({"type": _PLAIN[base]})
    return dict(schemas[0]) if len(schemas) == 1 else {"anyOf": schemas}
