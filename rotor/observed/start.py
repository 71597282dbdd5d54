"""Start of a fit: velocity and width by correlation, temperatures and column densities by linear least squares.

The spectrum is correlated with the optically thin spectrum of each species on a grid even in ln ν, where a velocity is a shift. At the best
shift, nonnegative least squares (C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23, as `scipy.optimize.nnls`)
gives the column densities for each of a few temperatures, one species after the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.observed.model.model import KM_PER_S, Component, Sight, component_depth
from rotor.observed.model.species import SpeciesLines
from rotor.observed.spectrum import ObservedSpectrum
from rotor.spectra.emission.emission import planck_k

TEMPERATURES_K = (10.0, 20.0, 40.0, 80.0, 160.0, 300.0)
WIDTHS_KM_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
WIDEST_SHIFT_KM_S = 200.0
_UNIT_COLUMN = 1e6  # column density of templates, thin for all lines
_MIDDLE_K = 80.0
_MOST_POINTS = 1 << 20
_CORRELATED_K = (30.0, 80.0, 150.0, 300.0)
_CLEAR = 0.8  # smallest contrast of a velocity, relative to that of the width with the largest contrast
_APART = 3.0  # smallest distance of an alternative shift from the best one, in widths
_CLIPPED = 8.0  # largest intensity in the correlation, in standard deviations


def start_components(
    spectrum: ObservedSpectrum,
    species: Sequence[SpeciesLines],
    sight: Sight | None = None,
    *,
    velocity_km_s: float | None = None,
    fwhm_km_s: float | None = None,
    excitation_k: float | None = None,
    size_arcsec: float | None = None,
) -> list[Component]:
    """Start of a fit: a component for each species.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Spectrum in K.
    species : sequence of SpeciesLines
    sight : Sight, optional
    velocity_km_s, fwhm_km_s, excitation_k : float, optional
        Known values; by default estimated from the spectrum, with a common velocity and width of all species.
    size_arcsec : float, optional
        Size of all components.

    Returns
    -------
    list of Component
        The column density of a species without visible lines corresponds to a third of the noise.
    """
    sight = sight or Sight()
    velocity, width = velocity_and_width(spectrum, species, velocity_km_s, fwhm_km_s, sight)
    kelvin = [temperature for temperature in TEMPERATURES_K if excitation_k is None] or [float(excitation_k or 0.0)]
    templates = [thin_templates(spectrum, lines, kelvin, velocity, width, sight) for lines in species]
    chosen, columns = best_temperatures(spectrum, templates)
    out = []
    for lines, bank, t, column in zip(species, templates, chosen, columns, strict=True):
        t = min(range(len(kelvin)), key=lambda i: abs(kelvin[i] - _MIDDLE_K)) if column == 0 else t
        # templates are over the noise; peak in K per column density
        peak = float(np.max(np.abs(bank[t] * spectrum.noise)))
        floor = float(np.median(spectrum.noise)) / 3 / peak if peak > 0 else 1e12
        temperature = float(np.clip(kelvin[t], *lines.partition.range_k))
        out.append(Component(lines, max(float(column), floor), temperature, velocity, width, size_arcsec))
    return out


def thin_templates(
    spectrum: ObservedSpectrum,
    species: SpeciesLines,
    temperatures_k: Sequence[float],
    velocity: float,
    width: float,
    sight: Sight,
) -> Floats:
    """Optically thin brightness per column density over the noise at each temperature (t, n); 0 if Q(T) is not known."""
    grid = spectrum.frequency_mhz * (1 + sight.redshift)
    out = np.zeros((len(temperatures_k), len(grid)))
    low, high = species.partition.range_k
    for place, t in enumerate(temperatures_k):
        if low <= t <= high or low == high:
            depth = component_depth(Component(species, _UNIT_COLUMN, t, velocity, width), grid)[0]
            out[place] = (
                depth
                * (planck_k(grid, t) - planck_k(grid, sight.background_k * (1 + sight.redshift)))
                / _UNIT_COLUMN
                / spectrum.noise
            )
    return out


def best_temperatures(
    spectrum: ObservedSpectrum, templates: Sequence[Floats], rounds: int = 2
) -> tuple[list[int], Floats]:
    """Temperatures with the smallest χ², varied one species at a time, and the column densities at the end."""
    from scipy.optimize import nnls

    data = spectrum.intensity / spectrum.noise
    middle = len(templates[0]) // 2
    chosen = [middle] * len(templates)
    for _ in range(rounds):
        for k, bank in enumerate(templates):
            errors = []
            for t in range(len(bank)):
                matrix, norms = _unit_columns([templates[i][t if i == k else chosen[i]] for i in range(len(templates))])
                errors.append(nnls(matrix, data)[1] if norms[k] > 0 else np.inf)
            chosen[k] = int(np.argmin(errors))
    matrix, norms = _unit_columns([bank[t] for bank, t in zip(templates, chosen, strict=True)])
    return chosen, np.asarray(nnls(matrix, data)[0] / np.where(norms > 0, norms, 1.0))


def _unit_columns(rows: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Templates as columns of unit length, and their lengths."""
    matrix = np.array(rows).T
    norms = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(norms > 0, norms, 1.0), norms


