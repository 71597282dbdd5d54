"""Tables as files: motions, Raman lines, spectra, thermodynamic functions, gases, fluids, each with where it came from.

One way for all of them: .csv, .parquet or .json by suffix, every number the shortest text that gives the same double
back. The provenance stands inside a .parquet and a .json, and beside a .csv in `path` + ".provenance.json".
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.formats.atomic_write import open_atomic
from rotor.formats.line_tables import provenance, top_provenance, write_frame
from rotor.table import Table
from rotor.version import version

if TYPE_CHECKING:
    from rotor.classical.gas.ensembles import Correlations
    from rotor.spectra.raman import RamanLines
    from rotor.spectra.spectrum import Spectrum
    from rotor.statistics.equipartition import Equipartition
    from rotor.thermo import ThermoFunctions

SUFFIXES = (".csv", ".parquet", ".json")


def write_table(table: Table, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write a table in the format that the suffix of `path` names; what is not a number is an empty field or null.

    settings: what the provenance shall say besides what the table itself knows. Raises ValueError for another suffix.
    """
    suffix, record = Path(path).suffix.lower(), _provenance(table) | dict(settings or {})
    if suffix not in SUFFIXES:
        raise ValueError(
            f"{os.fspath(path)}: this table can be written as .csv, .parquet or .json; the suffix names the format"
        )
    frame = table.to_polars().fill_nan(None)
    if suffix != ".json":
        write_frame(frame, path, record)
    else:
        with open_atomic(path, "w", encoding="utf-8") as handle:
            json.dump({"provenance": record, "rows": frame.to_dicts()}, handle, indent=1, allow_nan=False)
            handle.write("\n")


def _provenance(table: Table) -> dict[str, Any]:
    """What the table knows of where it came from."""
    from rotor.classical.gas.ensembles import Correlations
    from rotor.spectra.raman import RamanLines
    from rotor.spectra.spectrum import Spectrum
    from rotor.statistics.equipartition import Equipartition
    from rotor.thermo import ThermoFunctions

    if isinstance(table, RamanLines):
        return raman_provenance(table)
    if isinstance(table, Spectrum):
        return _spectrum_provenance(table)
    if isinstance(table, ThermoFunctions):
        return thermo_provenance(table)
    record = {"program": "rotor", "version": version()}
    if isinstance(table, Correlations | Equipartition):
        record |= _gas_facts(table)
    return record | {"rows": len(next(iter(table.columns.values())))}


def raman_provenance(lines: RamanLines) -> dict[str, Any]:
    """What Raman lines were made from: the top and its sources, the settings, Q."""
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


def _spectrum_provenance(spectrum: Spectrum) -> dict[str, Any]:
    return (provenance(spectrum.lines) if spectrum.lines is not None else {}) | {
        "profile": spectrum.profile,
        "fwhm_mhz": spectrum.fwhm_mhz,
        "unit": spectrum.unit,
        "outside": spectrum.outside,
    }


def _gas_facts(table: Correlations | Equipartition) -> dict[str, Any]:
    from rotor.statistics.equipartition import Equipartition

    if isinstance(table, Equipartition):
        return {"accepted": table.accepted, "p_value": table.p_value, "confidence": table.confidence, "kt": table.kt}
    return {"molecules": table.molecules}
