"""LTE fits of observed spectra: least squares of brightness, statistics, and the contribution of each component.

`rotor.statistics.least_squares` minimises χ² = Σ (T_obs - T_model)²/σ² in ln N, ln T, v, ln Δv, ln θ (`variables`). Standard
errors follow from the noise of the channels. They are multiplied by √(χ²/(n - m)) if this is above 1, that is, if the model is incomplete.
Weak priors around the start (`PRIORS`) hold parameters that the spectrum does not determine; a parameter is called undetermined if its
error exceeds half of its prior. Catalogue frequencies have errors: an error δ changes the model by δ ∂T/∂ν, a further term of the noise
(`catalogue_noise`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.model.model import Component, Sight, model
from rotor.observed.model.variables import DEFAULT_FREE, Variables, variables
from rotor.observed.spectrum import KELVIN, ObservedSpectrum, band_text
from rotor.statistics.least_squares import Iteration, Minimum
from rotor.statistics.regression import Regression, regression
from rotor.table import Table

PRIORS = {"column_per_cm2": 5.0, "excitation_k": 1.5, "velocity_km_s": 2.0, "fwhm_km_s": 1.0, "size_arcsec": 1.5}
"""Standard deviations of the priors: of logarithms, and of velocities in widths."""
NEEDED = 9.0  # gain in χ² that a needed component exceeds, besides 2 for each of its parameters


@dataclass(frozen=True)
class FitChoices:
    """Settings of a fit.

    free, shared: parameters, see `variables`. fixed: parameters of single components that are not fitted. calibration: relative error of
    the intensity scale and of the catalogues' intensities; this fraction of the spectrum is added to the noise. priors: whether
    `PRIORS` hold undetermined parameters. most_iterations: limit of the search.
    """

    free: tuple[str, ...] = DEFAULT_FREE
    shared: tuple[str, ...] = ()
    fixed: tuple[tuple[int, str], ...] = ()
    calibration: float = 0.0
    priors: bool = True
    most_iterations: int = 60


@dataclass(frozen=True, eq=False, repr=False)
class SourceFit(Table):
    """A fitted source.

    components: at the minimum. variables, values, statistics: of the search, with errors from the noise only. spectrum, model_k: fitted
    channels and the brightness of the model there. minimum: end of the search. sight, choices, start: input of the fit.
    """

    spectrum: ObservedSpectrum
    components: tuple[Component, ...]
    variables: Variables
    values: Floats
    statistics: Regression
    minimum: Minimum
    model_k: Floats
    noise: Floats
    sight: Sight
    choices: FitChoices
    start: tuple[Component, ...]

    @property
    def chi_squared(self) -> float:
        """Σ (T_obs - T_model)²/σ²."""
        return float(np.sum((self.residuals_k / self.noise) ** 2))

    @property
    def degrees_of_freedom(self) -> int:
        """Number of channels minus number of determined parameters."""
        return len(self.spectrum) - self.statistics.rank

    @property
    def reduced_chi_squared(self) -> float:
        """χ²/(n - m); nan without a degree of freedom."""
        return self.chi_squared / self.degrees_of_freedom if self.degrees_of_freedom > 0 else math.nan

    @property
    def scale(self) -> float:
        """Factor of the errors: √(χ²/(n - m)), at least 1."""
        return math.sqrt(max(1.0, self.reduced_chi_squared)) if self.degrees_of_freedom > 0 else 1.0

    @cached_property
    def parameters(self) -> list[dict[str, Any]]:
        """Free parameters: name, value, error (symmetric, to first order), interval of 68 %, and whether it is determined."""
        out = []
        errors = self.statistics.errors * self.scale
        for name, variable, value, error in zip(
            self.variables.names(self.components),
            self.variables.items,
            self.values.tolist(),
            errors.tolist(),
            strict=True,
        ):
            centre = variable.back(value)
            known = math.isfinite(error) and (not variable.logarithmic or error < 5.0)
            low, high = (variable.back(value - error), variable.back(value + error)) if known else (math.nan, math.nan)
            symmetric = (centre * error if variable.logarithmic else error) if known else math.inf
            out.append(
                {
                    "name": name,
                    "parameter": variable.name,
                    "components": list(variable.components),
                    "value": centre,
                    "error": symmetric,
                    "interval": (low, high),
                    "determined": known,
                }
            )
        return out

    def parameters_of(self, k: int) -> dict[str, dict[str, Any]]:
        """The free parameters of a component by name."""
        return {row["parameter"]: row for row in self.parameters if k in row["components"]}

    @property
    def columns(self) -> dict[str, Any]:
        """The free parameters: name, value, error, low and high of the interval of 68 %."""
        rows = self.parameters
        table: dict[str, Any] = {key: np.array([row[key] for row in rows]) for key in ("name", "value", "error")}
        for place, key in enumerate(("low", "high")):
            table[key] = np.array([row["interval"][place] for row in rows])
        return table

    @property
    def residuals_k(self) -> Floats:
        """Observed minus modelled brightness (n,)."""
        return self.spectrum.intensity - self.model_k

    def facts(self) -> dict[str, Any]:
        """All content except arrays, as plain numbers, texts, lists and dictionaries."""
        return {
            "components": [component_facts(component) for component in self.components],
            "parameters": [
                {
                    "name": row["name"],
                    "value": row["value"],
                    "error": row["error"] if row["determined"] else None,
                    "low": row["interval"][0] if row["determined"] else None,
                    "high": row["interval"][1] if row["determined"] else None,
                }
                for row in self.parameters
            ],
            "channels": len(self.spectrum),
            "chi_squared": self.chi_squared,
            "reduced_chi_squared": self.reduced_chi_squared,
            "rms_k": float(np.sqrt(np.mean(self.residuals_k**2))),
            "noise_k": float(np.median(self.spectrum.noise)),
            "status": self.minimum.status,
            "undetermined": [combination.text for combination in self.statistics.undetermined],
        }


def component_facts(component: Component) -> dict[str, Any]:
    """The numbers of a component."""
    names = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s", "size_arcsec", "layer")
    return {"species": component.species.name, **{name: getattr(component, name) for name in names}}


def fit_source(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    sight: Sight | None = None,
    choices: FitChoices | None = None,
    *,
    progress: Callable[[Iteration], None] | None = None,
) -> SourceFit:
    """Least-squares fit of column densities, temperatures, velocities and widths to a spectrum.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Spectrum in K without continuum.
    components : sequence of Component
        The start; `start_components` estimates it from the spectrum.
    sight : Sight, optional
        Background, beam, redshift, dust.
    choices : FitChoices, optional
    progress : callable, optional
        Called at each iteration.

    Returns
    -------
    SourceFit

    Raises
    ------
    ValueError
        For a spectrum in another unit, a component without a line in its range, and fewer channels than parameters.

    Notes
    -----
    The minimum may be a local one; velocities must start within a width of the lines.
    """
    sight, choices = sight or Sight(), choices or FitChoices()
    _refuse(spectrum, components, sight)
    free = variables(components, choices.free, choices.shared, choices.fixed)
    if len(spectrum) <= len(free):
        raise ValueError(f"{len(spectrum)} channels for {len(free)} parameters; fit fewer parameters, or more channels")
    noise = total_noise(spectrum, components, sight, choices)
    minimum = find_minimum(spectrum, components, free, sight, noise, choices, progress)
    best = free.applied(components, minimum.parameters)
    seen = model(best, spectrum.frequency_mhz, sight)
    return SourceFit(
        spectrum=spectrum,
        components=tuple(best),
        variables=free,
        values=minimum.parameters,
        statistics=regression(minimum.jacobian, free.names(components)),
        minimum=minimum,
        model_k=seen.brightness_k,
        noise=noise,
        sight=sight,
        choices=choices,
        start=tuple(components),
    )


def find_minimum(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    free: Variables,
    sight: Sight,
    noise: Floats,
    choices: FitChoices,
    progress: Callable[[Iteration], None] | None = None,
) -> Minimum:
    """The minimum of χ² from a start; the priors are the last residuals."""
    start, widths = free.values(components), prior_widths(components, free)
    rows = np.diag(1 / widths)

    def evaluate(values: Floats) -> tuple[Floats, Floats]:
        now = free.applied(components, values)
        seen = model(now, spectrum.frequency_mhz, sight, slopes=True)
        assert seen.slopes is not None
        residuals, jacobian = (
            (spectrum.intensity - seen.brightness_k) / noise,
            free.jacobian(now, seen.slopes) / noise[:, None],
        )
        if not choices.priors:
            return residuals, jacobian
        return np.concatenate([residuals, (start - values) / widths]), np.concatenate([jacobian, rows])

    return free.minimum(
        evaluate, components, most_iterations=choices.most_iterations, progress=progress, tolerance=1e-3
    )


def prior_widths(components: Sequence[Component], free: Variables) -> Floats:
    """Standard deviations (m,) of the priors of the search variables."""
    scale = [
        components[variable.components[0]].fwhm_km_s if variable.name == "velocity_km_s" else 1.0
        for variable in free.items
    ]
    return np.array([PRIORS[variable.name] for variable in free.items]) * scale


def _refuse(spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight) -> None:
    if spectrum.unit != KELVIN:
        raise ValueError(
            f"{spectrum.source or 'spectrum'}: in {spectrum.unit}; a fit needs brightness in K (`in_kelvin`)"
        )
    if not components:
        raise ValueError("a fit needs a component")
    first, last = (spectrum.frequency_mhz[i] * (1 + sight.redshift) for i in (0, -1))
    for component in components:
        if not len(component.species.between(first, last)):
            raise ValueError(f"{component.species.name}: no lines {band_text(first, last)}")


def total_noise(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, choices: FitChoices
) -> Floats:
    """Noise (n,) of the channels at the start of a fit, with errors of calibration and of the catalogues' frequencies."""
    variance = spectrum.noise**2
    if choices.calibration:
        variance = variance + (choices.calibration * spectrum.intensity.clip(min=0.0)) ** 2
    return np.sqrt(variance + catalogue_noise(components, spectrum.frequency_mhz, sight) ** 2)


