"""Fill requests from command lines, scenes and Python values, and write them back to scenes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.field import OUTPUTS, REQUIRED, Part, all_fields, declared_fields, parts_of
from rotor.requests.readers import Field


@dataclass(frozen=True)
class Entries:
    """Values that a user entered. values: by identity of the field. style: how errors name fields: "option", "key" or "name"."""

    values: Mapping[str, Any] = field(default_factory=dict)
    style: str = "name"

    def of(self, field: Field) -> Any:
        """The value entered for a field; None if it was not entered."""
        return self.values.get(field.identity)

    def has(self, field: Field) -> bool:
        """Whether a field was entered."""
        return self.values.get(field.identity) is not None

    def among(self, structure: Any) -> list[Field]:
        """The fields of a dataclass that were entered."""
        return [field for field in all_fields(structure).values() if self.has(field)]


def read_fields(structure: Any, entries: Entries, subject: Any = None) -> dict[str, Any]:
    """Values of the entered fields of a dataclass, by name; parts are made for the subject."""
    values = {
        name: field.read(entries.of(field), entries.style)
        for name, field in declared_fields(structure).items()
        if entries.has(field)
    }
    for name, part in parts_of(structure).items():
        value = _make(part, entries, subject)
        if value is not None:
            values[name] = value
    return values


def _make(part: Part, entries: Entries, subject: Any) -> Any:
    present = entries.among(part.inputs)
    inner = read_fields(part.inputs, entries, subject)
    if part.whole and present and len(present) < len(all_fields(part.inputs)):
        names = " and ".join(field.called(entries.style) for field in all_fields(part.inputs).values())
        raise ValueError(f"{names}: {part.why}")
    if part.single and len(present) > 1:
        raise ValueError(f"{' and '.join(field.called(entries.style) for field in present)}: {part.why}")
    if part.whole and not present:
        return None
    with naming(all_fields(part.inputs).values(), entries.style):
        return part.make(part.inputs(**inner), subject)


def read_instance(structure: Any, entries: Entries) -> Any:
    """Instance of a dataclass all of whose fields are declared."""
    missing = [
        field for field in declared_fields(structure).values() if field.default is REQUIRED and not entries.has(field)
    ]
    if missing:
        name = missing[0].called(entries.style)
        texts = f"the key {name!r} is missing", f"{name} is missing; --help shows what the command takes"
        raise ValueError(texts[entries.style == "option"])
    with naming(all_fields(structure).values(), entries.style):
        return structure(**read_fields(structure, entries))


def refuse_misfits(fields: Collection[Field], given: Collection[str], style: str) -> None:
    """Raise ValueError for a given field whose rule the other given fields break. given: identities.

    A scene may hold settings that nothing uses, so that only its files are checked. Python writes files afterwards.
    """
    ruled = [(item, item.rule) for item in fields if item.rule is not None and item.identity in given]
    names = {item.identity: item.called(style) for item in fields} if ruled else {}
    for item, rule in ruled:
        unused = style == "key" and not item.key.startswith(OUTPUTS)
        if unused or (style == "name" and any(name.startswith(OUTPUTS) for name in rule.needs)):
            continue
        start = f"{names[item.identity]}: {rule.why}{'; ' if rule.why else ''}expected"
        if rule.needs and not any(name in given for name in rule.needs):
            raise ValueError(f"{start} with {' or '.join(names[name] for name in rule.needs)}")
        if other := next((name for name in rule.excludes if name in given), ""):
            raise ValueError(f"{start} without {names[other]}")


class NamedError(ValueError):
    """Error whose text has fields in braces, by name or by identity: `{step}`. `naming` puts in the user's names."""


@contextmanager
def within(place: str) -> Iterator[None]:
    """Context in which the text of a ValueError begins with its place: an option, a key, or a field in braces (`NamedError`)."""
    try:
        yield
    except ValueError as error:
        kind = NamedError if place.startswith("{") else ValueError
        raise kind(f"{place}: {error}") from None


@contextmanager
def naming(fields: Iterable[Field], style: str, *, plain: bool = True) -> Iterator[None]:
    """Context in which a ValueError names these fields in the user's style.

    A NamedError has them in braces. plain: whether they are replaced in other errors too: a name with an underscore anywhere in the text,
    a plain word at its start.
    """
    try:
        yield
    except ValueError as error:
        names = {name: field.called(style) for field in fields for name in (field.name, field.identity)}
        if isinstance(error, NamedError):
            text = re.sub(r"\{([\w.]+)\}", lambda match: names.get(match[1], match[0]), str(error))
            raise NamedError(text) from None
        words = [name for name in names if plain and name and "." not in name]
        patterns = [rf"(?<![\w.-]){name}\b" if "_" in name else rf"^{name}\b(?!\.)" for name in words]
        text = re.sub("|".join(patterns), lambda match: names[match[0]], str(error)) if patterns else str(error)
        if text == str(error):
            raise
        raise ValueError(text) from None


def written_fields(request: Any) -> dict[str, Any]:
    """Content of a scene for a request, by key; default values are left out."""
    table: dict[str, Any] = {}
    structure: Any = type(request)
    for name, declared_field in declared_fields(structure).items():
        value = getattr(request, name)
        if declared_field.key and not equal(value, declared_field.default):
            table[declared_field.key] = declared_field.write(value)
    for name, part in parts_of(structure).items():
        inner = part.split(getattr(request, name), request)
        if inner is not None:
            table |= written_fields(inner)
    return table


def equal(value: Any, default: Any) -> bool:
    """Whether a value equals the default; sequences are compared item by item."""
    if value is default:
        return True
    if hasattr(value, "tolist"):
        value = tuple(value.tolist()) if value.ndim else value.item()
    if isinstance(value, list | tuple) and isinstance(default, list | tuple):
        return len(value) == len(default) and all(map(equal, value, default))
    return (type(value) is type(default) and bool(value == default)) or (
        isinstance(value, int | float | complex)
        and isinstance(default, int | float | complex)
        and not isinstance(value, bool)
        and value == default
    )
