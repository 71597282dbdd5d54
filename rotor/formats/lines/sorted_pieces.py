"""Pieces of a long list on disk: the folder of a list, and the sort of its pieces by DuckDB into ranges of frequency."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.formats.atomic_write import open_atomic, unfinished_folder
from rotor.formats.tables import quoted, run

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

_MANIFEST = "manifest.json"
SORTED_LINES = 20_000_000  # lines that are sorted at once


def open_folder(folder: Path, record: Mapping[str, Any]) -> None:
    """Make the folder of pieces, or check that an existing one belongs to this list."""
    text = json.dumps(record, sort_keys=True, ensure_ascii=False)
    mark = {"sha256": hashlib.sha256(text.encode()).hexdigest(), "list": record}
    manifest = folder / _MANIFEST
    if not manifest.exists():
        folder.mkdir(exist_ok=True)
        with open_atomic(manifest, "w", encoding="utf-8") as handle:
            json.dump(mark, handle, indent=1, ensure_ascii=False)
        return
    try:
        before = json.loads(manifest.read_text(encoding="utf-8"))
        recorded, differs = before["sha256"], _first_difference(before["list"], json.loads(text))
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"{manifest}: is not a manifest of pieces; remove the folder to start again") from None
    if recorded != mark["sha256"]:
        raise ValueError(
            f"{folder}: holds pieces of another list ({differs}); finish that list with its own settings, or remove the "
            "folder to start again"
        )


def _first_difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    keys = [key for key in now if before.get(key) != now[key]]
    return f"{keys[0]} was {before.get(keys[0])}, is {now[keys[0]]}" if keys else "its settings differ"


def sort_pieces(
    pieces: list[Path], target: Path, folder: Path, memory_mb: int, progress: Callable[[int, int], object]
) -> None:
    """Write the lines of all pieces into files of a folder, each a range of frequencies: the names rise with the frequency.

    DuckDB's external sort needs memory that grows with the number of rows: 367 million did not fit into 0.5 GB.
    """
    with engine_in(folder, memory_mb) as engine, unfinished_folder(folder) as unfinished:
        (unfinished / "sorted").mkdir()
        lines = f"read_parquet({listed(pieces)})"
        ranges = math.ceil(row_count(engine, pieces) / SORTED_LINES) or 1
        shares = [n / ranges for n in range(1, ranges)]
        row = (
            engine.execute(f"SELECT approx_quantile(frequency_mhz, {shares}) FROM {lines}").fetchone()
            if shares
            else None
        )
        bounds = [-math.inf, *(row[0] if row else []), math.inf]
        for number, (first, last) in enumerate(pairwise(bounds)):
            within = f"frequency_mhz >= '{first}'::DOUBLE AND frequency_mhz < '{last}'::DOUBLE"
            file = unfinished / "sorted" / f"{number:04d}.parquet"
            run(
                engine,
                f"COPY (SELECT * FROM {lines} WHERE {within} ORDER BY frequency_mhz) TO {quoted(str(file))} (FORMAT parquet)",
                file,
            )
            progress(number + 1, ranges)
        (unfinished / "sorted").rename(target)


@contextmanager
def engine_in(folder: Path, memory_mb: int) -> Iterator[DuckDBPyConnection]:
    """DuckDB with a bound on its memory, which sorts in a folder beyond it."""
    import duckdb

    with duckdb.connect() as engine:
        engine.execute("SET memory_limit = $limit", {"limit": f"{memory_mb}MB"})
        engine.execute("SET temp_directory = $folder", {"folder": str(folder / "sort")})
        engine.execute("SET preserve_insertion_order = true")
        yield engine


def listed(files: Sequence[Path]) -> str:
    """A list of files in SQL."""
    return f"[{', '.join(quoted(str(file)) for file in files)}]"


def row_count(engine: DuckDBPyConnection, files: Sequence[Path]) -> int:
    """How many rows Parquet files have."""
    row = engine.execute(f"SELECT count(*) FROM read_parquet({listed(files)})").fetchone()
    assert row is not None  # a count always has one row
    return int(row[0])
