"""Verbs, one a file: their declarations. Here are their names alone; nothing is imported, so that the command line starts at once."""

from __future__ import annotations

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


SCENE_VERBS = tuple(dict.fromkeys((*_ORDER, *declared_verbs())))  # kinds of scene
