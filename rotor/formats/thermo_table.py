"""Thermodynamic functions as a table in a file, with what they were computed from."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rotor.formats.atomic import atomic_path, open_atomic
from rotor.formats.line_tables import top_provenance, write_beside
from rotor.thermo import ThermoFunctions


def thermo_provenance(functions: ThermoFunctions) -> dict[str, Any]:
    """What the functions were made from: the top and its sources, species, vibration, pressure, errors of the sums."""
    gas, vibrations = functions.gas, functions.vibrations
    return top_provenance(functions.top) | {
        "species": functions.species,
        "fractions": dict(functions.fractions),
        "symmetry_number": functions.symmetry_number,
        "spin_factor": functions.spin_factor,
        "vibrations": vibrations.text if vibrations is not None else None,
        "pressure_bar": gas.pressure_bar if gas is not None else None,
        "mass_u": gas.mass_u if gas is not None else None,
        "jmax": int(functions.jmax.max()),
        "relative_error": float(functions.relative_error.max()),
        "rows": len(functions),
    }


def write_thermo(
    functions: ThermoFunctions, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None
) -> None:
    """Write thermodynamic functions as .csv or .parquet, every number in full precision.

    settings: what else the provenance shall say; it is inside a .parquet and beside a .csv, in `path` +
    ".provenance.json". What is not a number (NaN) is an empty field.
    """
    name = Path(path).name.lower()
    story = thermo_provenance(functions) | dict(settings or {})
    frame = functions.to_polars().fill_nan(None)
    if name.endswith(".csv"):
        with open_atomic(path) as handle:
            frame.write_csv(handle)
        write_beside(path, story)
    elif name.endswith(".parquet"):
        with atomic_path(path) as unfinished:
            frame.write_parquet(unfinished, metadata={"provenance": json.dumps(story)})
    else:
        raise ValueError(
            f"{os.fspath(path)}: thermodynamic functions can be written as .csv or .parquet; the suffix names the format"
        )
