"""Peak lists of known molecules, to be assigned."""

from __future__ import annotations

import numpy as np

import rotor
from rotor.assignment.answer import AssignAnswer
from rotor.assignment.peaks.peak_list import PeakList, peak_list

BAND = (8000.0, 18000.0)

TRUTH = {"A": 2237.03, "B": 1368.45, "C": 884.21, "DJ": 4e-5, "DJK": 1e-4, "DK": 2e-4, "d1": -1e-5, "d2": -1e-6}

SECOND = {"A": 3614.2, "B": 811.4, "C": 702.9, "DJ": 5e-5, "DJK": 2e-4, "DK": 1e-3, "d1": -6e-6, "d2": -5e-7}


def lines_of(
    truth: dict[str, float], dipole: tuple[float, float, float], height: float,
    temperature_k: float = 2.0, band: tuple[float, float] = BAND,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Frequencies and intensities above 1, of which `height` is the largest."""
    top = rotor.Top.from_constants(
        rotor.Constants(**truth, reduction="S", representation="Ir"), dipole_abc_debye=dipole
    )
    lines = rotor.api.line_list(top, temperature_k=temperature_k, jmax=30, range_mhz=band)
    intensity = 10 ** lines.columns["lgint"]
    intensity *= height / intensity.max()
    return lines.frequency_mhz[intensity > 1.0], intensity[intensity > 1.0]


def spectrum(seed: int = 5, foreign: int = 60, second: bool = False) -> PeakList:
    """A b- and c-type species, foreign peaks, errors of 5 kHz; on demand an a-type species of half its strength."""
    rng = np.random.default_rng(seed)
    f, i = lines_of(TRUTH, (0.0, 1.0, 0.6), 100.0)
    if second:
        g, j = lines_of(SECOND, (1.0, 0.0, 0.0), 50.0)
        f, i = np.concatenate([f, g]), np.concatenate([i, j])
    i = i * np.exp(0.2 * rng.normal(size=len(i)))
    f = np.concatenate([f + 0.005 * rng.normal(size=len(f)), rng.uniform(*BAND, foreign)])
    i = np.concatenate([i, rng.random(foreign) ** (-1 / 0.8)])
    return peak_list(f, i, 0.005, band_mhz=BAND)


def is_right(answer: AssignAnswer, number: int, truth: dict[str, float]) -> bool:
    """Whether A, B, C are within five standard errors and 0.1 %."""
    constants = answer.species[number].constants
    off = np.array([constants[name] - truth[name] for name in "ABC"])
    errors = np.array([constants.uncertainties[name] for name in "ABC"])
    values = np.array([truth[name] for name in "ABC"])
    return bool((np.abs(off) < 5 * errors).all() and (np.abs(off) < 1e-3 * values).all())
