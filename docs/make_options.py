"""Write docs/options.md, the reference of the inputs of every declared verb: option, key of a scene, name in Python, unit and default.

python docs/make_options.py          writes the page
python docs/make_options.py --check  exit code 1 where the page is stale
"""

from __future__ import annotations

import sys
from pathlib import Path

from rotor.cli.shared.command import parameters_of
from rotor.requests.field import PANELS, Field
from rotor.verbs.names import declared_verbs, verb_of
from rotor.verbs.verb import Verb

PAGE = Path(__file__).parent / "options.md"
HEAD = """# Options, keys and names

One declaration makes the option of the command line, the key of a scene file and the argument in Python; this page is made from it
(`python docs/make_options.py`). A number takes any unit of its kind. What every verb has besides: `--json FILE`, `--save-scene FILE`,
`--help`, `--help-all`.
"""


def page() -> str:
    """The whole page."""
    return HEAD + "".join(section(verb_of(name)) for name in declared_verbs())


def section(verb: Verb) -> str:
    """The tables of one verb."""
    fields = [one for one in verb.options.values() if one.name not in ("errors", "sources")]
    rows = [*map(row, sorted(fields, key=lambda one: PANELS.index(one.heading) if one.heading in PANELS else 0))]
    shown = {one.flag for one in fields}
    rows += [
        f"| `{one.flag}` | | | {cell(one.help)} |"
        for one in parameters_of(verb)
        if one.flag not in shown and one.flag not in ("--json", "--save-scene", "--errors", "--sources")
    ]
    head = "| option | key | in Python | |\n|---|---|---|---|\n"
    return f"\n## {verb.name}\n\n{verb.about}\n\n{head}" + "\n".join(rows) + "\n"


def row(one: Field) -> str:
    """One input."""
    default = "" if one.typed is None and not plain(one) else f" [{one.typed or one.reader.show(one.default)}]"
    return f"| `{one.flag}` | {code(one.key)} | `{one.name}` | {cell(one.help)}{default} |"


def plain(one: Field) -> bool:
    """Whether a default is worth showing."""
    return one.default is not None and not isinstance(one.default, bool) and one.default not in ((), "", {})


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
