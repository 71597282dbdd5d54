"""Lists of peaks and spectra on a grid, read as peaks: .csv, .npy, FITS."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path

import numpy as np

from rotor.arrays import Floats
from rotor.assignment.peak_finding import peaks_of_spectrum
from rotor.assignment.peaks import PeakList, peak_list
from rotor.formats.packed import first_bytes, load
from rotor.formats.spectra.axis import AXIS_UNITS

EQUAL_STEPS = 0.02  # largest relative spread of the steps of a grid
LEAST_GRID = 64  # fewest points of a grid
_FITS = b"SIMPLE  ="


def read_peaks(path: str | os.PathLike[str], band_mhz: tuple[float, float] | None = None) -> PeakList:
    """The peaks of a file.

    A .csv file, packed or not, has two or three columns: frequency, intensity, and the standard error of the frequency; a heading is
    optional. Frequencies are in MHz, or in the unit of their heading (frequency_ghz, f (cm-1)). A .npy file has the same as columns
    or rows. Frequencies in equal steps are a spectrum, whose peaks are found; a FITS file is always a spectrum.

    Parameters
    ----------
    path : path
    band_mhz : (float, float), optional
        First and last recorded frequency; peaks outside are left out.

    Returns
    -------
    PeakList

    Raises
    ------
    ValueError
        With file and rule, for unreadable input.
    """
    name = os.fspath(path)
    if not Path(path).is_file():
        raise ValueError(f"{name}: no such file; expected a list of peaks or a spectrum (.csv, .npy, .fits)")
    if first_bytes(Path(path), 80).startswith(_FITS):
        from rotor.formats.spectra.read import read_spectrum

        spectrum = read_spectrum(path)
        return _in_band(peaks_of_spectrum(spectrum.frequency_mhz, spectrum.intensity, name), band_mhz)
    columns = _from_npy(name) if name.lower().endswith(".npy") else _from_csv(Path(path))
    return peaks_of_columns(columns, band_mhz, name)


def peaks_of_columns(columns: Floats, band_mhz: tuple[float, float] | None = None, name: str = "") -> PeakList:
    """The peaks of columns (n, 2 or 3): a list of them, or a spectrum where frequencies rise in equal steps."""
    frequency = columns[:, 0]
    steps = np.diff(frequency)
    if len(steps) >= LEAST_GRID and steps.mean() > 0 and np.ptp(steps) < EQUAL_STEPS * steps.mean():
        return _in_band(peaks_of_spectrum(frequency, columns[:, 1], name), band_mhz)
    error = columns[:, 2] if columns.shape[1] > 2 else None
    return _in_band(peak_list(frequency, columns[:, 1], error, source=name), band_mhz)


def _in_band(peaks: PeakList, band_mhz: tuple[float, float] | None) -> PeakList:
    """The peaks inside a band, which replaces the band of the file."""
    if band_mhz is None or len(peaks) < 2:  # noise has none
        return peaks
    inside = (peaks.frequency_mhz >= band_mhz[0]) & (peaks.frequency_mhz <= band_mhz[1])
    return peak_list(
        peaks.frequency_mhz[inside], peaks.intensity[inside], peaks.uncertainty_mhz[inside], band_mhz=band_mhz,
        source=peaks.source,
    )  # fmt: skip


def _from_npy(name: str) -> Floats:
    try:
        values = np.load(name, allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise ValueError(f"{name}: not an array of numbers as numpy.save writes it: {error}") from None
    if values.ndim != 2 or not {2, 3} & set(values.shape) or values.dtype.kind not in "fiu":
        raise ValueError(f"{name}: an array of shape {values.shape}; expected two or three columns or rows of numbers")
    return np.asarray(values if values.shape[1] in (2, 3) else values.T, dtype=np.float64)


def _from_csv(path: Path) -> Floats:
    text, name = load(path)
    rows, heading, factor = list[list[float]](), True, 1.0
    lines = text.decode("utf-8", "replace").splitlines()
    for number, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in _cells(line) if cell.strip()]
        if not cells or cells[0].startswith("#"):
            continue
        try:
            values = [float(cell) for cell in cells[:3]]
        except ValueError:
            if heading and not rows:
                heading, factor = False, _unit_of_heading(cells[0])
                continue
            raise ValueError(
                f"{name}, line {number}: {','.join(cells)[:60]!r}: expected two or three numbers"
            ) from None
        if len(values) < 2 or (rows and len(values) != len(rows[0])):
            raise ValueError(
                f"{name}, line {number}: {len(values)} columns; expected frequency, intensity[, error] in each line"
            )
        rows.append(values)
    if not rows:
        raise ValueError(f"{name}: no numbers in it; expected frequency, intensity[, error] in each line")
    columns = np.array(rows)
    columns[:, [0, 2][: columns.shape[1] - 1]] *= factor
    return columns


def _cells(line: str) -> list[str]:
    """The cells of a line. Where they stand between semicolons, a comma is a decimal point."""
    if ";" in line:
        return line.replace(",", ".").split(";")
    return next(csv.reader([line]), [])


def _unit_of_heading(text: str) -> float:
    """MHz for each unit of frequency that ends a heading such as frequency_ghz or "f (GHz)"; 1 without a unit."""
    unit = re.search(r"(?:^|[^a-z])([kmgt]?hz|cm-1|cm\^-1|1/cm)\W*$", text.casefold())
    return AXIS_UNITS[unit[1]] if unit else 1.0
