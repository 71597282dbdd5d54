"""Non-LTE excitation by pythonradex (G. Cataldi and others; extra `nonlte`), and fits with it.

Level populations follow from the column density, the kinetic temperature and the densities of colliders, with the rates of a LAMDA file
(escape probabilities; F. F. S. van der Tak et al., Astron. Astrophys. 468, 627 (2007)). Each line then has its excitation temperature T_i:

    T_B(ν) = f [Σ_i τ_i(ν) (J_ν(T_i) - J_ν(T_bg))] (1 - e^-τ)/τ,       τ = Σ τ_i,    τ_i Gaussians of the width Δv

which is the formula of `model.model` with a temperature for each line. Frequencies are those of the file. Derivatives are finite
differences.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.checks import require_positive
from rotor.observed.model.model import KM_PER_S, Sight, beam_filling, escape
from rotor.observed.spectrum import ObservedSpectrum
from rotor.spectra.emission.emission import planck_k
from rotor.spectra.profiles import gaussian
from rotor.statistics.least_squares import Minimum, minimise
from rotor.statistics.regression import Regression, regression

EXTRA = 'python -m pip install "molrotor[nonlte]"'
GEOMETRIES = ("static slab", "static sphere", "static sphere RADEX", "LVG slab", "LVG sphere")
FITTED = ("column_per_cm2", "kinetic_k", "density_per_cm3", "velocity_km_s", "fwhm_km_s")
_STEP = 1e-4
_CM3 = 1e6
_CM2 = 1e4


@dataclass(frozen=True)
class NonLteComponent:
    """A species of a LAMDA file in gas without local thermodynamic equilibrium.

    file: LAMDA. column_per_cm2, kinetic_k. density_per_cm3: of the collider. collider: H2, para-H2, ortho-H2, e, H, He or H+.
    velocity_km_s, fwhm_km_s, size_arcsec: as in `Component`. geometry: one of `GEOMETRIES`.
    """

    file: str | os.PathLike[str]
    column_per_cm2: float
    kinetic_k: float
    density_per_cm3: float
    collider: str = "H2"
    velocity_km_s: float = 0.0
    fwhm_km_s: float = 1.0
    size_arcsec: float | None = None
    geometry: str = "static slab"

    def __post_init__(self) -> None:
        for name in ("column_per_cm2", "kinetic_k", "density_per_cm3", "fwhm_km_s"):
            require_positive(name, getattr(self, name))
        if self.geometry not in GEOMETRIES:
            raise ValueError(f"geometry {self.geometry!r}: expected one of {', '.join(GEOMETRIES)}")


@dataclass(frozen=True)
class ExcitedLines:
    """Lines (n,) with excitation temperatures and optical depths at the centre."""

    frequency_mhz: Floats
    excitation_k: Floats
    optical_depth: Floats


@lru_cache(maxsize=8)
def _source(file: str, geometry: str, fwhm_km_s: float) -> Any:
    """A source of pythonradex, cached because reading the file and its rates takes time."""
    try:
        from pythonradex import radiative_transfer
    except ModuleNotFoundError as error:
        raise ImportError(f"pythonradex is not installed: {EXTRA}", name="pythonradex") from error
    profile = "rectangular" if geometry.startswith("LVG") else "Gaussian"
    try:
        source = radiative_transfer.Source(
            datafilepath=file,
            geometry=geometry,
            line_profile_type=profile,
            width_v=fwhm_km_s * 1e3,
            warn_negative_tau=False,
        )
    except OSError as error:
        raise ValueError(f"{file}: {error.strerror or error}") from None
    except (ValueError, KeyError, IndexError, AssertionError, StopIteration) as error:
        raise ValueError(f"{file}: not a file of LAMDA that pythonradex reads: {error}") from None
    if not source.emitting_molecule.rad_transitions:
        raise ValueError(f"{file}: not a file of LAMDA: it has no radiative transitions")
    return source


def excited_lines(component: NonLteComponent, sight: Sight | None = None) -> ExcitedLines:
    """Excitation temperatures and optical depths of all lines of a component.

    Raises ValueError for an unreadable file, a temperature beyond its rates, and a collider that the file lacks.
    """
    sight = sight or Sight()
    background = sight.background_k * (1 + sight.redshift)
    source = _source(os.fspath(component.file), component.geometry, round(component.fwhm_km_s, 9))

    def radiation(nu: Any) -> Any:
        """B_ν of the background in W/m²/Hz/sr, frequencies in Hz."""
        x = units.PLANCK_J_S * np.asarray(nu) / (units.BOLTZMANN_J_PER_K * background)
        return 2 * units.PLANCK_J_S * np.asarray(nu) ** 3 / units.SPEED_OF_LIGHT_M_PER_S**2 / np.expm1(x)

    try:
        source.update_parameters(
            N=component.column_per_cm2 * _CM2,
            Tkin=component.kinetic_k,
            collider_densities={component.collider: component.density_per_cm3 * _CM3},
            ext_background=radiation,
            T_dust=0,
            tau_dust=0,
        )
        source.solve_radiative_transfer()
    except (AssertionError, ValueError, RuntimeError) as error:
        where = f"{component.kinetic_k:g} K, {component.density_per_cm3:g} cm⁻³ of {component.collider}"
        raise ValueError(
            f"{component.file}: pythonradex has no solution at {where}: {error or 'outside its rates'}"
        ) from None
    frequency = np.array([transition.nu0 for transition in source.emitting_molecule.rad_transitions]) * 1e-6
    order = np.argsort(frequency)
    depth, kelvin = np.asarray(source.tau_nu0_individual_transitions), np.asarray(source.Tex)
    return ExcitedLines(frequency[order], kelvin[order], depth[order])


def non_lte_brightness(component: NonLteComponent, grid_mhz: Floats, sight: Sight | None = None) -> Floats:
    """T_B (n,) on a rising grid of observed frequencies, with the background subtracted."""
    sight = sight or Sight()
    lines = excited_lines(component, sight)
    grid = np.asarray(grid_mhz, dtype=np.float64) * (1 + sight.redshift)
    behind = planck_k(grid, sight.background_k * (1 + sight.redshift))
    total, emitted = np.zeros_like(grid), np.zeros_like(grid)
    for rest, kelvin, depth in zip(
        lines.frequency_mhz.tolist(), lines.excitation_k.tolist(), lines.optical_depth.tolist(), strict=True
    ):
        centre = rest * (1 - component.velocity_km_s / KM_PER_S)
        width = centre * component.fwhm_km_s / KM_PER_S
        first, last = np.searchsorted(grid, (centre - 3 * width, centre + 3 * width))
        if last > first:
            part = slice(int(first), int(last))
            τ = depth * gaussian(grid[part] - centre, width) / float(gaussian(0.0, width))
            total[part] += τ
            emitted[part] += τ * (_rayleigh_jeans(grid[part], kelvin) - behind[part])
    filling = 1.0
    if component.size_arcsec is not None:
        if sight.beam_arcsec is None:
            raise ValueError("a source size without a beam: state beam_arcsec")
        filling = beam_filling(component.size_arcsec, sight.beam_arcsec)
    return np.asarray(filling * emitted * escape(total)[0] / (1 + sight.redshift))


def _rayleigh_jeans(frequency_mhz: Floats, kelvin: float) -> Floats:
    """J_ν(T), also at the negative temperatures of masers."""
    x = frequency_mhz / (units.MHZ_PER_K * kelvin)
    return np.asarray(frequency_mhz / units.MHZ_PER_K / np.expm1(x))


@dataclass(frozen=True)
class NonLteFit:
    """A fitted component, its free parameters, and their statistics in ln N, ln T, ln n, v, ln Δv."""

    component: NonLteComponent
    free: tuple[str, ...]
    statistics: Regression
    minimum: Minimum
    channels: int

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors by parameter; infinite if the spectrum does not determine it."""
        scale = max(1.0, self.minimum.rms * math.sqrt(self.channels / max(self.channels - len(self.free), 1)))
        values = [1.0 if name == "velocity_km_s" else getattr(self.component, name) for name in self.free]
        return {
            name: float(error * value * scale)
            for name, error, value in zip(self.free, self.statistics.errors, values, strict=True)
        }