def catalogue_noise(components: Sequence[Component], grid_mhz: Floats, sight: Sight) -> Floats:
    """Errors (n,) of the brightness from errors δ of catalogue frequencies: |∂T_B/∂ν| δ.

    All lines are shifted by their errors in the same direction; where lines overlap this is an upper bound.
    """
    if not any((component.species.error_mhz > 0).any() for component in components):
        return np.zeros(len(grid_mhz))
    shifted = [replace(component, species=_moved(component)) for component in components]
    return np.asarray(
        np.abs(model(shifted, grid_mhz, sight).brightness_k - model(components, grid_mhz, sight).brightness_k)
    )


def _moved(component: Component) -> Any:
    """Lines shifted by their frequency errors, by at most a third of a width; a line with a larger error does not affect the fit."""
    species = component.species
    third = species.frequency_mhz * component.fwhm_km_s / 299792.458 / 3
    moved = species.frequency_mhz + np.minimum(species.error_mhz, third)
    order = np.argsort(moved, kind="stable")
    return replace(species.where(order), frequency_mhz=moved[order])


@dataclass(frozen=True)
class Contribution:
    """Contribution of a component to a fit: gain of χ² (Δχ²), whether it is needed, and an upper limit if not.

    signal: increase of χ² when the component is left out and the others are fitted again. limit_per_cm2: upper limit of the column density
    at 3 standard deviations, for the velocity and width of the component and the temperature limit_excitation_k; None if it is needed.
    """

    species: str
    signal: float
    needed: bool
    limit_per_cm2: float | None
    limit_excitation_k: float | None


