"""Identification of species in a spectrum: forward selection with refits, then removal of species that are not needed.

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
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.observed.fit import FitChoices, SourceFit, fit_source
from rotor.observed.model import KM_PER_S, Component, Sight, component_depth, model
from rotor.observed.species import SpeciesLines
from rotor.observed.spectrum import ObservedSpectrum
from rotor.observed.start import TEMPERATURES_K, velocity_and_width
from rotor.spectra.emission import planck_k
from rotor.table import Table

THRESHOLD = 16.0  # smallest gain of χ² of a species, in addition to 2 ln(templates)
_TRIED = 4  # number of candidates that are fitted at each step
_ALWAYS_REFITTED = 12  # largest number of species that are all fitted again at each step
_REFIT_INTERVAL = 5
_UNIDENTIFIED = 5.0  # smallest peak of an unidentified line, in standard deviations
_VISIBLE = 3.0
_RIVAL = 0.7  # smallest gain of a rival outside the model, relative to the evidence of a species
_RIVALS = 3
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


@dataclass(frozen=True)
class Evidence:
    """A species that the spectrum needs.

    component: fitted. signal: increase of χ² without it, divided by the mean square of the residuals in its channels.
    expected: number of its lines above three standard deviations in the model. visible: number of these that the spectrum shows.
    rivals: species outside the model that explain nearly as much.
    """

    component: Component
    signal: float
    visible: int
    expected: int
    rivals: tuple[str, ...] = ()

    @property
    def single_line(self) -> bool:
        """Whether at most one of its lines is visible; such a line may belong to a species outside the candidates."""
        return self.visible <= 1


@dataclass(frozen=True)
class Unidentified:
    """A line outside the model: frequency and brightness of its peak, significance in standard deviations, candidates with a line there."""

    frequency_mhz: float
    peak_k: float
    deviations: float
    candidates: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Table):
    """Species by evidence, unidentified lines, the fit of all species, and the number of candidates."""

    species: tuple[Evidence, ...]
    unidentified: tuple[Unidentified, ...]
    fit: SourceFit | None
    candidates: int
    velocity_km_s: float
    fwhm_km_s: float
    notes: tuple[str, ...] = field(default=())

    @property
    def names(self) -> list[str]:
        """Names of the species in order of falling evidence."""
        return [evidence.component.species.name for evidence in self.species]

    @property
    def columns(self) -> dict[str, Any]:
        """species, signal, visible, expected, single_line, column_per_cm2, excitation_k, velocity_km_s, fwhm_km_s."""
        parts = [evidence.component for evidence in self.species]
        numbers = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")
        table: dict[str, Any] = {"species": np.array(self.names, dtype=np.str_)}
        table |= {
            name: np.array([getattr(evidence, name) for evidence in self.species])
            for name in ("signal", "visible", "expected", "single_line")
        }
        return table | {name: np.array([getattr(component, name) for component in parts]) for name in numbers}

    def facts(self) -> dict[str, Any]:
        """All content as plain numbers, texts, lists and dictionaries."""
        rows = [
            dict(zip(self.columns, row, strict=True))
            for row in zip(*(c.tolist() for c in self.columns.values()), strict=True)
        ]
        return {
            "species": [
                row | {"rivals": list(evidence.rivals)} for row, evidence in zip(rows, self.species, strict=True)
            ],
            "unidentified": [
                {
                    "frequency_mhz": line.frequency_mhz,
                    "peak_k": line.peak_k,
                    "deviations": line.deviations,
                    "candidates": list(line.candidates),
                }
                for line in self.unidentified
            ],
            "candidates": self.candidates,
            "velocity_km_s": self.velocity_km_s,
            "fwhm_km_s": self.fwhm_km_s,
            "reduced_chi_squared": None if self.fit is None else self.fit.reduced_chi_squared,
            "notes": list(self.notes),
        }


def identify(
    spectrum: ObservedSpectrum,
    candidates: Sequence[SpeciesLines],
    sight: Sight | None = None,
    choices: IdentifyChoices | None = None,
    *,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Species in a spectrum, ranked by evidence, and the lines that no candidate explains.

    Parameters
    ----------
    spectrum : ObservedSpectrum
        Spectrum in K without continuum.
    candidates : sequence of SpeciesLines
        For instance all species of a catalogue in the range of the spectrum.
    sight : Sight, optional
        Background, beam, redshift.
    choices : IdentifyChoices, optional
    progress : callable, optional
        Called with the name of each added species.

    Returns
    -------
    Identification

    Raises
    ------
    ValueError
        If no candidate has a line in the range.

    Notes
    -----
    All species have nearly the same velocity and width (free within priors in the last fit). A species with a single line in the range
    depends on this line only: check its rivals.
    """
    sight, choices = sight or Sight(), choices or IdentifyChoices()
    first, last = (spectrum.frequency_mhz[i] * (1 + sight.redshift) for i in (0, -1))
    known = [candidate for candidate in candidates if len(candidate.between(first, last))]
    if not known:
        raise ValueError(f"none of {len(candidates)} candidates has a line from {first:.10g} to {last:.10g} MHz")
    velocity, width = velocity_and_width(spectrum, known, choices.velocity_km_s, choices.fwhm_km_s, sight)
    bank = _Bank(spectrum, known, choices, velocity, width, sight)
    search = _Search(spectrum, known, sight, choices, bank, progress)
    search.run()
    fit, selected = search.pruned()
    evidence = (
        tuple(
            sorted(
                (_evidence(fit, k, signal, bank, search) for k, signal in enumerate(selected.tolist())),
                key=lambda evidence: -evidence.signal,
            )
        )
        if fit
        else ()
    )
    return Identification(evidence, _unidentified(search, fit), fit, len(known), velocity, width)


