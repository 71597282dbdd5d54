"""Identification of species in a spectrum: those that the selection needs, by their evidence, and the lines that none explains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.fit import SourceFit
from rotor.observed.identification.selection import VISIBLE, IdentifyChoices, Selection, Templates
from rotor.observed.model.model import KM_PER_S, Component, Sight, model
from rotor.observed.model.species import SpeciesLines
from rotor.observed.spectrum import ObservedSpectrum, band_text
from rotor.observed.start import velocity_and_width
from rotor.table import Table

_UNIDENTIFIED = 5.0  # smallest peak of an unidentified line, in standard deviations
_RIVAL = 0.7  # smallest gain of a rival outside the model, relative to the evidence of a species
_RIVALS = 3
_CHANCE = 0.05  # expected number of candidates that match as well by chance, above which a species is uncertain


@dataclass(frozen=True)
class Evidence:
    """A species that the spectrum needs.

    component: fitted. signal: increase of χ² without it, divided by the mean square of the residuals in its channels.
    expected: number of its lines above three standard deviations in the model. visible: number of these that the spectrum shows.
    chance: expected number of candidates whose lines, at random frequencies, would be visible as often (`chance_matches`). rivals: species
    outside the model that explain nearly as much.
    """

    component: Component
    signal: float
    visible: int
    expected: int
    chance: float
    rivals: tuple[str, ...] = ()

    @property
    def single_line(self) -> bool:
        """Whether at most one of its lines is visible; such a line may belong to a species outside the candidates."""
        return self.visible <= 1

    @property
    def uncertain(self) -> bool:
        """Whether a candidate may match as well by chance."""
        return self.chance > _CHANCE


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
        """species, signal, visible, expected, single_line, chance, uncertain, column_per_cm2, excitation_k, velocity_km_s, fwhm_km_s."""
        parts = [evidence.component for evidence in self.species]
        numbers = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")
        table: dict[str, Any] = {"species": np.array(self.names, dtype=np.str_)}
        table |= {
            name: np.array([getattr(evidence, name) for evidence in self.species])
            for name in ("signal", "visible", "expected", "single_line", "chance", "uncertain")
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
    depends on this line only: check its rivals. A species is uncertain if as many lines of a candidate would lie on signals by chance, as
    in a narrow piece of a spectrum that is full of lines.
    """
    sight, choices = sight or Sight(), choices or IdentifyChoices()
    first, last = (spectrum.frequency_mhz[i] * (1 + sight.redshift) for i in (0, -1))
    known = [candidate for candidate in candidates if len(candidate.between(first, last))]
    if not known:
        species = f"none of {len(candidates)} candidates" if candidates else "no species"
        raise ValueError(f"{species} has a line {band_text(first, last)}")
    velocity, width = velocity_and_width(spectrum, known, choices.velocity_km_s, choices.fwhm_km_s, sight)
    bank = Templates(spectrum, known, choices, velocity, width, sight)
    search = Selection(spectrum, known, sight, choices, bank, progress)
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


def _evidence(fit: SourceFit, k: int, signal: float, bank: Templates, search: Selection) -> Evidence:
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
    spectrum = search.spectrum
    occupied = float(np.mean(spectrum.intensity > VISIBLE * spectrum.noise))
    return Evidence(
        component, signal, visible, expected, chance_matches(visible, expected, occupied, len(search.known)), rivals
    )


def chance_matches(visible: int, expected: int, occupied: float, candidates: int) -> float:
    """Expected number of candidates of which so many of the expected lines, at random frequencies, lie on signals of the spectrum.

    n Σ_k≥v (m k) f^k (1 - f)^(m-k) with v visible of m expected lines, the share f of channels with a signal, and n candidates.

    >>> round(chance_matches(1, 1, 0.1, 20), 6), round(chance_matches(4, 4, 0.1, 20), 6)
    (2.0, 0.002)
    """
    from scipy.special import bdtrc

    return candidates * float(bdtrc(visible - 1, expected, occupied))


def _lines_seen(spectrum: ObservedSpectrum, alone: Floats) -> tuple[int, int]:
    """Number of expected lines (groups of channels above three standard deviations in the model), and of those that are visible."""
    noise = spectrum.noise
    high = alone > VISIBLE * noise
    edges = np.flatnonzero(np.diff(np.concatenate([[False], high, [False]]).astype(int)))
    expected = visible = 0
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        expected += 1
        peak = start + int(alone[start:stop].argmax())
        visible += bool(spectrum.intensity[peak] > max(VISIBLE * noise[peak], 0.5 * alone[peak]))
    return expected, visible


def _unidentified(search: Selection, fit: SourceFit | None) -> tuple[Unidentified, ...]:
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
