"""Lines as a radio telescope sees them: brightness temperature of a layer of gas, each molecule at an excitation temperature.

    T_B(ν) = f Σ_m [J_ν(T_m/(1+z_m)) - J_ν(T_bg)] τ_m (1 - e^-τ)/τ       τ = Σ_m τ_m,  J_ν(T) = (hν/k) / (e^(hν/kT) - 1)
    τ_m(ν) = N_m Σ_i I_i(T_m) φ_i(ν (1+z_m))                             I_i with stimulated emission (`spectra.intensity`), ∫φ dν = 1
    φ_i      a Gaussian at the rest frequency ν_i, of full width ν_i Δv/c at half maximum
    1+z_m  = (1+z) / (1 - v_m/c)                                         ν is the observed frequency, ν_i/(1+z_m) at a line

The first line is the equation of radiative transfer through a uniform layer, with the background subtracted, as in J. G. Mangum and
Y. L. Shirley, Publ. Astron. Soc. Pac. 127 (2015) 266 (arXiv:1501.01703). With uniformly mixed molecules its source function is
Σ τ_m J(T_m)/Σ τ_m. A redshift leaves I_ν/ν³ unchanged, so that a black body at T appears as one at T/(1+z): the gas appears at
T_m/(1+z_m), and T_bg is the observed temperature (2.725 K for the cosmic background at any z).
N is the column density of molecules in all levels and spin species; Q has the spin weights of the lines. Velocities follow the radio
convention v = c (1 - ν/ν_rest) in the frame of the redshift z. Widths are those in the source.
Neglected: departures from one excitation temperature, scattering, and structure of the source within the beam except f.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.checks import require_positive
from rotor.spectra.profiles import gaussian
from rotor.table import Table

BACKGROUND_K = 2.725
KM_PER_S = units.SPEED_OF_LIGHT_M_PER_S / 1e3
_REACH = 4.0  # full widths on either side of a line: a Gaussian has fallen to 5e-20 of its peak

# GHz; bands 3 to 9: ESO, ALMA System Specifications (eso.info/sci/facilities/alma/observing/specifications); bands 1, 2 and 10:
# IRAM ARC, "ALMA in short" (web-archives.iram.fr/IRAMFR/ARC.1/alma-short.html), where bands 1 and 2 are those planned
BANDS_GHZ: dict[str, tuple[float, float]] = {
    "ALMA1": (31.0, 45.0), "ALMA2": (67.0, 90.0), "ALMA3": (84.0, 116.0), "ALMA4": (125.0, 169.0), "ALMA5": (163.0, 211.0),
    "ALMA6": (211.0, 275.0), "ALMA7": (275.0, 373.0), "ALMA8": (385.0, 500.0), "ALMA9": (602.0, 720.0), "ALMA10": (787.0, 950.0),
}  # fmt: skip


class LinesAtRest(Protocol):
    """Rest frequencies and integrated absorption (n,) at one temperature: `Lines`, or lines from a catalogue."""

    @property
    def temperature_k(self) -> float:
        """Excitation temperature of the levels."""

    @property
    def frequency_mhz(self) -> Floats:
        """Rest frequencies (n,) in MHz."""

    @property
    def intensity_nm2_mhz(self) -> Floats:
        """Integrated absorption I(T) of a molecule (n,) in nm² MHz."""


@dataclass(frozen=True)
class Source:
    """A uniform layer of gas in front of a uniform background.

    column_per_cm2: molecules in the line of sight. excitation_k: excitation temperature of rotation. fwhm_km_s: full width of the lines at
    half maximum. velocity_km_s: radio convention, receding positive, in the frame of the redshift. background_k: behind the layer, as
    observed. filling: fraction of the beam that the layer covers. redshift: z. Raises ValueError for values out of range.
    """

    column_per_cm2: float
    excitation_k: float
    fwhm_km_s: float
    velocity_km_s: float = 0.0
    background_k: float = BACKGROUND_K
    filling: float = 1.0
    redshift: float = 0.0

    def __post_init__(self) -> None:
        for name in ("column_per_cm2", "excitation_k", "fwhm_km_s"):
            require_positive(name, getattr(self, name))
        if not (math.isfinite(self.background_k) and self.background_k >= 0):
            raise ValueError(f"background_k: {self.background_k:g}: expected a finite temperature of 0 K or more")
        if not 0 < self.filling <= 1:
            raise ValueError(f"filling: {self.filling:g}: expected a fraction above 0 and up to 1")
        if not abs(self.velocity_km_s) < KM_PER_S:
            raise ValueError(
                f"velocity_km_s: {self.velocity_km_s:g}: expected less than the speed of light, {KM_PER_S:.3f}; give a redshift"
            )
        if not (math.isfinite(self.redshift) and self.redshift > -1):
            raise ValueError(f"redshift: {self.redshift:g}: expected a finite number above -1")

    @property
    def frequency_ratio(self) -> float:
        """ν_observed/ν_rest = (1 - v/c)/(1+z)."""
        return (1 - self.velocity_km_s / KM_PER_S) / (1 + self.redshift)


@dataclass(frozen=True, eq=False, repr=False)
class Emission(Table):
    """Optical depth and brightness temperature (n,) on a grid of observed frequencies (n,), and the sources in the layer."""

    frequency_mhz: Floats
    optical_depth: Floats
    brightness_k: Floats
    sources: tuple[Source, ...]

    @property
    def provenance(self) -> dict[str, Any]:
        """The sources, by the names of their fields."""
        return {"sources": [asdict(source) for source in self.sources], "rows": len(self)}

    @property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """frequency_mhz, optical_depth, brightness_k."""
        return {name: getattr(self, name) for name in ("frequency_mhz", "optical_depth", "brightness_k")}

    def velocity_km_s(self, rest_mhz: float) -> Floats:
        """The grid as velocities (n,) of a line at rest frequency `rest_mhz`, radio convention, redshift included."""
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
    return np.asarray(KM_PER_S * (1 - np.asarray(frequency_mhz, dtype=np.float64) / rest_mhz))


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


def emission(
    lines: LinesAtRest | Sequence[LinesAtRest], source: Source | Sequence[Source], grid_mhz: ArrayLike
) -> Emission:
    """Optical depth and brightness temperature of a layer on a frequency grid.

    Parameters
    ----------
    lines : Lines or several
        One list for each molecule in the layer, at the excitation temperature of its source.
    source : Source or several
        One for each list, with the same background, filling and redshift; a single source serves all lists.
    grid_mhz : (n,) array
        Rising observed frequencies.

    Returns
    -------
    Emission

    Raises
    ------
    ValueError
        For lines at another temperature than that of the source, sources that do not form a layer, and a grid that does not rise.

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
    lists = list(lines) if isinstance(lines, Sequence) else [lines]
    sources = (source,) * len(lists) if isinstance(source, Source) else tuple(source)
    require_layer(sources, len(lists))
    parts = [_molecule_emission(molecule, source, grid) for molecule, source in zip(lists, sources, strict=True)]
    return together(parts)


