"""Compiled loops over roots: pairs of peaks as the first two lines of a family, and its third line along κ (`search.roots`)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.assignment.search._kernels import position
from rotor.kernels import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

HIGHEST_MHZ = 1e12  # above all frequencies; infinity is not allowed in loops with fastmath


@kernel(nogil=True, fastmath=True)
def _hits(
    jj: Floats, energies: Floats, k: int, w: float, mean: float, half: float,
    near: Bytes, low: float, high: float, per_mhz: float, reach: float,
) -> tuple[int, int]:  # fmt: skip
    """Numbers of lines of a top near peaks and away from peaks, counted until the top cannot win; κ is at grid position k + w."""
    hits, misses = 0, 0
    for q in range(len(jj)):
        f = jj[q] * mean + half * (energies[k, q] + w * (energies[k + 1, q] - energies[k, q]))
        if f < low or f >= high:  # outside the band nothing can be a peak
            continue
        if near[int((f - low) * per_mhz)] < reach:
            hits += 1
        else:
            misses += 1
            if misses >= 3 and misses > hits + 1:
                break
    return hits, misses


@kernel(nogil=True, fastmath=True)
def _crossing(linear: Floats, a: float, b: float, frequency: float, k: int, last: int) -> tuple[int, float]:
    """Grid position k + w between k and last where the third line has a frequency; w < 0 without one."""
    before = a * linear[k, 3] + b * linear[k, 4]
    for n in range(k, last):
        after = a * linear[n + 1, 3] + b * linear[n + 1, 4]
        if (before <= frequency) == (after >= frequency) and before != after:
            return n, (frequency - before) / (after - before)
        before = after
    return k, -1.0


@kernel(nogil=True, fastmath=True)
def _inside(a: float, b: float, c: float, bounds: Floats, margin: float, planar: float) -> bool:
    """Whether A, B, C lie within bounds with a margin, and 1/C is below 1/A + 1/B over `planar`."""
    return bool(
        a < bounds[1] * (1 + margin) and a > bounds[0] * (1 - margin) and b < bounds[3] * (1 + margin)
        and b > bounds[2] * (1 - margin) and c < bounds[5] * (1 + margin) and c > bounds[4] * (1 - margin)
        and c * (a + b) > planar * a * b
    )  # fmt: skip


def _linear(difference: Floats, jj: Floats, kappa: Floats) -> Floats:
    """At each κ (κ, 6): factors of the first two lines of a family in ½(A+C), 1/determinant, factors in the third line, and κ."""
    first, second, third = difference
    determinant = jj[0] * second - jj[1] * first
    determinant[np.abs(determinant) < 1e-6] = np.inf  # parallel lines: this κ has no solution
    inverse = 1 / determinant
    mean_a, mean_b, third = second * inverse, -first * inverse, third * inverse
    columns = mean_a, mean_b, inverse, jj[2] * mean_a - jj[1] * third, jj[2] * mean_b + jj[0] * third, kappa
    return np.ascontiguousarray(np.array(columns).T)


@kernel(nogil=True, fastmath=True)
def _root(
    linear: Floats, sa: float, sb: float, above: float, third: float, first: int, last: int
) -> tuple[int, float, float, float, float]:
    """Grid point of κ and position beyond it where the third line has a frequency, with ½(A+C), ½(A-C), κ; position < 0: no root."""
    i, w = _crossing(linear, sa, sb, third, first, last)
    mean = sa * (linear[i, 0] + w * (linear[i + 1, 0] - linear[i, 0])) + sb * (
        linear[i, 1] + w * (linear[i + 1, 1] - linear[i, 1])
    )
    half = above * (linear[i, 2] + w * (linear[i + 1, 2] - linear[i, 2]))
    return i, w, mean, half, linear[i, 5] + w * (linear[i + 1, 5] - linear[i, 5])


@kernel(nogil=True)
def _narrowed(low: float, high: float, value: float, slope: float, least: float, most: float) -> tuple[float, float]:
    """The part of an interval of x in which value + slope x lies between limits; empty (1, 0) for a slope of 0 beyond them."""
    if slope == 0.0:
        return (low, high) if least <= value <= most else (1.0, 0.0)
    inverse = 1 / slope
    at_least, at_most = (least - value) * inverse, (most - value) * inverse  # in reverse order for a negative slope
    return max(low, min(at_least, at_most)), min(high, max(at_least, at_most))


def _most_asymmetric(kappa: Floats, planar: float) -> Floats:
    """The largest (A-C)/(A+C) of tops with C (A+B) > planar A B at each κ.

    With u = (A-C)/(A+C) the condition is 2-p + ((1-p)(1+κ) - 2) u - (1 + (1+p) κ) u² > 0; it holds at 0 and fails at 1.
    """
    square, linear, constant = -(1 + (1 + planar) * kappa), (1 - planar) * (1 + kappa) - 2.0, 2 - planar
    root = np.sqrt(np.maximum(linear * linear - 4 * square * constant, 0.0))  # rounding at the edge of the band
    largest: Floats = 2 * constant / (root - linear)
    return largest


@kernel(nogil=True)
def _seconds_within(
    first: float, jj: Floats, linear: Floats, largest: Floats, seeds: Floats, bounds: Floats, begin: Ints, end: Ints
) -> None:
    """Write the range of seeds at each κ that as second line, with `first` as the first, give A, B, C within the bounds.

    largest (κ,) : of (A-C)/(A+C). All bounds are linear in the frequency of the second line. They are wider by 3 % here than at roots,
    which lie between the points.
    """
    bottom, top = 0, 0
    for k in range(len(linear)):
        kappa, inverse = linear[k, 5], linear[k, 2]
        mean, mean_slope = first * linear[k, 0], linear[k, 1]
        half, half_slope = -first * jj[1] * inverse, jj[0] * inverse
        low, high = _narrowed(seeds[0], seeds[-1], half, half_slope, 0.0, HIGHEST_MHZ)
        low, high = _narrowed(
            low, high, largest[k] * mean - half, largest[k] * mean_slope - half_slope, 0.0, HIGHEST_MHZ
        )
        for n in range(3):
            if low > high:
                break
            share = 1.0 if n == 0 else kappa if n == 1 else -1.0
            value, slope = mean + share * half, mean_slope + share * half_slope
            # the grid of κ is coarse: bounds are widened by 3 %
            low, high = _narrowed(low, high, value, slope, 0.97 * bounds[2 * n], 1.03 * bounds[2 * n + 1])
        if low > high:
            begin[k], end[k] = 0, 0
            continue
        while bottom < len(seeds) and seeds[bottom] < low:  # from the place of the last κ, which is near
            bottom += 1
        while bottom > 0 and seeds[bottom - 1] >= low:
            bottom -= 1
        while top < len(seeds) and seeds[top] <= high:
            top += 1
        while top > 0 and seeds[top - 1] > high:
            top -= 1
        begin[k], end[k] = bottom, top


@kernel(nogil=True)
def _kappa_ranges(begin: Ints, end: Ints, opening: Ints, closing: Ints) -> None:
    """Write for each seed the first κ, and the last plus 1, at which it lies in the range of second lines."""
    for b in range(len(opening)):
        opening[b], closing[b] = len(begin), 0
    for step in range(len(begin)):
        for b in range(begin[step], end[step]):
            opening[b], closing[b] = min(opening[b], step), step + 1  # the last κ plus 1


@kernel(nogil=True, fastmath=True)
def _write_roots(
    linear: Floats, coarse: Ints, largest: Floats, jj: Floats, companions: Floats, companion_jj: Floats, seeds: Floats,
    log_seeds: Floats, near: Bytes, low: float, high: float, per_mhz: float, tolerance: float, softness: float,
    ratio: float, bounds: Floats, need: int, looks: Floats, out: Floats,
) -> int:  # fmt: skip
    """`sweep` with the solutions at all κ, and at the coarse points between which crossings are looked for."""
    # a literal 0 has a type of its own, for which the functions called are compiled once more
    nowhere: Any = np.int64(0)
    roots: Any = np.int64(0)
    n, begin, end = len(seeds), np.empty(len(coarse), np.int64), np.empty(len(coarse), np.int64)
    opening, closing = np.empty(n, np.int64), np.empty(n, np.int64)
    for a in range(n):
        sa = seeds[a]
        _seconds_within(sa, jj, looks, largest, seeds, bounds, begin, end)
        _kappa_ranges(begin, end, opening, closing)
        for b in range(n):
            if a == b or abs(log_seeds[a] - log_seeds[b]) > ratio:  # lines of one family have like intensities
                continue
            sb = seeds[b]
            above = jj[0] * sb - jj[1] * sa
            before, p, at = -1.0, nowhere, nowhere
            for step in range(opening[b], closing[b]):
                if b < begin[step] or b >= end[step]:
                    before = -1.0  # a new stretch of κ: no crossing with what was before it
                    continue
                k, third = coarse[step], sa * looks[step, 3] + sb * looks[step, 4]
                if before < 0.0:
                    before, at, p = max(third, 0.0), k, position(seeds, max(third, 0.0))
                    continue
                rising = third > before
                while (rising and p < n and seeds[p] <= third) or (not rising and p > 0 and seeds[p - 1] >= third):
                    line = p if rising else p - 1
                    p = p + 1 if rising else p - 1
                    unlike = max(abs(log_seeds[line] - log_seeds[a]), abs(log_seeds[line] - log_seeds[b])) > ratio
                    if unlike or line in (a, b):
                        continue
                    i, w, s, d, x = _root(linear, sa, sb, above, seeds[line], at, k)
                    top_b = s + x * d
                    # the third line has no such frequency, or the top is out of bounds
                    if w < 0.0 or not _inside(s + d, top_b, s - d, bounds, 0.0, 0.985):
                        continue
                    reach = min(max(tolerance, softness * top_b), 255.0)
                    hits, misses = _hits(companion_jj, companions, i, w, s, d, near, low, high, per_mhz, reach)
                    if hits >= need and hits >= misses and roots < len(out):
                        out[roots, 0], out[roots, 1] = hits, misses
                        out[roots, 2], out[roots, 3], out[roots, 4] = s + d, top_b, s - d
                        roots += 1
                before, at = third, k
    return int(roots)


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
    linear, fifth = _linear(difference, jj, kappa), bin_width / 5
    coarse = np.minimum(np.arange((len(kappa) + stride - 2) // stride + 1) * stride, len(kappa) - 1)
    # a wider limit than at the roots, as κ stands on a grid
    largest = _most_asymmetric(kappa[coarse], 0.95)
    return _write_roots(
        linear, coarse, largest, jj, companions, companion_jj, seeds, log_seeds, near, low, high, 1 / bin_width, tolerance / fifth,
        softness / fifth, ratio, bounds, need, linear[coarse], out,
    )  # fmt: skip
