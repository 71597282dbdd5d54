"""A request for constants from a spectrum, and what answers it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.assignment.evidence import probability, word
from rotor.assignment.families import Bounds, Family, families
from rotor.assignment.growth import Grown
from rotor.assignment.peaks import PeakList, spurs
from rotor.assignment.refinement import Refined, refine
from rotor.assignment.rigid_table import rigid_table
from rotor.assignment.search import Field
from rotor.assignment.species import (
    FIRST_STAGES,
    NEXT_STAGES,
    Clock,
    explained,
    next_species,
    strength,
    without,
)
from rotor.checks import require_positive, require_whole

WIDEST = Bounds(np.array([500.0, 200.0, 150.0]), np.array([20000.0, 12000.0, 9000.0]))
COLDEST_K, HOTTEST_K = 0.7, 12.0
JMAX = 30
GUESS = 0.03
TRIED_K = (1.0, 2.0, 4.0, 8.0)


@dataclass(frozen=True)
class AssignRequest:
    """Constants to find.

    peaks : of the spectrum. temperature_k : of the gas, None where it is not known. species : how many to look for
    guess : A, B, C in MHz known to 3 %. bounds : of A, B, C in MHz. seconds : after which the search ends with what it has
    """

    peaks: PeakList
    temperature_k: float | None = None
    species: int = 1
    guess: tuple[float, float, float] | None = None
    bounds: Bounds = WIDEST
    seconds: float = 20.0
    seed: int = 1

    def __post_init__(self) -> None:
        require_whole("species", self.species, 1, 20)
        require_positive("seconds", self.seconds, "s")
        if self.temperature_k is not None:
            require_positive("temperature_k", self.temperature_k, "K")

    @property
    def search_bounds(self) -> Bounds:
        """The bounds, or those of the guess."""
        if self.guess is None:
            return self.bounds
        centre = np.array(self.guess)
        return Bounds(centre * (1 - 1.1 * GUESS), centre * (1 + 1.1 * GUESS))


@dataclass(frozen=True, eq=False)
class AssignedSpecies:
    """One species of the answer."""

    grown: Grown
    refined: Refined
    peak: NDArray[np.int64]
    strength: float
    probability: float
    twins: tuple[Floats, ...] = ()

    @property
    def word(self) -> str:
        """certain, likely or not found."""
        return word(self.probability)


@dataclass(frozen=True, eq=False)
class AssignAnswer:
    """Species by falling strength, and which peaks nothing explains."""

    request: AssignRequest
    species: tuple[AssignedSpecies, ...]
    unexplained: NDArray[np.bool_]
    spurs: NDArray[np.bool_]


@lru_cache(maxsize=8)
def _families(bounds: tuple[float, ...], band: tuple[float, float], temperature: tuple[float, float], seed: int) -> list[Family]:
    low_high = np.array(bounds).reshape(3, 2)
    rng = np.random.default_rng(seed)
    return families(rigid_table(JMAX), Bounds(low_high[:, 0], low_high[:, 1]), band, temperature, rng)


def answer_assign(request: AssignRequest) -> AssignAnswer:
    """The answer."""
    clock = Clock(request.seconds)
    peaks = request.peaks
    of_clock = spurs(peaks)
    known = request.temperature_k
    temperatures = np.array(TRIED_K if known is None else [known])
    bounds = request.search_bounds
    range_k = (COLDEST_K, HOTTEST_K) if known is None else (0.9 * known, 1.1 * known)
    tried = _families(tuple(bounds.array.tolist()), peaks.band_mhz, range_k, request.seed)
    left = ~of_clock
    table = rigid_table(JMAX)
    out = list[AssignedSpecies]()
    extra = 2
    while True:
        seen = Field(peaks.where(left), table, bounds, temperatures)
        stages = FIRST_STAGES if len(out) < request.species else NEXT_STAGES
        rivals = next_species(seen, tried, stages, clock)
        if not rivals or word(probability(rivals[0])) == "not found":
            break
        best = rivals[0]
        rows = np.flatnonzero(left)
        refined = refine(best, seen.peaks, table)
        twins = tuple(one.constants for one in rivals[1:] if one.evidence > best.evidence - 5)
        out.append(
            AssignedSpecies(best, refined, rows[best.peak], strength(seen, best), probability(best), twins)
        )
        left[rows[explained(seen, best, 0.1)]] = False
        if len(out) >= request.species:
            if extra == 0 or not _stronger_left(peaks, left, of_clock, out):
                break
            extra -= 1
    out.sort(key=lambda one: -one.strength)
    return AssignAnswer(request, tuple(out), left, of_clock)


def _stronger_left(
    peaks: PeakList, left: NDArray[np.bool_], of_clock: NDArray[np.bool_], species: list[AssignedSpecies]
) -> bool:
    """Whether several of the strongest peaks belong to nothing yet, so that a stronger species may be there."""
    order = np.argsort(np.where(of_clock, 0.0, -peaks.intensity))[:20]
    return int(left[order].sum()) >= 5