def contributions(fit: SourceFit) -> list[Contribution]:
    """Contribution of each component: loss of χ² when it is left out and the others are fitted again."""
    _refuse(fit.spectrum, fit.components, fit.sight)
    out = []
    for k, component in enumerate(fit.components):
        others = _without(fit, k)
        residuals = (fit.spectrum.intensity - others) / fit.noise
        signal = (float(residuals @ residuals) - fit.chi_squared) / fit.scale**2
        parameters = sum(variable.components == (k,) for variable in fit.variables.items)
        needed = signal > NEEDED + 2 * parameters
        limit = (None, None) if needed else (upper_limit(fit, k, others), fit.start[k].excitation_k)
        out.append(Contribution(component.species.name, signal, needed, *limit))
    return out


def _without(fit: SourceFit, k: int) -> Floats:
    """Brightness of the other components, fitted without component k."""
    rest = [component for i, component in enumerate(fit.components) if i != k]
    if not rest:
        return np.zeros(len(fit.spectrum))
    fixed = tuple((i - (i > k), name) for i, name in fit.choices.fixed if i != k)
    free = variables(rest, fit.choices.free, fit.choices.shared, fixed)
    minimum = find_minimum(fit.spectrum, rest, free, fit.sight, fit.noise, fit.choices)
    return model(free.applied(rest, minimum.parameters), fit.spectrum.frequency_mhz, fit.sight).brightness_k


