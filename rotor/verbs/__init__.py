"""Verbs, one a file: their declarations. Here are their names alone, and what the text of a scene says before anything is loaded.

Nothing is imported, so that the command line starts at once.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

_ORDER = (
    "spectrum", "levels", "raman", "thermo", "tumble", "gas", "fluid", "stark", "zeeman", "align", "fit", "emission",
)  # fmt: skip  # order of lists; other kinds follow by name


@cache
def declared_verbs() -> tuple[str, ...]:
    """The verbs that files of this folder declare."""
    files = Path(__file__).parent.glob("*.py")
    names = {file.stem for file in files if "\nVERB = Verb(" in file.read_text(encoding="utf-8")}
    return tuple(sorted(names, key=lambda name: (_ORDER.index(name) if name in _ORDER else len(_ORDER), name)))


def has_small_blocks(name: str) -> bool:
    """Whether a verb declares small blocks. The text of its file is read, since its module loads numpy."""
    file = Path(__file__).with_name(f"{name}.py")
    return file.is_file() and "\n    small_blocks=True," in file.read_text(encoding="utf-8")


def first_file_text(arguments: Sequence[str]) -> str:
    """The text of the first file among the words of a command; empty where none can be read."""
    with suppress(OSError, ValueError):
        return next((file.read_text(encoding="utf-8") for file in map(Path, arguments) if file.is_file()), "")
    return ""


def kind_in(text: str) -> str:
    """The kind of a scene, from its text; empty where it says none.

    >>> kind_in('kind = "spectrum"'), kind_in('{"kind": "levels"}'), kind_in("")
    ('spectrum', 'levels', '')
    """
    match = re.search(r"""\bkind"?\s*[=:]\s*["'](\w+)["']""", text)
    return match[1] if match else ""


def highest_j_in(text: str) -> int | None:
    """The highest limit of J that a scene or a command names, from its text, also among the values of a sweep; None without a limit.

    >>> highest_j_in("--jmax 20"), highest_j_in("jmax = [10, 300]"), highest_j_in('"numerics.jmax": 7,'), highest_j_in("top = 5")
    (20, 300, 7, None)
    """
    values = re.findall(r"""\bjmax["']?\s*[=: ]\s*(\[[^]]*\]|["'][^"']*["']|\d+)""", text)
    return max((int(number) for value in values for number in re.findall(r"\d+", value)), default=None)


SCENE_VERBS = tuple(dict.fromkeys((*_ORDER, *declared_verbs())))  # kinds of scene
