"""Tables of species of the JPL and CDMS catalogues, catdir.cat: tag, name, number of lines, log10 Q at some temperatures.

CDMS prints eleven temperatures from 1000 to 2.725 K and `0.0` where Q is unknown (0.0000 is log10 of 1); JPL prints seven from 300 to
9.375 K and a version behind them (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998); C. P. Endres et al.,
J. Mol. Spectrosc. 327, 95 (2016)).
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from rotor.formats.packed import load
from rotor.observed.model.partition import PartitionTable

CDMS_K = (1000.0, 500.0, 300.0, 225.0, 150.0, 75.0, 37.5, 18.75, 9.375, 5.0, 2.725)
JPL_K = (300.0, 225.0, 150.0, 75.0, 37.5, 18.75, 9.375)
UNKNOWN = "0.0"
_NUMBER = r"-?\d*\.\d+"
_CDMS = re.compile(rf"\s*(\d+)\s+(\S.*?)\s+(\d+)((?:\s+{_NUMBER}){{11}})\s*$")
_JPL = re.compile(rf"\s*(\d+)\s+(\S.*?)\s+(\d+)((?:\s*{_NUMBER}){{7}})\s*(\S*)\s*$")


@dataclass(frozen=True)
class CatdirEntry:
    """A species: tag, name, number of lines, Q(T) if known, and the database that its temperatures identify."""

    tag: int
    name: str
    lines: int
    partition: PartitionTable | None
    database: str


def read_catdir(source: str | os.PathLike[str] | bytes) -> dict[int, CatdirEntry]:
    """Species by tag; ValueError with file and line for a line that is neither CDMS's nor JPL's.

    >>> entries = read_catdir(b" 28001 CO    91 2.0369 1.9123 1.7370 1.4386 1.1429 0.8526 0.5733 4*\\n")
    >>> entries[28001].name, round(entries[28001].partition.at(300.0), 2)
    ('CO', 108.87)
    """
    text, name = load(source)
    entries: dict[int, CatdirEntry] = {}
    for number, line in enumerate(text.decode("latin-1").splitlines(), start=1):
        if line.strip():
            entry = _entry(line, f"{name}, line {number}")
            entries[entry.tag] = entry
    return entries


def _entry(line: str, where: str) -> CatdirEntry:
    for pattern, temperatures, database in ((_CDMS, CDMS_K, "CDMS"), (_JPL, JPL_K, "JPL")):
        if match := pattern.match(line):
            tag, name, count, values = match.group(1, 2, 3, 4)
            return CatdirEntry(
                int(tag),
                name,
                int(count),
                _table(re.findall(_NUMBER, values), temperatures, f"{database} catdir"),
                database,
            )
    raise ValueError(
        f"{where}: expected tag, name, number of lines and log10 Q at 11 (CDMS) or 7 (JPL) temperatures: {line.strip()[:60]!r}"
    )


def _table(texts: list[str], temperatures: tuple[float, ...], source: str) -> PartitionTable | None:
    points = [(t, 10.0 ** float(text)) for text, t in zip(texts, temperatures, strict=True) if text != UNKNOWN]
    if not points:
        return None
    kelvin, q = np.array(sorted(points)).T
    return PartitionTable(kelvin, q, source)


def catdir_beside(path: Path) -> dict[int, CatdirEntry]:
    """Species of the catdir files in the folder of a catalogue and its parent folder; empty without such files."""
    entries: dict[int, CatdirEntry] = {}
    for folder in (path.resolve().parent.parent, path.resolve().parent):
        for file in sorted(folder.glob("catdir*.cat")):
            stat = file.stat()
            entries |= _read_once(file, stat.st_mtime_ns, stat.st_size)
    return entries


@lru_cache(maxsize=8)
def _read_once(file: Path, modified_ns: int, size: int) -> dict[int, CatdirEntry]:
    """The species of an unchanged file, which stands beside many catalogues."""
    return read_catdir(file)


def is_catdir(path: Path) -> bool:
    """Whether a .cat file is a table of species, by its name."""
    return path.name.lower().startswith("catdir")
