"""Compiled loops of the search. Their plain forms are `rotor.api.line_list` (lines of a top) and the tests' own loops."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rotor.units import MHZ_PER_K

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

MIXED = 3  # the type of a family of lines of several types


@njit(cache=True, nogil=True)
def place(theta: Floats, kappa: float) -> tuple[int, float]:
    """Grid interval of κ and the position within it, from 0 to 1, for cubic interpolation between four points."""
    angle = np.arccos(min(1.0, max(-1.0, -kappa)))
    x = (angle - theta[0]) / (theta[1] - theta[0])
    i = int(min(max(np.floor(x), 1), len(theta) - 3))
    return i, x - i


@njit(cache=True, nogil=True)
def level_energies(levels: Floats, theta: Floats, jj: Floats, constants: Floats, energy: Floats) -> tuple[int, float]:
    """Energies (MHz) of all levels to first order in the quartic constants; returns the place on the grid."""
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


@njit(cache=True, nogil=True)
def lines_in_band(
    levels: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, strength: NDArray[np.float32],
    constants: Floats, windows: Floats, energy: Floats, row: Ints, frequency: Floats, s_nu: Floats,
) -> int:  # fmt: skip
    """Lines within windows (n, 2) of frequency: their rows in the table, frequencies and S ν²; returns how many."""
    level_energies(levels, theta, jj, constants, energy)
    kappa = (2 * constants[1] - constants[0] - constants[2]) / (constants[0] - constants[2])
    points = strength.shape[0]
    x = (np.arccos(min(1.0, max(-1.0, -kappa))) - theta[0]) / (theta[-1] - theta[0]) * (points - 1)
    k = int(min(max(x, 0.0), points - 2))
    w = min(max(x - k, 0.0), 1.0)
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
            if s > 1e-3:
                row[count], frequency[count], s_nu[count] = n, f, s * f * f
                count += 1
    return count


@njit(cache=True, nogil=True)
def derivatives(levels: Floats, theta: Floats, upper: Ints, lower: Ints, rows: Ints, constants: Floats) -> Floats:
    """∂ν/∂(A, B, C, DJ, DJK, DK, d1, d2) of lines (rows, 8)."""
    kappa = (2 * constants[1] - constants[0] - constants[2]) / (constants[0] - constants[2])
    i, w = place(theta, kappa)
    out = np.empty((len(rows), 8))
    for n in range(len(rows)):
        u, l = upper[rows[n]], lower[rows[n]]
        for q in range(8):
            out[n, q] = (1 - w) * (levels[i, u, q + 1] - levels[i, l, q + 1]) + w * (
                levels[i + 1, u, q + 1] - levels[i + 1, l, q + 1]
            )
    return out


@njit(cache=True, nogil=True)
def strongest_lines(
    levels: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, kind: Ints, strength: NDArray[np.float32],
    tops: Floats, log_dipoles: Floats, temperatures: Floats, windows: Floats, count: int, apart: float,
) -> tuple[Ints, Floats]:  # fmt: skip
    """The strongest lines in the band of each top by types a, b, c, and of all types with its dipole; of near lines the first.

    log_dipoles (tops, 3) : ln μ². Returns rows (tops, 4, count), -1 where there is none, and ∂ν/∂(A, B, C) (tops, 4, count, 3).
    """
    rows = np.full((len(tops), 4, count), -1)
    slopes = np.zeros((len(tops), 4, count, 3))
    energy, constants = np.empty(len(jj)), np.zeros(8)
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    for t in range(len(tops)):
        constants[:3] = tops[t]
        found = lines_in_band(levels, theta, jj, upper, lower, strength, constants, windows, energy, row, f, s_nu)
        height = np.empty(found)
        for n in range(found):
            height[n] = np.log(s_nu[n]) - energy[lower[row[n]]] / (MHZ_PER_K * temperatures[t])
        for q in range(4):
            taken = np.empty(count)
            at = 0
            if q == MIXED:
                of_type = np.arange(found)
                height += log_dipoles[t][kind[row[:found]]]
            else:
                of_type = np.flatnonzero(kind[row[:found]] == q)
            for n in of_type[np.argsort(-height[of_type])]:
                near = False
                for m in range(at):
                    if abs(taken[m] - f[n]) < apart:
                        near = True
                        break
                if near:
                    continue
                taken[at], rows[t, q, at] = f[n], row[n]
                at += 1
                if at == count:
                    break
            slopes[t, q, :at] = derivatives(levels, theta, upper, lower, rows[t, q, :at], constants)[:, :3]
    return rows, slopes


@njit(cache=True, nogil=True, fastmath=True)
def sweep(
    difference: Floats, jj: Floats, kappa: Floats, companions: Floats, companion_jj: Floats, seeds: Floats, log_seeds: Floats,
    near: NDArray[np.float32], low: float, high: float, bin_width: float, tolerance: float, softness: float, ratio: float,
    bounds: Floats, need: int, out: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Roots of a family: pairs of seeds give ½(A±C) at each κ, the third line crosses a third seed.

    difference (3, κ), jj (3,) : E_κ and J(J+1) differences of the family's lines; companions (n, κ), companion_jj (n,) alike
    near : distance from each bin's centre to the nearest peak; a hit is nearer than the larger of `tolerance` and `softness` B.
    bounds (6,) : of A, B, C. out (m, 5) : hits, misses, A, B, C
    """
    n, points, found, roots = len(seeds), len(kappa), 0, 0
    determinant = jj[0] * difference[1] - jj[1] * difference[0]
    total = len(companion_jj)
    rises, falls = bool((determinant > 0).all()), bool((determinant < 0).all())
    for a in range(n):
        for b in range(n):
            if a == b or abs(log_seeds[a] - log_seeds[b]) > ratio:
                continue
            above = jj[0] * seeds[b] - jj[1] * seeds[a]
            if (rises and above <= 0) or (falls and above >= 0):  # ½(A-C) below 0 at every κ
                continue
            before, before_sum, before_half = -1.0, 0.0, 0.0
            for k in range(points):
                if abs(determinant[k]) < 1e-6:
                    before = -1.0
                    continue
                mean = (seeds[a] * difference[1, k] - seeds[b] * difference[0, k]) / determinant[k]
                half = above / determinant[k]
                top_a, top_b, top_c = mean + half, mean + kappa[k] * half, mean - half
                if (
                    half <= 0.0 or top_a > bounds[1] or top_a < bounds[0] or top_b < bounds[2] or top_b > bounds[3]
                    or top_c < bounds[4] or top_c > bounds[5] or top_c * (top_a + top_b) < 0.985 * top_a * top_b
                ):  # fmt: skip
                    before = -1.0
                    continue
                third = jj[2] * mean + difference[2, k] * half
                if before > 0.0:
                    first, last = min(before, third), max(before, third)
                    if last > low and first < high:
                        p = np.searchsorted(seeds, first)
                        while p < n and seeds[p] <= last:
                            if (
                                p != a
                                and p != b
                                and abs(log_seeds[p] - log_seeds[a]) < ratio
                                and abs(log_seeds[p] - log_seeds[b]) < ratio
                            ):
                                w = (seeds[p] - before) / (third - before) if third != before else 0.0
                                s, d = before_sum + w * (mean - before_sum), before_half + w * (half - before_half)
                                hits, misses = 0, 0
                                roots += 1
                                at = kappa[k - 1] + w * (kappa[k] - kappa[k - 1])
                                reach = max(tolerance, softness * (s + at * d))
                                for q in range(total):
                                    f = companion_jj[q] * s + d * (
                                        companions[q, k - 1] + w * (companions[q, k] - companions[q, k - 1])
                                    )
                                    if f < low or f >= high:
                                        continue
                                    if near[int((f - low) / bin_width)] < reach:
                                        hits += 1
                                    else:
                                        misses += 1
                                        if misses >= 3 and misses > hits + 1:
                                            break
                                if hits >= need and hits >= misses and found < len(out):
                                    out[found, 0], out[found, 1] = hits, misses
                                    out[found, 2], out[found, 3], out[found, 4] = s + d, s + at * d, s - d
                                    found += 1
                            p += 1
                before, before_sum, before_half = third, mean, half
    return found, roots


