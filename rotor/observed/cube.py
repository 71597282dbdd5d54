"""Cubes: the same fit in every pixel, from neighbour to neighbour, with a mask, spread over an executor by rows.

A row begins at its brightest pixel and goes outwards; a pixel begins where its neighbour ended if that converged, else with the start
of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.observed.fit import FitChoices, fit_source
from rotor.observed.model import Component, Sight
from rotor.observed.spectrum import ObservedSpectrum
from rotor.observed.variables import variables


@dataclass(frozen=True)
class CubeFit:
    """Maps of parameters.

    names: of the parameters (m). values, errors: (m, y, x), nan where a pixel was not fitted; errors are nan where they are not determined.
    reduced_chi_squared: (y, x). fitted: (y, x) pixels whose search converged.
    """

    names: tuple[str, ...]
    values: Floats
    errors: Floats
    reduced_chi_squared: Floats
    fitted: NDArray[np.bool_]


@dataclass(frozen=True)
class _Row:
    """What a worker needs for one row of pixels."""

    frequency_mhz: Floats
    intensity: Floats  # (channels, x)
    noise: Floats  # (x,)
    mask: NDArray[np.bool_]
    components: tuple[Component, ...]
    sight: Sight
    choices: FitChoices


def fit_cube(
    frequency_mhz: Floats,
    intensity: Floats,
    noise: Floats | float,
    components: Sequence[Component],
    sight: Sight | None = None,
    choices: FitChoices | None = None,
    *,
    mask: NDArray[np.bool_] | None = None,
    executor: Executor | None = None,
) -> CubeFit:
    """Maps of the parameters of a source.

    Parameters
    ----------
    frequency_mhz : (n,) array
        Rising.
    intensity : (n, y, x) array
        K.
    noise : float or (y, x) array
        Of a channel.
    components : sequence of Component
        The start of every pixel.
    sight, choices : optional
        As in `fit_source`.
    mask : (y, x) array of bool, optional
        Pixels that are fitted; by default those with a channel above five standard deviations.
    executor : Executor, optional
        Rows are spread over it.

    Returns
    -------
    CubeFit

    Raises
    ------
    ValueError
        For shapes that do not fit each other.
    """
    n, height, width = intensity.shape
    if len(frequency_mhz) != n:
        raise ValueError(f"{len(frequency_mhz)} frequencies for a cube of {n} channels")
    sigma = np.broadcast_to(np.asarray(noise, dtype=np.float64), (height, width))
    chosen = np.nanmax(intensity, axis=0) > 5 * sigma if mask is None else np.asarray(mask, dtype=np.bool_)
    if chosen.shape != (height, width):
        raise ValueError(f"a mask of shape {chosen.shape} for a cube of {height} by {width} pixels")
    settings = (tuple(components), sight or Sight(), choices or FitChoices())
    rows = [_Row(frequency_mhz, intensity[:, y], sigma[y], chosen[y], *settings) for y in range(height)]
    results = list(map(_fit_row, rows) if executor is None else executor.map(_fit_row, rows))
    free = variables(components, settings[2].free, settings[2].shared, settings[2].fixed)
    values, errors, chi, fitted = (np.stack([result[i] for result in results], axis=-2) for i in range(4))
    return CubeFit(free.names(components), values, errors, chi, fitted.astype(np.bool_))


def _fit_row(row: _Row) -> tuple[Floats, Floats, Floats, Floats]:
    """Values (m, x), errors, χ²/ν (x,) and whether each pixel converged."""
    width = row.intensity.shape[1]
    count = len(variables(row.components, row.choices.free, row.choices.shared, row.choices.fixed))
    values, errors = np.full((count, width), np.nan), np.full((count, width), np.nan)
    chi, converged = np.full(width, np.nan), np.zeros(width)
    peak = np.where(row.mask, np.nanmax(row.intensity, axis=0), -np.inf)
    first = int(np.argmax(peak))
    for order in (range(first, width), range(first - 1, -1, -1)):
        start = row.components
        for x in order:
            spectrum = _pixel(row, x) if row.mask[x] else None
            if spectrum is None:
                start = row.components
                continue
            fit = fit_source(spectrum, start, row.sight, row.choices)
            if not fit.minimum.converged and start is not row.components:
                fit = fit_source(spectrum, row.components, row.sight, row.choices)
            values[:, x] = [parameter["value"] for parameter in fit.parameters]
            errors[:, x] = [parameter["error"] if parameter["determined"] else np.nan for parameter in fit.parameters]
            chi[x], converged[x] = fit.reduced_chi_squared, float(fit.minimum.converged)
            start = fit.components if fit.minimum.converged else row.components
    return values, errors, chi, converged


def _pixel(row: _Row, x: int) -> ObservedSpectrum | None:
    """The spectrum of a pixel without channels that are not finite; None with fewer than half of them."""
    finite = np.isfinite(row.intensity[:, x])
    if finite.mean() < 0.5 or not row.noise[x] > 0:
        return None
    whole = ObservedSpectrum(
        row.frequency_mhz, np.asarray(row.intensity[:, x], dtype=np.float64), np.full(len(finite), row.noise[x])
    )
    return replace(whole.where(finite))
