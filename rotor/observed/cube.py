"""Fits of a cube: the same fit in each pixel of a mask, started from the neighbouring pixel; an executor shares the rows.

First a chain with one pixel in each row is fitted. It begins at the brightest pixel of the cube and proceeds up and down, from row to row,
to the nearest pixel, so that it follows a velocity field. Then each row is fitted outwards from its pixel of the chain, independently of
other rows. A pixel starts from the result of its neighbour. If that fit fails (not converged, or parameters without an error and a χ² above
that of noise), further starts are tried: that of the row, the common start, and the velocity from the correlation of the pixel with the
species. The fit with the smallest χ² is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.observed.fit import FitChoices, SourceFit, fit_source
from rotor.observed.model.model import Component, Sight
from rotor.observed.model.variables import variables
from rotor.observed.spectrum import ObservedSpectrum
from rotor.observed.start import velocity_and_width

_CHANCE = 4.0  # largest χ²/ν of noise alone, in standard deviations above 1


@dataclass(frozen=True)
class CubeFit:
    """Maps of parameters.

    names: of the parameters (m), such as `CO excitation_k`, and parameters, such as `excitation_k`. values, errors: (m, y, x), nan where a
    pixel was not fitted; errors are nan where they are not determined. reduced_chi_squared: (y, x). fitted: (y, x) pixels whose search
    converged.
    """

    names: tuple[str, ...]
    parameters: tuple[str, ...]
    values: Floats
    errors: Floats
    reduced_chi_squared: Floats
    fitted: NDArray[np.bool_]


@dataclass(frozen=True)
class _Row:
    """Data of a row for a worker. first: pixel to begin with, started from `components`. start: the common start of all pixels."""

    frequency_mhz: Floats
    intensity: NDArray[Any]  # (channels, x)
    noise: Floats  # (x,)
    mask: NDArray[np.bool_]
    first: int
    components: tuple[Component, ...]
    start: tuple[Component, ...]
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
        Standard deviation of a channel.
    components : sequence of Component
        The common start of all pixels.
    sight, choices : optional
        As in `fit_source`.
    mask : (y, x) array of bool, optional
        Pixels to fit; by default those with a channel above five standard deviations.
    executor : Executor, optional
        Shares the work over rows.

    Returns
    -------
    CubeFit

    Raises
    ------
    ValueError
        For inconsistent shapes.
    """
    n, height, width = intensity.shape
    if len(frequency_mhz) != n:
        raise ValueError(f"{len(frequency_mhz)} frequencies for a cube of {n} channels")
    sigma = np.broadcast_to(np.asarray(noise, dtype=np.float64), (height, width))
    chosen = _peak(intensity) > 5 * sigma if mask is None else np.asarray(mask, dtype=np.bool_)
    if chosen.shape != (height, width):
        raise ValueError(f"a mask of shape {chosen.shape} for a cube of {height} by {width} pixels")
    begin, settings = tuple(components), (sight or Sight(), choices or FitChoices())
    rows = [
        _Row(frequency_mhz, intensity[:, y], sigma[y], chosen[y] & _fit_to_use(intensity[:, y], sigma[y]), 0, begin, begin, *settings)
        for y in range(height)
    ]  # fmt: skip
    rows = _chained(rows)
    results = list(map(_fit_row, rows) if executor is None else executor.map(_fit_row, rows))
    free = variables(components, settings[1].free, settings[1].shared, settings[1].fixed)
    values, errors, chi, fitted = (np.stack([result[i] for result in results], axis=-2) for i in range(4))
    parameters = tuple(variable.name for variable in free.items)
    return CubeFit(free.names(components), parameters, values, errors, chi, fitted.astype(np.bool_))


def _fit_to_use(intensity: NDArray[Any], noise: Floats) -> NDArray[np.bool_]:
    """Mask (x,) of pixels with known noise and finite values in at least half of their channels."""
    return np.asarray((np.isfinite(intensity).mean(axis=0) >= 0.5) & (noise > 0))


