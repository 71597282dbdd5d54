"""Hashes of the files that a point reads besides its scene.

These are the files that a scene names, the library's file of a molecule that it names, and files beside those: the .var of an .int, the
table of levels of a molecule file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rotor.formats.toml import read_toml
from rotor.molecules.readers.sdf_entries import BUILT, entry_bytes, parse_entry
from rotor.version import version

_WRITTEN = ("outputs", "title", "sweep")  # parts of a scene that name no input
_MOLECULE_KEYS = ("molecule", "source")
_SPCAT = (".par", ".var", ".int", ".lin")  # files of one case, read together


class InputHashes:
    """Hashes of files in a folder, each read once."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._folder = folder
        self._of_word: dict[tuple[str, str], dict[str, str]] = {}
        self._of_file: dict[Path, str] = {}

    def key(self, content: Mapping[str, Any], values: Mapping[str, Any]) -> str:
        """Hash of a point: its values, the tables of its scene, the files that it reads, and the version of the package."""
        parts = [version(), values, content, self.of(content)]
        return hashlib.sha256(json.dumps(parts, sort_keys=True, ensure_ascii=False, default=str).encode()).hexdigest()

    def of(self, content: Mapping[str, Any]) -> dict[str, str]:
        """Hashes of the files that a scene reads, by name."""
        hashes: dict[str, str] = {}
        for key, word in _texts({name: value for name, value in content.items() if name not in _WRITTEN}):
            if (key, word) not in self._of_word:
                self._of_word[key, word] = dict(self._files(key, word))
            hashes |= self._of_word[key, word]
        return hashes

    def _files(self, key: str, word: str) -> Iterator[tuple[str, str]]:
        path = Path(self._folder, word)
        entry = parse_entry(str(path))
        if entry is not None and entry[0].is_file():
            yield word, hashlib.sha256(entry_bytes(*entry)).hexdigest()
            return
        if os.path.isfile(path):  # False for words that no path can be
            for file in _read_together(path):
                yield (
                    str(file.relative_to(self._folder) if file.is_relative_to(self._folder) else file),
                    self._hash(file),
                )
        if key in _MOLECULE_KEYS and not word.startswith(BUILT):
            from rotor.formats.molecules.library import library_file

            known = library_file(word)
            if known is not None:
                for file in _read_together(known):
                    yield f"library: {file.name}", self._hash(file)

    def _hash(self, path: Path) -> str:
        if path not in self._of_file:
            with open(path, "rb") as handle:
                self._of_file[path] = hashlib.file_digest(handle, "sha256").hexdigest()
        return self._of_file[path]


def _texts(content: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """All texts in tables and lists, each with its key."""
    if isinstance(content, str):
        yield key, content
    elif isinstance(content, Mapping):
        for name, value in content.items():
            yield from _texts(value, str(name))
    elif isinstance(content, list | tuple):
        for value in content:
            yield from _texts(value, key)


def _read_together(path: Path) -> Iterator[Path]:
    """A file and the files that are read with it."""
    yield path
    suffix = path.suffix.lower()
    if suffix in _SPCAT:
        yield from (p for s in _SPCAT if s != suffix and (p := path.with_suffix(s)).is_file())
    elif suffix == ".toml":
        try:
            levels = read_toml(path).get("levels", {})
        except ValueError:  # no TOML: its reader says so
            return
        name = levels.get("file") if isinstance(levels, dict) else None
        if isinstance(name, str) and os.path.isfile(table := path.parent / name):
            yield table
