"""Lines of linear and symmetric tops among peaks: the progressions ν = 2B m - 4D m³ of J = m - 1 to m.

From E = B J(J + 1) - D J²(J + 1)² (W. Gordy and R. L. Cook, Microwave Molecular Spectra, chapter on linear molecules). Two peaks with
their m give B and D; the others of a progression then lie within their errors of the calculated frequencies. The numbers m of the
strongest peaks are tried in turn; B and D that more peaks fit than chance allows are accepted. D lies between 0 and Kratzer's 4B³/ω² of the
lowest vibration ω. Neglected: H, the K structure of symmetric tops (lines of K = 0 alone are fitted where it is resolved), hyperfine
structure, and whether intensities fit one temperature.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.fitting.assignment import Assignments
from rotor.units import MHZ_PER_CM

STRONGEST = 40  # peaks whose numbers m are tried
LEAST_B_MHZ, LARGEST_M = 100.0, 150
LOWEST_VIBRATION_MHZ = 80.0 * MHZ_PER_CM
WITHIN = 4.0  # standard errors of a peak
FEWEST_LINES, LEAST_SHARE = (
    5,
    0.75,
)  # of a progression; of the lines between its first and its last, hyperfine structure hides some
MOST_CHANCE = 1e-6  # expected number of progressions as good in a list without any
MOST = 5


@dataclass(frozen=True, eq=False)
class Progression:
    """Lines from J to J + 1 of a linear or symmetric top.

    constants_mhz, errors_mhz : B and D with standard errors, scaled by the scatter where it is larger than the stated errors. lines : the
    assigned lines, ready for a fit. peak (n,) : their rows in the list of peaks. chance : expected number of progressions as good in a
    list of random peaks.
    """

    constants_mhz: Floats
    errors_mhz: Floats
    lines: Assignments
    peak: Ints
    rms_mhz: float
    chance: float

    def facts(self) -> dict[str, Any]:
        """The facts as JSON."""
        names = ("B", "D")
        return {
            "constants_mhz": dict(zip(names, self.constants_mhz.tolist(), strict=True)),
            "errors_mhz": dict(zip(names, self.errors_mhz.tolist(), strict=True)),
            "j_lower": self.lines.lower[:, 0].tolist(),
            "frequencies_mhz": self.lines.frequency_mhz.tolist(),
            "rms_mhz": self.rms_mhz,
            "chance": self.chance,
        }


def progressions(peaks: PeakList, among: NDArray[np.bool_]) -> list[Progression]:
    """The progressions among some of the peaks, each without the peaks of those before; the least probable by chance first."""
    left, series = among.copy(), list[Progression]()
    while len(series) < MOST and left.sum() >= FEWEST_LINES:
        best = _best(peaks.where(left), np.flatnonzero(left))
        if best is None:
            break
        series.append(best)
        left[best.peak] = False
    return series


def _best(peaks: PeakList, rows: Ints) -> Progression | None:
    """The progression that is least probable by chance, with peaks numbered by rows; None if chance may have made it."""
    order = np.argsort(-peaks.intensity, kind="stable")[:STRONGEST]
    best: tuple[float, Floats] = (np.log(MOST_CHANCE), np.zeros(2))
    trials, filled = 0, _filled(peaks)
    for reference in order.tolist():
        pairs = _constants(peaks, order, reference)
        trials += len(pairs)
        for constants in pairs:
            log_chance = _log_chance(peaks, constants, filled)
            if log_chance < best[0]:
                best = log_chance, constants
    if not best[1].any() or best[0] + np.log(trials) > np.log(MOST_CHANCE):
        return None
    return _fitted(peaks, rows, best[1], float(np.exp(best[0] + np.log(trials))))


def _constants(peaks: PeakList, order: Ints, reference: int) -> Floats:
    """B and D (n, 2) of pairs with possible D: the reference peak as line m, by rising m, and other peaks as the lines nearest to them."""
    frequency, error, first = peaks.frequency_mhz[order], peaks.uncertainty_mhz[order], peaks.frequency_mhz[reference]
    m = np.arange(1, min(LARGEST_M, int(first / (2 * LEAST_B_MHZ))) + 1)[:, None]
    step = first / m
    largest = 4 * (step / 2) ** 3 / LOWEST_VIBRATION_MHZ**2
    numbers = np.rint(frequency / step)
    cubic = 4 * numbers * (numbers**2 - m * m)
    with np.errstate(divide="ignore", invalid="ignore"):
        d = (numbers * step - frequency) / cubic
        spread = WITHIN * (error + peaks.uncertainty_mhz[reference] * numbers / m) / np.abs(cubic)
    possible = (numbers > 0) & (numbers <= LARGEST_M) & (cubic != 0) & (d > -spread) & (d < largest + spread)
    return np.column_stack([(step / 2 + 2 * d * m * m)[possible], d[possible]])


def _filled(peaks: PeakList) -> float:
    """Share of the recorded band that lies within the errors of a peak."""
    width = 2 * WITHIN * float(np.median(peaks.uncertainty_mhz))
    return min(1.0, len(peaks) * width / float((peaks.windows[:, 1] - peaks.windows[:, 0]).sum()))


def _matches(peaks: PeakList, constants: Floats) -> tuple[Ints, Ints, Floats]:
    """Numbers m of the recorded lines of a progression, the peak nearest to each, and its distance in standard errors."""
    b, d = constants.tolist()
    last = min(LARGEST_M, int(peaks.band_mhz[1] / (2 * b)) + 1)
    m = np.arange(max(1, int(peaks.band_mhz[0] / (2 * b))), last + 1)
    calculated = 2 * b * m - 4 * d * m**3.0
    right = np.clip(np.searchsorted(peaks.frequency_mhz, calculated), 1, len(peaks) - 1)
    peak = right - (calculated - peaks.frequency_mhz[right - 1] < peaks.frequency_mhz[right] - calculated)
    distance = np.abs(peaks.frequency_mhz[peak] - calculated) / peaks.uncertainty_mhz[peak]
    recorded = peaks.covers(calculated) | (distance < WITHIN)  # rounding at the edges of the band
    return m[recorded], peak[recorded], distance[recorded]


def _log_chance(peaks: PeakList, constants: Floats, filled: float) -> float:
    """ln of the probability that random peaks fit so many lines; 0 for too few or too many gaps. filled: see `_filled`."""
    *_, distance = _matches(peaks, constants)
    hits = np.flatnonzero(distance < WITHIN)
    if len(hits) < FEWEST_LINES:
        return 0.0
    lines = hits[-1] - hits[0] + 1
    if len(hits) < LEAST_SHARE * lines:
        return 0.0
    free, most = len(hits) - 2, lines - 2  # two lines gave B and D
    # binomial distribution: the probability of so many lines or more
    tail = sum(math.comb(most, n) * filled**n * (1 - filled) ** (most - n) for n in range(free, most + 1))
    return math.log(max(tail, 1e-300))


def _fitted(peaks: PeakList, rows: Ints, constants: Floats, chance: float) -> Progression:
    """B and D from all lines of a progression, weighted by the errors of the peaks; again, as the fit may reach further lines."""
    for _ in range(5):
        m, peak, distance = _matches(peaks, constants)
        m, peak = m[distance < WITHIN], peak[distance < WITHIN]
        weights = 1 / peaks.uncertainty_mhz[peak]
        design = np.column_stack([2.0 * m, -4.0 * m**3.0])
        scale = np.linalg.norm(design * weights[:, None], axis=0)
        solved, *_ = np.linalg.lstsq(design * weights[:, None] / scale, peaks.frequency_mhz[peak] * weights, rcond=None)
        constants = solved / scale
    residual = peaks.frequency_mhz[peak] - design @ constants
    scatter = max(1.0, float(np.sum((residual * weights) ** 2)) / (len(m) - 2))
    scaled = design * weights[:, None] / scale
    errors = np.sqrt(scatter * np.diag(np.linalg.inv(scaled.T @ scaled))) / scale
    numbers = np.column_stack([m, m - 1, peaks.frequency_mhz[peak], peaks.uncertainty_mhz[peak]])
    lines = Assignments.from_rows(["j"], numbers, peaks.source or "peaks")
    return Progression(constants, errors, lines, rows[peak], float(np.sqrt(np.mean(residual**2))), chance)
