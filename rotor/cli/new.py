"""`rotor new`: a commented scene file to start from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.frozen import dataclass
from rotor.requests.field import declared
from rotor.requests.readers import Flag, Text
from rotor.verbs import SCENE_VERBS
from rotor.verbs.common.outputs import Output, write_text
from rotor.verbs.common.verb import Tool

EXAMPLES = """\
  rotor new spectrum > s.toml
  rotor new align --out align.toml
  rotor new --schema > scene.schema.json"""


@dataclass(frozen=True)
class NewRequest:
    """The kind of scene, or the schema of all kinds."""

    kind: str | None = declared(None, Text(), ", ".join(SCENE_VERBS), option="KIND")
    schema: bool = declared(False, Flag(), "Write the JSON Schema of scene files instead, for editors")


def answer(request: NewRequest, _: Any) -> str:
    """The scene, or the schema."""
    if (request.kind is None) != request.schema:
        raise ValueError(f"expected either a kind of scene, one of {', '.join(SCENE_VERBS)}, or --schema")
    if request.kind is not None:
        from rotor.scenes.template import template

        return template(request.kind)
    from json import dumps

    from rotor.scenes.schema import json_schema

    return f"{dumps(json_schema(), indent=1, ensure_ascii=False)}\n"


def check(_: NewRequest, outputs: Mapping[str, Any], __: Any) -> None:
    """Refuse to overwrite a file, which may hold an edited scene."""
    for path in outputs.get("out", ()):
        if path.exists():
            raise ValueError(f"--out {path}: exists already; remove it, or give another name")


VERB = Tool(
    name="new",
    about="A scene file with every key, commented, to edit and run.",
    examples=EXAMPLES,
    request=NewRequest,
    answer=answer,
    text=None,
    show=lambda answer, report: () if report.content["files"] else (answer.removesuffix("\n"),),
    outputs=(
        Output("out", (".toml", ".json"), "Write to a file", lambda answer, path, report: write_text(path, answer)),
    ),
    check=check,
)
