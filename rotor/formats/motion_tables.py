"""A motion as a CSV file, in full precision, with its provenance in a file beside it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.classical.motion import MotionTable
from rotor.formats.atomic import open_atomic
from rotor.formats.line_tables import write_beside


def write_motion(motion: MotionTable, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write a motion as .csv; every number is the shortest text that gives the same double back.

    settings: what the provenance (`path` + ".provenance.json") shall say besides version and number of rows, for
    instance moments and units.
    """
    import rotor

    if not Path(path).name.lower().endswith(".csv"):
        raise ValueError(f"{path}: a motion can be written as .csv; the suffix names the format")
    story = {"program": "rotor", "version": rotor.__version__, **(settings or {}), "rows": len(motion)}
    with open_atomic(path) as handle:
        motion.to_polars().write_csv(handle)
    write_beside(path, story)