@njit(cache=True, nogil=True)
def joint_ratio(
    f: Floats, height: Floats, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats, log_threshold: float,
    spread: float, detected: float, used: Ints, mark: int,
) -> float:  # fmt: skip
    """ln of the likelihood ratio of lines, strong ones first, against a random background of peaks; a peak serves one line only.

    height : ln of the expected intensities. used (peaks,) : work space, in which `mark` stands for a peak that is taken
    """
    total = 0.0
    for n in range(len(f)):
        seen = detected / (1.0 + np.exp(-(height[n] - log_threshold) / (0.4 * spread)))
        if seen < 0.02:
            continue
        p = np.searchsorted(peaks, f[n] - 4.0 * sigma[n])
        best, at = 0.0, -1
        while p < len(peaks) and peaks[p] <= f[n] + 4.0 * sigma[n]:
            if used[p] != mark:
                x, y = (peaks[p] - f[n]) / sigma[n], (log_peaks[p] - height[n]) / spread
                ratio = np.exp(-0.5 * (x * x + y * y) - log_density[p])
                if ratio > best:
                    best, at = ratio, p
            p += 1
        if at >= 0:
            used[at] = mark
        total += np.log(1.0 - seen + seen * best / (2 * np.pi * sigma[n] * spread))
    return total


