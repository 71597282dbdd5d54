"""Spectrum of a sample in an inhomogeneous field: lines broadened by the distribution of fields.

The frequency ν(E) and intensity I(E) of a line, computed at a few fields, are interpolated by cubic splines in E. Its spectrum is

    ∫ p(E) I(E) s(ν - ν(E)) dE,

with the density p of fields in the sample and the profile s of a line. The integral is a sum over fields that are so close that ν(E)
changes by less than a quarter of the width from one to the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.checks import require_positive
from rotor.spectra.fields.lines import FieldLines
from rotor.spectra.profiles import gaussian, lorentzian
from rotor.spectra.spectrum import Spectrum

REACH = 4.0  # extent of a Gaussian distribution, in standard deviations
LEAST_FIELDS = 33  # smallest number of fields of a distribution
MOST_FIELDS = 200_000  # largest number of fields of a line
STEP = 0.25  # largest change of ν(E) between two fields, relative to the width


@dataclass(frozen=True)
class FieldDistribution:
    """Distribution of the field over a sample: a density (n,) at fields (n,) in kV/cm, piecewise linear, of unit area.

    Raises ValueError for fewer than two fields, fields that do not rise, and a density that is negative or zero everywhere.
    """

    fields_kv_per_cm: Floats
    density: Floats

    def __post_init__(self) -> None:
        fields = np.array(self.fields_kv_per_cm, dtype=np.float64)
        density = np.array(self.density, dtype=np.float64)
        if fields.ndim != 1 or len(fields) < 2 or fields.shape != density.shape:
            raise ValueError(
                f"a distribution of fields has two fields or more and a density for each; got {fields.shape}"
            )
        if not np.isfinite(fields).all() or (np.diff(fields) <= 0).any():
            raise ValueError("fields of a distribution: expected finite, rising numbers in kV/cm")
        # normalised, so that any unit of density will do
        area = float(np.trapezoid(density, fields)) if (density >= 0).all() else math.nan
        if not (math.isfinite(area) and area > 0):
            raise ValueError("density of a distribution of fields: expected numbers of 0 or more, not all 0")
        object.__setattr__(self, "fields_kv_per_cm", fields)
        object.__setattr__(self, "density", density / area)

    @classmethod
    def gaussian(cls, mean_kv_per_cm: float, deviation_kv_per_cm: float) -> FieldDistribution:
        """A normal distribution with this mean and standard deviation, cut at four standard deviations.

        >>> round(FieldDistribution.gaussian(10.0, 0.1).mean_kv_per_cm, 6)
        10.0
        """
        require_positive("deviation_kv_per_cm", deviation_kv_per_cm, "kV/cm")
        x = np.linspace(-REACH, REACH, 2 * LEAST_FIELDS + 1)
        return cls(mean_kv_per_cm + deviation_kv_per_cm * x, np.exp(-x * x / 2))

    @classmethod
    def uniform(cls, first_kv_per_cm: float, last_kv_per_cm: float) -> FieldDistribution:
        """A uniform density between two fields."""
        return cls(np.linspace(first_kv_per_cm, last_kv_per_cm, LEAST_FIELDS), np.ones(LEAST_FIELDS))

    @property
    def mean_kv_per_cm(self) -> float:
        """The mean field."""
        return float(np.trapezoid(self.density * self.fields_kv_per_cm, self.fields_kv_per_cm))

    def weights(self, fields_kv_per_cm: Floats) -> Floats:
        """Share of the sample at each of closely spaced fields (n,); the shares add up to 1."""
        here = np.interp(fields_kv_per_cm, self.fields_kv_per_cm, self.density) * np.gradient(fields_kv_per_cm)
        return np.asarray(here / here.sum())


def field_spectrum(
    lines: FieldLines,
    grid_mhz: ArrayLike,
    distribution: FieldDistribution | float,
    *,
    fwhm_mhz: float,
    profile: str = "gaussian",
) -> Spectrum:
    """Absorption cross section of a sample with a distribution of fields.

    Parameters
    ----------
    lines : FieldLines
        Lines at fields that cover the distribution and are close enough for cubic splines.
    grid_mhz : (n,)
        Rising frequencies.
    distribution : FieldDistribution or float
        Distribution of the field in kV/cm; a number means a homogeneous field.
    fwhm_mhz : float
        Full width at half maximum of a line in a homogeneous field.
    profile : str
        "gaussian" or "lorentzian".

    Returns
    -------
    Spectrum
        In nm².

    Raises
    ------
    ValueError
        For a distribution beyond the fields of the lines, lines at fewer than two fields, a width not above 0, an unknown profile.

    Notes
    -----
    Neglected: motion of the molecules through different fields during absorption.
    """
    shapes = {"gaussian": gaussian, "lorentzian": lorentzian}
    if profile not in shapes:
        raise ValueError(f"profile {profile!r}: expected one of {', '.join(shapes)}")
    require_positive("fwhm_mhz", fwhm_mhz, "MHz")
    grid = np.asarray(grid_mhz, dtype=np.float64)
    if grid.ndim != 1 or len(grid) < 2 or not np.isfinite(grid).all() or (np.diff(grid) <= 0).any():
        raise ValueError("grid: expected two or more finite, rising frequencies in MHz")
    total = np.zeros(len(grid))
    for frequency, area in _smeared(lines, distribution, fwhm_mhz):
        _add(total, grid, np.abs(frequency), area, fwhm_mhz, shapes[profile])
    return Spectrum(grid, total, "nm^2", lines.temperature_k, profile, fwhm_mhz)


def _smeared(
    lines: FieldLines, distribution: FieldDistribution | float, fwhm_mhz: float
) -> list[tuple[Floats, Floats]]:
    """Frequencies and areas of each pair of states over the fields of the sample."""
    from scipy.interpolate import CubicSpline

    fields = lines.fields
    first, last = (
        (distribution, distribution)
        if not isinstance(distribution, FieldDistribution)
        else (distribution.fields_kv_per_cm[0], distribution.fields_kv_per_cm[-1])
    )
    if first < fields[0] or last > fields[-1] or len(fields) < 2:
        raise ValueError(
            f"the sample has fields from {first:g} to {last:g} kV/cm, the lines were computed from {fields[0]:g} to {fields[-1]:g}; "
            "compute them at two fields or more that cover the sample"
        )
    out = []
    for rows in lines.pairs():
        curves = [CubicSpline(fields, column[rows]) for column in (lines.frequency_mhz, lines.intensity_nm2_mhz)]
        if not isinstance(distribution, FieldDistribution):
            out.append((curves[0](np.array([first])), curves[1](np.array([first]))))
            continue
        moved = np.ptp(curves[0](distribution.fields_kv_per_cm))
        # two fields for each step of a width, within bounds
        count = min(max(LEAST_FIELDS, math.ceil(2 * moved / (STEP * fwhm_mhz))), MOST_FIELDS)
        here = np.linspace(first, last, count)
        out.append((curves[0](here), curves[1](here) * distribution.weights(here)))
    return out


def _add(total: Floats, grid: Floats, centres: Floats, areas: Floats, fwhm_mhz: float, shape: object) -> None:
    """Add the profiles of many centres to `total`; centres more than 50 widths outside the grid are left out."""
    # a Lorentzian has fallen to 1e-4 of its peak at 50 widths
    near = (centres > grid[0] - 50 * fwhm_mhz) & (centres < grid[-1] + 50 * fwhm_mhz)
    assert callable(shape)
    for start in range(0, int(near.sum()), 256):  # pieces bound the memory of (lines, points)
        piece = slice(start, start + 256)
        total += areas[near][piece] @ shape(grid[None, :] - centres[near][piece][:, None], fwhm_mhz)
