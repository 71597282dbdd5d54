"""Writes docs/validation/reviews.md: what reviews of the second release found, with commands and what they print now.

    python docs/make_reviews.py             # the page
    python docs/make_reviews.py FOLDER      # the files that its commands read, to run them by hand in FOLDER

The items stand in docs/validation/reviews.toml. A test runs the commands again.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import shlex
import shutil
import sys
import tempfile
import textwrap
import tomllib
from pathlib import Path
from typing import Any

from rotor import cli

HERE = Path(__file__).parent
ITEMS = HERE / "validation" / "reviews.toml"
TARGET = ITEMS.with_suffix(".md")
ROUND_OFF = 1e-6  # standard errors
STEP, BOUNDED = (
    r"the next step would be (\S+) standard errors",
    f"the next step would be below {ROUND_OFF:g} standard errors",
)
INTRODUCTION = """# What reviews of the second release found

Six reviews ran the second release on inputs that nobody here had seen. Each item has the command that was wrong, what it prints now (lines
left out are not marked), and the tests that show it. `python docs/make_reviews.py FOLDER` lays the files of the commands in FOLDER;
files from `../shared` are reference data beside the project. Commands marked *measured* depend on the machine or take long; all others are
run again by `tests/documentation/test_reviews.py`.

"""


def content() -> dict[str, Any]:
    return tomllib.loads(ITEMS.read_text(encoding="utf-8"))


def lay_out(folder: Path, inputs: dict[str, Any]) -> None:
    """Write the files that commands read; those of ../shared only where they are."""
    for name, text in inputs["texts"].items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, source in inputs["files"].items():
        if (HERE.parent / source).exists():
            shutil.copyfile(HERE.parent / source, folder / name)


def printed(command: str) -> str:
    """What a command prints on both streams; `rotor`, `python FILE`, `cp` and `grep` alone are known, and are run in this process."""
    words = shlex.split(command)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        if words[0] == "cp":
            shutil.copyfile(*words[1:])
        elif words[0] == "grep":
            lines = Path(words[2]).read_text(encoding="utf-8").splitlines()
            print(*(line for line in lines if re.search(words[1], line)), sep="\n")
        elif words[0] == "python":
            runpy.run_path(words[1])
        elif code := cli.run(words[1:]):
            print(f"exit code {code}")
    return said.getvalue()


def _shown(line: str, columns: int | None) -> str:
    """A line of output without seconds and keys of points, cut to the whole values within so many columns.

    The step that would follow a finished fit is round-off, shown as a bound.
    """
    line = re.sub(r"^[0-9a-f]{16}(?=,)", "KEY", re.sub(r"in [0-9.]+ s\b", "in ... s", line.rstrip()))
    line = re.sub(STEP, lambda step: BOUNDED if float(step[1]) < ROUND_OFF else step[0], line)
    return line if columns is None or len(line) <= columns else re.sub(r"[^,\s]*$", "", line[:columns]) + " ..."


def transcript(shown: dict[str, Any]) -> list[str]:
    """Lines of the block of commands: each command, then the chosen lines of what it prints."""
    lines = []
    for command in shown["typed"]:
        lines.append(f"$ {command}")
        wanted = re.compile(shown.get("lines", ""))
        kept = (line for line in printed(command).splitlines() if line.strip() and wanted.search(line))
        lines += [_shown(line, shown.get("columns")) for line in kept]
    return lines


def block(lines: list[str], measured: bool = False) -> str:
    return ("*Measured:*\n\n" if measured else "") + "```text\n" + "\n".join(lines) + "\n```\n"


def folded(text: str) -> str:
    return "\n".join(textwrap.wrap(text, 140, break_long_words=False, break_on_hyphens=False)) + "\n"


def section(item: dict[str, Any], blocks: list[str]) -> str:
    heading = f"### {item['item']}: {item.get('state', 'repaired')}\n"
    tests = "Tests: " + ", ".join(f"`{name}`" for name in item["tests"])
    return "\n".join([heading, folded(item["text"]), *blocks, folded(tests)])


def page(items: list[dict[str, Any]], blocks: list[list[str]]) -> str:
    parts = []
    for item, shown in zip(items, blocks, strict=True):
        if heading := item.get("heading"):
            parts.append(f"## {heading}\n")
        parts.append(section(item, shown))
    return INTRODUCTION + "\n".join(parts)


def made_page() -> str:
    """The whole page; every command is run."""
    all_items = content()
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        os.environ["COLUMNS"] = "120"
        lay_out(Path(name), all_items["inputs"])
        blocks = [
            [block(transcript(shown), "measured" in shown) for shown in item.get("shown", ())]
            for item in all_items["items"]
        ]
    return page(all_items["items"], blocks)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        lay_out(Path(sys.argv[1]), content()["inputs"])
    else:
        TARGET.write_text(made_page(), encoding="utf-8")
