"""Things of several kinds in a list of tables, such as [[pulses]] with shape = "gaussian": each kind a dataclass of declared fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Union

import msgspec

from rotor.requests.field import all_fields
from rotor.requests.fill import Given, read_instance, written_fields
from rotor.verbs.tables import Section, entries_of


@dataclass(frozen=True)
class Choices:
    """The kinds of a list of tables. table: its key in a scene. word: the key that names the kind. kinds: dataclasses by that name."""

    table: str
    word: str
    kinds: Mapping[str, type]

    @cached_property
    def structures(self) -> dict[str, Any]:
        """The structure of the table of each kind."""
        return {name: self._structure(name, kind) for name, kind in self.kinds.items()}

    def _structure(self, name: str, kind: Any) -> Any:
        title = "".join(word.capitalize() for word in name.split())
        made = msgspec.defstruct(
            f"{title}Section", entries_of(tuple(all_fields(kind).values())), bases=(Section,), frozen=True, kw_only=True, tag=name,
            tag_field=self.word, forbid_unknown_fields=True, omit_defaults=True, module=__name__,
        )  # fmt: skip
        made.__doc__ = (kind.__doc__ or "").splitlines()[0]
        return made

    @property
    def scene_type(self) -> Any:
        """The type of one table."""
        return Union[tuple(self.structures.values())]  # noqa: UP007  # of types that are known when it runs

    def read(self, tables: Sequence[Mapping[str, Any]], style: str = "key") -> tuple[Any, ...]:
        """What the tables say; a ValueError names table, number and key."""
        return tuple(self._read(table, f"{self.table}[{number}]", style) for number, table in enumerate(tables))

    def _read(self, table: Mapping[str, Any], place: str, style: str) -> Any:
        kind = self.kinds[str(table[self.word])]
        try:
            return read_instance(
                kind, Given({name: value for name, value in table.items() if name != self.word}, style)
            )
        except ValueError as error:
            text = str(error)
            key = text.partition(":")[0]
            raise ValueError(f"{place}.{text}" if key in table else f"{place}: {text}") from None

    def write(self, things: Sequence[Any]) -> list[dict[str, Any]]:
        """Tables that say the same again; ValueError for a thing that no table holds."""
        names = {kind: name for name, kind in self.kinds.items()}
        if other := next((thing for thing in things if type(thing) not in names), None):
            raise ValueError(f"a scene holds no {type(other).__name__}")
        return [{self.word: names[type(thing)], **written_fields(thing)} for thing in things]
