"""Request for constants from a spectrum."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.assignment.guesses import guess_values
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.search.bounds import Bounds
from rotor.requests.field import check_fields, declared
from rotor.requests.lists import Numbers
from rotor.requests.readers import Custom, Flag, Quantity, Whole

if TYPE_CHECKING:
    from rotor.assignment.species.grown import Grown
    from rotor.molecules.molecule import Molecule

LOWEST_MHZ, HIGHEST_MHZ = (500.0, 200.0, 150.0), (20000.0, 12000.0, 9000.0)  # default bounds of A, B, C
TRIED_K = (1.0, 2.0, 4.0, 8.0)
LEAST_A_MHZ = 50.0  # of a guess; the least bound of A without one is far above, and guesses in GHz are below
GUESS_ERROR = 0.033  # of a guess: 3 % and a little
ROOT_MARGINS = (0.15, 0.03, 0.03)  # of A, B, C of roots beyond the error of a guess


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
    species: int = declared(1, Whole(1, 20), "Number of species to look for", "observables.species", common=True)
    temperature_k: float | None = declared(
        None,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the gas (K); by default estimated",
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
        20.0, Quantity("s", above=0, metavar="T"), "End the search after this many seconds", "numerics.seconds"
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
            if a < LEAST_A_MHZ:
                raise ValueError(
                    f"guess_mhz: A = {a:g} MHz: no lines of such a top can be searched; another unit stands behind the numbers, "
                    "as in 9,3,2.4GHz"
                )
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
