"""From evidence to a probability and a word."""

from __future__ import annotations

import numpy as np

from rotor.assignment.growth import Grown

MIDDLE, WIDTH = 40.0, 8.0


def probability(grown: Grown) -> float:
    """Probability that the constants are right."""
    return float(1 / (1 + np.exp(-(grown.evidence - MIDDLE) / WIDTH)))


def word(p: float) -> str:
    """certain, likely or not found."""
    return "certain" if p > 0.99 else "likely" if p > 0.5 else "not found"
