"""Raman lines as a CSV file, with their provenance in a file beside it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.formats.atomic import open_atomic
from rotor.formats.line_tables import top_provenance, write_beside
from rotor.spectra.raman import RamanLines


def raman_provenance(lines: RamanLines) -> dict[str, Any]:
    """What the lines were made from: the top and its sources, the settings, Q."""
    return top_provenance(lines.top) | {
        "polarizability_abc_angstrom3": lines.top.polarizability_abc_angstrom3,
        "polarizability_source": lines.top.polarizability_source,
        "temperature_k": lines.temperature_k,
        "laser_nm": lines.laser_nm,
        "jmax": lines.jmax,
        "min_relative": lines.min_relative or None,
        "q": lines.partition.q,
        "q_source": lines.partition.source,
        "lines": len(lines),
        "warnings": list(lines.warnings),
    }


def write_raman(lines: RamanLines, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write Raman lines as .csv; settings: what else the provenance, in `path` + ".provenance.json", shall say."""
    if not Path(path).name.lower().endswith(".csv"):
        raise ValueError(f"{os.fspath(path)}: Raman lines can be written as .csv; the suffix names the format")
    with open_atomic(path) as handle:
        lines.to_polars().write_csv(handle)
    write_beside(path, raman_provenance(lines) | dict(settings or {}))
