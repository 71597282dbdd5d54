"""Spectra in FITS: images of one axis, pixels of cubes, tables with columns of frequency and flux, and SDFITS.

The spectral axis is what the header's world coordinates say, by `astropy.wcs`; CLASS writes RESTFREQ beside an offset, ν_n = RESTFREQ +
CRVAL1 + (n - CRPIX1) CDELT1, in the frame that moves with VELO-LSR. In SDFITS a keyword of the header counts for every row of the table
(B. Garwood, AIPS++ note 236, appendix on SDFITS). Needs astropy (extra `astro`).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spectra.axis import (
    OPTICAL,
    RADIO,
    RELATIVISTIC,
    ReadChoices,
    axis_mhz,
    intensity_unit,
    velocity_to_frequency,
)
from rotor.observed.spectrum import ObservedSpectrum, observed_spectrum

EXTRA = 'python -m pip install "molrotor[astro]"'
_DATA = ("DATA", "SPECTRUM", "SERIES")
_AXES = ("frequency", "freq", "spectral_axis", "wavelength", "wave", "lambda", "velocity", "vrad", "velo")
_FLUX = ("flux", "intensity", "t", "tmb", "ta", "data", "brightness", "i")
_NOISE = ("uncertainty", "error", "noise", "sigma", "err")
_FRAMES = {
    "-LSR": "LSRK",
    "-LSRK": "LSRK",
    "-LSRD": "LSRD",
    "-HEL": "HELIOCEN",
    "-BAR": "BARYCENT",
    "-OBS": "TOPOCENT",
    "-GEO": "GEOCENTR",
    "-TOP": "TOPOCENT",
}
_CONVENTION = {
    "FREQ": None,
    "VRAD": RADIO,
    "VOPT": OPTICAL,
    "VELO": RELATIVISTIC,
    "FELO": OPTICAL,
    "WAVE": None,
    "ZOPT": OPTICAL,
}


def unreadable(path: Path, error: OSError) -> ValueError:
    """The error for a file that cannot be opened as FITS: the reason of the system, or a wrong first card."""
    return ValueError(f"{path}: {error.strerror or 'not a FITS file; its first card is not SIMPLE'}")


def astropy_fits() -> Any:
    """`astropy.io.fits`; ImportError with the command that installs it."""
    try:
        from astropy.io import fits
    except ModuleNotFoundError as error:
        if error.name != "astropy":
            raise
        raise ImportError(f"astropy is not installed: {EXTRA}", name="astropy") from None
    return fits


def read_fits_spectrum(path: Path, choices: ReadChoices | None = None) -> ObservedSpectrum:
    """The spectrum in a FITS file.

    choices: settings that the header does not state; `row` of a table of several spectra, `pixel` of a cube.
    Raises ValueError with file and rule: no spectrum, several spectra without a choice, missing or unknown units, velocities without rest
    frequency. Raises ImportError without astropy.
    """
    fits, choices = astropy_fits(), choices or ReadChoices()
    try:
        opened = fits.open(path, memmap=False)
    except OSError as error:
        raise unreadable(path, error) from None
    with opened as units_of_file:
        for hdu in units_of_file:
            if hdu.data is None:
                continue
            if isinstance(hdu, fits.BinTableHDU):
                return _read_table(hdu, str(path), choices)
            return _read_image(hdu, str(path), choices)
    raise ValueError(f"{path}: no image and no table with data")


def _read_image(hdu: Any, name: str, choices: ReadChoices) -> ObservedSpectrum:
    header = hdu.header
    axis = spectral_axis_number(header, name)
    data = np.asarray(hdu.data, dtype=np.float64)
    values = _pixel_spectrum(data, data.ndim - axis, name, choices)
    if (blank := header.get("BLANK")) is not None and header.get("BITPIX", 0) < 0:
        values = np.where(values == blank, np.nan, values)  # CLASS marks bad channels so in floating point too
    frequency, rest = image_axis_mhz(header, axis, len(values), name, choices)
    return _spectrum(frequency, values, header, rest, header.get("BUNIT"), name, choices)


def _pixel_spectrum(data: Floats, axis: int, name: str, choices: ReadChoices) -> Floats:
    """The channels of an image of one long axis, or of the chosen pixel of a cube."""
    moved = np.moveaxis(data, axis, -1)
    if moved[..., 0].size == 1:
        return moved.reshape(-1)
    if choices.pixel is None:
        raise ValueError(
            f"{name}: a cube of {data.shape[::-1]} pixels; state which spectrum, such as --pixel 32,32 (all of them: emission --maps)"
        )
    x, y = choices.pixel
    plane = moved.reshape(-1, *moved.shape[-3:]) if moved.ndim > 3 else moved[None]
    if not (1 <= x <= plane.shape[2] and 1 <= y <= plane.shape[1]):
        raise ValueError(f"{name}: pixel {x},{y}: the image has {plane.shape[2]} by {plane.shape[1]}, counted from 1")
    return np.asarray(plane[0, y - 1, x - 1])


def spectral_axis_number(header: Mapping[str, Any], name: str) -> int:
    """Number, from 1, of the spectral axis; ValueError if there is none."""
    for number in range(1, int(header.get("NAXIS", 0)) + 1):
        if str(header.get(f"CTYPE{number}", "")).upper()[:4] in _CONVENTION:
            return number
    kinds = [str(header.get(f"CTYPE{number}", "")) for number in range(1, int(header.get("NAXIS", 0)) + 1)]
    raise ValueError(f"{name}: no spectral axis (FREQ, VRAD, VOPT, VELO, WAVE) among CTYPE {kinds}")


def image_axis_mhz(
    header: Mapping[str, Any], axis: int, count: int, name: str, choices: ReadChoices
) -> tuple[Floats, float | None]:
    """Frequencies (n,) of the spectral axis in MHz, and the rest frequency."""
    rest = next((float(header[key]) * 1e-6 for key in ("RESTFRQ", "RESTFREQ") if header.get(key)), choices.rest_mhz)
    kind = str(header[f"CTYPE{axis}"]).upper()
    if _is_class(header, kind):
        offset = float(header[f"CRVAL{axis}"]) + (np.arange(1, count + 1) - float(header[f"CRPIX{axis}"])) * float(
            header[f"CDELT{axis}"]
        )
        return np.asarray((rest or 0.0) + 1e-6 * offset), rest
    world = _world(header, axis, count)
    if kind.startswith("FREQ"):
        return world * 1e-6, rest
    if kind.startswith("WAVE"):
        return axis_mhz(world, "m", name, choices), rest
    used = choices.rest_mhz or rest
    if used is None:
        raise ValueError(
            f"{name}: a velocity axis ({kind}) without RESTFRQ; state the rest frequency, such as --rest 230.538GHz"
        )
    convention = choices.convention or _CONVENTION[kind[:4]] or RADIO
    if kind.startswith("VELO-") and choices.convention is None:
        # AIPS: 256 is added for radio velocities
        convention = RADIO if int(header.get("VELREF", 257)) > 256 else OPTICAL
    return velocity_to_frequency(world * 1e-3, used, convention), used


def _is_class(header: Mapping[str, Any], kind: str) -> bool:
    """CLASS: a frequency axis whose reference value is an offset from RESTFREQ."""
    rest = header.get("RESTFREQ")
    return bool(kind.startswith("FREQ") and rest and abs(float(header.get("CRVAL1", rest))) < 0.1 * float(rest))


def _world(header: Mapping[str, Any], axis: int, count: int) -> Floats:
    """The axis in SI units by the header's world coordinates."""
    from astropy.wcs import WCS, FITSFixedWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FITSFixedWarning)  # old keywords and dates are translated
        spectral = WCS(header, naxis=[axis])
    pixels = np.arange(count, dtype=np.float64)
    return np.asarray(spectral.wcs_pix2world(pixels[:, None], 0)[:, 0], dtype=np.float64)


