"""Correlation functions and the degrees of a test of equipartition as tables in files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.classical.ensembles import Correlations
from rotor.equipartition import Equipartition
from rotor.formats.atomic import atomic_path, open_atomic
from rotor.formats.line_tables import write_beside


def write_gas_table(
    table: Correlations | Equipartition, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None
) -> None:
    """Write a table as .csv, .parquet or .json, every number in full precision.

    settings: what the provenance shall say besides; it is inside a .parquet and a .json and beside a .csv, in `path` +
    ".provenance.json". Raises ValueError for another suffix.
    """
    import rotor

    name, frame = Path(path).name.lower(), table.to_polars()
    story = {"program": "rotor", "version": rotor.__version__, **_facts(table), **(settings or {})}
    if name.endswith(".csv"):
        with open_atomic(path) as handle:
            frame.write_csv(handle)
        write_beside(path, story)
    elif name.endswith(".parquet"):
        with atomic_path(path) as unfinished:
            frame.write_parquet(unfinished, metadata={"provenance": json.dumps(story)})
    elif name.endswith(".json"):
        with open_atomic(path, "w", encoding="utf-8") as handle:
            json.dump({"provenance": story, "rows": frame.to_dicts()}, handle, indent=1, allow_nan=False)
    else:
        raise ValueError(f"{path}: this table can be written as .csv, .parquet or .json; the suffix names the format")


def _facts(table: Correlations | Equipartition) -> dict[str, Any]:
    if isinstance(table, Correlations):
        return {"molecules": table.molecules, "rows": len(table)}
    return {"accepted": table.accepted, "p_value": table.p_value, "confidence": table.confidence, "kt": table.kt}
