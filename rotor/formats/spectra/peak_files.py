"""Lists of peaks and spectra on a grid, read as peaks: columns of text, .npy, FITS."""

from __future__ import annotations

import csv
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.assignment.peaks.peak_finding import LEAST_POINTS, pick_peaks_in_pieces
from rotor.assignment.peaks.peak_list import PeakList, peak_list
from rotor.checks import require_file
from rotor.formats.packed import first_bytes, load
from rotor.formats.spectra.axis import AXIS_UNITS
from rotor.observed.spectrum import lost_channels

EQUAL_STEPS = 0.02  # largest relative spread of the steps of a grid
LEAST_GRID = 64  # fewest steps of a grid
EQUAL_NEIGHBOURS = 0.05  # largest relative difference of neighbouring steps inside a piece; frequencies may be rounded
MOSTLY = 0.9  # least share of such steps in a spectrum with gaps
LEAST_WITH_GAPS = 300  # fewest points of a spectrum with gaps
COMMENTS = ("#", "!", "//", "%")
_FITS = b"SIMPLE  ="
_UNIT = re.compile(r"(?:^|[^a-z])([kmgt]?hz|cm-1|cm\^-1|1/cm)(?![a-z0-9])", re.IGNORECASE)
_NAME_IN_COMMENT = re.compile(r"\W*(?:x\s*label\s*:\s*)?([a-z]\w*\s*(?:[\[(][^\])]*[\])])?)", re.IGNORECASE)


def read_peaks(path: str | os.PathLike[str], band_mhz: tuple[float, float] | None = None) -> PeakList:
    """The peaks of a file.

    A text file, packed or not, has two or three columns between commas, semicolons or blanks: frequency, intensity, and the standard
    error of the frequency; a heading and lines of comment (#) are optional. Frequencies are in MHz, or in the unit of their heading
    (frequency_ghz, f (cm-1)). A .npy file has the same as columns or rows. Frequencies in equal steps are a spectrum, whose peaks are
    found. A spectrum may have gaps: then at least 300 rows, of which nine in ten lie on grids of equal steps; its peaks are found piece
    by piece. Channels without a finite number are gaps, with a note. A FITS file is always a spectrum.

    band_mhz: first and last recorded frequency; peaks outside are left out.
    Raises ValueError with file and rule, for unreadable input.
    """
    name = os.fspath(path)
    require_file(name, "expected a list of peaks or a spectrum (.csv, .npy, .fits)")
    if first_bytes(Path(path), 80).startswith(_FITS):
        from rotor.formats.spectra.read import read_spectrum

        spectrum = read_spectrum(path)
        columns = np.column_stack([spectrum.frequency_mhz, spectrum.intensity])
        pieces = _pieces(columns) or [(spectrum.frequency_mhz, spectrum.intensity)]
        return replace(_in_band(pick_peaks_in_pieces(pieces, name), band_mhz), notes=spectrum.notes)
    columns = _from_npy(name) if name.lower().endswith(".npy") else _from_csv(Path(path))
    return peaks_from_columns(columns, band_mhz, name)


def peaks_from_columns(columns: Floats, band_mhz: tuple[float, float] | None = None, name: str = "") -> PeakList:
    """The peaks of columns (n, 2 or 3): a list of them, or a spectrum on a grid, which may have gaps.

    Channels of a spectrum without a finite number are gaps, with a note; in a list of peaks they are an error.
    """
    pieces = _pieces(columns)
    if pieces:
        return replace(_in_band(pick_peaks_in_pieces(pieces, name), band_mhz), notes=lost_channels(_infinite(columns)))
    error = columns[:, 2] if columns.shape[1] > 2 else None
    try:
        return _in_band(peak_list(columns[:, 0], columns[:, 1], error, source=name), band_mhz)
    except ValueError as reason:
        if len(columns) <= LEAST_GRID:
            raise
        raise ValueError(f"{reason} (read as a list of peaks, as its steps are not equal)") from None


