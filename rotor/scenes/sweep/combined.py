"""A Parquet or CSV file with the rows of all points, each row with the values of its point.

The rows of each finished point are stored in the folder NAME.points. At the end they are joined with the rows of the existing file, in
the order of the points. The column `point` holds the key of the point: finished points are not computed again, and rows of points that
the sweep no longer has are left out.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rotor.table import Table

KEY_LENGTH = 16  # hexadecimal digits of a point's key in its rows: two of a million points agree in 1 of 4e7 sweeps
MEMORY_MB = 300  # for the sort; more goes to files
SMALL_ROWS = 5_000  # of a point whose rows are stored as an array: DuckDB takes 20 ms for a file, numpy 0.2
BATCH_ROWS, BATCH_FILES = 100_000, 2_000  # of small files that are joined at once
_SMALL, _LARGE = ".npy", ".parquet"
_FORMAT = (3, 0)  # of numpy's files: names of columns are UTF-8


def point_columns(values: Mapping[str, Any], table: Table) -> dict[str, Any]:
    """Columns of the swept values, then those of a table. A swept value has the last part of its name if no other column has it."""
    from rotor.scenes.sweep.points import cell

    columns = dict(table.columns)
    short = [name.rpartition(".")[2] for name in values]
    out = {}
    for name, key in zip(values, short, strict=True):
        free = short.count(key) == 1 and key not in columns and key != "point"
        out[key if free else name] = np.full(len(table), cell(values[name]))
    return out | columns


class CombinedFile:
    """The file with the rows of all points.

    targets: one or several files with the same rows; the first is read to find the finished points.
    """

    def __init__(self, targets: Sequence[Path]) -> None:
        self.targets, self.folder = tuple(targets), Path(f"{targets[0]}.points")

    @classmethod
    def of(cls, names: Sequence[str], out: str | os.PathLike[str]) -> CombinedFile | None:
        """The files of these names in a folder; None without any."""
        return cls([Path(out) / name for name in names]) if names else None

    def keys(self) -> set[str]:
        """Keys of the points whose rows are stored, in the file or in the folder."""
        return self._waiting().keys() | self._joined()

    def _waiting(self) -> dict[str, Path]:
        """Files of finished points by the key of the point."""
        suffixes = (_SMALL, _LARGE)
        return {path.stem: path for path in self.folder.glob("*") if path.suffix in suffixes}

    def _joined(self) -> set[str]:
        first = self.targets[0]
        if not first.is_file():
            return set()
        import duckdb

        with duckdb.connect() as engine, suppress(duckdb.Error):  # not a table of points: it is replaced
            rows = engine.execute(f"SELECT DISTINCT point FROM {_table_of(first)}").fetchall()
            return {str(key) for (key,) in rows}
        return set()

    def load(self) -> None:
        """Import what joining needs."""
        import duckdb  # noqa: F401

    def open_folder(self) -> None:
        """Make the folder of the rows of finished points."""
        os.makedirs(self.folder, exist_ok=True)

    def write_part(self, key: str, values: Mapping[str, Any], table: Table) -> None:
        """Store the rows of a finished point in the folder."""
        from rotor.formats.tables import copy_columns

        columns = {"point": np.full(len(table), key[:KEY_LENGTH])} | point_columns(values, table)
        small = len(table) <= SMALL_ROWS and all(np.asarray(column).dtype.kind != "O" for column in columns.values())
        path = self.folder / f"{key[:KEY_LENGTH]}{_SMALL if small else _LARGE}"
        unfinished = path.with_suffix(f".{os.getpid()}{path.suffix}.part")  # in a folder that this sweep alone uses
        if small:
            with open(unfinished, "wb") as handle:
                np.lib.format.write_array(handle, _rows_of(columns), _FORMAT, allow_pickle=False)
        else:
            copy_columns(columns, unfinished, "(FORMAT parquet)")
        os.replace(unfinished, path)

    def join(self, keys: Sequence[str], provenance: str) -> None:
        """Write the files with the rows of these points, in this order, and remove the folder."""
        from rotor.formats.atomic_write import atomic_path
        from rotor.formats.lines.sorted_pieces import engine_in, listed
        from rotor.formats.tables import quoted, run

        order = {key[:KEY_LENGTH]: number for number, key in enumerate(keys)}  # columns of the first point come first
        waiting = dict(sorted(self._waiting().items(), key=lambda item: order.get(item[0], len(order))))
        before = self._joined() - waiting.keys()
        with ExitStack() as stack:
            unfinished = [stack.enter_context(atomic_path(target)) for target in self.targets]
            engine = stack.enter_context(engine_in(self.folder, MEMORY_MB))
            places = {"key": np.array([key[:KEY_LENGTH] for key in keys]), "number": np.arange(len(keys))}
            engine.register("given", places)
            engine.execute("CREATE TABLE places AS SELECT key::VARCHAR AS key, number FROM given")
            parts = []
            if files := self._large_files(waiting.values()):
                rows = f"read_parquet({listed(files)}, union_by_name = true, file_row_number = true)"
                parts.append(f"SELECT * FROM {rows}")
            if before:
                others = ", ".join(map(quoted, ("", *waiting)))
                parts.append(f"SELECT * FROM {_table_of(self.targets[0])} WHERE point NOT IN ({others})")
            chosen = "SELECT key AS point FROM places LIMIT 0"  # no point has rows
            if parts:
                joined = " UNION ALL BY NAME ".join(parts)
                chosen = f"SELECT t.* EXCLUDE (file_row_number) FROM ({joined}) t JOIN places ON t.point = places.key"
                chosen += " ORDER BY places.number, t.file_row_number"
            for target, path in zip(self.targets, unfinished, strict=True):
                options = "(FORMAT csv, HEADER, DELIMITER ',')"
                if not _is_csv(target):
                    options = f"(FORMAT parquet, KV_METADATA {{provenance: {quoted(provenance)}}})"
                run(engine, f"COPY ({chosen}) TO {quoted(str(path))} {options}", target)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _large_files(self, paths: Collection[Path]) -> list[Path]:
        """The large files, and files into which the small ones are gathered."""
        from rotor.formats.tables import copy_columns

        place = self.folder / "joined"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        large = [path for path in paths if path.suffix == _LARGE]
        for number, rows in enumerate(_gathered(path for path in paths if path.suffix == _SMALL)):
            large.append(place / f"{number}{_LARGE}")
            copy_columns({name: rows[name] for name in rows.dtype.names or ()}, large[-1], "(FORMAT parquet)")
        return large


def _gathered(paths: Iterable[Path]) -> Iterator[NDArray[Any]]:
    """Rows of small files of equal columns, one after the other, in batches of bounded size."""
    batches: dict[tuple[Any, ...], list[NDArray[Any]]] = {}
    for path in paths:
        rows = np.load(path, allow_pickle=False)
        form = tuple((name, rows.dtype[name].kind) for name in rows.dtype.names)
        batch = batches.setdefault(form, [])
        batch.append(rows)
        if sum(map(len, batch)) > BATCH_ROWS or len(batch) > BATCH_FILES:
            yield np.concatenate(batches.pop(form))
    yield from map(np.concatenate, batches.values())


def _rows_of(columns: Mapping[str, Any]) -> NDArray[Any]:
    """Columns as one array of rows with named fields."""
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    rows = np.empty(len(arrays["point"]), [(name, column.dtype) for name, column in arrays.items()])
    for name, column in arrays.items():
        rows[name] = column
    return rows


def _is_csv(path: Path) -> bool:
    return path.suffix.lower() == ".csv"


def _table_of(path: Path) -> str:
    """A finished file as a table with the numbers of its rows; texts of a CSV stay as they stand."""
    from rotor.formats.tables import quoted

    if not _is_csv(path):
        return f"read_parquet({quoted(str(path))}, file_row_number = true)"
    rows = f"read_csv({quoted(str(path))}, header = true, all_varchar = true, delim = ',')"
    return f"(SELECT *, row_number() OVER () AS file_row_number FROM {rows})"
