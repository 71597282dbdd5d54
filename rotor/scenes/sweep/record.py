"""The record of a sweep: one line of JSON for each point that was run, appended as soon as it is done."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

Record = Mapping[str, Any]
_CUT_OFF = '{"key"'  # how a line begins that a stop has cut off


def read_records(path: str | os.PathLike[str] | None) -> dict[str, Record]:
    """What was run, by key, the last of several lines of one key; a line that a stop cut off is left out.

    Raises ValueError, with file and line, for anything else that is no record of a point.
    """
    if path is None or not Path(path).exists():
        return {}
    records = {}
    try:
        with open(path, encoding="utf-8") as handle:
            for number, line in enumerate(handle, 1):
                record = _record(line, f"{os.fspath(path)}, line {number}")
                if record is not None:
                    records[record["key"]] = record
    except UnicodeDecodeError as error:
        raise ValueError(f"{os.fspath(path)}: a record of a sweep is UTF-8 text: {error}; give another name") from None
    return records


def _record(line: str, where: str) -> Record | None:
    """The record on a line; None for an empty line, and for one that was cut off."""
    if not line.strip():
        return None
    try:
        made = json.loads(line)
    except (json.JSONDecodeError, RecursionError):
        if line.startswith(_CUT_OFF) or _CUT_OFF.startswith(line.strip()):
            return None
        raise ValueError(
            f"{where}: {_short(line)}: is no record of a sweep; remove the line, or give another file"
        ) from None
    if isinstance(made, dict) and isinstance(made.get("key"), str) and isinstance(made.get("values"), dict):
        done = isinstance(made.get("files"), list) and all(isinstance(file, str) for file in made["files"])
        numbers = all(isinstance(made.get(name), int | float) for name in ("rows", "seconds"))
        if isinstance(made.get("error"), str) or (done and numbers and isinstance(made.get("results", {}), dict)):
            return made
    raise ValueError(
        f"{where}: {_short(line)}: expected the record of a point: key, values, rows, seconds, files, results, or error; "
        "remove the line, or give another file"
    )


def _short(line: str) -> str:
    text = line.strip()
    return text if len(text) <= 40 else f"{text[:37]}..."


@contextmanager
def appended(path: str | os.PathLike[str] | None) -> Iterator[Callable[[Record], None]]:
    """A function that appends a record as a line, written out at once; one that does nothing without a path."""
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