def velocity_and_width(
    spectrum: ObservedSpectrum,
    species: Sequence[SpeciesLines],
    velocity_km_s: float | None = None,
    fwhm_km_s: float | None = None,
    sight: Sight | None = None,
) -> tuple[float, float]:
    """Velocity and width (km/s) with the best correlation of the spectrum with the lines of all species; given values do not change.

    The width has the best score among those with a clear maximum of the velocity.
    """
    if velocity_km_s is not None and fwhm_km_s is not None:
        return velocity_km_s, fwhm_km_s
    sight = sight or Sight()
    step, grid, data = _even_in_log(spectrum)
    widths = [candidate for candidate in WIDTHS_KM_S if candidate > 1.5 * step * KM_PER_S] or [3 * step * KM_PER_S]
    widths = widths if fwhm_km_s is None else [fwhm_km_s]
    reach = min(int(WIDEST_SHIFT_KM_S / (step * KM_PER_S)), len(grid) // 2)
    shifts = np.arange(-reach, reach + 1)
    velocities = shifts * step * KM_PER_S
    allowed = np.arange(len(shifts))
    if velocity_km_s is not None:
        allowed = np.array([int(np.argmin(np.abs(velocities - velocity_km_s)))])
    peaks: list[tuple[float, float, float, float]] = []  # contrast, score, velocity, width
    for width in widths:
        score = _score(data, grid * (1 + sight.redshift), species, width, shifts)
        place = int(allowed[np.argmax(score[allowed])])
        elsewhere = score[np.abs(velocities - velocities[place]) > _APART * width].max(initial=1e-300)
        peaks.append((float(score[place] / elsewhere), float(score[place]), float(velocities[place]), width))
    clear = _CLEAR * max(peak[0] for peak in peaks)
    _, _, velocity, width = max((peak for peak in peaks if peak[0] >= clear), key=lambda peak: peak[1])
    return (velocity if velocity_km_s is None else velocity_km_s), width


def _score(data: Floats, grid: Floats, species: Sequence[SpeciesLines], width: float, shifts: Ints) -> Floats:
    """Score of each shift: Σ over species of the fourth power of the projection of the spectrum on the species.

    The fourth power favours shifts at which many lines of a species match; at a wrong shift single lines match by chance. Intensities are
    limited, so that the brightest lines do not dominate. The mean is subtracted, because a crowded spectrum with its mean matches anything.
    """
    length = 1 << int(len(data) + np.abs(shifts).max(initial=0)).bit_length()
    clipped = np.minimum(data, _CLIPPED)
    spectrum = np.fft.rfft(clipped - clipped.mean(), length).conj()
    score = np.zeros(len(shifts))
    for lines in species:
        best = np.zeros(len(shifts))
        for kelvin in _CORRELATED_K:
            t = float(np.clip(kelvin, *lines.partition.range_k))
            template = component_depth(Component(lines, 1.0, t, 0.0, width), grid)[0]
            if (norm := float(np.linalg.norm(template))) > 0:
                best = np.maximum(best, np.fft.irfft(spectrum * np.fft.rfft(template, length), length)[shifts] / norm)
        score += best**4
    return score


def _even_in_log(spectrum: ObservedSpectrum) -> tuple[float, Floats, Floats]:
    """Step in ln ν, frequencies and intensities over the noise on an even grid; 0 in gaps."""
    x = np.log(spectrum.frequency_mhz)
    step = max(float(np.median(np.diff(x))), (x[-1] - x[0]) / _MOST_POINTS)
    even = np.arange(x[0], x[-1], step)
    data = np.interp(even, x, spectrum.intensity / spectrum.noise)
    gap = np.diff(x)[np.clip(np.searchsorted(x, even) - 1, 0, len(x) - 2)] > 4 * step
    return step, np.exp(even), np.where(gap, 0.0, data)
