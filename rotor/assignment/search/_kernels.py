"""Compiled loops of the search. `rotor.api.line_list` (lines of a top) and loops in the tests are the plain forms.

Loops over elements only: expressions of whole arrays, sorting and slices compile several times as long, part of it for the texts of errors.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.kernels import kernel
from rotor.units import MHZ_PER_K

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@kernel(nogil=True)
def place(theta: Floats, kappa: float) -> tuple[int, float]:
    """Grid interval of κ and the position within it, from 0 to 1, for cubic interpolation between four points."""
    angle = np.arccos(min(1.0, max(-1.0, -kappa)))  # cos θ = -κ; round-off may leave the range
    x = (angle - theta[0]) / (theta[1] - theta[0])  # an even grid: the place follows without a search
    i = int(min(max(np.floor(x), 1), len(theta) - 3))  # four points of interpolation: two on either side
    return i, x - i


@kernel(nogil=True)
def position(ascending: Floats, value: float) -> int:
    """Number of elements below a value."""
    low, high = 0, len(ascending)
    while low < high:
        middle = (low + high) >> 1
        if ascending[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(nogil=True)
def level_energies(levels: Floats, theta: Floats, jj: Floats, constants: Floats, energy: Floats) -> tuple[int, float]:
    """Write energies (MHz) of all levels, to first order in the quartic constants; return the position on the grid."""
    mean, half = 0.5 * (constants[0] + constants[2]), 0.5 * (constants[0] - constants[2])
    kappa = (constants[1] - mean) / half
    i, w = place(theta, kappa)
    w0, w1 = -w * (w - 1) * (w - 2) / 6, (w + 1) * (w - 1) * (w - 2) / 2
    w2, w3 = -(w + 1) * w * (w - 2) / 2, (w + 1) * w * (w - 1) / 6
    for n in range(len(jj)):
        reduced = w0 * levels[i - 1, n, 0] + w1 * levels[i, n, 0] + w2 * levels[i + 1, n, 0] + w3 * levels[i + 2, n, 0]
        total = mean * jj[n] + half * reduced
        for q in range(4, 9):
            if constants[q - 1] != 0.0:
                total += constants[q - 1] * ((1 - w) * levels[i, n, q] + w * levels[i + 1, n, q])
        energy[n] = total
    return i, w


@kernel(nogil=True)
# Lagrange's cubic through four neighbouring points
def rigid_energies(reduced: Floats, theta: Floats, jj: Floats, top: Floats, energy: Floats) -> None:
    """Write energies (MHz) of all levels of a rigid top A, B, C; reduced (POINTS, levels) : E_κ."""
    mean, half = 0.5 * (top[0] + top[2]), 0.5 * (top[0] - top[2])
    i, w = place(theta, (top[1] - mean) / half)
    w0, w1 = -w * (w - 1) * (w - 2) / 6, (w + 1) * (w - 1) * (w - 2) / 2
    w2, w3 = -(w + 1) * w * (w - 2) / 2, (w + 1) * w * (w - 1) / 6
    for n in range(len(jj)):
        shape = w0 * reduced[i - 1, n] + w1 * reduced[i, n] + w2 * reduced[i + 1, n] + w3 * reduced[i + 2, n]
        energy[n] = mean * jj[n] + half * shape


@kernel(nogil=True)
def lines_in_band(
    theta: Floats, upper: Ints, lower: Ints, strength: NDArray[np.float32], constants: Floats, windows: Floats,
    energy: Floats, row: Ints, frequency: Floats, s_nu: Floats,
) -> int:  # fmt: skip
    """Write lines within frequency windows (n, 2): rows in the table, frequencies and S ν²; return their number."""
    kappa = (2 * constants[1] - constants[0] - constants[2]) / (constants[0] - constants[2])
    points = strength.shape[0]
    x = (np.arccos(min(1.0, max(-1.0, -kappa))) - theta[0]) / (theta[-1] - theta[0]) * (points - 1)
    k = int(min(max(x, 0.0), points - 2))
    w = min(max(x - k, 0.0), 1.0)  # beyond the ends the nearest point counts
    count = 0
    low, high = windows[0, 0], windows[-1, 1]
    for n in range(len(upper)):
        f = energy[upper[n]] - energy[lower[n]]
        if low < f < high and count < len(row):
            inside = False
            for m in range(len(windows)):
                inside = inside or (windows[m, 0] <= f <= windows[m, 1])
            if not inside:
                continue
            s = (1 - w) * strength[k, n] + w * strength[k + 1, n]
            if s > 1e-3:  # lines of no strength at this κ are left out
                row[count], frequency[count], s_nu[count] = n, f, s * f * f
                count += 1
    return count


@kernel(nogil=True)
def derivatives(
    levels: Floats, theta: Floats, upper: Ints, lower: Ints, rows: Ints, constants: Floats, out: Floats
) -> None:
    """Write ∂ν/∂(A, B, C, DJ, DJK, DK, d1, d2), or the first of them, of lines (rows, n); none for the row -1."""
    kappa = (2 * constants[1] - constants[0] - constants[2]) / (constants[0] - constants[2])
    i, w = place(theta, kappa)
    for n in range(len(rows)):
        if rows[n] < 0:
            continue
        u, l = upper[rows[n]], lower[rows[n]]
        for q in range(out.shape[1]):
            out[n, q] = (1 - w) * (levels[i, u, q + 1] - levels[i, l, q + 1]) + w * (
                levels[i + 1, u, q + 1] - levels[i + 1, l, q + 1]
            )


@kernel(nogil=True)
def _highest_apart(
    height: Floats, f: Floats, line_count: int, waiting: Ints, apart: float, row: Ints, out: Ints
) -> None:
    """Write the rows of the highest waiting lines in descending order, without lines closer than `apart` to a higher one; then -1."""
    for at in range(len(out)):
        best = -1
        for n in range(line_count):
            if waiting[n] and (best < 0 or height[n] > height[best]):
                best = n
        out[at] = -1 if best < 0 else row[best]
        for n in range(line_count):
            if best >= 0 and (n == best or abs(f[best] - f[n]) < apart):
                waiting[n] = 0


@kernel(nogil=True)
def strongest_lines(
    levels: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, kind: Ints, strength: NDArray[np.float32],
    tops: Floats, log_dipoles: Floats, temperatures: Floats, windows: Floats, count: int, apart: float,
) -> tuple[Ints, Floats]:  # fmt: skip
    """The strongest lines of each top in the band, for types a, b, c, and for all types with its dipole; close lines count once.

    log_dipoles (tops, 3) : ln μ². Returns rows (tops, 4, count), padded with -1, and ∂ν/∂(A, B, C) (tops, 4, count, 3).
    """
    types = log_dipoles.shape[1]
    rows, slopes = np.empty((len(tops), types + 1, count), np.int64), np.zeros((len(tops), types + 1, count, 3))
    energy, constants = np.empty(len(jj)), np.zeros(8)
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    height, waiting = np.empty(len(upper)), np.empty(len(upper), np.int64)
    for t in range(len(tops)):
        for n in range(3):
            constants[n] = tops[t, n]
        level_energies(levels, theta, jj, constants, energy)
        line_count = lines_in_band(theta, upper, lower, strength, constants, windows, energy, row, f, s_nu)
        for n in range(line_count):
            height[n] = np.log(s_nu[n]) - energy[lower[row[n]]] / (MHZ_PER_K * temperatures[t])
        for q in range(types + 1):
            for n in range(line_count):
                waiting[n] = q == types or kind[row[n]] == q
                if q == types:  # lines of all types
                    height[n] += log_dipoles[t, kind[row[n]]]
            _highest_apart(height, f, line_count, waiting, apart, row, rows[t, q])
            derivatives(levels, theta, upper, lower, rows[t, q], constants, slopes[t, q])
    return rows, slopes


@kernel(nogil=True)
def _windows(f: Floats, sigma: Floats, peaks: Floats, first: Ints, last: Ints) -> None:
    """Write the ranges of peaks within four standard errors of lines."""
    for n in range(len(f)):
        first[n] = position(peaks, f[n] - 4.0 * sigma[n])
        last[n] = first[n]
        while last[n] < len(peaks) and peaks[last[n]] <= f[n] + 4.0 * sigma[n]:
            last[n] += 1


@kernel(nogil=True)
def _joint(
    f: Floats, height: Floats, scale: float, sigma: Floats, first: Ints, last: Ints, peaks: Floats, log_peaks: Floats,
    log_density: Floats, log_threshold: float, spread: float, detected: float, used: Ints, mark: int, gains: Floats, least: float,
) -> float:  # fmt: skip
    """ln of the likelihood ratio of lines with `scale` added to their heights, from ranges of peaks; ended where it stays below `least`.

    gains (lines + 1,) : upper bounds of what the lines from each one on add.
    """
    total = 0.0
    for n in range(len(f)):
        if total + gains[n] < least:
            break
        level = height[n] + scale
        # a logistic function of the height: weak lines are often missed
        seen = detected / (1.0 + np.exp(-(level - log_threshold) / (0.4 * spread)))
        if seen < 0.02:  # so unlikely that a peak here means nothing
            continue
        best, at = 0.0, -1
        for p in range(first[n], last[n]):
            if used[p] != mark:
                # heights scatter in the logarithm, positions in units of their error
                x, y = (peaks[p] - f[n]) / sigma[n], (log_peaks[p] - level) / spread
                ratio = np.exp(-0.5 * (x * x + y * y) - log_density[p])
                if ratio > best:
                    best, at = ratio, p
        if at >= 0:
            used[at] = mark
        total += np.log(1.0 - seen + seen * best / (2 * np.pi * sigma[n] * spread))
    return total


@kernel(nogil=True)
def joint_ratios_along(
    f: Floats, move: Floats, t: Floats, height: Floats, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats,
    log_threshold: float, spread: float, detected: float,
) -> Floats:  # fmt: skip
    """ln of the likelihood ratio of lines at f + t move, for each t (n,), against a random background of peaks.

    Lines are strongest first; a peak matches only one line. height : ln of the expected intensities.
    """
    out, at = np.empty(len(t)), np.empty(len(f))
    first, last = np.empty(len(f), np.int64), np.empty(len(f), np.int64)
    used, gains = np.zeros(len(peaks), np.int64), np.zeros(len(f) + 1)
    for n in range(len(t)):
        for line in range(len(f)):
            at[line] = f[line] + t[n] * move[line]
        _windows(at, sigma, peaks, first, last)
        out[n] = _joint(
            at, height, 0.0, sigma, first, last, peaks, log_peaks, log_density, log_threshold, spread, detected, used, n + 1, gains,
            -np.inf,
        )  # fmt: skip
    return out


@kernel(nogil=True)
def _gains(
    f: Floats,
    sigma: Floats,
    first: Ints,
    last: Ints,
    peaks: Floats,
    log_density: Floats,
    spread: float,
    detected: float,
) -> Floats:
    """Upper bounds of what each line and those after it can add to a likelihood ratio, 0 after the last (lines + 1,)."""
    out = np.zeros(len(f) + 1)
    for n in range(len(f) - 1, -1, -1):
        best = 0.0
        for p in range(first[n], last[n]):
            x = (peaks[p] - f[n]) / sigma[n]
            best = max(best, np.exp(-0.5 * x * x - log_density[p]))
        out[n] = (
            out[n + 1] + np.log(1.0 + detected * best / (2 * np.pi * sigma[n] * spread)) if best > 0.0 else out[n + 1]
        )
    return out


@kernel(nogil=True)
def best_scale(
    f: Floats, expected: Floats, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats, log_threshold: float,
    spread: float, detected: float, proposals: int, least: float,
) -> tuple[float, float]:  # fmt: skip
    """ln of the best likelihood ratio of lines, strongest first, and ln of their intensity scale; 0 and -inf below `least`.

    Trial scales come from peaks near the first lines. `expected` is ln of the relative intensity.
    """
    highest, best = least, -np.inf
    first, last = np.empty(len(f), np.int64), np.empty(len(f), np.int64)
    _windows(f, sigma, peaks, first, last)
    gains = _gains(f, sigma, first, last, peaks, log_density, spread, detected)
    if gains[0] < least:
        return 0.0, best
    # marks of the peaks used at each scale
    used, tried, count = np.zeros(len(peaks), np.int64), np.empty(8 * proposals), 0
    for n in range(min(proposals, len(f))):
        for p in range(first[n], last[n]):
            if abs(peaks[p] - f[n]) > 3 * sigma[n] or count == len(tried):
                continue
            scale = log_peaks[p] - expected[n]
            is_repeated = False
            for m in range(count):
                if abs(tried[m] - scale) < 0.25 * spread:  # scales this close give the same matches
                    is_repeated = True
                    break
            if is_repeated:
                continue
            tried[count] = scale
            count += 1
            value = _joint(
                f, expected, scale, sigma, first, last, peaks, log_peaks, log_density, log_threshold, spread, detected, used, count,
                gains, highest,
            )  # fmt: skip
            if value > highest:
                highest, best = value, scale
    return highest if best > -np.inf else 0.0, best  # no scale fits: the type is taken as absent


@kernel(nogil=True)
def best_scales(
    f: Floats, expected: Floats, kind: Ints, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats,
    log_threshold: float, spread: float, detected: float, most: int, proposals: int,
) -> tuple[Floats, Floats]:  # fmt: skip
    """For each type, ln of the best likelihood ratio (3,), 0 if no line is above chance, and ln of its intensity scale (3,).

    Lines are strongest first; `most` of each type count.
    """
    ratios, scales = np.empty(3), np.empty(3)
    centre, strength, error = np.empty(len(f)), np.empty(len(f)), np.empty(len(f))
    for q in range(3):
        count = 0
        for n in range(len(f)):
            if kind[n] == q and count < most:
                centre[count], strength[count], error[count] = f[n], expected[n], sigma[n]
                count += 1
        ratios[q], scales[q] = best_scale(
            centre[:count], strength[:count], error[:count], peaks, log_peaks, log_density, log_threshold, spread, detected, proposals,
            0.0,
        )  # fmt: skip
    return ratios, scales


@kernel(nogil=True)
def _highest(height: Floats, most: int) -> Ints:
    """Indices of the highest values in descending order; equal values keep their order."""
    out, count = np.empty(most, np.int64), 0
    for n in range(len(height)):
        # the list is full, and this one is weaker than its last
        if count == most and height[n] <= height[out[most - 1]]:
            continue
        at = count if count < most else most - 1
        while at > 0 and height[out[at - 1]] < height[n]:
            out[at] = out[at - 1]
            at -= 1
        out[at] = n
        count = min(count + 1, most)
    return out[:count]


@kernel(nogil=True)
def _apart(order: Ints, f: Floats, most: int, apart: float) -> Ints:
    """The first lines in this order, without lines closer than `apart` to a preceding one."""
    out = np.empty(min(most, len(order)), np.int64)
    count = 0
    for k in range(len(order)):
        n = order[k]
        near = False
        for m in range(count):
            if abs(f[out[m]] - f[n]) < apart:
                near = True
                break
        if not near:
            out[count] = n
            count += 1
            if count == len(out):
                break
    return out[:count]


@kernel(nogil=True)
def quick_ratios(
    reduced: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, kind: Ints, strength: NDArray[np.float32], mixed: bool,
    tops: Floats, temperatures: Floats, windows: Floats, sigma_mhz: float, softness: float,
    peaks: Floats, log_peaks: Floats, log_density: Floats, log_threshold: float, spread: float, detected: float, most: int, apart: float,
    least: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """ln of the likelihood ratio of each rigid top (tops,) from the lines of a table, and its best temperature.

    mixed : whether the lines are of several types. The standard error of a line is the larger of `sigma_mhz` and `softness` B. A ratio
    of lines of one type below `least` counts as 0.
    """
    out, best = np.empty(len(tops)), np.zeros(len(tops))
    energy = np.empty(len(jj))
    proposals: Any = np.int64(8)  # a literal has a type of its own, for which the function called is compiled once more
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    strength_at, below, expected = np.empty(len(upper)), np.empty(len(upper)), np.empty(len(upper))
    centre, height, sigma, types = np.empty(most), np.empty(most), np.empty(most), np.empty(most, np.int64)
    for t in range(len(tops)):
        out[t] = -np.inf
        rigid_energies(reduced, theta, jj, tops[t], energy)
        count = lines_in_band(theta, upper, lower, strength, tops[t], windows, energy, row, f, s_nu)
        if count == 0:
            continue
        for line in range(count):
            strength_at[line], below[line] = np.log(s_nu[line]), energy[lower[row[line]]] / MHZ_PER_K
        for n in range(len(temperatures)):
            for line in range(count):
                expected[line] = strength_at[line] - below[line] / temperatures[n]
            chosen = _apart(_highest(expected[:count], 2 * most), f, most, apart)
            size = len(chosen)
            for line in range(size):
                at = chosen[line]
                centre[line], height[line], types[line] = f[at], expected[at], kind[row[at]]
                sigma[line] = max(sigma_mhz, softness * tops[t, 1])
            if mixed:
                ratios, _ = best_scales(
                    centre[:size], height[:size], types[:size], sigma[:size], peaks, log_peaks, log_density, log_threshold, spread,
                    detected, most, proposals,
                )  # fmt: skip
                ratio = ratios[0] + ratios[1] + ratios[2]
            else:
                ratio = best_scale(
                    centre[:size], height[:size], sigma[:size], peaks, log_peaks, log_density, log_threshold, spread, detected,
                    proposals, max(least, out[t]),
                )[0]  # fmt: skip
            if ratio > out[t]:
                out[t], best[t] = ratio, temperatures[n]
    return out, best


@kernel(nogil=True)
def nearest_peaks(
    centre: Floats, height: Floats, errors: Floats, window: float, most_chance: float, peaks: Floats, log_peaks: Floats,
    log_density: Floats, spread: float, most: int,
) -> Ints:  # fmt: skip
    """The peak nearest to each line in frequency and height (lines,), or -1.

    It lies within `window` errors, among fewer than `most` peaks, its height within three `spread`, and fewer than `most_chance` such peaks
    are expected by chance.
    """
    out = np.empty(len(centre), np.int64)
    for n in range(len(centre)):
        out[n] = -1
        reach = window * errors[n]
        first, last = position(peaks, centre[n] - reach), position(peaks, centre[n] + reach)
        if last - first >= most:  # a crowd of peaks does not tell which is the line
            continue
        best, lowest = -1, np.inf
        for p in range(first, last):
            apart, higher = (peaks[p] - centre[n]) / errors[n], (log_peaks[p] - height[n]) / spread
            cost = apart * apart + higher * higher
            if cost < lowest:
                best, lowest = p, cost
        if best < 0 or abs(log_peaks[best] - height[n]) >= 3.0 * spread:
            continue
        # a match that chance would make as often says nothing
        if 2 * reach * np.exp(log_density[best]) * 4 * spread < most_chance:
            out[n] = best
    return out
