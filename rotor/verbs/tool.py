"""Verbs without scenes: on files, lists, or in a browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from rotor.reports.screen import json_text
from rotor.requests.fill import Entries, read_instance
from rotor.verbs.verb import NOTHING, Output, Place, Subject, SubjectKind, Verb


@dataclass(frozen=True, eq=False, repr=False)
class Unshown:
    """No options of printing."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Tool(Verb):
    """A verb that works on files, lists or a browser: no scene says it, and what its report shows is a part of its request.

    of: the field that is the input of the JSON and of files. text: the JSON, where it is not the facts; None: there is none.
    """

    table: Callable[[Any], Any] = lambda answer: None
    rows: str = ""
    outputs: tuple[Output, ...] = ()
    subject: SubjectKind = NOTHING
    shown: type = Unshown
    drawn: str | None = None
    scaled: bool = False
    sound: bool = False
    of: str = ""
    text: Callable[[Any, Mapping[str, Any]], str] | None = lambda answer, content: json_text(content)
    has_scenes: ClassVar[bool] = False

    @property
    def has_json(self) -> bool:
        """Whether there is anything for programs."""
        return self.text is not None

    def read(self, entries: Entries, place: Place) -> tuple[Any, Subject]:
        """The request; its own field is the subject."""
        request = read_instance(self.request, entries)
        source = getattr(request, self.of, "")
        return request, Subject(text=source if isinstance(source, str) else " ".join(source), note=place.note)

    def json(self, answer: Any, content: Mapping[str, Any]) -> str:
        """The facts, or what stands for them."""
        return "" if self.text is None else self.text(answer, content)
