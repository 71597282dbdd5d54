"""Verbs without scenes: they work on files or lists, or in a browser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from rotor.frozen import dataclass
from rotor.reports.screen import json_text
from rotor.requests.fill import Entries, read_instance
from rotor.verbs.outputs import Output
from rotor.verbs.verb import NOTHING, Place, Subject, SubjectKind, Verb


@dataclass(frozen=True, eq=False, repr=False)
class NoDisplayOptions:
    """For verbs without display options."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Tool(Verb):
    """A verb without scenes; its display options are fields of its request.

    of: the field that names the input, for JSON and provenance. text: JSON text if it is not the facts; None: the verb has no JSON.
    """

    table: Callable[[Any], Any] = lambda answer: None
    rows: str = ""
    outputs: tuple[Output, ...] = ()
    subject: SubjectKind = NOTHING
    shown: type = NoDisplayOptions
    drawn: str | None = None
    scaled: bool = False
    sound: bool = False
    of: str = ""
    text: Callable[[Any, Mapping[str, Any]], str] | None = lambda answer, content: json_text(content)
    has_scenes: ClassVar[bool] = False

    @property
    def has_json(self) -> bool:
        """Whether the verb has JSON."""
        return self.text is not None

    def read(self, entries: Entries, place: Place) -> tuple[Any, Subject]:
        """The request; its field `of` is the subject."""
        request = read_instance(self.request, entries)
        source = getattr(request, self.of, "")
        return request, Subject(text=source if isinstance(source, str) else " ".join(source), note=place.note)

    def facts(self, answer: Any) -> Mapping[str, Any]:
        """What the JSON says of an answer; nothing without JSON."""
        return super().facts(answer) if self.has_json else {}

    def json(self, answer: Any, content: Mapping[str, Any]) -> str:
        """The JSON text."""
        return "" if self.text is None else self.text(answer, content)
