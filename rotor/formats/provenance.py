"""Provenance of files: the record, and an accompanying file for formats without a place for it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

from rotor.formats.atomic_write import open_atomic
from rotor.table import Table
from rotor.version import version


def provenance_record(table: Table, settings: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The program with its version, the provenance of the table, and the settings, as values for JSON.

    Numbers that are not finite are None.
    """
    stated = {name: _finite(value) for name, value in table.provenance.items()}
    return {"program": "rotor", "version": version()} | stated | dict(settings or {})


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, tuple | list):
        return [_finite(item) for item in value]
    return {name: _finite(item) for name, item in value.items()} if isinstance(value, Mapping) else value


def write_beside(path: str | os.PathLike[str], record: Mapping[str, Any]) -> None:
    """Write the record of a file whose format cannot contain it, as `path` + ".provenance.json"."""
    with open_atomic(f"{os.fspath(path)}.provenance.json", "w", encoding="utf-8") as handle:
        json.dump(record, handle, indent=1, ensure_ascii=False)
        handle.write("\n")
