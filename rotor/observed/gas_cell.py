"""A gas cell: temperature and amount of gas from an absorption spectrum.

    A(ν) = lg(I_0/I) = Σ_k τ_k(ν)/ln 10,    τ_k(ν) = N_k L Σ_i I_i(T) φ_i(ν)          (Lambert and Beer)

with one temperature T for all species, N_k L the molecules in the line of sight, and Gaussians of one relative width, as motion makes them.
Neglected: pressure broadening, emission of the gas, and the response of the detector.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotor.arrays import Floats
from rotor.observed.model import Component, component_depth
from rotor.observed.spectrum import ABSORBANCE, ObservedSpectrum
from rotor.statistics.least_squares import Minimum, minimise
from rotor.statistics.regression import Regression, regression

_LN10 = math.log(10)


def absorbance(components: Sequence[Component], grid_mhz: Floats) -> Floats:
    """A (n,) on a rising grid; the columns of the components are N L in cm⁻².

    >>> absorbance([], np.array([1.0, 2.0])).tolist()
    [0.0, 0.0]
    """
    grid = np.asarray(grid_mhz, dtype=np.float64)
    return np.asarray(
        sum((component_depth(component, grid)[0] for component in components), np.zeros(len(grid))) / _LN10
    )


@dataclass(frozen=True)
class CellFit:
    """Fitted components, and standard errors: of every column density (cm⁻²), the temperature (K) and the width (km/s)."""

    components: tuple[Component, ...]
    column_errors: tuple[float, ...]
    temperature_error_k: float
    fwhm_error_km_s: float
    statistics: Regression
    minimum: Minimum

    @property
    def temperature_k(self) -> float:
        """Temperature of the gas."""
        return self.components[0].excitation_k


def fit_cell(spectrum: ObservedSpectrum, start: Sequence[Component]) -> CellFit:
    """Column densities of all species, one temperature and one width, from a spectrum in absorbance.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Its unit is absorbance.
    start : sequence of Component
        The first one's temperature and width count for all.

    Returns
    -------
    CellFit

    Raises
    ------
    ValueError
        For a spectrum in another unit, and a species without a line in its range.
    """
    if spectrum.unit != ABSORBANCE:
        raise ValueError(f"{spectrum.source or 'spectrum'}: in {spectrum.unit}; a gas cell is fitted in absorbance")
    grid = spectrum.frequency_mhz
    for component in start:
        if not len(component.species.between(grid[0], grid[-1])):
            raise ValueError(f"{component.species.name}: no lines from {grid[0]:.10g} to {grid[-1]:.10g} MHz")

    def components(values: Floats) -> list[Component]:
        *columns, kelvin, width = np.exp(np.clip(values, -300, 300)).tolist()
        return [
            replace(component, column_per_cm2=n, excitation_k=kelvin, fwhm_km_s=width)
            for component, n in zip(start, columns, strict=True)
        ]

    def evaluate(values: Floats) -> tuple[Floats, Floats]:
        parts = components(values)
        depths = [component_depth(component, grid, slopes=True) / _LN10 for component in parts]
        kelvin, width = parts[0].excitation_k, parts[0].fwhm_km_s
        slopes = [depth[0] for depth in depths]
        slopes += [kelvin * sum(depth[2] for depth in depths), width * sum(depth[4] for depth in depths)]
        seen = sum(depth[0] for depth in depths)
        return (spectrum.intensity - seen) / spectrum.noise, np.stack(slopes, axis=1) / spectrum.noise[:, None]

    first = np.log([*(component.column_per_cm2 for component in start), start[0].excitation_k, start[0].fwhm_km_s])
    minimum = minimise(evaluate, first, tolerance=1e-3)
    names = [*(component.species.name for component in start), "temperature", "width"]
    statistics = regression(minimum.jacobian, names)
    errors = statistics.errors * max(1.0, minimum.rms)
    best = components(minimum.parameters)
    return CellFit(
        tuple(best),
        tuple(float(error * component.column_per_cm2) for error, component in zip(errors, best, strict=False)),
        float(errors[-2] * best[0].excitation_k),
        float(errors[-1] * best[0].fwhm_km_s),
        statistics,
        minimum,
    )
