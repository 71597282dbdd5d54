"""Rotational diagrams: level populations from integrated lines, a straight line through them, with the correction for optical depth.

    ln(N_u/g_u) = ln(N/Q(T)) - E_u/kT,        N_u/g_u = (8π k ν²/(h c³ A g_u)) W C_τ,   W = ∫T_B dv,  C_τ = τ/(1 - e^-τ)

(P. F. Goldsmith and W. D. Langer, Astrophys. J. 517, 209 (1999)), here with Planck's law and the background: W is divided by
[J(T) - J(T_bg)]/T_RJ, which is 1 in the Rayleigh-Jeans limit of the formula. C_τ follows from the temperature and column density of the
straight line, by iteration. A spectral line is used if other lines contribute less than a tenth to it in a fitted model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.observed.model.model import KM_PER_S, Component, Sight, escape, model
from rotor.observed.spectrum import ObservedSpectrum
from rotor.spectra.emission.emission import planck_k
from rotor.table import Table, counted

_REACH = 2.0  # range of integration on either side of a line, in line widths
_OTHERS = 0.1  # contribution of other lines, relative to a line, above which it is a blend
_ROUNDS = 50
_C_CM = units.SPEED_OF_LIGHT_M_PER_S * 100
_DETECTED = 3.0


@dataclass(frozen=True, eq=False, repr=False)
class RotationalDiagram(Table):
    """Points (n,) of a rotational diagram and the straight line through them.

    frequency_mhz, energy_upper_k: of the spectral lines. log_population, error: ln(N_u/g_u), corrected for optical depth.
    uncorrected: without the correction. optical_depth: at the centre. excitation_k, column_per_cm2, errors: from the straight line.
    """

    frequency_mhz: Floats
    energy_upper_k: Floats
    log_population: Floats
    error: Floats
    uncorrected: Floats
    optical_depth: Floats
    excitation_k: float
    excitation_error_k: float
    column_per_cm2: float
    column_error_per_cm2: float
    chi_squared: float

    @property
    def columns(self) -> dict[str, Any]:
        """The points."""
        names = ("frequency_mhz", "energy_upper_k", "log_population", "error", "uncorrected", "optical_depth")
        return {name: getattr(self, name) for name in names}


def rotational_diagram(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    number: int = 0,
    sight: Sight | None = None,
    *,
    corrected: bool = True,
) -> RotationalDiagram:
    """The rotational diagram of a component of a model, from its unblended lines.

    Parameters
    ----------
    spectrum : ObservedSpectrum
    components : sequence of Component
        Components of a fit, or a guess: velocity and width give the ranges of integration, all components together the blends.
    number : int, optional
        Number of the component.
    sight : Sight, optional
    corrected : bool, optional
        Whether populations are corrected for optical depth.

    Returns
    -------
    RotationalDiagram

    Raises
    ------
    ValueError
        For fewer than two lines above three standard deviations.
    """
    sight = sight or Sight()
    component = components[number]
    lines = _integrated(spectrum, components, number, sight)
    if len(lines) < 2:
        raise ValueError(
            f"{component.species.name}: {counted(len(lines), 'line')} above three standard deviations in the model; a diagram needs two"
        )
    rows, area, sigma = (np.array(column) for column in zip(*lines, strict=True))
    species = component.species.where(rows.astype(int))
    t, column = component.excitation_k, component.column_per_cm2
    points = _points(component, species, area, t, column, sight, corrected)
    line = points[0]
    for _ in range(_ROUNDS):
        slope, intercept, covariance = _linear(species.energy_upper_k, points[0], line, sigma / area)
        line = intercept + slope * species.energy_upper_k
        if slope >= 0:
            raise ValueError(
                f"{component.species.name}: populations rise with energy; no temperature describes the lines"
            )
        before, t = t, float(np.clip(-1 / slope, *component.species.partition.range_k))
        column = math.exp(intercept) * component.species.partition.at(t)
        points = _points(component, species, area, t, column, sight, corrected)
        if abs(t - before) < 1e-8 * t:
            break
    y, bare, depth = points
    residual = (np.exp(y - line) - 1) / (sigma / area * np.exp(y - line))
    t_error = math.sqrt(covariance[0, 0]) * t**2
    q_slope = component.species.partition.slope(t)
    gradient = np.array([q_slope * t, 1.0])  # d ln N = d intercept + (d ln Q/d ln T) T d slope
    n_error = column * math.sqrt(float(gradient @ covariance @ gradient))
    return RotationalDiagram(
        species.frequency_mhz,
        species.energy_upper_k,
        y,
        sigma / area,
        bare,
        depth,
        t,
        t_error,
        column,
        n_error,
        float(residual @ residual),
    )


def _integrated(
    spectrum: ObservedSpectrum, components: Sequence[Component], number: int, sight: Sight
) -> list[tuple[int, float, float]]:
    """Row, ∫T_B dv (K km/s) and its error of unblended lines above three standard deviations in the model."""
    component, species = components[number], components[number].species
    total = model(components, spectrum.frequency_mhz, sight).brightness_k
    alone = model([component], spectrum.frequency_mhz, sight).brightness_k
    factor = (1 - component.velocity_km_s / KM_PER_S) / (1 + sight.redshift)
    out = []
    for row, rest in enumerate(species.frequency_mhz.tolist()):
        centre = rest * factor
        reach = _REACH * component.fwhm_km_s / KM_PER_S * centre
        a, b = np.searchsorted(spectrum.frequency_mhz, (centre - reach, centre + reach)).tolist()
        near = np.abs(species.frequency_mhz - rest) < 2 * reach / factor
        if b - a < 3 or near.sum() > 1 or spectrum.frequency_mhz[b - 1] - spectrum.frequency_mhz[a] < 1.5 * reach:
            continue
        part = slice(a, b)
        others = float(np.sum(np.abs(total[part] - alone[part])))
        if others > _OTHERS * float(np.sum(np.abs(alone[part]))):
            continue
        step = np.gradient(spectrum.frequency_mhz[part]) / centre * KM_PER_S
        area, sigma = float(spectrum.intensity[part] @ step), float(np.sqrt(np.sum((spectrum.noise[part] * step) ** 2)))
        # the model decides, so that noise does not select
        if float(alone[part] @ step) > _DETECTED * sigma and area > 0:
            out.append((row, area, sigma))
    return out


def _points(
    component: Component, species: Any, area: Floats, t: float, column: float, sight: Sight, corrected: bool
) -> tuple[Floats, Floats, Floats]:
    """ln(N_u/g_u) with and without the correction, and the optical depth at the centre."""
    nu = species.frequency_mhz
    photon = nu / units.MHZ_PER_K
    contrast = planck_k(nu, t) - planck_k(nu, sight.background_k * (1 + sight.redshift))
    filling = 1.0
    if component.size_arcsec is not None and sight.beam_arcsec is not None:
        filling = component.size_arcsec**2 / (component.size_arcsec**2 + sight.beam_arcsec**2)
    # thin: W = f [J(T) - J(bg)] N_u A c³/(8π ν³) (e^x - 1), with velocities in cm/s
    per_column = (
        _C_CM**3
        / (8 * math.pi * (nu * 1e6) ** 3)
        * species.einstein_a_per_s
        * species.g_upper
        * np.expm1(photon / t)
        * 1e-5
    )
    bare = np.log(area / (filling * contrast * per_column))
    width = nu * component.fwhm_km_s / KM_PER_S
    depth = column * units.NM2_IN_CM2 * species.intensity_nm2_mhz(t) * math.sqrt(4 * math.log(2) / math.pi) / width
    return (bare - np.log(_mean_escape(depth)) if corrected else bare), bare, depth


def _mean_escape(depth: Floats) -> Floats:
    """∫(1 - e^-τ(v))dv/∫τ(v)dv (n,) of Gaussian lines with these optical depths at their centres."""
    u = np.linspace(-3.0, 3.0, 121)
    shape = np.exp(-4 * math.log(2) * u * u)
    return np.asarray((escape(depth[:, None] * shape)[0] * shape).sum(axis=1) / shape.sum())


def _linear(x: Floats, y: Floats, line: Floats, relative: Floats) -> tuple[float, float, Floats]:
    """The straight line through populations, with errors of the integrals predicted by it: logarithms of noisy integrals are biased."""
    ratio = np.exp(y - line)
    return _weighted_line(x, line + ratio - 1, relative * ratio)


def _weighted_line(x: Floats, y: Floats, sigma: Floats) -> tuple[float, float, Floats]:
    """Slope, intercept, and their covariance (2, 2), of a weighted straight line."""
    matrix = np.stack([x, np.ones_like(x)], axis=1) / sigma[:, None]
    covariance = np.asarray(np.linalg.inv(matrix.T @ matrix), dtype=np.float64)
    slope, intercept = (covariance @ (matrix.T @ (y / sigma))).tolist()
    return float(slope), float(intercept), covariance


def plot_rotational_diagram(diagram: RotationalDiagram, axes: Any) -> None:
    """Draw points with errors, with and without the correction, and the straight line on matplotlib axes."""
    axes.errorbar(
        diagram.energy_upper_k,
        diagram.log_population,
        diagram.error,
        linestyle="",
        marker="o",
        markersize=4,
        label="corrected",
    )
    axes.plot(
        diagram.energy_upper_k,
        diagram.uncorrected,
        linestyle="",
        marker="o",
        markerfacecolor="none",
        markersize=4,
        label="optically thin",
    )
    slope = -1 / diagram.excitation_k
    centre = float(np.average(diagram.energy_upper_k, weights=diagram.error**-2))
    middle = float(np.average(diagram.log_population, weights=diagram.error**-2))
    x = np.array([0.0, float(diagram.energy_upper_k.max()) * 1.05])
    error = diagram.excitation_error_k
    places = math.ceil(-math.log10(error)) if 0.0 < error < 0.1 else 1
    axes.plot(
        x,
        middle + slope * (x - centre),
        linewidth=0.8,
        label=f"{diagram.excitation_k:.{places}f} ± {error:.{places}f} K",
    )
    axes.set_xlabel("Energy of the upper level $E_u/k$ (K)")
    axes.set_ylabel(r"Population ln($N_u/g_u$ cm²)")
    axes.legend()
