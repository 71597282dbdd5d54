"""Request for constants from a spectrum, and the search that answers it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.answer import AssignAnswer, AssignedSpecies
from rotor.assignment.confirmation import confirmed
from rotor.assignment.doublets import with_centres
from rotor.assignment.evidence import (
    FEWEST,
    NOT_FOUND,
    UNDETERMINED,
    differs,
    isotopologue_probability,
    probability,
    word,
)
from rotor.assignment.families import MOST, SAMPLES, Bounds, Family, families
from rotor.assignment.growth import Grown, grown_anew
from rotor.assignment.guesses import guess_values
from rotor.assignment.isotopologues import expected_isotopologues, find_isotopologues
from rotor.assignment.peaks import PeakList, spurs
from rotor.assignment.refinement import excess_scatter, refine
from rotor.assignment.rigid_table import JMAX, rigid_table
from rotor.assignment.search import CHANCE_OF_FEW, Field
from rotor.assignment.species import (
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
from rotor.molecules.molecule import Molecule
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Custom, Flag, Numbers, Quantity, Whole

LOWEST_MHZ, HIGHEST_MHZ = (500.0, 200.0, 150.0), (20000.0, 12000.0, 9000.0)  # default bounds of A, B, C
COLDEST_K, HOTTEST_K = 0.7, 12.0
TRIED_K = (1.0, 2.0, 4.0, 8.0)
GUESS_ERROR = 0.033  # of a guess: 3 % and a little
SAMPLES_OF_GUESS = 120
CHANCE_OF_GUESS = 1.0  # more chance peaks in a window at first: a root near a guess is seldom wrong, and distortion may move its lines
ROOT_MARGINS = (0.15, 0.03, 0.03)  # of A, B, C of roots beyond the error of a guess
STRONG, MANY = 20, 6  # so many of the strongest peaks without a species: a stronger one may be there
HIGH, FEW_HIGH = 0.4, 3  # and so many peaks higher than this share of the strongest species
ROUNDS_OF_ISOTOPOLOGUES = 2
LEAST_LEFT = 0.6  # of the peaks of an isotopologue that no other one before has taken
MOST_EXTRA = 3  # species beyond those of the request


@dataclass(frozen=True)
class AssignRequest:
    """A search for constants in a spectrum; all fields are checked when the request is made.

    peaks : of the spectrum. species : number of species to find; stronger ones found on the way are added. temperature_k : of the gas;
    None: unknown. guess_mhz : A, B, C known to 3 %, or several such triples. low_mhz, high_mhz : bounds of A, B, C. isotopologues :
    whether to search for those of `molecule`. molecule : geometry of the first species. seconds : time limit; the search ends with the
    species found so far. seed : of the sample of tops from which families of lines are chosen.
    """

    peaks: PeakList
    molecule: Molecule | None = field(default=None, repr=False)
    species: int = declared(1, Whole(1, 20), "How many species to look for", "observables.species", common=True)
    temperature_k: float | None = declared(
        None,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the gas (K); by default it is found",
        "conditions.temperature",
        common=True,
        example=2.0,
    )
    guess_mhz: tuple[float, ...] | None = declared(
        None,
        Custom(guess_values, list, "A,B,C", list[float] | str),
        "A, B, C known to 3 % (MHz), or SMILES:... with constants of its conformers",
        "observables.guess",
        common=True,
        example=[2458.0, 490.0, 409.0],
    )
    low_mhz: tuple[float, ...] | None = declared(
        None, Numbers("MHz", (3,), "500,200,150"), "Least A, B, C (MHz); by default 500,200,150", "observables.low",
        example=[500.0, 200.0, 150.0],
    )  # fmt: skip
    high_mhz: tuple[float, ...] | None = declared(
        None, Numbers("MHz", (3,), "20000,12000,9000"), "Greatest A, B, C (MHz); by default 20000,12000,9000",
        "observables.high", example=[20000.0, 12000.0, 9000.0],
    )  # fmt: skip
    isotopologues: bool = declared(
        False,
        Flag(),
        "Look for isotopologues of the first species; needs its geometry",
        "observables.isotopologues",
        common=True,
    )
    seconds: float = declared(
        20.0, Quantity("s", above=0, metavar="T"), "End the search after so many seconds", "numerics.seconds"
    )
    seed: int = declared(1, Whole(0), "Seed of the sample of tops", "numerics.seed")

    def __post_init__(self) -> None:
        check_fields(self)
        if not (self._range.low > 0).all() or not (self._range.low < self._range.high).all():
            raise ValueError(
                f"low_mhz, high_mhz: {self._range.low}, {self._range.high}: expected 0 < low < high for A, B and C"
            )
        for a, b, c in self._guesses:
            if not a > b > c > 0:
                raise ValueError(f"guess_mhz: {self.guess_mhz}: expected A > B > C > 0")
        if self.isotopologues and self.molecule is None:
            raise ValueError(
                "isotopologues: a geometry of the first species is needed; give it as the molecule (--molecule FILE)"
            )

    @property
    def each_guess(self) -> list[AssignRequest]:
        """A request for each guess; the request itself with one guess or none."""
        return [replace(self, guess_mhz=guess) for guess in self._guesses] if len(self._guesses) > 1 else [self]

    @property
    def _guesses(self) -> list[tuple[float, ...]]:
        return [tuple(self.guess_mhz[n : n + 3]) for n in range(0, len(self.guess_mhz), 3)] if self.guess_mhz else []

    @property
    def bounds(self) -> Bounds:
        """Bounds of A, B, C: those of the first guess, or of the range without a guess."""
        if self.guess_mhz is None:
            return self._range
        centre = np.array(self.guess_mhz[:3])
        return Bounds(centre * (1 - GUESS_ERROR), centre * (1 + GUESS_ERROR))

    @property
    def root_bounds(self) -> Bounds:
        """Bounds of the constants of roots; wider, because the rigid A from three lines of a near-prolate top has an error of some %."""
        if self.guess_mhz is None:
            return self._range
        margin = np.array(ROOT_MARGINS)
        return Bounds(self.bounds.low * (1 - margin), self.bounds.high * (1 + margin))

    def allows(self, grown: Grown) -> bool:
        """Whether the constants agree with the guess within its error, or within five of their standard errors."""
        if self.guess_mhz is None:
            return True
        errors = 5 * np.sqrt(np.diag(grown.covariance)[:3])
        values = grown.constants[:3]
        return bool((values + errors > self.bounds.low).all() and (values - errors < self.bounds.high).all())

    @property
    def _range(self) -> Bounds:
        return Bounds(np.array(self.low_mhz or LOWEST_MHZ), np.array(self.high_mhz or HIGHEST_MHZ))

    @property
    def temperatures(self) -> Floats:
        """Trial temperatures (K)."""
        return np.array(TRIED_K if self.temperature_k is None else [self.temperature_k])


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
    The method is described in docs/assign.md. Only asymmetric tops with lines of J up to 30 are found. The answer is reproducible unless
    the time limit ends the search.
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