def _molecule_emission(lines: LinesAtRest, source: Source, grid: Floats) -> Emission:
    _refuse_other_temperature(lines, source)
    depth = _optical_depth(grid, lines, source)
    brightness = source.filling * contrast_k(grid, source) * -np.expm1(-depth)
    return Emission(grid, depth, brightness, (source,))


def together(parts: Sequence[Emission]) -> Emission:
    """The layer of several molecules from their separate layers on one grid: T_B = f Σ c_m τ_m (1 - e^-τ)/τ."""
    if len(parts) == 1:
        return parts[0]
    sources = tuple(source for part in parts for source in part.sources)
    grid, depth = parts[0].frequency_mhz, np.sum([part.optical_depth for part in parts], axis=0)
    emitted = np.sum([part.optical_depth * contrast_k(grid, part.sources[0]) for part in parts], axis=0)
    escaping = np.divide(-np.expm1(-depth), depth, out=np.ones_like(depth), where=depth > 0)
    return Emission(grid, depth, sources[0].filling * emitted * escaping, sources)


def contrast_k(frequency_mhz: ArrayLike, source: Source) -> Floats:
    """J_ν(T_ex/(1+z)) - J_ν(T_bg) at observed frequencies, in K: the brightness of an opaque layer that fills the beam.

    >>> round(float(contrast_k(115271.2, Source(1e14, 10.0, 1.0))), 3)
    6.651
    """
    seen_k = source.excitation_k * source.frequency_ratio
    return planck_k(frequency_mhz, seen_k) - planck_k(frequency_mhz, source.background_k)