@njit(cache=True, nogil=True)
def best_scales(
    f: Floats, expected: Floats, kind: Ints, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats,
    log_threshold: float, spread: float, detected: float, most: int, proposals: int,
) -> tuple[Floats, Floats]:  # fmt: skip
    """For each type ln of the best likelihood ratio (3,), 0 where no line is above chance, and ln of the scale of its intensities.

    Scales are proposed by peaks near the strongest lines. `expected` is ln of the relative intensity.
    """
    ratios, scales = np.zeros(3), np.full(3, -np.inf)
    used, mark = np.zeros(len(peaks), np.int64), 0
    for q in range(3):
        rows = np.flatnonzero(kind == q)
        if len(rows) == 0:
            continue
        rows = rows[np.argsort(-expected[rows])][:most]
        g, e, s = f[rows], expected[rows], sigma[rows]
        tried = np.empty(8 * proposals)
        count = 0
        for n in range(min(proposals, len(rows))):
            p = np.searchsorted(peaks, g[n] - 3 * s[n])
            while p < len(peaks) and peaks[p] <= g[n] + 3 * s[n] and count < len(tried):
                scale = log_peaks[p] - e[n]
                p += 1
                known = False
                for m in range(count):
                    if abs(tried[m] - scale) < 0.25 * spread:
                        known = True
                        break
                if known:
                    continue
                tried[count] = scale
                count += 1
                mark += 1
                value = joint_ratio(
                    g, e + scale, s, peaks, log_peaks, log_density, log_threshold, spread, detected, used, mark
                )
                if value > ratios[q]:
                    ratios[q], scales[q] = value, scale
    return ratios, scales


@njit(cache=True, nogil=True)
def _apart(order: Ints, f: Floats, most: int, apart: float) -> Ints:
    """The first lines of an order, without those nearer than `apart` to one before."""
    out = np.empty(min(most, len(order)), np.int64)
    count = 0
    for n in order:
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


@njit(cache=True, nogil=True)
def quick_ratios(
    levels: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, kind: Ints, strength: NDArray[np.float32],
    tops: Floats, kinds: Ints, temperatures: Floats, windows: Floats, sigma_mhz: float, softness: float,
    peaks: Floats, log_peaks: Floats, log_density: Floats, log_threshold: float, spread: float, detected: float, most: int, apart: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """ln of the likelihood ratio of each rigid top (tops,), lines of one type or of all, and the temperature it is best at.

    The standard error of a line is the larger of `sigma_mhz` and `softness` B.
    """
    out, best = np.full(len(tops), -np.inf), np.zeros(len(tops))
    energy, constants = np.empty(len(jj)), np.zeros(8)
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    for t in range(len(tops)):
        constants[:3] = tops[t]
        found = lines_in_band(levels, theta, jj, upper, lower, strength, constants, windows, energy, row, f, s_nu)
        mixed = kinds[t] == MIXED
        of_type = np.arange(found) if mixed else np.flatnonzero(kind[row[:found]] == kinds[t])
        if len(of_type) == 0:
            continue
        for temperature in temperatures:
            expected = np.log(s_nu[of_type]) - energy[lower[row[of_type]]] / (MHZ_PER_K * temperature)
            strongest = _apart(np.argsort(-expected), f[of_type], most, apart)
            chosen = of_type[strongest]
            ratios, _ = best_scales(
                f[chosen], expected[strongest], kind[row[chosen]], np.full(len(chosen), max(sigma_mhz, softness * tops[t, 1])),
                peaks, log_peaks, log_density, log_threshold, spread, detected, most, 8,
            )  # fmt: skip
            if ratios.sum() > out[t]:
                out[t], best[t] = ratios.sum(), temperature
    return out, best
