"""Lines as a radio telescope sees them: brightness temperature of a layer of gas in local thermodynamic equilibrium.

    T_B(ν) = f [J_ν(T_ex) - J_ν(T_bg)] (1 - e^-τ(ν)),        J_ν(T) = (hν/k) / (e^(hν/kT) - 1)
    τ(ν)   = N Σ_i I_i(T_ex) φ_i(ν)                            I_i with stimulated emission (`spectra.intensity`), ∫φ dν = 1
    φ_i    a Gaussian at ν_i (1 - v/c), of full width ν_i Δv/c at half maximum

from the equation of radiative transfer through a uniform layer, the background subtracted, as J. G. Mangum and Y. L. Shirley,
Publ. Astron. Soc. Pac. 127 (2015) 266 (arXiv:1501.01703) set it out. N: molecules in the line of sight, all levels and spin
species together, Q with the same spin weights as the lines. Velocities follow the radio convention v = c (1 - ν/ν_rest).
Neglected: departures from one excitation temperature, scattering, and structure of the source within the beam but for f.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.spectra.lines import Lines
from rotor.spectra.opacity import NM2_IN_CM2
from rotor.spectra.profiles import gaussian
from rotor.table import Table

BACKGROUND_K = 2.725
_KM_PER_S = units.SPEED_OF_LIGHT_M_PER_S / 1e3
_REACH = 4.0  # full widths at half maximum on either side: a Gaussian has fallen to 5e-20 of its peak

# GHz; bands 3 to 9: ESO, ALMA System Specifications (eso.info/sci/facilities/alma/observing/specifications); bands 1, 2 and 10:
# IRAM ARC, "ALMA in short" (web-archives.iram.fr/IRAMFR/ARC.1/alma-short.html), where bands 1 and 2 are those planned
BANDS_GHZ: dict[str, tuple[float, float]] = {
    "ALMA1": (31.0, 45.0), "ALMA2": (67.0, 90.0), "ALMA3": (84.0, 116.0), "ALMA4": (125.0, 169.0), "ALMA5": (163.0, 211.0),
    "ALMA6": (211.0, 275.0), "ALMA7": (275.0, 373.0), "ALMA8": (385.0, 500.0), "ALMA9": (602.0, 720.0), "ALMA10": (787.0, 950.0),
}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """A uniform layer of gas in front of a uniform background.

    column_per_cm2: molecules in the line of sight. excitation_k: of rotation. background_k: behind the layer. filling: fraction of the
    beam that the layer covers. velocity_km_s: radio convention, receding positive. fwhm_km_s: full width of the lines
    at half maximum. ValueError for what is not above 0, a filling above 1 and a velocity beyond that of light.
    """

    column_per_cm2: float
    excitation_k: float
    fwhm_km_s: float
    velocity_km_s: float = 0.0
    background_k: float = BACKGROUND_K
    filling: float = 1.0

    def __post_init__(self) -> None:
        for name in ("column_per_cm2", "excitation_k", "fwhm_km_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} = {getattr(self, name)}: expected a finite number above 0")
        if not (math.isfinite(self.background_k) and self.background_k >= 0):
            raise ValueError(f"background_k = {self.background_k}: expected a finite temperature of 0 K or more")
        if not 0 < self.filling <= 1:
            raise ValueError(f"filling = {self.filling}: expected a fraction above 0 and up to 1")
        if not abs(self.velocity_km_s) < _KM_PER_S:
            raise ValueError(
                f"velocity_km_s = {self.velocity_km_s}: expected less than the speed of light, {_KM_PER_S:.3f}"
            )


@dataclass(frozen=True, eq=False, repr=False)
class Emission(Table):
    """Optical depth and brightness temperature (n,) on a grid of frequencies (n,), and the source they belong to."""

    frequency_mhz: Floats
    optical_depth: Floats
    brightness_k: Floats
    source: Source

    @property
    def provenance(self) -> dict[str, Any]:
        """The source, by the names of its fields."""
        return {**asdict(self.source), "rows": len(self)}

    @property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """frequency_mhz, optical_depth, brightness_k."""
        return {name: getattr(self, name) for name in ("frequency_mhz", "optical_depth", "brightness_k")}

    def velocity_km_s(self, rest_mhz: float) -> Floats:
        """The grid as velocities (n,) of a line at rest frequency `rest_mhz`, radio convention."""
        return radio_velocity_km_s(self.frequency_mhz, rest_mhz)


def planck_k(frequency_mhz: ArrayLike, temperature_k: float) -> Floats:
    """J_ν(T) = (hν/k)/(e^(hν/kT) - 1) in K, the Rayleigh-Jeans temperature of a black body; 0 at 0 K.

    >>> round(float(planck_k(115271.2, 2.725)), 4)
    0.8363
    """
    photon_k = np.asarray(frequency_mhz, dtype=np.float64) / units.MHZ_PER_K
    if temperature_k == 0:
        return np.zeros_like(photon_k)
    return np.asarray(photon_k / np.expm1(photon_k / temperature_k))


def radio_velocity_km_s(frequency_mhz: ArrayLike, rest_mhz: float) -> Floats:
    """v = c (1 - ν/ν_rest) in km/s, receding positive.

    >>> round(float(radio_velocity_km_s(115271.202 * (1 - 1e-4), 115271.202)), 6)
    29.979246
    """
    return np.asarray(_KM_PER_S * (1 - np.asarray(frequency_mhz, dtype=np.float64) / rest_mhz))


def band_mhz(name: str) -> tuple[float, float]:
    """First and last frequency in MHz of a receiver band by its name, such as ALMA6.

    >>> band_mhz("alma6")
    (211000.0, 275000.0)
    """
    try:
        low, high = BANDS_GHZ[name.upper().replace(" ", "")]
    except KeyError:
        raise ValueError(f"band {name!r}: known are {', '.join(BANDS_GHZ)}") from None
    return low * 1e3, high * 1e3


def emission(lines: Lines | Sequence[Lines], source: Source, grid_mhz: ArrayLike) -> Emission:
    """Optical depth and brightness temperature of a source on a grid of frequencies.

    Parameters
    ----------
    lines : Lines or several
        Of one molecule, or of several that share the source's column; at its excitation temperature.
    source : Source
    grid_mhz : (n,) array
        Rising frequencies as they are observed.

    Returns
    -------
    Emission

    Raises
    ------
    ValueError
        For lines at another temperature than the source's, and for a grid that does not rise.

    Examples
    --------
    >>> from rotor.spectra.lines import line_list
    >>> from rotor.tops.top import Top
    >>> co = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0))
    >>> thick = Source(column_per_cm2=1e21, excitation_k=20, fwhm_km_s=1.0)
    >>> seen = emission(line_list(co, temperature_k=20, jmax=10), thick, [115271.0, 115271.202])
    >>> bool(abs(seen.brightness_k[1] - (planck_k(115271.202, 20) - planck_k(115271.202, 2.725))) < 1e-6)
    True
    """
    grid = np.asarray(grid_mhz, dtype=np.float64)
    if grid.ndim != 1 or not np.isfinite(grid).all() or (np.diff(grid) <= 0).any() or not len(grid) or grid[0] <= 0:
        raise ValueError(f"a grid of shape {grid.shape}: expected rising, finite frequencies (n,) above 0")
    depth = np.zeros_like(grid)
    for one in [lines] if isinstance(lines, Lines) else lines:
        _refuse_other_temperature(one, source)
        _add_depth(depth, grid, one, source)
    contrast = planck_k(grid, source.excitation_k) - planck_k(grid, source.background_k)
    return Emission(grid, depth, source.filling * contrast * -np.expm1(-depth), source)


def _refuse_other_temperature(lines: Lines, source: Source) -> None:
    if not math.isclose(lines.temperature_k, source.excitation_k, rel_tol=1e-12):
        raise ValueError(
            f"lines at {lines.temperature_k:g} K for an excitation temperature of {source.excitation_k:g} K: make the list at "
            "the temperature of the source"
        )


def _add_depth(depth: Floats, grid: Floats, lines: Lines, source: Source) -> None:
    """N I φ of every line, added in place within `_REACH` widths of its centre."""
    centre = lines.frequency_mhz * (1 - source.velocity_km_s / _KM_PER_S)
    width = centre * source.fwhm_km_s / _KM_PER_S
    area = source.column_per_cm2 * NM2_IN_CM2 * lines.intensity_nm2_mhz
    first = np.searchsorted(grid, centre - _REACH * width)
    last = np.searchsorted(grid, centre + _REACH * width)
    for i in np.flatnonzero((last > first) & (area > 0)):
        here = slice(first[i], last[i])
        depth[here] += area[i] * gaussian(grid[here] - centre[i], width[i])


def source_grid(first_mhz: float, last_mhz: float, source: Source, points_per_width: int = 8) -> Floats:
    """Frequencies from first to last, each `points_per_width` to a line's full width: even in log ν.

    Parameters
    ----------
    first_mhz, last_mhz : float
        Ends of the range, rising and above 0.
    source : Source
        Its full width in km/s is that of the lines.
    points_per_width : int, optional
        Points to a full width at half maximum.

    Returns
    -------
    (n,) array
        MHz, rising.

    Raises
    ------
    ValueError
        For a range that does not rise or does not begin above 0.

    Examples
    --------
    >>> len(source_grid(100e3, 100.1e3, Source(1e14, 10, 1.0)))
    2399
    """
    if not 0 < first_mhz < last_mhz:
        raise ValueError(f"range from {first_mhz} to {last_mhz} MHz: expected two rising frequencies above 0")
    step = source.fwhm_km_s / _KM_PER_S / points_per_width
    count = math.ceil(math.log(last_mhz / first_mhz) / step) + 1
    return np.asarray(np.geomspace(first_mhz, last_mhz, count))