def _chained(rows: list[_Row]) -> list[_Row]:
    """The rows with their first pixels and starts, from a chain of fits that begins at the brightest pixel of the cube."""
    peaks = [np.where(row.mask, _peak(row.intensity), -np.inf) for row in rows]
    brightest = int(np.argmax([peak.max(initial=-np.inf) for peak in peaks]))
    out = list(rows)
    for order in (range(brightest, len(rows)), range(brightest - 1, -1, -1)):
        at, start = int(np.argmax(peaks[brightest])), out[brightest].components
        for y in order:
            pixels = np.flatnonzero(rows[y].mask)
            if not len(pixels):
                continue
            at = int(pixels[np.argmin(np.abs(pixels - at))])
            out[y] = replace(rows[y], first=at, components=start)
            if (fit := _fit_pixel(out[y], at, start)) is not None and fit.minimum.converged:
                start = fit.components
                out[y] = replace(out[y], components=start)
    return out


def _peak(intensity: NDArray[Any]) -> Floats:
    """Intensity of the brightest channel of each pixel (x,); -inf if no channel is finite."""
    return np.asarray(np.max(np.where(np.isfinite(intensity), intensity, -np.inf), axis=0))


def _fit_pixel(row: _Row, x: int, neighbour: tuple[Component, ...]) -> SourceFit | None:
    """The converged fit with the smallest χ²; starts are tried until a fit is trusted. None if no fit is possible."""
    spectrum, best = _pixel(row, x), None
    for start in _starts(row, spectrum, neighbour):
        try:
            fit = fit_source(spectrum, start, row.sight, row.choices)
        # the search left the range of doubles, or the pixel has too few channels: the map marks it as not fitted
        except ValueError:
            continue
        if best is None or (fit.minimum.converged, -fit.chi_squared) > (best.minimum.converged, -best.chi_squared):
            best = fit
        if _is_trusted(best):
            break
    return best


def _starts(row: _Row, spectrum: ObservedSpectrum, neighbour: tuple[Component, ...]) -> Iterator[tuple[Component, ...]]:
    """Starts of a pixel: its neighbour, that of the row, the common one, and the velocity and width from the correlation of the pixel."""
    yield from {id(each): each for each in (neighbour, row.components, row.start)}.values()
    known = [component.species for component in row.start]
    velocity, width = velocity_and_width(spectrum, known, None, None, row.sight)
    yield tuple(replace(component, velocity_km_s=velocity, fwhm_km_s=width) for component in row.start)


def _is_trusted(fit: SourceFit) -> bool:
    """Whether a fit describes lines: after a start far from all lines no parameter is determined, and χ² is above that of noise."""
    noise_alone = 1 + _CHANCE * math.sqrt(2 / max(fit.degrees_of_freedom, 1))
    determined = all(parameter["determined"] for parameter in fit.parameters)
    return fit.minimum.converged and (determined or fit.reduced_chi_squared < noise_alone)


def _fit_row(row: _Row) -> tuple[Floats, Floats, Floats, Floats]:
    """Values (m, x), errors, χ²/ν (x,) and whether each pixel converged."""
    width = row.intensity.shape[1]
    count = len(variables(row.components, row.choices.free, row.choices.shared, row.choices.fixed))
    values, errors = np.full((count, width), np.nan), np.full((count, width), np.nan)
    chi, converged = np.full(width, np.nan), np.zeros(width)
    for order in (range(row.first, width), range(row.first - 1, -1, -1)):
        start = row.components
        for x in order:
            fit = _fit_pixel(row, x, start) if row.mask[x] else None
            if fit is None:
                continue
            values[:, x] = [parameter["value"] for parameter in fit.parameters]
            errors[:, x] = [parameter["error"] if parameter["determined"] else np.nan for parameter in fit.parameters]
            chi[x], converged[x] = fit.reduced_chi_squared, float(fit.minimum.converged)
            start = fit.components if fit.minimum.converged else row.components
    return values, errors, chi, converged


def _pixel(row: _Row, x: int) -> ObservedSpectrum:
    """The spectrum of a pixel without channels that are not finite."""
    finite = np.isfinite(row.intensity[:, x])
    values = np.asarray(row.intensity[:, x], dtype=np.float64)
    return ObservedSpectrum(row.frequency_mhz, values, np.full(len(finite), row.noise[x])).where(finite)
