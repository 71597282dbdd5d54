"""A toy tool in one file: a verb on a file, without a scene: it counts words."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotor.checks import NoAnswerError
from rotor.requests.field import REQUIRED, check_fields, declared
from rotor.requests.readers import Text, Whole
from rotor.verbs.common.outputs import Output
from rotor.verbs.common.verb import Tool


@dataclass(frozen=True)
class CountRequest:
    """The file, and which words count."""

    file: str = declared(REQUIRED, Text(), "A text", option="FILE")
    least: int = declared(1, Whole(1, 9), "Letters of a word at least")

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Counted:
    """How many words there are."""

    words: int

    def facts(self) -> dict[str, Any]:
        """The number."""
        return {"words": self.words}


def answer(request: CountRequest, work: Any) -> Counted:
    """Count the words."""
    words = sum(len(word) >= request.least for word in Path(request.file).read_text().split())
    if not words:
        raise NoAnswerError(f"{request.file}: no word of {request.least} letters")
    return Counted(words)


VERB = Tool(
    name="count",
    about="Words of a text.",
    examples="",
    request=CountRequest,
    of="file",
    answer=answer,
    show=lambda answer, report: [[("words", str(answer.words))]],
    outputs=(Output("out", (".txt",), "The number", lambda answer, path, report: path.write_text(str(answer.words))),),
)
