"""The search of a spectrum: one species after the other, doublets by their centres, isotopologues at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.assignment.answer import AssignAnswer, AssignedSpecies
from rotor.assignment.peaks.doublets import with_centres
from rotor.assignment.peaks.peak_list import PeakList, spurs
from rotor.assignment.request import AssignRequest
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import MOST, SAMPLES, Family, families
from rotor.assignment.search.rigid_table import JMAX, rigid_table
from rotor.assignment.search.roots import CHANCE_OF_FEW, Field
from rotor.assignment.species.confirmation import confirmed
from rotor.assignment.species.evidence import (
    FEWEST,
    NOT_FOUND,
    UNDETERMINED,
    differs,
    isotopologue_probability,
    probability,
    word,
)
from rotor.assignment.species.grown import Grown
from rotor.assignment.species.growth import grown_anew
from rotor.assignment.species.isotopologues import expected_isotopologues, find_isotopologues
from rotor.assignment.species.refinement import excess_scatter, refine
from rotor.assignment.species.successive import (
    FIRST_STAGES,
    GUESS_STAGES,
    NEXT_STAGES,
    STRONG_STAGES,
    Clock,
    Stage,
    compiled,
    explained,
    next_species,
    strength,
)

COLDEST_K, HOTTEST_K = 0.7, 12.0
SAMPLES_OF_GUESS = 120
CHANCE_OF_GUESS = 1.0  # more chance peaks in a window at first: a root near a guess is seldom wrong, and distortion may move its lines
STRONG, MANY = 20, 6  # so many of the strongest peaks without a species: a stronger one may be there
HIGH, FEW_HIGH = 0.4, 3  # and so many peaks higher than this share of the strongest species
ROUNDS_OF_ISOTOPOLOGUES = 2
LEAST_LEFT = 0.6  # of the peaks of an isotopologue that no other one before has taken
MOST_EXTRA = 3  # species beyond those of the request


@lru_cache(maxsize=32)
def families_for(
    bounds: tuple[float, ...], band_mhz: tuple[float, float], range_k: tuple[float, float], seed: int, samples: int
) -> list[Family]:
    """Families in the order in which to try them, cached by arguments."""
    pairs = np.array(bounds).reshape(3, 2)
    rng = np.random.default_rng(seed)
    return families(rigid_table(JMAX), Bounds(pairs[:, 0], pairs[:, 1]), band_mhz, range_k, rng, samples, MOST)


def search_families(request: AssignRequest) -> list[Family]:
    """Families for the band, bounds and temperature of a request."""
    temperature = request.temperature_k
    # a stated temperature is uncertain by a quarter
    range_k = (COLDEST_K, HOTTEST_K) if temperature is None else (0.8 * temperature, 1.25 * temperature)
    samples = SAMPLES if request.guess_mhz is None else SAMPLES_OF_GUESS
    return families_for(tuple(request.bounds.array.tolist()), request.peaks.band_mhz, range_k, request.seed, samples)


def answer_assign(request: AssignRequest) -> AssignAnswer:
    """Find the significant species of a spectrum and their constants.

    Parameters
    ----------
    request : AssignRequest

    Returns
    -------
    AssignAnswer
        Species by decreasing strength; empty if none was found.

    Notes
    -----
    The method is described in docs/assign.md. Of asymmetric tops only lines of J up to 30 are used; linear molecules are `progressions` of
    the answer. The answer is reproducible unless the time limit ends the search.
    """
    if len(request.peaks) < FEWEST:
        none = np.zeros(len(request.peaks), dtype=bool)
        return AssignAnswer(request, (), ~none, none)
    search = _Search(request, spurs(request.peaks))
    search.main_species()
    if request.isotopologues:
        search.isotopologues()
    return search.answer()


@dataclass(eq=False)
class _Search:
    """State of a search: the remaining peaks and the species found so far."""

    request: AssignRequest
    spurs: NDArray[np.bool_]
    species: list[AssignedSpecies] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.left = ~self.spurs
        self.table = rigid_table(JMAX)
        for guess in self.request.each_guess:
            search_families(guess)
        compiled(self.table)
        self.clock = Clock(self.request.seconds)

    def main_species(self) -> None:
        """Find the requested number of species (not isotopologues), and stronger ones."""
        extra = MOST_EXTRA if self.request.guess_mhz is None else 0
        while len(self.species) < self.request.species or (extra and self._stronger_may_be_left()):
            extra -= len(self.species) >= self.request.species
            if not self._find_next():
                break

    def _find_next(self) -> bool:
        """Find a further species, with doublets replaced by their centres if needed; whether one was found."""
        rows = np.flatnonzero(self.left)
        if len(rows) < 5:
            return False
        peaks = self.request.peaks.where(self.left)
        rivals = self._rivals(peaks, self._stages())
        if rivals:
            centres, members = with_centres(peaks, alone=True)
            doublets = self._as_doublets(centres, rivals) if excess_scatter(rivals[0], peaks) else []
            if doublets:
                return self._add(centres, rows[members], doublets)
            return self._add(peaks, np.column_stack([rows, rows]), rivals)
        if not self.species and self.request.species == 1 and len(peaks) > 2000:
            return False
        centres, members = with_centres(peaks)
        rivals = self._rivals(centres, NEXT_STAGES) if len(centres) > len(peaks) else []
        return bool(rivals) and self._add(centres, rows[members], rivals)

    def _stages(self) -> tuple[Stage, ...]:
        """Families and peaks to try for the next species."""
        if self.request.guess_mhz is not None:
            return GUESS_STAGES
        if not self.species:
            return FIRST_STAGES
        return STRONG_STAGES if self._strong_left() >= MANY else NEXT_STAGES

    def _as_doublets(self, centres: PeakList, rivals: list[Grown]) -> list[Grown]:
        """The species grown on centres of doublets, if its lines scatter less about these."""
        seen = self._field(centres, self.request)
        anew = [again for again in grown_anew(seen, rivals[0]) if again.rms_mhz < rivals[0].rms_mhz / 2]
        return sorted((again for again in anew if again.evidence > 0), key=lambda again: -again.evidence)[:1]

    def _field(self, peaks: PeakList, request: AssignRequest) -> Field:
        """The inputs of a search among peaks."""
        chance = CHANCE_OF_FEW if request.guess_mhz is None else CHANCE_OF_GUESS
        return Field(peaks, self.table, request.root_bounds, request.temperatures, chance_of_few=chance)

    def _rivals(self, peaks: PeakList, stages: Sequence[Stage]) -> list[Grown]:
        rivals = list[Grown]()
        for guess in self.request.each_guess:
            seen = self._field(peaks, guess)
            rivals += [
                grown for grown in next_species(seen, search_families(guess), stages, self.clock) if guess.allows(grown)
            ]
        rivals.sort(key=lambda grown: -grown.evidence)
        return rivals if rivals and word(probability(rivals[0])) != NOT_FOUND else []

    def _add(self, peaks: PeakList, members: Ints, rivals: list[Grown], isotopologue: str = "") -> bool:
        """Accept the first of the rivals if it is likely, and remove the peaks that it explains; whether it was accepted."""
        first = rivals[0]
        seen = self._field(peaks, self.request)
        best = first if isotopologue else confirmed(seen, first, all_types=self.request.guess_mhz is not None)
        # rivals within exp(10) share the probability
        twins = [other for other in rivals[1:] if other.evidence > first.evidence - 10 and differs(first, other)]
        p = isotopologue_probability(best) if isotopologue else probability(best)
        p /= 1 + sum(float(np.exp(other.evidence - first.evidence)) for other in twins)
        if word(p) == NOT_FOUND:  # without the groups that have no clear place
            best, p = first, UNDETERMINED * probability(first)
        if word(p) == NOT_FOUND:
            return False
        refined = refine(best, peaks, self.table)
        others = tuple((other.constants[:3], other.evidence) for other in twins)
        self.species.append(
            AssignedSpecies(best, refined, members[best.peak], strength(seen, best), p, others, isotopologue)
        )
        mask = explained(seen, best)
        self.left[members[mask].ravel()] = False
        return True

    def _strong_left(self) -> int:
        """Number of the strongest peaks without a species."""
        order = np.argsort(np.where(self.spurs, 0.0, -self.request.peaks.intensity))[:STRONG]
        return int(self.left[order].sum())

    def _stronger_may_be_left(self) -> bool:
        """Whether a stronger species may remain: several strong peaks are left, or the strongest of all."""
        if self._strong_left() >= MANY or not self.species:
            return True
        high = np.sort(self.request.peaks.intensity[self.left])[-FEW_HIGH:] / max(
            species.strength for species in self.species
        )
        return bool(len(high) == FEW_HIGH and (high[0] > HIGH or high[-1] > 1.0))

    def isotopologues(self) -> None:
        """Isotopologues of the strongest species."""
        if not self.species or self.request.molecule is None:
            return
        parent = max(self.species, key=lambda species: species.strength)
        constants = replace(parent.grown, constants=parent.refined.values)
        waiting = expected_isotopologues(parent.refined.values, self.request.molecule)
        for _ in range(ROUNDS_OF_ISOTOPOLOGUES):
            rows = np.flatnonzero(self.left)
            if self.clock.over() or len(rows) < 5:
                break
            peaks = self.request.peaks.where(self.left)
            pairs = find_isotopologues(peaks, constants, waiting, self.table, self.clock.over)
            for isotopologue, grown in pairs:
                free = self.left[rows[grown.peak]].mean() > LEAST_LEFT
                if free and self._add(peaks, np.column_stack([rows, rows]), [grown], isotopologue.label):
                    waiting.remove(isotopologue)
            if not pairs:
                break

    def answer(self) -> AssignAnswer:
        """Species by decreasing strength, followed by isotopologues."""
        order = sorted(self.species, key=lambda species: (bool(species.isotopologue), -species.strength))
        return AssignAnswer(self.request, tuple(order), self.left, self.spurs, self.clock.over())