def require_layer(sources: Sequence[Source], count: int) -> None:
    """Raise ValueError unless the sources form one layer of `count` molecules."""
    if not count or len(sources) != count:
        raise ValueError(f"sources: {len(sources)} given for {count} molecules; expected one for each")
    for name in ("background_k", "filling", "redshift"):
        if len({getattr(source, name) for source in sources}) > 1:
            raise ValueError(
                f"{name}: {[getattr(source, name) for source in sources]}; molecules of one layer share it"
            )


def _refuse_other_temperature(lines: LinesAtRest, source: Source) -> None:
    if not math.isclose(lines.temperature_k, source.excitation_k, rel_tol=1e-12):  # the same number but for round-off
        raise ValueError(
            f"lines at {lines.temperature_k:g} K for an excitation temperature of {source.excitation_k:g} K: make the list at "
            "the temperature of the source"
        )


def _optical_depth(grid: Floats, lines: LinesAtRest, source: Source) -> Floats:
    """Optical depth N Σ I φ (n,); each line extends to `_REACH` widths from its centre."""
    depth = np.zeros_like(grid)
    rest = grid / source.frequency_ratio
    centre = lines.frequency_mhz
    width = centre * source.fwhm_km_s / KM_PER_S
    area = source.column_per_cm2 * units.NM2_IN_CM2 * lines.intensity_nm2_mhz
    first = np.searchsorted(rest, centre - _REACH * width)
    last = np.searchsorted(rest, centre + _REACH * width)
    for i in np.flatnonzero((last > first) & (area > 0)):
        here = slice(first[i], last[i])
        depth[here] += area[i] * gaussian(rest[here] - centre[i], width[i])
    return depth


def peak_depth(lines: LinesAtRest, source: Source) -> Floats:
    """Optical depth (n,) at the centre of each line alone: N I 2 √(ln 2/π)/Δν."""
    width = lines.frequency_mhz * source.fwhm_km_s / KM_PER_S
    area = source.column_per_cm2 * units.NM2_IN_CM2 * lines.intensity_nm2_mhz
    return np.asarray(area * gaussian(np.zeros_like(width), width))


def source_grid(first_mhz: float, last_mhz: float, source: Source, points_per_width: int = 8) -> Floats:
    """Frequencies from first to last with `points_per_width` points to the width of a line, evenly spaced in log ν.

    Parameters
    ----------
    first_mhz, last_mhz : float
        Ends of the range, rising and above 0.
    source : Source
        Its full width in km/s is the width of the lines.
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
        For a range that does not rise or does not start above 0.
    Examples
    --------
    >>> len(source_grid(100e3, 100.1e3, Source(1e14, 10, 1.0)))
    2399
    """
    if not 0 < first_mhz < last_mhz:
        raise ValueError(f"range from {first_mhz} to {last_mhz} MHz: expected two rising frequencies above 0")
    step = source.fwhm_km_s / KM_PER_S / points_per_width
    count = math.ceil(math.log(last_mhz / first_mhz) / step) + 1
    return np.asarray(np.geomspace(first_mhz, last_mhz, count))
