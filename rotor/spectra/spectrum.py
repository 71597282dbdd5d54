"""Spectra: lines with a shape, on a frequency grid.

    σ(ν) = Σ_i I_i s_i(ν - ν_i),     ∫ s_i dν = 1

with I_i the integrated absorption in nm² MHz, so that σ is the absorption cross section of one molecule in nm².
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.spectra.lines import Lines
from rotor.spectra.profiles import doppler_fwhm, gaussian, gaussian_reach, lorentzian, lorentzian_reach, voigt
from rotor.table import Table

# Fraction of the area of a line that may lie outside its computed points: 3 widths for a Gaussian, but
# 3183 for a Lorentzian, whose wings fall as 1/x².
OUTSIDE = {"gaussian": 1e-12, "lorentzian": 1e-4, "voigt": 1e-4}
PIECE = 1_000_000  # points computed at a time, to bound memory
MOST_POINTS = 20_000_000  # of a grid that resolves every line

# a resolving grid has steps of a fortieth of the width at a centre, and of a tenth of the distance far from it
_STEP = 0.1
_BACKGROUND = 2001  # evenly spaced points in addition


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum(Table):
    """Intensity on a grid of frequencies.

    frequency_mhz, intensity: (n,) arrays. unit: of the intensity: "nm^2" for a cross section,
    "optical depth" for a layer of gas (`opacity`). temperature_k: of the gas.
    profile, fwhm_mhz: line shape and width, None for the Doppler width. outside: fraction of the area of each
    line that may be missing far from its centre. lines: source of the spectrum; None for a spectrum not computed from lines.
    """

    frequency_mhz: Floats
    intensity: Floats
    unit: str = "nm^2"
    temperature_k: float | None = None
    profile: str = ""
    fwhm_mhz: float | None = None
    outside: float = 0.0
    lines: Lines | None = None

    def __post_init__(self) -> None:
        if self.frequency_mhz.ndim != 1 or self.frequency_mhz.shape != self.intensity.shape:
            shapes = f"{self.frequency_mhz.shape} and {self.intensity.shape}"
            raise ValueError(f"frequencies and intensities of shapes {shapes}: both must be (n,)")

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    @property
    def provenance(self) -> dict[str, Any]:
        """Origin of the spectrum: its lines, their shape, the unit."""
        return (self.lines.provenance if self.lines is not None else {}) | {
            "profile": self.profile,
            "fwhm_mhz": self.fwhm_mhz,
            "unit": self.unit,
            "outside": self.outside,
            "rows": len(self),
        }

    @classmethod
    def from_lines(
        cls,
        lines: Lines,
        grid_mhz: ArrayLike,
        *,
        fwhm_mhz: float | None = None,
        profile: str = "gaussian",
        outside: float | None = None,
    ) -> Spectrum:
        """Absorption cross section in nm² of lines on a grid; each line has the area of its integrated absorption.

        Parameters
        ----------
        lines : Lines
            With `lines.top.mass_u` for a Doppler width.
        grid_mhz : (n,) array
            Rising frequencies, evenly spaced or not; `resolving_grid` makes one.
        fwhm_mhz : float, optional
            Full width at half maximum of the Gaussian (by default the Doppler width) or of the Lorentzian.
        profile : "gaussian", "lorentzian" or "voigt"
            A Voigt profile combines the Doppler width with a Lorentzian of `fwhm_mhz`.
        outside : float, optional
            Each line is computed out to where this fraction of its area remains; by default 1e-12 for a Gaussian and 1e-4 for the
            others. It bounds the relative error of an area. The error of the intensity at a point is below the sum
            of I_i s_i(reach) over the lines i further away than their reach: at most 2.5e-8 of their peaks.

        Returns
        -------
        Spectrum
            (n,) in nm².

        Raises
        ------
        ValueError
            For a grid that does not rise, a width not above 0, an unknown shape, a Doppler width without a mass.

        Notes
        -----
        Neglected: Dicke narrowing, line mixing, and the change of the radiation factor across a line.

        >>> from rotor.spectra.lines import line_list
        >>> from rotor.tops.top import Top
        >>> lines = line_list(Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0)), jmax=1)
        >>> grid = np.linspace(115270, 115274, 401)
        >>> spectrum = Spectrum.from_lines(lines, grid, fwhm_mhz=0.5)
        >>> round(float(np.trapezoid(spectrum.intensity, grid) / lines.intensity_nm2_mhz[0]), 3)
        1.0
        """
        grid = _rising(grid_mhz)
        shape, outside = _shape(lines, profile, fwhm_mhz), _fraction(profile, outside)
        intensity = _summed(grid, lines.frequency_mhz, lines.intensity_nm2_mhz, shape, outside)
        return cls(grid, intensity, "nm^2", lines.temperature_k, profile, fwhm_mhz, outside, lines)

    @property
    def columns(self) -> dict[str, Floats]:
        """Frequency and intensity by their names with unit."""
        name = {"nm^2": "cross_section_nm2", "optical depth": "optical_depth"}.get(self.unit, "intensity")
        return {"frequency_mhz": self.frequency_mhz, name: self.intensity}


def resolving_grid(
    lines: Lines,
    *,
    fwhm_mhz: float | None = None,
    profile: str = "gaussian",
    range_mhz: tuple[float, float] | None = None,
    outside: float | None = None,
) -> Floats:
    """Frequencies that resolve each line: dense at its centre, sparser away from it, with evenly spaced points in between.

    The trapezoidal rule on these points gives the area of a line within 0.2 %.

    Parameters
    ----------
    lines : Lines
        With the mass of their top for a Doppler width.
    fwhm_mhz : float, optional
        Full width at half maximum, as in `Spectrum.from_lines`.
    profile : "gaussian", "lorentzian" or "voigt", optional
        Line shape.
    range_mhz : (float, float), optional
        First and last frequency; by default the range of all lines with their reach.
    outside : float, optional
        Fraction of a line's area beyond its reach, as in `Spectrum.from_lines`.

    Returns
    -------
    (n,) array
        MHz, rising.

    Raises
    ------
    ValueError
        For a range that does not rise, and for a grid of more than 20 million points.
    """
    shape = _shape(lines, profile, fwhm_mhz)
    width, reach = shape.fwhm(), shape.reach(_fraction(profile, outside))
    first, last = _ends(lines, reach) if range_mhz is None else range_mhz
    if not 0 <= first < last < float("inf"):
        raise ValueError(f"range from {first} to {last} MHz: expected two rising, finite frequencies")
    # lines outside whose wings reach in count too
    near = (lines.frequency_mhz > first - reach) & (lines.frequency_mhz < last + reach)
    arm = _arm(float((reach / width).max(initial=1.0)))
    points = near.sum() * len(arm)
    if points > MOST_POINTS:
        raise ValueError(
            f"{near.sum()} lines need a grid of {points / 1e6:.0f} million points, more than {MOST_POINTS / 1e6:.0f}; "
            "choose a narrower range, a higher cut, or sticks"
        )
    follow = lines.frequency_mhz[near, None] + width[near, None] * arm
    grid = np.unique(np.concatenate([np.linspace(first, last, _BACKGROUND), follow.ravel()]))
    return np.asarray(grid[(grid >= first) & (grid <= last)])


def reach_at(
    frequency_mhz: Sequence[float], lines: Lines, *, profile: str, fwhm_mhz: float | None
) -> tuple[float, ...]:
    """Reach in MHz of the profile of a line at each frequency; `lines` gives temperature and mass for the Doppler width.

    >>> from rotor.spectra.lines import line_list
    >>> from rotor.tops.top import Top
    >>> lines = line_list(Top.from_constants("B=57635.968 MHz", dipole_abc_debye=(0.11, 0, 0)), jmax=1)
    >>> [round(reach, 1) for reach in reach_at([1e5], lines, profile="gaussian", fwhm_mhz=10.0)]
    [30.3]
    """
    probes = replace(lines, frequency_mhz=np.asarray(frequency_mhz, dtype=np.float64))
    return tuple(_shape(probes, profile, fwhm_mhz).reach(_fraction(profile, None)).tolist())


def _arm(reach: float) -> Floats:
    """Distances from a centre in widths: increasing steps out to the reach, and a point just beyond it."""
    # steps grow with the distance from a centre
    half = 0.25 * np.sinh(np.arange(_STEP, np.arcsinh(4 * reach), _STEP))
    # one point on either side of the edge, where a profile is cut
    half = np.append(half, [reach * (1 - 1e-9), reach * (1 + 1e-9)])
    return np.concatenate([-half[::-1], [0.0], half])


def _ends(lines: Lines, reach: Floats) -> tuple[float, float]:
    """First and last frequency at which a line contributes."""
    if not len(lines):
        raise ValueError("a grid without lines needs a range")
    first, last = (lines.frequency_mhz - reach).min(), (lines.frequency_mhz + reach).max()
    return max(float(first), 0.0), float(last)


@dataclass(frozen=True)
class _Shape:
    """Widths (lines,) of the Gaussian and the Lorentzian part of each line; None for a missing part."""

    gaussian: Floats | None
    lorentzian: Floats | None

    def at(self, offset: Floats, rows: NDArray[np.int64]) -> Floats:
        """The shape of the lines `rows` at these distances from their centres."""
        if self.lorentzian is None:
            assert self.gaussian is not None
            return gaussian(offset, self.gaussian[rows])
        if self.gaussian is None:
            return lorentzian(offset, self.lorentzian[rows])
        return voigt(offset, self.gaussian[rows], self.lorentzian[rows])

    def reach(self, outside: float) -> Floats:
        """Distance from the centre of each line within which all but `outside` of its area lies.

        A Voigt profile is the density of a sum x + y: |x + y| > a + b needs |x| > a or |y| > b, half of `outside` each.
        """
        share = outside if self.gaussian is None or self.lorentzian is None else outside / 2
        reach = 0.0 if self.gaussian is None else gaussian_reach(self.gaussian, share)
        return np.asarray(reach + (0.0 if self.lorentzian is None else lorentzian_reach(self.lorentzian, share)))

    def fwhm(self) -> Floats:
        """Full width of each line; for a Voigt profile accurate to 0.02 %.

        0.5346 w_L + √(0.2166 w_L² + w_G²): J. J. Olivero and R. L. Longbothum, J. Quant. Spectrosc. Radiat. Transf. 17,
        233 (1977).
        """
        if self.gaussian is None:
            assert self.lorentzian is not None
            return self.lorentzian
        if self.lorentzian is None:
            return self.gaussian
        # width of a Voigt profile: J. J. Olivero and R. L. Longbothum, JQSRT 17 (1977) 233
        return np.asarray(0.5346 * self.lorentzian + np.sqrt(0.2166 * self.lorentzian**2 + self.gaussian**2))


def line_widths(lines: Lines, profile: str, fwhm_mhz: float | None) -> Floats:
    """Full width at half maximum (lines,) in MHz for a profile as in `Spectrum.from_lines`."""
    return _shape(lines, profile, fwhm_mhz).fwhm()


def line_peaks(lines: Lines, profile: str, fwhm_mhz: float | None) -> Floats:
    """Value (lines,) in 1/MHz of the shape of unit area at the centre of each line."""
    return _shape(lines, profile, fwhm_mhz).at(np.zeros(len(lines)), np.arange(len(lines)))


def _shape(lines: Lines, profile: str, fwhm_mhz: float | None) -> _Shape:
    if profile not in OUTSIDE:
        raise ValueError(f"profile {profile!r} is none of {', '.join(OUTSIDE)}")
    if fwhm_mhz is not None and not 0 < fwhm_mhz < float("inf"):
        raise ValueError(f"full width at half maximum {fwhm_mhz} MHz: expected a finite number above 0")
    fixed = None if fwhm_mhz is None else np.full(len(lines), float(fwhm_mhz))
    if profile == "gaussian":
        return _Shape(_doppler(lines) if fixed is None else fixed, None)
    if fixed is None:
        raise ValueError(f"profile {profile!r}: expected the width of the Lorentzian, fwhm_mhz")
    return _Shape(_doppler(lines) if profile == "voigt" else None, fixed)


def _fraction(profile: str, outside: float | None) -> float:
    fraction = OUTSIDE[profile] if outside is None else outside
    if not 0 < fraction < 1:
        raise ValueError(f"outside = {outside}: expected a fraction of the area between 0 and 1")
    return fraction


def _doppler(lines: Lines) -> Floats:
    if lines.top.mass_u is None:
        raise ValueError("a Doppler width needs a mass, which constants alone do not have; give fwhm_mhz or a geometry")
    return doppler_fwhm(lines.frequency_mhz, lines.temperature_k, lines.top.mass_u)


def _rising(grid_mhz: ArrayLike) -> Floats:
    grid = np.asarray(grid_mhz, dtype=float)
    if grid.ndim != 1 or not len(grid) or not np.isfinite(grid).all() or not (np.diff(grid) > 0).all():
        raise ValueError(f"a grid of shape {grid.shape}: expected rising, finite frequencies (n,)")
    return grid


def _summed(grid: Floats, centres: Floats, areas: Floats, shape: _Shape, outside: float) -> Floats:
    """Sum of area × shape on the grid, each line over the points within its reach."""
    reach = shape.reach(outside)
    first = np.searchsorted(grid, centres - reach, side="left")
    count = np.searchsorted(grid, centres + reach, side="right") - first
    total = np.zeros(len(grid))
    for rows in _pieces(count):
        line = np.repeat(rows, count[rows])
        begin = np.repeat(first[rows] - np.cumsum(count[rows]) + count[rows], count[rows])
        point = begin + np.arange(len(line))
        value = areas[line] * shape.at(grid[point] - centres[line], line)
        low, high = point.min(), point.max() + 1
        # bincount adds points that coincide
        total[low:high] += np.bincount(point - low, weights=value, minlength=high - low)
    return total


def _pieces(count: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Rows of lines that have points, in pieces of about `PIECE` points."""
    rows = np.flatnonzero(count)
    cuts = np.flatnonzero(np.diff(np.cumsum(count[rows]) // PIECE)) + 1
    yield from (piece for piece in np.split(rows, cuts) if len(piece))