def _read_table(hdu: Any, name: str, choices: ReadChoices) -> ObservedSpectrum:
    """A table with a spectrum in each row (SDFITS), or with a channel in each row."""
    columns = {str(column.name).upper(): column for column in hdu.columns}
    data = next((key for key in _DATA if key in columns), None)
    if data is not None and np.asarray(hdu.data[columns[data].name]).ndim > 1:
        return _read_rows(hdu, columns, data, name, choices)
    return _read_channels(hdu, name, choices)


def _read_rows(hdu: Any, columns: Mapping[str, Any], data: str, name: str, choices: ReadChoices) -> ObservedSpectrum:
    count = len(hdu.data)
    if count > 1 and choices.row is None:
        raise ValueError(f"{name}: a table of {count} spectra; state which, such as --row 1")
    row = (choices.row or 1) - 1
    if not 0 <= row < count:
        raise ValueError(f"{name}: row {row + 1}: the table has {count} spectra, counted from 1")
    header = dict(hdu.header) | {
        key: _plain(hdu.data[column.name][row]) for key, column in columns.items() if key != data
    }
    values = np.asarray(hdu.data[columns[data].name][row], dtype=np.float64).reshape(-1)
    header.setdefault("CTYPE1", "FREQ")
    for key in ("CRVAL1", "CDELT1", "CRPIX1"):
        if key not in header:
            raise ValueError(f"{name}: row {row + 1} has no {key}, neither as a column nor as a keyword")
    step = np.arange(1, len(values) + 1) - float(header["CRPIX1"])
    axis = float(header["CRVAL1"]) + step * float(header["CDELT1"])
    rest = float(header["RESTFREQ"]) * 1e-6 if header.get("RESTFREQ") else choices.rest_mhz
    kind = str(header["CTYPE1"]).upper()
    if kind.startswith("FREQ"):
        frequency = 1e-6 * axis + ((rest or 0.0) if _is_class(header, kind) else 0.0)
    else:
        convention = choices.convention or (
            OPTICAL if str(header.get("VELDEF", "")).upper().startswith("OPTI") else RADIO
        )
        if rest is None:
            raise ValueError(f"{name}: a velocity axis ({kind}) without RESTFREQ; state the rest frequency")
        frequency = velocity_to_frequency(axis * 1e-3, rest, convention)
    unit = columns[data].unit or header.get("BUNIT") or header.get("TUNIT")
    return _spectrum(np.asarray(frequency), values, header, rest, unit, name, choices)


