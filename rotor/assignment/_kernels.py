"""Compiled loops of the search. `rotor.api.line_list` (lines of a top) and loops in the tests are the plain forms."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rotor.units import MHZ_PER_K

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Bytes = NDArray[np.uint8]

MIXED = 3  # the type of a family of lines of several types
OUTSIDE = -1e300  # a frequency that stands for constants out of bounds


@njit(cache=True, nogil=True)
def place(theta: Floats, kappa: float) -> tuple[int, float]:
    """Grid interval of κ and the position within it, from 0 to 1, for cubic interpolation between four points."""
    angle = np.arccos(min(1.0, max(-1.0, -kappa)))
    x = (angle - theta[0]) / (theta[1] - theta[0])
    i = int(min(max(np.floor(x), 1), len(theta) - 3))
    return i, x - i


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def lines_in_band(
    levels: Floats, theta: Floats, jj: Floats, upper: Ints, lower: Ints, strength: NDArray[np.float32],
    constants: Floats, windows: Floats, energy: Floats, row: Ints, frequency: Floats, s_nu: Floats,
) -> int:  # fmt: skip
    """Write lines within frequency windows (n, 2): rows in the table, frequencies and S ν²; return their number."""
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
    """The strongest lines of each top in the band, for types a, b, c, and for all types with its dipole; close lines count once.

    log_dipoles (tops, 3) : ln μ². Returns rows (tops, 4, count), padded with -1, and ∂ν/∂(A, B, C) (tops, 4, count, 3).
    """
    rows = np.full((len(tops), 4, count), -1)
    slopes = np.zeros((len(tops), 4, count, 3))
    energy, constants = np.empty(len(jj)), np.zeros(8)
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    for t in range(len(tops)):
        constants[:3] = tops[t]
        line_count = lines_in_band(levels, theta, jj, upper, lower, strength, constants, windows, energy, row, f, s_nu)
        height = np.empty(line_count)
        for n in range(line_count):
            height[n] = np.log(s_nu[n]) - energy[lower[row[n]]] / (MHZ_PER_K * temperatures[t])
        for q in range(4):
            taken = np.empty(count)
            at = 0
            if q == MIXED:
                candidates = np.arange(line_count)
                height += log_dipoles[t][kind[row[:line_count]]]
            else:
                candidates = np.flatnonzero(kind[row[:line_count]] == q)
            for n in candidates[np.argsort(-height[candidates])]:
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
def _hits(
    jj: Floats, energies: Floats, k: int, w: float, mean: float, half: float,
    near: Bytes, low: float, high: float, per_mhz: float, reach: float,
) -> tuple[int, int]:  # fmt: skip
    """Numbers of lines of a top near peaks and away from peaks, counted until the top cannot win; κ is at grid position k + w."""
    hits, misses = 0, 0
    for q in range(len(jj)):
        f = jj[q] * mean + half * (energies[k, q] + w * (energies[k + 1, q] - energies[k, q]))
        if f < low or f >= high:
            continue
        if near[int((f - low) * per_mhz)] < reach:
            hits += 1
        else:
            misses += 1
            if misses >= 3 and misses > hits + 1:
                break
    return hits, misses


@njit(cache=True, nogil=True, fastmath=True)
def _crossing(
    first: Floats, second: Floats, a: float, b: float, frequency: float, k: int, last: int
) -> tuple[int, float]:
    """Grid position k + w between k and last where a first + b second equals a frequency; w < 0 without one."""
    before = a * first[k] + b * second[k]
    for n in range(k, last):
        after = a * first[n + 1] + b * second[n + 1]
        if (before <= frequency) == (after >= frequency) and before != after:
            return n, (frequency - before) / (after - before)
        before = after
    return k, -1.0


@njit(cache=True, nogil=True, fastmath=True)
def _inside(a: float, b: float, c: float, bounds: Floats, margin: float, planar: float) -> bool:
    """Whether A, B, C lie within bounds with a margin, and 1/C is below 1/A + 1/B over `planar`."""
    return bool(
        a < bounds[1] * (1 + margin) and a > bounds[0] * (1 - margin) and b < bounds[3] * (1 + margin)
        and b > bounds[2] * (1 - margin) and c < bounds[5] * (1 + margin) and c > bounds[4] * (1 - margin)
        and c * (a + b) > planar * a * b
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True)
def _linear(difference: Floats, jj: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Factors that give ½(A+C) and the third line of a family from its first two lines, at each κ, and 1/determinant."""
    determinant = jj[0] * difference[1] - jj[1] * difference[0]
    inverse = np.where(np.abs(determinant) < 1e-6, 0.0, 1 / np.where(determinant == 0.0, 1.0, determinant))
    mean_a, mean_b = difference[1] * inverse, -difference[0] * inverse
    third_a, third_b = (
        jj[2] * mean_a - difference[2] * jj[1] * inverse,
        jj[2] * mean_b + difference[2] * jj[0] * inverse,
    )
    return mean_a, mean_b, inverse, third_a, third_b


