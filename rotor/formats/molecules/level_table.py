"""Reads and writes a table of level energies: a .csv with a column for each quantum number, energy_mhz, error_mhz, maybe own_error_mhz."""

from __future__ import annotations

import os

import numpy as np

from rotor.formats.atomic_write import open_atomic
from rotor.tops.states.level_table import LevelTable

_NUMBERS = ("energy_mhz", "error_mhz")
_ERROR_COLUMN = "own_error_mhz"
_QUANTA = ("v", "j", "ka", "kc", "k")


def read_level_table(path: str | os.PathLike[str], source: str = "") -> LevelTable:
    """The level energies of a file; lines that begin with # are comments, other columns are ignored.

    Raises ValueError, with file and line, for a missing column or an invalid number.
    """
    try:
        with open(path, encoding="utf-8", newline="") as handle:
            lines = [(i, line) for i, line in enumerate(handle, start=1) if not line.startswith("#")]
    except OSError as error:
        raise ValueError(f"{path}: level energies cannot be read: {error.strerror}") from None
    import csv

    rows = list(csv.reader(line for _, line in lines))
    names = rows[0] if rows else []
    quanta = [name for name in names if name in _QUANTA]
    if not quanta or not set(_NUMBERS) <= set(names):
        raise ValueError(
            f"{path}: expected the columns j (v, k, ka, kc), energy_mhz, error_mhz; found {', '.join(names) or 'none'}"
        )
    columns: dict[str, list[float]] = {
        name: [] for name in (*quanta, *_NUMBERS, *([_ERROR_COLUMN] if _ERROR_COLUMN in names else []))
    }
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        for name, values in columns.items():
            try:
                values.append((int if name in _QUANTA else float)(row[names.index(name)]))
            except (ValueError, IndexError):
                raise ValueError(f"{path}, line {number}: {name} is no number: {','.join(row)!r}") from None
    try:
        labels = {name: np.array(columns[name], dtype=np.int64) for name in quanta}
        unshared_errors = np.array(columns[_ERROR_COLUMN]) if _ERROR_COLUMN in columns else None
        return LevelTable(
            labels, np.array(columns["energy_mhz"]), np.array(columns["error_mhz"]), source, unshared_errors
        )
    except ValueError as reason:
        raise ValueError(f"{path}: {reason}") from None


def write_level_table(table: LevelTable, path: str | os.PathLike[str]) -> None:
    """Write a table of level energies atomically, with all digits."""
    with open_atomic(path, "w", encoding="utf-8", newline="") as handle:
        import csv

        rows = csv.writer(handle, lineterminator="\n")
        rows.writerow(table.columns)
        rows.writerows(zip(*(column.tolist() for column in table.columns.values()), strict=True))
