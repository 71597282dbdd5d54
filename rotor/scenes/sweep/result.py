"""The result of a sweep: a row for each point, with its values and results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.frozen import dataclass
from rotor.scenes.sweep.points import cell
from rotor.table import Table


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