def _pieces(columns: Floats) -> list[tuple[Floats, Floats]]:
    """Frequencies and intensities of the pieces of a spectrum, rising and without overlap; none for a list of peaks."""
    finite = columns[~_infinite(columns)]
    if len(finite) <= LEAST_GRID:
        return []
    order = -1 if np.median(np.diff(finite[:, 0])) < 0 else 1
    f, x = finite[::order, 0], finite[::order, 1]
    if _equal_steps(f):
        return [(f, x)]
    joined = _equal_neighbours(np.diff(f))
    if not _equal_steps(columns[::order, 0]) and (len(finite) < LEAST_WITH_GAPS or joined.mean() < MOSTLY):
        return []
    parts = sorted(np.split(np.arange(len(f)), np.flatnonzero(~joined) + 1), key=lambda part: float(f[part[0]]))
    out, end = list[tuple[Floats, Floats]](), -np.inf
    for part in parts:
        new = part[f[part] > end]  # of overlapping windows the first one counts
        if len(new) >= LEAST_POINTS:
            out.append((f[new], x[new]))
            end = float(f[new[-1]])
    return out


def _infinite(columns: Floats) -> NDArray[np.bool_]:
    """Which rows lack a finite frequency or intensity."""
    return np.asarray(~np.isfinite(columns[:, :2]).all(axis=1))


def _equal_steps(frequency: Floats) -> bool:
    """Whether frequencies rise in equal steps."""
    steps = np.diff(frequency)
    return bool(steps.mean() > 0 and np.ptp(steps) < EQUAL_STEPS * steps.mean())


def _equal_neighbours(steps: Floats) -> NDArray[np.bool_]:
    """Which steps rise and equal the step before or after; of two grids side by side the second begins with a step that does not."""
    alike = (np.abs(np.diff(steps)) <= EQUAL_NEIGHBOURS * np.abs(steps[1:])) & (steps[1:] > 0)
    equal: NDArray[np.bool_] = np.append(alike, False) | np.append(False, alike)
    equal[1:] &= alike | ~equal[:-1]
    return equal


def _in_band(peaks: PeakList, band_mhz: tuple[float, float] | None) -> PeakList:
    """The peaks inside a band, which replaces the band of the file."""
    if band_mhz is None or len(peaks) < 2:  # noise has none
        return peaks
    inside = (peaks.frequency_mhz >= band_mhz[0]) & (peaks.frequency_mhz <= band_mhz[1])
    chosen = peak_list(
        peaks.frequency_mhz[inside], peaks.intensity[inside], peaks.uncertainty_mhz[inside], band_mhz=band_mhz,
        source=peaks.source,
    )  # fmt: skip
    chosen = replace(chosen, trace=peaks.trace)
    if peaks.stated_windows is None:
        return chosen
    windows = np.clip(peaks.stated_windows, *band_mhz)
    return replace(chosen, stated_windows=windows[windows[:, 1] > windows[:, 0]])


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
        if not cells or cells[0].startswith(COMMENTS):
            factor = _comment_unit(line) or factor if not rows else factor
            continue
        try:
            values = [float(cell) for cell in cells[:3]]
        except ValueError:
            if heading and not rows:
                heading, factor = False, _heading_unit(line) or factor
                continue
            raise ValueError(
                f"{name}, line {number}: {line.strip()[:60]!r}: expected two or three numbers, separated by commas or blanks"
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
    """The cells of a line between commas or blanks. Where they stand between semicolons, a comma is a decimal point."""
    if ";" in line:
        return line.replace(",", ".").split(";")
    return next(csv.reader([line]), []) if "," in line else line.split()


def _heading_unit(line: str) -> float | None:
    """MHz for the first unit of frequency in a heading such as frequency_ghz,intensity or "f (GHz) T (K)"; None without a unit."""
    unit = _UNIT.search(_cells(line)[0] if set(",;") & set(line) else line)
    return AXIS_UNITS[unit[1].casefold()] if unit else None


def _comment_unit(line: str) -> float | None:
    """MHz for the unit that the first name of a comment states: "# frequency_ghz ...", "# f (GHz) ...", "#xLabel: frequency [GHz]"."""
    name = _NAME_IN_COMMENT.match(line)
    return _heading_unit(name[1]) if name else None
