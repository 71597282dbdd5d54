"""A species with all lines that could be matched, as `rotor.assignment.species.growth` makes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints

if TYPE_CHECKING:
    from rotor.assignment.search.roots import Candidate

LEAST_RATIO = 3.0  # ln of the likelihood ratio above which a type counts as present
OPEN = 1e-3  # relative standard error above which a constant is not determined
FEWEST_MOVED = 4  # lines with ΔJ ≠ 0: wrong twins of Q branches had two by chance, right constants five or more


@dataclass(frozen=True, eq=False)
class Grown:
    """A species with all lines that could be matched.

    constants (8,), covariance (8, 8) in MHz: A, B, C, DJ, DJK, DK, d1, d2. temperature_k. ratios (3,), scales (3,) by type: ln of
    likelihood ratios and of intensity scales (-inf: absent). rows, peak, residual, share, weight (m,) : assigned lines, their peaks,
    obs - calc in MHz, share in the peak, weight in the fit (1/MHz²). rms_mhz. evidence : ln of the evidence ratio against chance.
    start : the root from which it was grown. moved : how many of the peaks have lines with ΔJ ≠ 0, which a change of A + C moves.
    """

    constants: Floats
    covariance: Floats
    temperature_k: float
    ratios: Floats
    scales: Floats
    rows: Ints
    peak: Ints
    residual: Floats
    share: Floats
    weight: Floats
    rms_mhz: float
    evidence: float
    start: Candidate | None = None
    moved: int = 0

    @property
    def determined(self) -> bool:
        """Whether B and C are known to 0.1 %. Q branches alone do not determine A + C; with few other lines a twin fits as well."""
        errors = np.sqrt(np.diag(self.covariance)[1:3])
        return self.moved >= FEWEST_MOVED and bool((errors < OPEN * self.constants[1:3]).all())

    @property
    def lines(self) -> int:
        """Number of peaks assigned."""
        return len(set(self.peak.tolist()))
