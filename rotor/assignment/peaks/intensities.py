"""Temperature and dipole ratios from the heights of peaks at the lines of known constants.

A line of type q (a, b, c) has the height I = s_q S ν² exp(-E″/kT) for hν ≪ kT, with S from the given dipole. So

    ln I - ln(S ν²) = ln s_q - E″/kT

is linear in ln s_a, ln s_b, ln s_c and 1/T; it is fitted with Huber's weights (P. J. Huber, Ann. Math. Statist. 35, 73 (1964)), since
some peaks are blends. The dipole components are the given ones times √s_q. If less than half of the lines of a type that should be
visible have a peak, the type is absent: its peaks are chance matches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.spectra.lines import Lines
from rotor.units import MHZ_PER_K

NEAR_MHZ = 0.1  # largest distance of a peak from its line, or three errors of the peak
APART_MHZ = 0.3  # lines closer than this are a blend and are left out
STRONGEST = 300  # lines that are looked for
HUBER = 1.5  # standard deviations beyond which the weight of a line decreases
LEAST_SPREAD = 1.0  # smallest range of E″/k (K) that determines a temperature
LEAST_LINES = 5
# times the threshold of the peaks; share of a type's lines above this that must have a peak
CLEARLY, LEAST_SEEN = (
    2.0,
    0.5,
)
TURNS = 30


@dataclass(frozen=True, eq=False)
class Intensities:
    """Results from intensities: temperature and error (K; nan if not determined), |μa|, |μb|, |μc| relative to the largest.

    line, peak (n,) : the compared lines and their peaks. scatter : standard deviation of ln I. log_scale (3,) : ln s of each type, -inf
    without lines.
    """

    temperature_k: float
    temperature_error_k: float
    dipole_ratio: Floats
    line: Ints
    peak: Ints
    scatter: float
    log_scale: Floats

    def heights(self, lines: Lines) -> Floats:
        """Heights of lines in the units of the peaks; at the temperature of the lines if the peaks do not determine one."""
        temperature = self.temperature_k if np.isfinite(self.temperature_k) else lines.temperature_k
        scale = self.log_scale[line_types(lines, np.arange(len(lines)))]
        below = lines.levels.energy_mhz[lines.lower] - lines.levels.energy_mhz.min()
        with np.errstate(divide="ignore"):  # a line of strength 0 has no logarithm
            strength = np.log(lines.strength_debye2 * lines.frequency_mhz**2)
        return np.asarray(np.exp(scale + strength - below / (MHZ_PER_K * temperature)))


def matched(lines: Lines, peaks: PeakList) -> tuple[Ints, Ints]:
    """Strong single lines and their peaks; -1 without a peak."""
    # stable: equal intensities keep the order of lines
    order = np.argsort(-lines.intensity_nm2_mhz, kind="stable")[:STRONGEST]
    rows = np.sort(order)
    f = lines.frequency_mhz[rows]
    gaps = np.concatenate([[np.inf], np.diff(f), [np.inf]])  # only isolated lines: a blend has the height of several
    rows = rows[(gaps[:-1] > APART_MHZ) & (gaps[1:] > APART_MHZ)]
    f = lines.frequency_mhz[rows]
    at = np.clip(np.searchsorted(peaks.frequency_mhz, f), 1, len(peaks) - 1)
    nearer = np.abs(peaks.frequency_mhz[at - 1] - f) < np.abs(peaks.frequency_mhz[at] - f)
    peak = np.where(nearer, at - 1, at)
    near = np.abs(peaks.frequency_mhz[peak] - f) < np.maximum(NEAR_MHZ, 3 * peaks.uncertainty_mhz[peak])
    return rows, np.where(near, peak, -1)


def line_types(lines: Lines, rows: Ints) -> Ints:
    """0, 1, 2 for a, b, c-type by the parities of Ka and Kc; 0 for tops without these labels."""
    quanta = lines.levels.quanta
    if not {"ka", "kc"} <= set(quanta):
        return np.zeros(len(rows), dtype=np.int64)
    ka, kc = ((quanta[name][lines.upper[rows]] - quanta[name][lines.lower[rows]]) % 2 for name in ("ka", "kc"))
    return np.where(ka == 0, 0, np.where(kc == 1, 1, 2))  # even, odd: a; odd, odd: b; odd, even: c


def fit_intensities(lines: Lines, peaks: PeakList) -> Intensities:
    """Fit temperature and dipole ratios to the heights of peaks at lines.

    Parameters
    ----------
    lines : Lines
        Lines computed with a dipole that has all components to be fitted.
    peaks : PeakList

    Returns
    -------
    Intensities

    Raises
    ------
    ValueError
        For fewer than five single lines with a peak.
    """
    rows, at = matched(lines, peaks)
    kind = line_types(lines, rows)
    absent = list[int]()
    while True:
        chosen = (at >= 0) & ~np.isin(kind, absent)
        fit = _fitted(lines, peaks, rows[chosen], at[chosen], kind[chosen])
        expected = fit.heights(lines)[rows] > CLEARLY * np.exp(peaks.log_threshold)
        shares = [
            (float((at[expected & (kind == q)] >= 0).mean()), q) for q in range(3) if (expected & (kind == q)).any()
        ]
        if not shares or min(shares)[0] >= LEAST_SEEN:
            return fit
        absent.append(min(shares)[1])


def _fitted(lines: Lines, peaks: PeakList, line: Ints, peak: Ints, kind: Ints) -> Intensities:
    """The fit of lines with their peaks."""
    if len(line) < LEAST_LINES:
        raise ValueError(
            f"{len(line)} single lines have a peak within {NEAR_MHZ:g} MHz; at least {LEAST_LINES} are needed to fit a temperature"
        )
    kinds = np.unique(kind)
    energy = (lines.levels.energy_mhz[lines.lower[line]] - lines.levels.energy_mhz.min()) / MHZ_PER_K
    value = peaks.log_intensity[peak] - np.log(lines.strength_debye2[line] * lines.frequency_mhz[line] ** 2)
    design = np.column_stack([*(kind == q for q in kinds), -energy]).astype(np.float64)
    tells = bool(np.ptp(energy) > LEAST_SPREAD)
    used = design if tells else design[:, :-1]
    value = value if tells else value + energy / lines.temperature_k
    weight = np.ones(len(value))
    for _ in range(TURNS):
        solved = np.linalg.lstsq(np.sqrt(weight)[:, None] * used, np.sqrt(weight) * value, rcond=None)[0]
        off = value - used @ solved
        # 1.4826 turns a median deviation into a standard deviation
        scatter = max(1.4826 * float(np.median(np.abs(off))), 1e-6)
        weight = np.minimum(1.0, HUBER * scatter / np.maximum(np.abs(off), 1e-12))
    temperature = error = float("nan")
    if tells and solved[-1] > 0:
        temperature = float(1 / solved[-1])
        error = float(np.sqrt(np.linalg.inv(used.T @ (weight[:, None] * used))[-1, -1]) * scatter * temperature**2)
    log_scale = np.full(3, -np.inf)
    log_scale[kinds] = solved[: len(kinds)]
    factors = np.exp((log_scale - log_scale.max()) / 2)
    dipole = factors * np.abs(np.array(lines.top.dipole_abc_debye))
    # the limit avoids 0/0 where no dipole is left
    return Intensities(temperature, error, dipole / max(dipole.max(), 1e-300), line, peak, scatter, log_scale)
