"""Single molecules of an SDF file with several: `many.sdf#3` is the third."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path

from rotor.checks import require_file

SDF_SUFFIXES = (".sdf", ".sd")
BUILT = ("SMILES:", "InChI=")  # beginnings of texts from which RDKit builds a molecule
LIST_SUFFIXES = (".csv", ".smi", ".smiles")  # of lists of molecules by names and SMILES
_ENTRY = re.compile(r"(.+\.sdf?)#(\d+)", flags=re.IGNORECASE | re.DOTALL)


def parse_entry(word: str) -> tuple[Path, int] | None:
    """File and number of a word such as many.sdf#3; None for other words, and if a file has exactly this name.

    >>> parse_entry("many.sdf#3"), parse_entry("water")
    ((PosixPath('many.sdf'), 3), None)
    """
    entry = _ENTRY.fullmatch(word)
    return None if entry is None or os.path.exists(word) else (Path(entry[1]), int(entry[2]))


def entry_names(path: Path) -> tuple[str, ...]:
    """The titles of the molecules of a file, in order; empty for a molecule without a title."""
    return tuple(name for name, _, _ in _entries(*_stamp(path)))


def entry_bytes(path: Path, number: int) -> bytes:
    """The text of a molecule in the file, numbered from 1.

    Raises ValueError for a number beyond the entries of the file.
    """
    require_file(path)
    entries = _entries(*_stamp(path))
    if not 1 <= number <= len(entries):
        raise ValueError(f"{path}#{number}: the file has {len(entries)} molecules, numbered from 1")
    _, start, length = entries[number - 1]
    with open(path, "rb") as handle:
        handle.seek(start)
        return handle.read(length)


def _stamp(path: Path) -> tuple[str, int, int]:
    status = path.stat()
    return str(path), status.st_mtime_ns, status.st_size


@lru_cache(maxsize=8)
def _entries(path: str, modified: int, size: int) -> list[tuple[str, int, int]]:
    """Title, position and length of all molecules of a file; cached until the file changes."""
    out: list[tuple[str, int, int]] = []
    start, place, title, blank = 0, 0, b"", True
    with open(path, "rb") as handle:
        for line in handle:
            if place == start:
                title = line
            place += len(line)
            if line.startswith(b"$$$$"):
                out += [] if blank else [_entry(title, start, place - len(line))]
                start, blank = place, True
            elif line.strip():
                blank = False
    return out if blank else [*out, _entry(title, start, place)]


def _entry(title: bytes, start: int, end: int) -> tuple[str, int, int]:
    return title.decode("utf-8", "replace").removeprefix("\ufeff").strip(), start, end - start