def fit_non_lte(
    spectrum: ObservedSpectrum, start: NonLteComponent, sight: Sight | None = None, free: tuple[str, ...] = FITTED
) -> NonLteFit:
    """Least-squares fit of column density, kinetic temperature, density, velocity and width to a spectrum.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        In K.
    start : NonLteComponent
    sight : Sight, optional
    free : tuple of str, optional
        Free parameters, from `FITTED`.

    Returns
    -------
    NonLteFit

    Raises
    ------
    ValueError
        For an unknown parameter, and if the start cannot be computed.
    ImportError
        Without pythonradex.
    """
    for name in free:
        if name not in FITTED:
            raise ValueError(f"parameter {name!r}: known are {', '.join(FITTED)}")

    def component(values: Floats) -> NonLteComponent:
        numbers = {
            name: float(v if name == "velocity_km_s" else np.exp(v)) for name, v in zip(free, values, strict=True)
        }
        return replace(start, **numbers)  # type: ignore[arg-type]

    def brightness(values: Floats) -> Floats:
        return non_lte_brightness(component(values), spectrum.frequency_mhz, sight)

    def evaluate(values: Floats) -> tuple[Floats, Floats]:
        steps = _STEP * np.eye(len(values))
        slopes = np.stack([(brightness(values + h) - brightness(values - h)) / (2 * _STEP) for h in steps], axis=1)
        return (spectrum.intensity - brightness(values)) / spectrum.noise, slopes / spectrum.noise[:, None]

    first = np.array(
        [getattr(start, name) if name == "velocity_km_s" else math.log(getattr(start, name)) for name in free]
    )
    minimum = minimise(evaluate, first, tolerance=1e-2, most_iterations=40)
    return NonLteFit(
        component(minimum.parameters), free, regression(minimum.jacobian, list(free)), minimum, len(spectrum)
    )
