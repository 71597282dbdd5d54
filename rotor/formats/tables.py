"""Tables as files: CSV and Parquet by DuckDB, and JSON, each with its provenance.

One way for all of them: every number is the shortest text that gives the same double back, and what is not a number is an
empty field or null. The provenance stands inside a .parquet and a .json, and beside a .csv in `path` + ".provenance.json".
Short tables become CSV without DuckDB, in the same characters.
"""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.atomic_write import atomic_path, open_atomic
from rotor.formats.provenance import provenance_record, write_beside
from rotor.table import Table

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

LONG_TABLE = 10_000  # rows from which DuckDB, some 0.1 s to load, writes CSV

Settings = Mapping[str, Any]
Columns = Mapping[str, NDArray[Any]]


def write_csv(table: Table, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write a table as comma-separated values, names of columns first, its provenance beside it."""
    columns, record = dict(table.columns), provenance_record(table, settings)
    if len(table) < LONG_TABLE:
        with open_atomic(path, "w", encoding="utf-8", newline="") as handle:
            rows = csv.writer(handle, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(_rows({name: _spelled(np.asarray(column)) for name, column in columns.items()}))
    else:
        with atomic_path(path) as unfinished:
            copy_columns(columns, unfinished, "(FORMAT csv, HEADER, DELIMITER ',')")
    write_beside(path, record)


def write_parquet(table: Table, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write a table as Parquet, its provenance in the metadata under that name."""
    record = json.dumps(provenance_record(table, settings), ensure_ascii=False)
    with atomic_path(path) as unfinished:
        copy_columns(table.columns, unfinished, f"(FORMAT parquet, KV_METADATA {{provenance: {quoted(record)}}})")


def write_json(table: Table, path: str | os.PathLike[str], settings: Settings, key: str = "rows") -> None:
    """Write a table as JSON: `provenance`, and under `key` a record for each row.

    table: columns by name. path: the file; it is replaced when it is whole. settings: of the command or call that made the table; part of
    the provenance. key: key of the rows.
    """
    columns = dict(table.columns)
    rows = [dict(zip(columns, row, strict=True)) for row in _rows(columns)]
    with open_atomic(path, "w", encoding="utf-8") as handle:
        json.dump({"provenance": provenance_record(table, settings), key: rows}, handle, indent=1, allow_nan=False)
        handle.write("\n")


def write_motion(motion: Any, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write the motion of one body, as an integrator made it, in the format of the suffix."""
    from rotor.classical.motion import MotionTable
    from rotor.formats.registry import find_writer

    table = MotionTable.from_motion(motion)
    find_writer(table, path)(table, path, settings)


def _rows(columns: Columns) -> Iterable[tuple[Any, ...]]:
    """Rows of plain values, None for numbers that are not finite."""
    return zip(*(_plain(np.asarray(column)) for column in columns.values()), strict=True)


def _plain(column: NDArray[Any]) -> list[Any]:
    values: list[Any] = column.tolist()
    if column.dtype.kind == "f" and not np.isfinite(column).all():
        return [value if math.isfinite(value) else None for value in values]
    return values


def _spelled(column: NDArray[Any]) -> NDArray[Any]:
    """Truth values as DuckDB spells them: true, false."""
    return np.where(column, "true", "false") if column.dtype.kind == "b" else column


def copy_columns(columns: Columns, path: Path, options: str) -> None:
    """Write columns through DuckDB's COPY with its options; numbers that are not finite become NULL, texts stay texts."""
    import duckdb

    with duckdb.connect() as engine:
        chosen = registered(engine, "given", columns)
        run(engine, f"COPY (SELECT {chosen} FROM given) TO {quoted(str(path))} {options}", path)


def registered(engine: DuckDBPyConnection, name: str, columns: Columns) -> str:
    """Make columns a table of DuckDB; what selects them: numbers that are not finite are NULL, texts stay texts."""
    arrays = {key: _without_infinities(np.asarray(column)) for key, column in columns.items()}
    engine.register(name, arrays)
    return ", ".join(
        f'"{key}"::VARCHAR AS "{key}"' if column.dtype.kind in "UO" else f'"{key}"' for key, column in arrays.items()
    )


def run(engine: DuckDBPyConnection, command: str, path: Path) -> None:
    """Run a command that writes a file; a full disk raises OSError with the name of the file."""
    import duckdb

    try:
        engine.execute(command)
    except duckdb.IOException as error:
        raise OSError(f"{path}: cannot be written: {error}") from None


def _without_infinities(column: NDArray[Any]) -> NDArray[Any]:
    """DuckDB takes NaN of numpy as NULL, infinities as numbers."""
    if column.dtype.kind == "f" and np.isinf(column).any():
        return np.where(np.isinf(column), np.nan, column)
    return column


def quoted(text: str) -> str:
    """A literal of SQL."""
    return "'" + text.replace("'", "''") + "'"
