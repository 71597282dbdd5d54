"""Result of an assignment: species, their lines, and unexplained peaks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.doublets import WIDEST_MHZ, look_split, split_lines
from rotor.assignment.peaks.progressions import Progression, progressions
from rotor.assignment.request import AssignRequest
from rotor.assignment.search.rigid_table import PARAMETERS, TYPES
from rotor.assignment.species.evidence import NOT_FOUND, word
from rotor.assignment.species.grown import LEAST_RATIO, Grown
from rotor.fitting.assignment import Assignments
from rotor.requests.budget import ErrorBudget, ErrorTerm
from rotor.table import Table, TextOf
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

if TYPE_CHECKING:  # the search and its compiled loops are loaded by a search only
    from rotor.assignment.species.refinement import Refined


@dataclass(frozen=True, eq=False)
class AssignedSpecies:
    """An assigned species.

    grown, refined : result of the search, and the fit. peak (m, 2) : peaks of the request for each assigned line, two for a split line.
    strength : height of the strongest line in the units of the spectrum. probability : that the constants are right. twins : other
    constants (3,) with evidence within a factor e^10. isotopologue : name, if it is an isotopologue of the first species.
    """

    grown: Grown
    refined: Refined
    peak: Ints
    strength: float
    probability: float
    twins: tuple[tuple[Floats, float], ...] = ()
    isotopologue: str = ""

    @property
    def word(self) -> str:
        """The confidence as a word: certain or likely."""
        return word(self.probability)

    @property
    def constants(self) -> Constants:
        """A, B, C and quartic constants with standard errors, S reduction."""
        values, errors = self.refined.values.tolist(), self.refined.errors.tolist()
        return Constants(
            **dict(zip(PARAMETERS, values, strict=True)), reduction="S", representation="Ir",
            uncertainties=dict(zip(PARAMETERS, errors, strict=True)),
        )  # fmt: skip

    @property
    def lines(self) -> Assignments:
        """The assigned lines, ready for a fit."""
        return self.refined.fit.lines

    @property
    def kind(self) -> str:
        """The types of its lines, such as "ac"."""
        return "".join(name for name, ratio in zip(TYPES, self.grown.ratios, strict=True) if ratio > LEAST_RATIO)

    @property
    def dipole_ratio(self) -> Floats:
        """|μa|, |μb|, |μc| relative to the largest (3,), from intensities ∝ μ²."""
        scales = np.where(self.grown.ratios > LEAST_RATIO, self.grown.scales, -np.inf)
        return np.asarray(np.exp((scales - scales.max()) / 2))  # intensity goes with the square of the dipole

    @property
    def split(self) -> bool:
        """Whether the lines are split into doublets."""
        # a third of the assigned lines in two peaks: the spectrum is split
        return bool((self.peak[:, 0] != self.peak[:, 1]).mean() > 0.3)

    @property
    def top(self) -> Top:
        """A top with the constants and the relative dipole."""
        a, b, c = self.dipole_ratio.tolist()
        return Top.from_constants(self.constants, dipole_abc_debye=(a, b, c))

    def facts(self) -> dict[str, Any]:
        """The facts of the species, without its lines."""
        constants, errors = self.refined.values.tolist(), self.refined.errors.tolist()
        return {
            "word": self.word,
            "probability": self.probability,
            "evidence": self.grown.evidence,
            "constants_mhz": dict(zip(PARAMETERS, constants, strict=True)),
            "errors_mhz": dict(zip(PARAMETERS, errors, strict=True)),
            "open_constants": list(self.refined.open_constants),
            "types": self.kind,
            "dipole_ratio": self.dipole_ratio.tolist(),
            "temperature_k": self.grown.temperature_k,
            "lines": len(self.lines),
            "peaks": len(np.unique(self.peak)),
            "rms_mhz": self.refined.fit.rms_mhz(),
            "weighted_rms": self.refined.fit.weighted_rms,
            "strength": self.strength,
            "split_lines": self.split,
            "isotopologue": self.isotopologue or None,
            "twins": [{"constants_mhz": twin.tolist(), "evidence": evidence} for twin, evidence in self.twins],
        }


@dataclass(frozen=True, eq=False, repr=False)
class AssignedPeaks(Table):
    """The peaks of a spectrum: species of each (0: none), its first line, and the calculated frequency of that line."""

    frequency_mhz: Floats
    intensity: Floats
    uncertainty_mhz: Floats
    species: Ints
    spur: NDArray[np.bool_]
    upper: Ints
    lower: Ints
    calculated_mhz: Floats

    @property
    def residual_mhz(self) -> Floats:
        """Observed minus calculated (n,); nan for unassigned peaks."""
        return self.frequency_mhz - self.calculated_mhz

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """All columns; -1 and nan for unassigned peaks."""
        labels = {
            f"{name}_{side}": getattr(self, side)[:, n]
            for side in ("upper", "lower")
            for n, name in enumerate(("j", "ka", "kc"))
        }
        return {
            "frequency_mhz": self.frequency_mhz, "intensity": self.intensity, "uncertainty_mhz": self.uncertainty_mhz,
            "species": self.species, "spur": self.spur.astype(np.int64), **labels, "calculated_mhz": self.calculated_mhz,
            "residual_mhz": self.residual_mhz,
        }  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class AssignAnswer(TextOf):
    """Species by decreasing strength, and unexplained peaks.

    unexplained, spurs (n,) : peaks of the request without a species, and harmonics of a clock. ended : whether the time limit ended
    the search.
    """

    shown = "table"

    request: AssignRequest
    species: tuple[AssignedSpecies, ...]
    unexplained: NDArray[np.bool_]
    spurs: NDArray[np.bool_]
    ended: bool = False

    @property
    def word(self) -> str:
        """The confidence of the first species: certain, likely or not found."""
        return self.species[0].word if self.species else NOT_FOUND

    @cached_property
    def progressions(self) -> tuple[Progression, ...]:
        """Linear and symmetric tops whose lines are among the unexplained peaks."""
        return tuple(progressions(self.request.peaks, self.unexplained))

    @property
    def notes(self) -> tuple[str, ...]:
        """A remark on each species whose lines look split, though it was assigned without doublets."""
        return tuple(filter(None, map(self._note_on_splittings, range(1, len(self.species) + 1))))

    def _note_on_splittings(self, number: int) -> str:
        species = self.species[number - 1]
        near, expected = split_lines(self.request.peaks, species.peak.ravel(), self.unexplained)
        if species.split or not look_split(near, expected):
            return ""
        lines = len(np.unique(species.peak))
        return (
            f"species {number}: {near} of its {lines} peaks have an unassigned peak of similar height within {WIDEST_MHZ:g} MHz "
            f"(by chance {expected:.1g}): lines look split, by internal rotation or nuclear spins; its constants, those of distortion "
            "first, may describe the splittings"
        )

    @property
    def table(self) -> AssignedPeaks:
        """All peaks with their assignments."""
        peaks = self.request.peaks
        size = len(peaks)
        species, calculated = np.zeros(size, dtype=np.int64), np.full(size, np.nan)
        upper, lower = np.full((size, 3), -1), np.full((size, 3), -1)
        # strong species last, so that a shared peak names the strongest
        for number, member in reversed(list(enumerate(self.species, 1))):
            fit = member.refined.fit
            for side in (1, 0):
                at = member.peak[:, side]
                species[at], calculated[at] = number, fit.blended_mhz
                upper[at], lower[at] = fit.lines.upper, fit.lines.lower
        return AssignedPeaks(
            peaks.frequency_mhz, peaks.intensity, peaks.uncertainty_mhz, species, self.spurs, upper, lower, calculated
        )

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the frequencies of the first species, assuming that its assignment is right."""
        from rotor.fitting.budgets import predictions_budget

        quantity = "frequencies of the first species"
        if not self.species:
            unknown = ErrorTerm(None, "no species was found")
            return ErrorBudget(quantity, "MHz", *(unknown,) * 5)
        first = self.species[0]
        budget = predictions_budget(first.refined.fit)
        right = f"{budget.model.source}; the assignment is right with a probability of {first.probability:.4f}"
        return replace(budget, of=quantity, model=replace(budget.model, source=right))

    def facts(self) -> dict[str, Any]:
        """The facts of the answer, without the table of peaks."""
        return {
            "errors": self.errors.as_json(),
            "word": self.word,
            "peaks": len(self.request.peaks),
            "band_mhz": list(self.request.peaks.band_mhz),
            "spurs": int(self.spurs.sum()),
            "unexplained": int(self.unexplained.sum()),
            "ended_by_time": self.ended,
            "species": [species.facts() for species in self.species],
            "progressions": [progression.facts() for progression in self.progressions],
        }