def upper_limit(fit: SourceFit, k: int, others_k: Floats | None = None, deviations: float = 3.0) -> float:
    """Column density of a component at which χ² is `deviations`² above its least value.

    The temperature is that of the start, because the fitted temperature of a species without lines is meaningless. Velocity and width are
    the fitted ones, or those of the start if they are not determined.
    others_k: brightness (n,) of the other components, by default that of the fit.
    """
    if others_k is None:
        others = [component for i, component in enumerate(fit.components) if i != k]
        others_k = model(others, fit.spectrum.frequency_mhz, fit.sight).brightness_k if others else None
    component = replace(fit.components[k], excitation_k=fit.start[k].excitation_k)
    if not fit.parameters_of(k).get("velocity_km_s", {"determined": True})["determined"]:
        component = replace(component, velocity_km_s=fit.start[k].velocity_km_s, fwhm_km_s=fit.start[k].fwhm_km_s)
    return column_limit(fit.spectrum, fit.noise * fit.scale, component, fit.sight, others_k, deviations)


def column_limit(
    spectrum: ObservedSpectrum,
    noise: Floats,
    component: Component,
    sight: Sight | None = None,
    others_k: Floats | None = None,
    deviations: float = 3.0,
) -> float:
    """Upper limit of a column density from the residuals of a spectrum, as `upper_limit`."""
    seen = sight or Sight()
    left = spectrum.intensity if others_k is None else spectrum.intensity - others_k
    thin = replace(component, column_per_cm2=1.0)
    slope = model([thin], spectrum.frequency_mhz, seen, slopes=True).slopes
    assert slope is not None
    weighted = slope[0, 0] / noise
    if not (squared := float(weighted @ weighted)) > 0:
        raise ValueError(f"{component.species.name}: no line in the spectrum's range, so that nothing limits it")
    best = max(float(weighted @ (left / noise)) / squared, 0.0)
    first = best + deviations / math.sqrt(squared)
    return _thick_limit(left, noise, thin, seen, spectrum, first, deviations)


def _thick_limit(
    left: Floats,
    noise: Floats,
    thin: Component,
    sight: Sight,
    spectrum: ObservedSpectrum,
    first: float,
    deviations: float,
) -> float:
    """The limit with saturation: the column density at which χ² exceeds its minimum by the square of `deviations`."""

    def chi_squared(column: float) -> float:
        seen = model([replace(thin, column_per_cm2=column)], spectrum.frequency_mhz, sight).brightness_k
        return float(np.sum(((left - seen) / noise) ** 2))

    trials = first * np.geomspace(1e-3, 1e3, 49)
    values = np.array([chi_squared(column) for column in trials])
    least = min(float(np.sum((left / noise) ** 2)), float(values.min()))
    above = np.flatnonzero(values - least <= deviations**2)
    last = int(above[-1]) if len(above) else 0
    if last == len(trials) - 1:
        return math.inf
    low, high = trials[last], trials[last + 1]
    for _ in range(40):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if chi_squared(middle) - least <= deviations**2 else (low, middle)
    return float(low)
