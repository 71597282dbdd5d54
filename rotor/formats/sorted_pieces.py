"""Pieces of a long list on disk: the folder of a list, and the sort of its pieces by DuckDB into one Parquet file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.formats.atomic_write import atomic_path, open_atomic
from rotor.formats.tables import quoted, run

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection

_MANIFEST = "manifest.json"


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


def sort_pieces(pieces: list[Path], target: Path, record: Mapping[str, Any], folder: Path, memory_mb: int) -> None:
    """DuckDB's external merge sort: what exceeds its memory goes to files in `folder`."""
    with engine_in(folder, memory_mb) as engine, atomic_path(target) as unfinished:
        files = ", ".join(quoted(str(piece)) for piece in pieces)
        text = quoted(json.dumps(record, ensure_ascii=False))
        run(
            engine,
            f"COPY (SELECT * FROM read_parquet([{files}]) ORDER BY frequency_mhz) TO {quoted(str(unfinished))} "
            f"(FORMAT parquet, KV_METADATA {{provenance: {text}}})",
            target,
        )


@contextmanager
def engine_in(folder: Path, memory_mb: int) -> Iterator[DuckDBPyConnection]:
    """DuckDB with a bound on its memory, which sorts in a folder beyond it."""
    import duckdb

    with duckdb.connect() as engine:
        engine.execute("SET memory_limit = $limit", {"limit": f"{memory_mb}MB"})
        engine.execute("SET temp_directory = $folder", {"folder": str(folder / "sort")})
        engine.execute("SET preserve_insertion_order = true")
        yield engine


def row_count(engine: DuckDBPyConnection, path: Path) -> int:
    """How many rows a Parquet file has."""
    row = engine.execute(f"SELECT count(*) FROM read_parquet({quoted(str(path))})").fetchone()
    assert row is not None  # a count always has one row
    return int(row[0])
