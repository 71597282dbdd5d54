"""What is done of a sweep: a line of JSON for each finished point, appended at once, and all points as a table."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.checks import read_text
from rotor.frozen import dataclass
from rotor.scenes.sweep.points import cell
from rotor.table import Table

Record = Mapping[str, Any]
_CUT_OFF = '{"key"'  # start of a line that a stop has cut off


def read_records(path: str | os.PathLike[str] | None) -> dict[str, Record]:
    """The records of a file by key; of several lines with a key, the last. A line cut off by a stop is left out.

    Raises ValueError, with file and line, for any other line.
    """
    if path is None or not Path(path).exists():
        return {}
    records = {}
    for number, line in enumerate(io.StringIO(read_text(path)), 1):
        record = _record(line, f"{os.fspath(path)}, line {number}")
        if record is not None:
            records[record["key"]] = record
    return records


def _record(line: str, where: str) -> Record | None:
    """The record on a line; None for an empty line or one that was cut off."""
    if not line.strip():
        return None
    try:
        content = json.loads(line)
    except (json.JSONDecodeError, RecursionError):
        if line.startswith(_CUT_OFF) or _CUT_OFF.startswith(line.strip()):
            return None
        raise ValueError(
            f"{where}: {_short(line)}: is no record of a sweep; remove the line, or give another file"
        ) from None
    if isinstance(content, dict) and isinstance(content.get("key"), str) and isinstance(content.get("values"), dict):
        files = isinstance(content.get("files"), list) and all(isinstance(file, str) for file in content["files"])
        numbers = all(isinstance(content.get(name), int | float) for name in ("rows", "seconds"))
        if isinstance(content.get("error"), str) or (
            files and numbers and isinstance(content.get("results", {}), dict)
        ):
            return content
    raise ValueError(
        f"{where}: {_short(line)}: expected the record of a point: key, values, rows, seconds, files, results, or error; "
        "remove the line, or give another file"
    )


def _short(line: str) -> str:
    text = line.strip()
    return text if len(text) <= 40 else f"{text[:37]}..."


@contextmanager
def appended(path: str | os.PathLike[str] | None) -> Iterator[Callable[[Record], None]]:
    """A function that appends a record as a line and flushes it; without a path, it does nothing."""
    if path is None:
        yield lambda _: None
        return
    with open(path, "ab") as handle:
        if handle.tell() and not _ends_with_line(path):
            handle.write(b"\n")

        def append(record: Record) -> None:
            handle.write(json.dumps(record, ensure_ascii=False).encode() + b"\n")
            handle.flush()

        yield append


def _ends_with_line(path: str | os.PathLike[str]) -> bool:
    with open(path, "rb") as handle:
        handle.seek(-1, os.SEEK_END)
        return handle.read(1) == b"\n"


@dataclass(frozen=True, repr=False)
class SweepResult(Table):
    """A finished sweep, with a row for each point.

    computed: number of points of this run; the others are from earlier runs. combined: files with the rows of all points.
    """

    records: tuple[Mapping[str, Any], ...]
    computed: int
    combined: tuple[Path, ...] = ()

    @property
    def failed(self) -> tuple[Mapping[str, Any], ...]:
        """The records of failed points, with the reason under "error"."""
        return tuple(record for record in self.records if "error" in record)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The swept values, rows, seconds, results (NaN if a point lacks one), and the reasons of failed points."""
        first = self.records[0]["values"] if self.records else {}
        out = {name: np.array([cell(record["values"][name]) for record in self.records]) for name in first}
        out["rows"] = np.array([record.get("rows", 0) for record in self.records])
        out["seconds"] = np.array([record["seconds"] for record in self.records])
        names = dict.fromkeys(name for record in self.records for name in record.get("results", {}))
        for name in names:
            out[name] = np.array([record.get("results", {}).get(name, np.nan) for record in self.records])
        return out | ({"error": np.array([record.get("error", "") for record in self.records])} if self.failed else {})

    @property
    def files(self) -> tuple[str, ...]:
        """The files of each point, then those with the rows of all points."""
        single = [file for record in self.records for file in record.get("files", ())]
        return (*single, *map(str, self.combined))
