"""The table of a fluid's run as CSV, Parquet or JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from rotor.fluid.record import FluidRecord
from rotor.formats.atomic import atomic_path
from rotor.formats.line_tables import write_beside


def write_fluid(record: FluidRecord, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write a record as .csv, .parquet or .json (a list of rows, null for what is not a number).

    settings: what the provenance (`path` + ".provenance.json") shall say besides version and number of rows.
    """
    import rotor

    suffix = os.path.splitext(os.fspath(path))[1].lower()
    if suffix not in (".csv", ".parquet", ".json"):
        raise ValueError(f"{path}: a fluid's table is written as .csv, .parquet or .json; the suffix names the format")
    frame = record.to_polars()
    with atomic_path(path) as unfinished:
        if suffix == ".csv":
            frame.write_csv(unfinished)
        elif suffix == ".parquet":
            frame.write_parquet(unfinished)
        else:
            rows = [{k: v if v == v else None for k, v in row.items()} for row in frame.to_dicts()]
            unfinished.write_text(json.dumps(rows, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    write_beside(path, {"program": "rotor", "version": rotor.__version__, **(settings or {}), "rows": len(record)})