def _read_channels(hdu: Any, name: str, choices: ReadChoices) -> ObservedSpectrum:
    by_name = {str(column.name).lower(): column for column in hdu.columns}
    axis, flux = _first(by_name, _AXES), _first(by_name, _FLUX)
    if axis is None or flux is None:
        raise ValueError(
            f"{name}: a table with columns {', '.join(by_name)}; expected one of {', '.join(_AXES)} and one of {', '.join(_FLUX)}"
        )
    unit = choices.axis_unit or axis.unit
    if not unit:
        raise ValueError(f"{name}: column {axis.name} has no unit (TUNIT); state it, such as --axis-unit GHz")
    header, noise = hdu.header, _first(by_name, _NOISE)
    rest = float(header["RESTFRQ"]) * 1e-6 if header.get("RESTFRQ") else choices.rest_mhz
    frequency = axis_mhz(hdu.data[axis.name], str(unit), name, choices, rest)
    sigma = None if noise is None else np.asarray(hdu.data[noise.name], dtype=np.float64)
    return _spectrum(
        frequency, np.asarray(hdu.data[flux.name], dtype=np.float64), header, rest, flux.unit, name, choices, sigma
    )


def _first(columns: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    return next((columns[name] for name in names if name in columns), None)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _spectrum(
    frequency: Floats,
    values: Floats,
    header: Mapping[str, Any],
    rest: float | None,
    unit: Any,
    name: str,
    choices: ReadChoices,
    noise: Floats | None = None,
) -> ObservedSpectrum:
    """The spectrum with what the header states of frame, beam and object."""
    chosen, factor = intensity_unit(choices.unit or (None if unit is None else str(unit)), name)
    selected = {
        key: _plain(header[key])
        for key in ("OBJECT", "TELESCOP", "LINE", "VELO-LSR", "VLSR", "VELDEF", "DATE-OBS")
        if key in header
    }
    notes = []
    frame = choices.frame or rest_frame(header)
    if frame == "TOPOCENT":
        notes.append("frequencies are topocentric: the motion of the Earth is in the velocities")
    if choices.noise is not None:
        noise = np.full(len(values), choices.noise)
    return observed_spectrum(
        frequency,
        values * factor,
        noise=None if noise is None else noise * factor,
        source=name,
        unit=chosen,
        rest_mhz=rest,
        frame=frame,
        beam_arcsec=read_beam(header, choices),
        notes=notes,
        header={key.lower().replace("-", "_"): value for key, value in selected.items()},
    )


def read_beam(header: Mapping[str, Any], choices: ReadChoices) -> tuple[float, float] | None:
    """Full widths of the beam as stated by the user, else by the header."""
    if choices.beam_arcsec is not None or not (header.get("BMAJ") and header.get("BMIN")):
        return choices.beam_arcsec
    return float(header["BMAJ"]) * 3600, float(header["BMIN"]) * 3600


def rest_frame(header: Mapping[str, Any]) -> str:
    """SPECSYS, else the end of CTYPE, else that of CLASS, which moves with the source."""
    if header.get("SPECSYS"):
        return str(header["SPECSYS"]).strip()
    for number in range(1, int(header.get("NAXIS", 1)) + 1):
        kind = str(header.get(f"CTYPE{number}", "")).upper().rstrip()
        for end, frame in _FRAMES.items():
            if kind[:4] in _CONVENTION and kind.endswith(end):
                return frame
    if str(header.get("VELDEF", "")).upper().endswith("LSR"):
        return "LSRK"
    return "SOURCE" if "VELO-LSR" in header else "unknown"
