"""Selection of the species that a spectrum needs, one by one: forward selection with refits, then removal of those that are not needed.

Optically thin templates t of all candidates at a few temperatures are projected on the residuals r of the current model. The gain in χ² is
(t·r)²/(t·t) for t·r > 0 (orthogonal matching pursuit: S. Chen, S. A. Billings, W. Luo, Int. J. Control 50, 1873 (1989)). The best
candidates are fitted with optical depth. The best of these is added if its gain exceeds a threshold that grows with the number of
candidates; then all species are fitted again. At the end each species is removed once and the others are fitted without it: the increase of
χ² is its evidence. Expected lines that are missing count in full against a species, whereas a channel far above the model counts as a few
standard deviations at most. Species that match many lines therefore win over those that match a bright line. A part of the noise is
proportional to the model, to account for departures from LTE and from a single layer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.observed.fit import FitChoices, SourceFit, fit_source
from rotor.observed.model.model import Component, Sight, component_depth, model
from rotor.observed.model.species import SpeciesLines
from rotor.observed.spectrum import ObservedSpectrum
from rotor.observed.start import TEMPERATURES_K
from rotor.spectra.emission.emission import planck_k

THRESHOLD = 16.0  # smallest gain of χ² of a species, in addition to 2 ln(templates)
VISIBLE = 3.0  # smallest peak of a visible line, in standard deviations
_TRIED = 4  # number of candidates that are fitted at each step
_ALWAYS_REFITTED = 12  # largest number of species that are all fitted again at each step
_REFIT_INTERVAL = 5
_GUARD = 4.0  # standard deviations above the model; a channel further above has less weight
_AWAY = 5.0  # largest change of a velocity, and largest width, in widths of the lines
_SHARED = 0.3  # smallest brightness of a species in a channel that it contributes to, in standard deviations


@dataclass(frozen=True)
class IdentifyChoices:
    """Settings of an identification.

    velocity_km_s, fwhm_km_s: known values, otherwise estimated from the spectrum. temperatures_k: of the templates. model_error: relative
    error of the brightness, added to the noise. most_species: limit of the search. threshold: smallest gain of χ² of a species.
    """

    velocity_km_s: float | None = None
    fwhm_km_s: float | None = None
    temperatures_k: tuple[float, ...] = TEMPERATURES_K
    model_error: float = 0.1
    most_species: int = 60
    threshold: float = THRESHOLD
    size_arcsec: float | None = None


class Templates:
    """Optically thin templates (brightness per column density) of all candidates at all temperatures, as a sparse matrix (s t, n)."""

    def __init__(
        self,
        spectrum: ObservedSpectrum,
        known: Sequence[SpeciesLines],
        choices: IdentifyChoices,
        velocity: float,
        width: float,
        sight: Sight,
    ) -> None:
        from scipy.sparse import csr_matrix, vstack

        grid = spectrum.frequency_mhz * (1 + sight.redshift)
        self.start = [Component(species, 1.0, 80.0, velocity, width, choices.size_arcsec) for species in known]
        self.temperatures = choices.temperatures_k
        rows = []
        for component in self.start:
            for t in self.temperatures:
                low, high = component.species.partition.range_k
                depth = np.zeros(len(grid))
                if low <= t <= high or low == high:
                    depth = component_depth(replace(component, excitation_k=t), grid)[0]
                    depth = depth * (planck_k(grid, t) - planck_k(grid, sight.background_k * (1 + sight.redshift)))
                rows.append(csr_matrix(depth))
        self.templates = vstack(rows).tocsr()
        self.squares = self.templates.multiply(self.templates).tocsr()

    def gains(self, residual_k: Floats, sigma: Floats) -> tuple[Floats, Floats]:
        """Gain of χ² and column density of each candidate at each temperature, (s, t) each."""
        overlap = self.templates @ (residual_k / sigma**2)
        length = self.squares @ (1 / sigma**2)
        safe = np.where(length > 0, length, 1.0)
        column = np.where(length > 0, overlap / safe, 0.0)
        gain = np.where(column > 0, overlap * column, 0.0)
        shape = (len(self.start), len(self.temperatures))
        return gain.reshape(shape), column.reshape(shape)

    def best(self, residual_k: Floats, sigma: Floats) -> tuple[Floats, list[Component]]:
        """Gain of each candidate at its best temperature, and a component to start from."""
        gain, column = self.gains(residual_k, sigma)
        at = gain.argmax(axis=1)
        rows = np.arange(len(at))
        parts = [
            replace(component, column_per_cm2=max(float(column[k, at[k]]), 1.0), excitation_k=self.temperatures[at[k]])
            for k, component in enumerate(self.start)
        ]
        return gain[rows, at], parts


class Selection:
    """The selected species: their numbers among the candidates, and their components."""

    def __init__(
        self,
        spectrum: ObservedSpectrum,
        known: Sequence[SpeciesLines],
        sight: Sight,
        choices: IdentifyChoices,
        bank: Templates,
        progress: Callable[[str], None] | None,
    ) -> None:
        self.spectrum, self.known, self.sight, self.choices, self.bank, self.progress = (
            spectrum,
            known,
            sight,
            choices,
            bank,
            progress,
        )
        self.threshold = choices.threshold + 2 * math.log(len(known) * len(choices.temperatures_k))
        self.numbers: list[int] = []
        self.components: list[Component] = []
        self.refused: set[int] = set()

    def model_k(self, components: Sequence[Component] | None = None) -> Floats:
        """Brightness of the current model."""
        parts = self.components if components is None else components
        return (
            model(parts, self.spectrum.frequency_mhz, self.sight).brightness_k
            if parts
            else np.zeros(len(self.spectrum))
        )

    def sigma(self, brightness_k: Floats) -> Floats:
        """Noise including the error of the model."""
        return np.asarray(np.hypot(self.spectrum.noise, self.choices.model_error * brightness_k))

    def guarded(self, brightness_k: Floats) -> Floats:
        """Noise, raised where the spectrum is far above the model, so that lines of unknown species do not attract known species."""
        above = (self.spectrum.intensity - brightness_k) / _GUARD
        return np.asarray(np.maximum(self.sigma(brightness_k), above))

    def run(self) -> None:
        """Add species until the gain is below the threshold."""
        while len(self.components) < self.choices.most_species and self._add():
            self._refit()

    def _add(self) -> bool:
        """Add the best candidate; False if its gain is below the threshold."""
        now = self.model_k()
        residual = self.spectrum.intensity - now
        sigma = self.guarded(now)
        gain, parts = self.bank.best(residual, sigma)
        gain[[*self.numbers, *self.refused]] = 0.0
        order = np.argsort(-gain)[:_TRIED]
        tried = [(self._gain(parts[k], residual, sigma), int(k)) for k in order if gain[k] > self.threshold / 2]
        if not tried:
            return False
        (best, component), k = max(tried, key=lambda candidate: candidate[0][0])
        if best < self.threshold:
            self.refused |= {number for _, number in tried}
            return (
                bool(gain[[i for i in range(len(gain)) if i not in self.refused]].max(initial=0.0) > self.threshold / 2)
                and self._add()
            )
        self.numbers.append(k)
        self.components.append(component)
        if self.progress:
            self.progress(component.species.name)
        return True

    def _gain(self, component: Component, residual: Floats, sigma: Floats) -> tuple[float, Component]:
        """Gain of χ² of a candidate that is fitted to the residuals with optical depth, and the fitted component."""
        left = replace(self.spectrum, intensity=residual, noise=sigma)
        try:
            fit = fit_source(
                left, [component], self.sight, FitChoices(free=("column_per_cm2", "excitation_k"), most_iterations=20)
            )
        except ValueError:  # out of the range of Q(T)
            return 0.0, component
        before = float(np.sum((residual / sigma) ** 2))
        return before - fit.chi_squared, fit.components[0]

    def _refit(self) -> None:
        """Fit all species with a common velocity and width, if there are few species or the last such fit is several steps ago."""
        count = len(self.components)
        if count <= _ALWAYS_REFITTED or count % _REFIT_INTERVAL == 0:
            self.components = list(self.fit(self.components, 15).components)

    def fit(self, components: Sequence[Component], iterations: int, *, alone: bool = False) -> SourceFit:
        """A fit of components, with noise that includes the error of their model; alone: separate velocities and widths."""
        noisy = replace(self.spectrum, noise=self.guarded(self.model_k(components)))
        shared = () if alone else ("velocity_km_s", "fwhm_km_s")
        free = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")
        fit = fit_source(
            noisy, components, self.sight, FitChoices(free=free, shared=shared, most_iterations=iterations)
        )
        if not any(self._ran_away(component) for component in fit.components):
            return fit
        start = self.bank.start[0]
        back = [
            replace(component, velocity_km_s=start.velocity_km_s, fwhm_km_s=start.fwhm_km_s) for component in components
        ]
        return fit_source(noisy, back, self.sight, FitChoices(free=free[:2], most_iterations=iterations))

    def _ran_away(self, component: Component) -> bool:
        """Whether velocity or width are far from those of the lines, as where a band is fitted to a forest of other lines."""
        start = self.bank.start[0]
        moved = abs(component.velocity_km_s - start.velocity_km_s)
        return max(moved, component.fwhm_km_s) > _AWAY * start.fwhm_km_s

    def pruned(self) -> tuple[SourceFit | None, Floats]:
        """The last fit without unnecessary species, and the evidence of the remaining species."""
        while self.components:
            fit = self.fit(self.components, 40)
            signals = self.signals(fit)
            if signals.min() >= self.threshold:
                return fit, signals
            lost = (signals < self.threshold / 4) | (signals == signals.min())
            self.components = [component for component, gone in zip(fit.components, lost, strict=True) if not gone]
            self.numbers = [number for number, gone in zip(self.numbers, lost, strict=True) if not gone]
        return None, np.zeros(0)

    def signals(self, fit: SourceFit) -> Floats:
        """Increase of χ² without each species, with the species that share its channels fitted again."""
        grid = fit.spectrum.frequency_mhz
        alone = np.array([model([component], grid, self.sight).brightness_k for component in fit.components])
        shines = np.abs(alone) > _SHARED * fit.noise
        out = np.zeros(len(alone))
        for k in range(len(alone)):
            near = [i for i in range(len(alone)) if i != k and (shines[i] & shines[k]).any()]
            rest = [component for i, component in enumerate(fit.components) if i != k and i not in near]
            left = fit.spectrum.intensity - self.model_k(rest) if rest else fit.spectrum.intensity
            out[k] = self._misfit(fit, left, [fit.components[i] for i in near]) - fit.chi_squared
        # a species without a visible line may take any column density
        has_lines = (alone > VISIBLE * fit.noise).any(axis=1)
        return np.where(has_lines, out / _local_scatter(fit, shines), 0.0)

    def _misfit(self, fit: SourceFit, left: Floats, near: list[Component]) -> float:
        """χ² of the residuals after these species are fitted again."""
        if not near:
            return float(np.sum((left / fit.noise) ** 2))
        part = replace(fit.spectrum, intensity=left, noise=fit.noise)
        return fit_source(
            part, near, self.sight, FitChoices(free=("column_per_cm2", "excitation_k"), most_iterations=15)
        ).chi_squared


def _local_scatter(fit: SourceFit, shines: NDArray[np.bool_]) -> Floats:
    """Mean square of residual over noise in the channels of each species, at least 1; a poor fit lowers the evidence."""
    squares = (fit.residuals_k / fit.noise) ** 2
    return np.array([max(1.0, float(squares[part].mean())) if part.any() else 1.0 for part in shines])
