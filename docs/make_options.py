"""Write docs/options.md, the reference of the inputs of every verb: option, key of a scene, name in Python, unit and default.

python docs/make_options.py          writes the page
python docs/make_options.py --check  exit code 1 where the page is stale
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import typer

from rotor import cli
from rotor.requests.field import PANELS, panel_of
from rotor.requests.readers import Field
from rotor.verbs import declared_verbs
from rotor.verbs.common.verb import verb_of

EVERYWHERE = {"--json", "--save-scene", "--errors", "--sources", "--help", "--help-all"}
PAGE = Path(__file__).parent / "options.md"
HEAD = """# Options, keys and names

One declaration makes the option of the command line, the key of a scene file and the argument in Python; this page is made from it
(`python docs/make_options.py`). A number takes any unit of its kind. What every verb has besides: `--json FILE`, `--save-scene FILE`,
`--errors`, `--sources`, `--help`, `--help-all`. A switch such as `--hyperfine` has its opposite, `--no-hyperfine`.
"""


def page() -> str:
    """The whole page."""
    return HEAD + "".join(section(name, command) for name, command in commands().items())


def commands() -> dict[str, Any]:
    """The commands of the verbs, in the order of the help."""
    application: Any = typer.main.get_command(cli._application())
    return dict(application.commands)


def section(name: str, command: Any) -> str:
    """The table of one verb: declared inputs first, then what the command takes besides."""
    verb = verb_of(name) if name in declared_verbs() else None
    fields = [field for field in verb.options.values() if field.name not in ("errors", "sources")] if verb else []
    rows = [
        *map(row, sorted(fields, key=lambda field: PANELS.index(panel_of(field)) if panel_of(field) in PANELS else 0))
    ]
    shown = {field.flag for field in fields} | EVERYWHERE
    rows += [
        f"| `{option.opts[0]}` | | | {cell(option.help or '')} |"
        for option in command.params
        if option.param_type_name == "option" and not option.hidden and option.opts[0] not in shown
    ]
    head = "| option | key | in Python | |\n|---|---|---|---|\n"
    about = verb.about if verb else (command.help or "").split("\n\n")[0].strip()
    return f"\n## {name}\n\n{about}\n" + (f"\n{head}" + "\n".join(rows) + "\n" if rows else "")


def row(one: Field) -> str:
    """One input."""
    default = f" [{text}]" if (text := one.default_text) else ""
    return f"| `{one.flag}` | {code(one.key)} | `{one.name}` | {cell(one.help)}{default} |"


def code(text: str) -> str:
    """A key as code, nothing for none."""
    return f"`{text}`" if text else ""


def cell(text: str) -> str:
    """A text in a table."""
    return text.replace("|", "\\|")


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(
            0 if PAGE.read_text(encoding="utf-8") == page() else "docs/options.md is stale: python docs/make_options.py"
        )
    PAGE.write_text(page(), encoding="utf-8")