@njit(cache=True, nogil=True, fastmath=True)
def _root(
    linear: tuple[Floats, Floats, Floats, Floats, Floats], kappa: Floats, sa: float, sb: float, above: float, third: float,
    first: int, last: int,
) -> tuple[int, float, float, float, float]:  # fmt: skip
    """Grid point of κ and position beyond it where the third line has a frequency, with ½(A+C), ½(A-C), κ; position < 0: no root."""
    mean_a, mean_b, inverse, third_a, third_b = linear
    i, w = _crossing(third_a, third_b, sa, sb, third, first, last)
    mean = sa * (mean_a[i] + w * (mean_a[i + 1] - mean_a[i])) + sb * (mean_b[i] + w * (mean_b[i + 1] - mean_b[i]))
    half = above * (inverse[i] + w * (inverse[i + 1] - inverse[i]))
    return i, w, mean, half, kappa[i] + w * (kappa[i + 1] - kappa[i])


@njit(cache=True, nogil=True, fastmath=True)
def _third_lines(
    sa: float, sb: float, above: float, kappa: Floats, mean_a: Floats, mean_b: Floats, inverse: Floats, third_a: Floats,
    third_b: Floats, bounds: Floats, out: Floats,
) -> None:  # fmt: skip
    """Frequency of the third line at each κ (κ,), `OUTSIDE` where A, B, C are out of bounds; no branches, so that it is vectorised.

    Bounds are wider by 3 % here than at roots, which lie between the points.
    """
    for k in range(len(kappa)):
        half, mean = above * inverse[k], sa * mean_a[k] + sb * mean_b[k]
        a, b, c = mean + half, mean + kappa[k] * half, mean - half
        within = (
            (half > 0.0) & (a < bounds[1] * 1.03) & (a > bounds[0] * 0.97) & (b < bounds[3] * 1.03) & (b > bounds[2] * 0.97)
            & (c < bounds[5] * 1.03) & (c > bounds[4] * 0.97) & (c * (a + b) > 0.95 * a * b)
        )  # fmt: skip
        out[k] = sa * third_a[k] + sb * third_b[k] if within else OUTSIDE


