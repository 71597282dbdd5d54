"""From evidence to the probability that constants are right, and to a word.

The evidence ln Z (`species.growth.with_evidence`) compares a species with a random background of peaks. Real spectra are not
random: another species' pattern, a multiple of J or a twin fit in part. The odds of right constants therefore rise as a power of ln Z
up to a ceiling. Both were fitted to the answers of 1,000 synthetic spectra (`benchmarks/bench_assign.py`; calibration:
docs/validation/assign.md): each half of them predicts how often the other half is right.
"""

from __future__ import annotations

import numpy as np

from rotor.assignment.species.grown import Grown

CERTAIN, LIKELY, NOT_FOUND = "certain", "likely", "not found"
LEAST_CERTAIN, LEAST_LIKELY = 0.99, 0.5
MIDDLE, POWER = 40.0, 3.68  # ln Z at even odds, and the power of ln Z with which the odds rise
CEILING = 0.9977  # 4 of 1,372 answers with more than 0.99 were wrong, three of them at ln Z above 300
MIDDLE_OF_ISOTOPOLOGUES = 6.0
UNDETERMINED = 0.51  # factor for constants that the lines do not determine: a twin is as good
FEWEST = 6  # peaks below which nothing is found: three constants, a temperature and a scale are fitted


def probability(grown: Grown) -> float:
    """Probability that the constants of a species are right."""
    if grown.lines < FEWEST:
        return 0.0
    factor = 1.0 if grown.determined else UNDETERMINED
    odds = float(max(grown.evidence, 0.0) / MIDDLE) ** POWER
    return float(factor * CEILING * odds / (1 + odds))


def isotopologue_probability(grown: Grown) -> float:
    """Probability that the constants of an isotopologue are right; its prior volume of constants is small."""
    # limited, so that exp does not overflow
    return float(1 / (1 + np.exp(-np.clip((grown.evidence - MIDDLE_OF_ISOTOPOLOGUES) / 2.0, -50, 50))))


def differs(species: Grown, other: Grown) -> bool:
    """Whether A, B, C of two species differ by more than five standard errors."""
    variances = np.diag(species.covariance)[:3] + np.diag(other.covariance)[:3]
    return bool((np.abs(species.constants[:3] - other.constants[:3]) > 5 * np.sqrt(variances)).any())


def word(p: float) -> str:
    """certain from 0.99, likely from 0.5 on, else not found.

    >>> word(0.999), word(0.7), word(0.1)
    ('certain', 'likely', 'not found')
    """
    return CERTAIN if p >= LEAST_CERTAIN else LIKELY if p >= LEAST_LIKELY else NOT_FOUND
