"""Spectral axes and intensity scales: from what a file states to MHz and to the units of `ObservedSpectrum`.

    radio     ν = ν_0 (1 - v/c)          optical   ν = ν_0/(1 + v/c)        relativistic   ν = ν_0 √((c - v)/(c + v))

E. W. Greisen, M. R. Calabretta, F. G. Valdes, S. L. Allen, Astron. Astrophys. 446, 747 (2006), the spectral coordinates of FITS.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.observed.spectrum import ABSORBANCE, JANSKY_PER_BEAM, KELVIN, VOLT

RADIO, OPTICAL, RELATIVISTIC = "radio", "optical", "relativistic"
CONVENTIONS = (RADIO, OPTICAL, RELATIVISTIC)
_C_KM_S = units.SPEED_OF_LIGHT_M_PER_S / 1e3
AXIS_UNITS = {
    "hz": 1e-6, "khz": 1e-3, "mhz": 1.0, "ghz": 1e3, "thz": 1e6, "cm-1": units.MHZ_PER_CM,
    "cm^-1": units.MHZ_PER_CM, "1/cm": units.MHZ_PER_CM,
}  # fmt: skip
_VELOCITY_UNITS = {
    "km/s": 1.0,
    "m/s": 1e-3,
    "km s-1": 1.0,
    "m s-1": 1e-3,
    "km.s-1": 1.0,
    "km / s": 1.0,
    "m / s": 1e-3,
    "km s^-1": 1.0,
}
_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "nm": 1e-9, "angstrom": 1e-10}
INTENSITIES = {
    "k": (KELVIN, 1.0), "mk": (KELVIN, 1e-3), "k(ta*)": (KELVIN, 1.0), "k(tmb)": (KELVIN, 1.0), "ta*": (KELVIN, 1.0), "tmb": (KELVIN, 1.0),
    "jy/beam": (JANSKY_PER_BEAM, 1.0), "mjy/beam": (JANSKY_PER_BEAM, 1e-3), "jybeam-1": (JANSKY_PER_BEAM, 1.0),
    "mjybeam-1": (JANSKY_PER_BEAM, 1e-3), "beam-1jy": (JANSKY_PER_BEAM, 1.0),
    "absorbance": (ABSORBANCE, 1.0), "v": (VOLT, 1.0), "mv": (VOLT, 1e-3),
}  # fmt: skip


@dataclass(frozen=True)
class ReadChoices:
    """Settings that complete or replace those of a file.

    axis_unit, unit: of frequency (or velocity) and intensity. rest_mhz: of a velocity axis. convention: of velocities. frame: of the
    spectrum. noise: of a channel, in the unit of the file. beam_arcsec: two full widths. row: of a table of several spectra, from 1.
    pixel: of a cube, x and y from 1.
    """

    axis_unit: str | None = None
    unit: str | None = None
    rest_mhz: float | None = None
    convention: str | None = None
    frame: str | None = None
    noise: float | None = None
    beam_arcsec: tuple[float, float] | None = None
    row: int | None = None
    pixel: tuple[int, int] | None = None


def velocity_to_frequency(velocity_km_s: Any, rest_mhz: float, convention: str = RADIO) -> Floats:
    """Frequencies in MHz of velocities; ValueError for an unknown convention.

    >>> [round(float(velocity_to_frequency(1000.0, 1e5, convention)), 3) for convention in CONVENTIONS]
    [99666.436, 99667.545, 99666.99]
    """
    beta = np.asarray(velocity_km_s, dtype=np.float64) / _C_KM_S
    if convention == RADIO:
        return np.asarray(rest_mhz * (1 - beta))
    if convention == OPTICAL:
        return np.asarray(rest_mhz / (1 + beta))
    if convention == RELATIVISTIC:
        return np.asarray(rest_mhz * np.sqrt((1 - beta) / (1 + beta)))
    raise ValueError(f"velocity convention {convention!r}: known are {', '.join(CONVENTIONS)}")


def axis_mhz(values: Any, unit: str, where: str, choices: ReadChoices, rest_mhz: float | None = None) -> Floats:
    """A spectral axis in MHz; ValueError unless its unit is of frequency, velocity (with a rest frequency) or length."""
    text = " ".join(unit.lower().split())
    numbers = np.asarray(values, dtype=np.float64)
    if text in AXIS_UNITS:
        return np.asarray(numbers * AXIS_UNITS[text])
    if text in _VELOCITY_UNITS:
        rest = choices.rest_mhz or rest_mhz
        if rest is None:
            raise ValueError(f"{where}: velocities without a rest frequency; state it, such as --rest 230.538GHz")
        return velocity_to_frequency(numbers * _VELOCITY_UNITS[text], rest, choices.convention or RADIO)
    if text in _LENGTH_UNITS:
        return np.asarray(units.SPEED_OF_LIGHT_M_PER_S * 1e-6 / (numbers * _LENGTH_UNITS[text]))
    accepted = ", ".join([*AXIS_UNITS, *list(_VELOCITY_UNITS)[:2], *_LENGTH_UNITS])
    raise ValueError(f"{where}: spectral axis in {unit!r}; known units are {accepted}")


def intensity_unit(text: str | None, where: str) -> tuple[str, float]:
    """The unit of `ObservedSpectrum` and the factor to it; ValueError for a missing or unknown unit.

    >>> intensity_unit("mJy/beam", "a file")
    ('Jy/beam', 0.001)
    """
    if not text or not text.strip():
        raise ValueError(f"{where}: no unit of intensity; state it, such as --unit K")
    key = re.sub(r"[\s*]+", "", text.lower().replace("ta*", "ta")).replace("(ta)", "").replace("(tmb)", "")
    key = {"ta": "k", "tmb": "k", "ktmb": "k", "kta": "k"}.get(key, key)
    if key not in INTENSITIES:
        raise ValueError(f"{where}: intensity in {text!r}; known units are K, mK, Jy/beam, mJy/beam, absorbance, V, mV")
    return INTENSITIES[key]


def is_unit(text: str) -> bool:
    """Whether a text is a unit of a spectral axis or of an intensity.

    >>> is_unit("km/s"), is_unit("K (Tmb)"), is_unit("30 arcsec")
    (True, True, False)
    """
    with suppress(ValueError):
        return bool(intensity_unit(text, ""))
    return " ".join(text.lower().split()) in {*AXIS_UNITS, *_VELOCITY_UNITS, *_LENGTH_UNITS}
