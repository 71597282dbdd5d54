"""`rotor new`: a commented scene file to begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer

from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import Files, write_text

EXAMPLES = """\b
Examples:
  rotor new spectrum > s.toml
  rotor new align --out align.toml
  rotor new --schema > scene.schema.json"""


@dataclass(frozen=True)
class Options:
    """Which scene."""

    kind: str | None = argument(
        help="spectrum, levels, raman, thermo, tumble, gas, fluid, stark, zeeman, align, fit or emission."
    )
    schema: bool = option(False, "--schema", help="The JSON Schema of scene files instead, for editors.")
    out: str | None = file_option(".toml", ".json", help="Write it into a file.")


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """A scene file with every key, commented: what to simulate, to be edited and run."""
    from rotor.scenes.scene import KINDS
    from rotor.scenes.template import template

    if (options.kind is None) != options.schema:
        raise ValueError(f"expected either a kind of scene, one of {', '.join(KINDS)}, or --schema")
    text = _schema() if options.kind is None else template(options.kind)
    files = Files()
    files.ask("--out", options.out, (".toml", ".json"))
    if options.out is not None and Path(options.out).exists():
        raise ValueError(f"--out {options.out}: is there already; remove it, or give another name")
    if not files.paths:
        print(text, end="")
    files.write({"--out": lambda path: write_text(Path(path), text)})


def _schema() -> str:
    import json

    from rotor.scenes.scene_file import json_schema

    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"
