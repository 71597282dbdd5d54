"""A spectrum as CSV: two columns, with their provenance in a file beside it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from rotor.formats.atomic import open_atomic
from rotor.formats.line_tables import provenance, write_beside
from rotor.spectra.spectrum import Spectrum


def write_spectrum(spectrum: Spectrum, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write a spectrum as .csv: `frequency_mhz` and `cross_section_nm2` (or `intensity`).

    settings: what else the provenance, in `path` + ".provenance.json", shall say. Raises ValueError for another suffix.
    """
    if not os.fspath(path).lower().endswith(".csv"):
        raise ValueError(f"{os.fspath(path)}: a spectrum can be written as .csv; the suffix names the format")
    story = (provenance(spectrum.lines) if spectrum.lines is not None else {}) | {
        "profile": spectrum.profile,
        "fwhm_mhz": spectrum.fwhm_mhz,
        "unit": spectrum.unit,
        "outside": spectrum.outside,
        **(settings or {}),
    }
    with open_atomic(path) as handle:
        spectrum.to_polars().write_csv(handle)
    write_beside(path, story)
