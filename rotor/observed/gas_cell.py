"""A gas cell: temperature and amount of gas from an absorption spectrum.

    A(ν) = lg(P_0/P) = Σ_k τ_k(ν)/ln 10,    τ_k(ν) = N_k L Σ_i I_i(T) φ_i(ν)

by the law of Beer and Lambert, P = P_0 10^(-A) (IUPAC Compendium of Chemical Terminology, 5th ed. (2025), doi 10.1351/goldbook.B00626),
with a common temperature T, the column density N_k L of each species, and Doppler profiles (Gaussians of a common relative width).
Neglected: pressure broadening, emission of the gas, and the response of the detector.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.fit import FitChoices, SourceFit
from rotor.observed.model.model import KM_PER_S, Component, Sight, component_depth
from rotor.observed.model.species import SpeciesLines
from rotor.observed.model.variables import variables
from rotor.observed.spectrum import ABSORBANCE, ObservedSpectrum, band_text
from rotor.statistics.regression import regression

_LN10 = math.log(10)
_CHOICES = FitChoices(
    free=("column_per_cm2", "excitation_k", "fwhm_km_s"), shared=("excitation_k", "fwhm_km_s"), priors=False
)
_START_K = (50.0, 100.0, 200.0, 300.0, 450.0)
_START_CHANNELS = (2.0, 4.0, 8.0, 16.0, 32.0)  # widths of lines
_UNIT_COLUMN = 1e6


def absorbance(components: Sequence[Component], grid_mhz: Floats) -> Floats:
    """A (n,) on a rising grid; the columns of the components are N L in cm⁻².

    >>> absorbance([], np.array([1.0, 2.0])).tolist()
    [0.0, 0.0]
    """
    grid = np.asarray(grid_mhz, dtype=np.float64)
    return np.asarray(
        sum((component_depth(component, grid)[0] for component in components), np.zeros(len(grid))) / _LN10
    )


@dataclass(frozen=True, eq=False, repr=False)
class CellFit(SourceFit):
    """A fitted gas cell: a `SourceFit` whose `model_k` and `residuals_k` are absorbances."""

    @property
    def temperature_k(self) -> float:
        """Temperature of the gas."""
        return self.components[0].excitation_k

    @property
    def temperature_error_k(self) -> float:
        """Standard error of the temperature; inf if it is not determined."""
        return float(self.parameters_of(0)["excitation_k"]["error"])

    @property
    def column_errors(self) -> tuple[float, ...]:
        """Standard errors of N L (cm⁻²), of each component."""
        return tuple(self.parameters_of(k)["column_per_cm2"]["error"] for k in range(len(self.components)))

    def facts(self) -> dict[str, Any]:
        """Facts as of a `SourceFit`, with `rms` and `noise` in absorbance."""
        content = super().facts()
        return content | {"rms": content.pop("rms_k"), "noise": content.pop("noise_k")}


def start_cell(
    spectrum: ObservedSpectrum,
    species: Sequence[SpeciesLines],
    temperature_k: float | None = None,
    fwhm_km_s: float | None = None,
) -> list[Component]:
    """Start of a fit: the temperature and width of a grid with the smallest χ²; column densities by linear least squares.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Its unit is absorbance.
    species : sequence of SpeciesLines
    temperature_k, fwhm_km_s : float, optional
        Known values; by default estimated.

    Returns
    -------
    list of Component
        Components at rest; the column density of a species without visible lines corresponds to a third of the noise.

    Raises
    ------
    ValueError
        As `fit_cell`.
    """
    from scipy.optimize import nnls

    _refuse(spectrum, species)
    channel = spectrum.channel_mhz / float(np.median(spectrum.frequency_mhz)) * KM_PER_S
    low = max(each.partition.range_k[0] for each in species)
    high = min(each.partition.range_k[1] for each in species)
    kelvin = [temperature_k] if temperature_k else sorted({min(max(t, low), high) for t in _START_K})
    widths = [fwhm_km_s] if fwhm_km_s else [channels * channel for channels in _START_CHANNELS]
    best: tuple[float, list[Component]] = math.inf, []
    for t, width in ((t, width) for t in kelvin for width in widths):
        trial = [Component(each, _UNIT_COLUMN, t, 0.0, width) for each in species]
        bank = np.stack([absorbance([each], spectrum.frequency_mhz) / spectrum.noise for each in trial], axis=1)
        norms = np.maximum(np.linalg.norm(bank, axis=0), 1e-300)
        columns, left = nnls(bank / norms, spectrum.intensity / spectrum.noise)
        if left < best[0]:
            floor = 1 / 3 / np.maximum(bank.max(axis=0), 1e-300)
            columns = _UNIT_COLUMN * np.maximum(columns / norms, floor)
            best = left, [Component(each, float(n), t, 0.0, width) for each, n in zip(species, columns, strict=True)]
    return best[1]


def fit_cell(spectrum: ObservedSpectrum, start: Sequence[Component]) -> CellFit:
    """Fit of a gas cell: column densities of all species, a common temperature and a common width.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Its unit is absorbance.
    start : sequence of Component
        The start; temperature and width are those of the first component. `start_cell` estimates it.

    Returns
    -------
    CellFit

    Raises
    ------
    ValueError
        For a spectrum in another unit, and a species without a line in its range.
    """
    _refuse(spectrum, [component.species for component in start])
    grid, noise = spectrum.frequency_mhz, spectrum.noise
    free = variables(start, _CHOICES.free, _CHOICES.shared, ())

    def evaluate(values: Floats) -> tuple[Floats, Floats]:
        parts = free.applied(start, values)
        depths = np.stack([component_depth(component, grid, slopes=True) for component in parts]) / _LN10
        # the size of a source has no effect
        slopes = np.concatenate([depths[:, 1:], np.zeros_like(depths[:, :1])], axis=1)
        return (spectrum.intensity - depths[:, 0].sum(axis=0)) / noise, free.jacobian(parts, slopes) / noise[:, None]

    minimum = free.minimum(evaluate, start, tolerance=1e-3)
    best = free.applied(start, minimum.parameters)
    return CellFit(
        spectrum=spectrum,
        components=tuple(best),
        variables=free,
        values=minimum.parameters,
        statistics=regression(minimum.jacobian, free.names(start)),
        minimum=minimum,
        model_k=absorbance(best, grid),
        noise=noise,
        sight=Sight(),
        choices=_CHOICES,
        start=tuple(start),
    )


def _refuse(spectrum: ObservedSpectrum, species: Sequence[SpeciesLines]) -> None:
    if spectrum.unit != ABSORBANCE:
        raise ValueError(f"{spectrum.source or 'spectrum'}: in {spectrum.unit}; a gas cell is fitted in absorbance")
    first, last = spectrum.frequency_mhz[0], spectrum.frequency_mhz[-1]
    for each in species:
        if not len(each.between(first, last)):
            raise ValueError(f"{each.name}: no lines {band_text(first, last)}")
