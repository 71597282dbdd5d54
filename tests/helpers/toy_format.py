"""A toy format in one file: a table with a comment line, columns by tabs; shown by tests/requests/test_declarations.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.atomic_write import open_atomic
from rotor.formats.registry import TABLE, Format
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class Rows(Table):
    """Columns of numbers by name."""

    values: dict[str, Any]

    @property
    def columns(self) -> dict[str, Any]:
        """As in the file."""
        return self.values

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def read_tabs(path: Path) -> Rows:
    """The table of a file; ValueError, with its line, for a row of another length."""
    head, *rows = [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    for number, row in enumerate(rows, 3):
        if len(row) != len(head):
            raise ValueError(f"{path}, line {number}: {len(row)} columns; expected {len(head)}")
    return Rows({name: np.array([float(row[n]) for row in rows]) for n, name in enumerate(head)})


def write_tabs(table: Any, path: Any, settings: Mapping[str, Any]) -> None:
    """The numbers of a table, in full precision."""
    columns = {name: column for name, column in table.columns.items() if np.asarray(column).dtype.kind in "if"}
    with open_atomic(path, "w", encoding="utf-8") as handle:
        handle.write(f"# rotor {settings.get('command', '')}\n" + "\t".join(columns) + "\n")
        for row in zip(*columns.values(), strict=True):
            handle.write("\t".join(repr(float(item)) for item in row) + "\n")


FORMAT = Format("columns by tabs", (".tabs",), "toy_format:read_tabs", {TABLE: "toy_format:write_tabs"})
