"""Predicted lines of a species, and the likelihood ratio of the peaks near them against a random background.

Lines of a type share an intensity scale; lines closer than the width of a peak are merged. The likelihood of matched, missed and chance
peaks is computed by the loops of `rotor.assignment.search._kernels`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.search import _kernels
from rotor.assignment.search.roots import DETECTED, SPREAD, Field
from rotor.units import MHZ_PER_K

BLENDED_MHZ = 0.08  # predicted lines closer than this form one peak
TEMPERATURES = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 12.0)
MOST_LINES = 400
SHARP_MHZ = 0.03  # largest standard error of predicted lines used for the temperature


@dataclass(frozen=True, eq=False)
class Predicted:
    """Predicted lines of all types in the band: row in the table, frequency, ln of relative intensity, type, lower energy."""

    row: Ints
    frequency: Floats
    expected: Floats
    kind: Ints
    energy: Floats


def predict(field: Field, constants: Floats, temperature_k: float, most: int = MOST_LINES) -> Predicted:
    """The strongest lines of each type in the band."""
    table = field.table
    size = len(table.upper)
    energy, row, f, s_nu = np.empty(len(field.jj)), np.empty(size, np.int64), np.empty(size), np.empty(size)
    _kernels.level_energies(table.levels, table.theta, field.jj, constants, energy)
    count = _kernels.lines_in_band(
        table.theta, table.upper, table.lower, table.strength, constants, field.peaks.windows, energy, row, f, s_nu
    )
    row, f = row[:count], f[:count]
    below = energy[table.lower[row]]
    expected = np.log(s_nu[:count]) - below / (MHZ_PER_K * temperature_k)
    kind = table.kind[row]
    selected = np.zeros(count, dtype=bool)
    for q in range(3):
        rows = np.flatnonzero(kind == q)
        if len(rows) > most:
            # stable: equal strengths keep the order of lines
            rows = rows[np.argsort(-expected[rows], kind="stable")[:most]]
        selected[rows] = True
    return Predicted(row[selected], f[selected], expected[selected], kind[selected], below[selected])


def line_slopes(field: Field, rows: Ints, constants: Floats) -> Floats:
    """∂ν/∂c of lines (rows, 8)."""
    table = field.table
    slopes = np.empty((len(rows), 8))
    _kernels.derivatives(table.levels, table.theta, table.upper, table.lower, rows, constants, slopes)
    return slopes


@dataclass(frozen=True, eq=False)
class Merged:
    """Predicted lines of all types, merged into peaks.

    row, share, blend (lines,) : row in the table, share in the peak, index of the peak. centre, height, main (peaks,), slope (peaks, 8) :
    frequency, ln of the intensity, row of the strongest line, ∂ν/∂c
    """

    row: Ints
    share: Floats
    blend: Ints
    centre: Floats
    height: Floats
    main: Ints
    slope: Floats


def merged_lines(field: Field, constants: Floats, lines: Predicted, scales: Floats) -> Merged:
    """Predicted lines above the threshold; those closer than the width of a peak are merged."""
    level = lines.expected + scales[lines.kind]
    # lines just below the weakest peak may still be seen
    selected = np.flatnonzero(level > field.peaks.log_threshold - 1.0)
    # stable: lines of one frequency keep their order
    selected = selected[np.argsort(lines.frequency[selected], kind="stable")]
    row, f, level = lines.row[selected], lines.frequency[selected], level[selected]
    if not len(selected):
        none = np.zeros(0)
        return Merged(row, none, row, none, none, row, np.zeros((0, 8)))
    blend = np.concatenate([[0], np.cumsum(np.diff(f) > BLENDED_MHZ)])
    starts = np.flatnonzero(np.diff(np.concatenate([[-1], blend])))
    weight = np.exp(level - level.max())  # relative to the strongest line, so that exp does not overflow
    total = np.add.reduceat(weight, starts)
    share = weight / total[blend]
    strongest = np.lexsort((-share, blend))[starts]
    slope = np.add.reduceat(share[:, None] * line_slopes(field, row, constants), starts, axis=0)
    return Merged(
        row, share, blend, np.add.reduceat(share * f, starts), np.log(total) + level.max(), row[strongest], slope
    )


def variances(slopes: Floats, covariance: Floats) -> Floats:
    """gᵀCg of each row g."""
    # round-off may make a variance of 0 negative
    return np.asarray(np.maximum(((slopes @ covariance) * slopes).sum(axis=1), 0.0))


def line_errors(slopes: Floats, covariance: Floats, sigma0: float) -> Floats:
    """Standard errors of predicted lines, from the constants and from the measurement."""
    return np.asarray(np.sqrt(variances(slopes, covariance) + sigma0**2))


def best_temperature(field: Field, constants: Floats, covariance: Floats, sigma0: float) -> float:
    """The temperature with the largest likelihood ratio, among the given ones or on a grid."""
    if len(field.temperatures) == 1:
        return float(field.temperatures[0])
    lines = predict(field, constants, TEMPERATURES[-1], 4000)  # the highest temperature shows the most lines
    errors = line_errors(line_slopes(field, lines.row, constants), covariance, sigma0)
    # at least thirty lines, however uncertain
    sharp = errors <= max(SHARP_MHZ, float(np.partition(errors, min(30, len(errors) - 1))[min(30, len(errors) - 1)]))
    strength = lines.expected[sharp] + lines.energy[sharp] / (MHZ_PER_K * TEMPERATURES[-1])
    best, temperature = -np.inf, TEMPERATURES[0]
    for t in TEMPERATURES:
        expected = strength - lines.energy[sharp] / (MHZ_PER_K * t)
        ratios, _ = _ratios_of_types(
            field.peaks, lines.frequency[sharp], expected, lines.kind[sharp], errors[sharp], 300, 6
        )
        if ratios.sum() > best:
            best, temperature = float(ratios.sum()), t
    return temperature


def type_ratios(field: Field, lines: Predicted, errors: Floats, most: int) -> tuple[Floats, Floats]:
    """Likelihood ratios and scales by type, from the strongest lines of each; errors of lines (lines,)."""
    return _ratios_of_types(field.peaks, lines.frequency, lines.expected, lines.kind, errors, most, 16)


def _ratios_of_types(
    peaks: PeakList, frequency: Floats, expected: Floats, kind: Ints, errors: Floats, most: int, proposals: int
) -> tuple[Floats, Floats]:
    """Likelihood ratios and scales by type (3,), from the strongest lines of each; scales are proposed by the first of them."""
    order = np.argsort(-expected, kind="stable")
    return _kernels.best_scales(
        frequency[order], expected[order], kind[order], errors[order], peaks.frequency_mhz, peaks.log_intensity,
        peaks.log_density, peaks.log_threshold, SPREAD, DETECTED, most, proposals,
    )  # fmt: skip


def joint_ratio(field: Field, constants: Floats, lines: Predicted, scales: Floats, sigma0: float) -> float:
    """ln of the likelihood ratio of the lines of all types; lines of a peak are merged, and each peak is matched once."""
    merged = merged_lines(field, constants, lines, scales)
    order = np.argsort(-merged.height, kind="stable")
    return ratio_at(field.peaks, merged.centre[order], merged.height[order], sigma0)


def ratio_at(peaks: PeakList, centre: Floats, height: Floats, error: float) -> float:
    """ln of the likelihood ratio of lines, strongest first, with one standard error; each peak is matched once."""
    ratios = _kernels.joint_ratios_along(
        centre, np.zeros(len(centre)), np.zeros(1), height, np.full(len(centre), error), peaks.frequency_mhz, peaks.log_intensity,
        peaks.log_density, peaks.log_threshold, SPREAD, DETECTED,
    )  # fmt: skip
    return float(ratios[0])