@njit(cache=True, nogil=True, fastmath=True)
def sweep(
    difference: Floats, jj: Floats, kappa: Floats, companions: Floats, companion_jj: Floats, seeds: Floats, log_seeds: Floats,
    near: Bytes, low: float, high: float, bin_width: float, tolerance: float, softness: float, ratio: float,
    bounds: Floats, need: int, stride: int, out: Floats,
) -> int:  # fmt: skip
    """Write the roots of a family and return their number: pairs of seeds give ½(A±C) at each κ, the third line crosses a third seed.

    difference (3, κ), jj (3,) : E_κ and J(J+1) differences of the family's lines; companions (κ, n), companion_jj (n,) : of the predicted
    near : distance from each bin's centre to the nearest peak in fifths of `bin_width`, at most 255; a hit is nearer than the larger of
    `tolerance` and `softness` B. bounds (6,) : of A, B, C. stride : grid points of κ between tests for a crossing.
    out (m, 5) : hits, misses, A, B, C
    """
    n, points, roots, per_mhz, fifths = len(seeds), len(kappa), 0, 1 / bin_width, 5 / bin_width
    linear = _linear(difference, jj)
    coarse = np.minimum(np.arange((points + stride - 2) // stride + 1) * stride, points - 1)
    mean_a, mean_b, inverse, third_a, third_b = (
        linear[0][coarse], linear[1][coarse], linear[2][coarse], linear[3][coarse], linear[4][coarse],
    )  # fmt: skip
    looks, thirds = kappa[coarse], np.empty(len(coarse))
    rises, falls = bool((inverse > 0).all()), bool((inverse < 0).all())
    for a in range(n):
        sa = seeds[a]
        for b in range(n):
            if a == b or abs(log_seeds[a] - log_seeds[b]) > ratio:
                continue
            sb = seeds[b]
            above = jj[0] * sb - jj[1] * sa
            if (rises and above <= 0) or (falls and above >= 0):  # ½(A-C) below 0 at all κ
                continue
            _third_lines(sa, sb, above, looks, mean_a, mean_b, inverse, third_a, third_b, bounds, thirds)
            before, p, at = -1.0, 0, 0
            for step in range(len(coarse)):
                third = thirds[step]
                if third == OUTSIDE:
                    before = -1.0
                    continue
                k = coarse[step]
                if before < 0.0:
                    before, at, p = max(third, 0.0), k, np.searchsorted(seeds, max(third, 0.0))
                    continue
                rising = third > before
                while (rising and p < n and seeds[p] <= third) or (not rising and p > 0 and seeds[p - 1] >= third):
                    line = p if rising else p - 1
                    p = p + 1 if rising else p - 1
                    unlike = max(abs(log_seeds[line] - log_seeds[a]), abs(log_seeds[line] - log_seeds[b])) > ratio
                    if unlike or line in (a, b):
                        continue
                    i, w, s, d, x = _root(linear, kappa, sa, sb, above, seeds[line], at, k)
                    top_b = s + x * d
                    if w < 0.0 or not _inside(s + d, top_b, s - d, bounds, 0.0, 0.985):
                        continue
                    reach = min(max(tolerance, softness * top_b) * fifths, 255.0)
                    hits, misses = _hits(companion_jj, companions, i, w, s, d, near, low, high, per_mhz, reach)
                    if hits >= need and hits >= misses and roots < len(out):
                        out[roots, 0], out[roots, 1] = hits, misses
                        out[roots, 2], out[roots, 3], out[roots, 4] = s + d, top_b, s - d
                        roots += 1
                before, at = third, k
    return roots


@njit(cache=True, nogil=True)
def joint_ratio(
    f: Floats, height: Floats, sigma: Floats, peaks: Floats, log_peaks: Floats, log_density: Floats, log_threshold: float,
    spread: float, detected: float, used: Ints, mark: int,
) -> float:  # fmt: skip
    """ln of the likelihood ratio of lines, strongest first, against a random background of peaks; a peak matches only one line.

    height : ln of the expected intensities. used (peaks,) : work space, where `mark` denotes a matched peak
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
    """For each type, ln of the best likelihood ratio (3,), 0 if no line is above chance, and ln of its intensity scale (3,).

    Trial scales come from peaks near the strongest lines. `expected` is ln of the relative intensity.
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
                is_repeated = False
                for m in range(count):
                    if abs(tried[m] - scale) < 0.25 * spread:
                        is_repeated = True
                        break
                if is_repeated:
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
def _highest(height: Floats, most: int) -> Ints:
    """Indices of the highest values in descending order; equal values keep their order."""
    out, count = np.empty(most, np.int64), 0
    for n in range(len(height)):
        if count == most and height[n] <= height[out[most - 1]]:
            continue
        at = count if count < most else most - 1
        while at > 0 and height[out[at - 1]] < height[n]:
            out[at] = out[at - 1]
            at -= 1
        out[at] = n
        count = min(count + 1, most)
    return out[:count]


@njit(cache=True, nogil=True)
def _apart(order: Ints, f: Floats, most: int, apart: float) -> Ints:
    """The first lines in this order, without lines closer than `apart` to a preceding one."""
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
    """ln of the likelihood ratio of each rigid top (tops,), with lines of one type or of all, and its best temperature.

    The standard error of a line is the larger of `sigma_mhz` and `softness` B.
    """
    out, best = np.full(len(tops), -np.inf), np.zeros(len(tops))
    energy, constants = np.empty(len(jj)), np.zeros(8)
    row, f, s_nu = np.empty(len(upper), np.int64), np.empty(len(upper)), np.empty(len(upper))
    for t in range(len(tops)):
        constants[:3] = tops[t]
        count = lines_in_band(levels, theta, jj, upper, lower, strength, constants, windows, energy, row, f, s_nu)
        mixed = kinds[t] == MIXED
        candidates = np.arange(count) if mixed else np.flatnonzero(kind[row[:count]] == kinds[t])
        if len(candidates) == 0:
            continue
        strength_at, below = np.log(s_nu[candidates]), energy[lower[row[candidates]]] / MHZ_PER_K
        for temperature in temperatures:
            expected = strength_at - below / temperature
            strongest = _apart(_highest(expected, 2 * most), f[candidates], most, apart)
            chosen = candidates[strongest]
            ratios, _ = best_scales(
                f[chosen], expected[strongest], kind[row[chosen]], np.full(len(chosen), max(sigma_mhz, softness * tops[t, 1])),
                peaks, log_peaks, log_density, log_threshold, spread, detected, most, 8,
            )  # fmt: skip
            if ratios.sum() > out[t]:
                out[t], best[t] = ratios.sum(), temperature
    return out, best
