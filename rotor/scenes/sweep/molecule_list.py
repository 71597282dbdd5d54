"""Lists of molecules: an SDF file with several, a CSV file with a column of SMILES or names, or a file of SMILES (.smi)."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path

from rotor.checks import read_text
from rotor.frozen import dataclass
from rotor.molecules.readers.sdf_entries import LIST_SUFFIXES, SDF_SUFFIXES, entry_names

SMILES_COLUMNS, MOLECULE_COLUMNS, NAME_COLUMNS = ("smiles",), ("molecule", "source", "name"), ("name", "id", "title")


@dataclass(frozen=True)
class Entry:
    """A molecule of a list. source: as the molecule of a scene. name: in tables and files."""

    source: str
    name: str


def is_list(source: str, folder: str | os.PathLike[str]) -> bool:
    """Whether a source is a list of molecules: a CSV or SMILES file, or an SDF file of two or more."""
    suffix, path = Path(source).suffix.lower(), Path(folder, source)
    if suffix not in (*SDF_SUFFIXES, *LIST_SUFFIXES) or not os.path.isfile(path):
        return False
    return suffix in LIST_SUFFIXES or len(entry_names(path)) > 1


def list_entries(source: str, folder: str | os.PathLike[str]) -> list[Entry]:
    """The molecules named in a file of a folder.

    Raises ValueError for a CSV file without a column of molecules, and for a list without molecules.
    """
    path = Path(folder, source)
    if path.suffix.lower() in LIST_SUFFIXES:
        return _csv_entries(path) if path.suffix.lower() == ".csv" else _smiles_entries(path)
    names = entry_names(path)
    return [Entry(f"{source}#{n}", name or f"{path.stem}_{n}") for n, name in enumerate(names, 1)]


def _csv_entries(path: Path) -> list[Entry]:
    try:
        rows = [row for row in csv.reader(io.StringIO(read_text(path))) if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise ValueError(f"{path}: a list of molecules is comma-separated text: {error}") from None
    heads = [head.strip().lower() for head in rows[0]] if rows else []
    smiles, word = _column(heads, SMILES_COLUMNS), _column(heads, MOLECULE_COLUMNS)
    if smiles is None and word is None:
        raise ValueError(
            f"{path}: expected a column smiles, molecule or name, found {', '.join(heads) or 'no columns'}"
        )
    if len(rows) < 2:
        raise ValueError(f"{path}: no molecules below the names of the columns")
    column = smiles if smiles is not None else word
    assert column is not None
    label = _column(heads, NAME_COLUMNS)
    out = []
    for row in rows[1:]:
        source = row[column].strip() if column < len(row) else ""
        name = row[label].strip() if label is not None and label < len(row) else ""
        if smiles is not None and not source.startswith("SMILES:"):
            source = f"SMILES:{source}"
        out.append(Entry(source, name or source.removeprefix("SMILES:")))
    return out


def _smiles_entries(path: Path) -> list[Entry]:
    """Lines of a SMILES and a name, with or without a heading."""
    lines = [line.split(maxsplit=1) for line in read_text(path).splitlines() if line.strip()]
    if lines and lines[0][0].lower() in SMILES_COLUMNS:
        lines = lines[1:]
    if not lines:
        raise ValueError(f"{path}: no molecules; expected lines of a SMILES and a name")
    return [Entry(f"SMILES:{words[0]}", words[-1].strip()) for words in lines]


def _column(heads: list[str], names: tuple[str, ...]) -> int | None:
    return next((heads.index(name) for name in names if name in heads), None)