class _Bank:
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


class _Search:
    """Forward selection."""

    def __init__(
        self,
        spectrum: ObservedSpectrum,
        known: Sequence[SpeciesLines],
        sight: Sight,
        choices: IdentifyChoices,
        bank: _Bank,
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
        has_lines = (alone > _VISIBLE * fit.noise).any(axis=1)
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


def _evidence(fit: SourceFit, k: int, signal: float, bank: _Bank, search: _Search) -> Evidence:
    """Evidence of a species: increase of χ² without it, visible and expected lines, rivals."""
    component = fit.components[k]
    alone = model([component], fit.spectrum.frequency_mhz, fit.sight).brightness_k
    expected, visible = _lines_seen(search.spectrum, alone)
    rest = fit.spectrum.intensity - (fit.model_k - alone)
    gain, _ = bank.best(rest, fit.noise)
    gain_of_species = gain[search.numbers[k]]
    gain[search.numbers] = 0.0
    order = np.argsort(-gain)[:_RIVALS]
    rivals = tuple(search.known[i].name for i in order if gain[i] > _RIVAL * gain_of_species)
    return Evidence(component, signal, visible, expected, rivals)


def _lines_seen(spectrum: ObservedSpectrum, alone: Floats) -> tuple[int, int]:
    """Number of expected lines (groups of channels above three standard deviations in the model), and of those that are visible."""
    noise = spectrum.noise
    high = alone > _VISIBLE * noise
    edges = np.flatnonzero(np.diff(np.concatenate([[False], high, [False]]).astype(int)))
    expected = visible = 0
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        expected += 1
        peak = start + int(alone[start:stop].argmax())
        visible += bool(spectrum.intensity[peak] > max(_VISIBLE * noise[peak], 0.5 * alone[peak]))
    return expected, visible


def _unidentified(search: _Search, fit: SourceFit | None) -> tuple[Unidentified, ...]:
    """Peaks of the residuals above five standard deviations, at least a width apart, the strongest first."""
    spectrum = search.spectrum
    brightness = np.zeros(len(spectrum)) if fit is None else fit.model_k
    residual = spectrum.intensity - brightness
    deviations = residual / search.sigma(brightness)
    width = search.bank.start[0].fwhm_km_s / KM_PER_S
    shift = 1 - search.bank.start[0].velocity_km_s / KM_PER_S
    out: list[Unidentified] = []
    taken = np.zeros(len(spectrum), dtype=np.bool_)
    for peak in np.argsort(-deviations):
        if deviations[peak] < _UNIDENTIFIED:
            break
        if taken[peak]:
            continue
        at = float(spectrum.frequency_mhz[peak])
        taken |= np.abs(spectrum.frequency_mhz - at) < 1.5 * width * at
        rest = at * (1 + search.sight.redshift) / shift
        near = [
            species.name
            for species in search.known
            if len(species.between(rest * (1 - width / 2), rest * (1 + width / 2)))
        ]
        out.append(Unidentified(at, float(spectrum.intensity[peak]), float(deviations[peak]), tuple(near[:5])))
    return tuple(out)
