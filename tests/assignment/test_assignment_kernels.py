"""The compiled loops of the search against plain forms written here from the definitions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from rotor.arrays import Floats
from rotor.assignment.peaks.peak_list import PeakList, peak_list
from rotor.assignment.search import _kernels, _sweep
from rotor.assignment.search.bounds import Bounds
from rotor.assignment.search.families import families
from rotor.assignment.search.rigid_table import JMAX, rigid_table
from rotor.assignment.search.roots import (
    BIN_MHZ,
    DETECTED,
    NEAR_MHZ,
    RATIO,
    ROUGH_MHZ,
    SOFTNESS,
    SPREAD,
    Field,
    quick_ratios,
    search_roots,
)
from rotor.assignment.species.likelihood import ratio_at
from rotor.units import MHZ_PER_K

BOUNDS = Bounds(np.array([1500.0, 700, 500]), np.array([4000.0, 2000, 1500]))
TOP = np.array([2237.03, 1368.45, 884.21])


def frequencies(constants: Floats, rows: Floats) -> Floats:
    """Rigid lines by cubic interpolation of E_κ between the points of the grid."""
    table = rigid_table(JMAX)
    a, b, c = constants
    x = (np.arccos(-(2 * b - a - c) / (a - c)) - table.theta[0]) / (table.theta[1] - table.theta[0])
    i = int(x)
    points = np.arange(i - 1, i + 3)
    weights = [np.prod([(x - other) / (at - other) for other in points if other != at]) for at in points]
    j = table.quanta[:, 0]
    energy = (a + c) / 2 * j * (j + 1) + (a - c) / 2 * (np.array(weights) @ table.levels[points][:, :, 0])
    return np.asarray(energy[table.upper[rows]] - energy[table.lower[rows]])


def field_of(seed: int = 1, foreign: int = 25) -> Field:
    """The strongest rigid lines of a top with foreign peaks."""
    rng, table = np.random.default_rng(seed), rigid_table(JMAX)
    f = frequencies(TOP, np.arange(len(table.upper)))
    low = table.quanta[table.upper][:, :2].max(axis=1) <= 10
    rows = np.flatnonzero(low & (table.kind == 1) & (f > 8000) & (f < 18000))
    f = np.concatenate([f[rows], rng.uniform(8000, 18000, foreign)])
    return Field(
        peak_list(f, 10 * rng.uniform(0.5, 2.0, len(f)), 0.005, band_mhz=(8000.0, 18000.0)),
        table,
        BOUNDS,
        np.array([1.0, 2.0]),
    )


def plain_roots(field: Field, lines: Floats, companions: Floats, seeds: Floats, need: int) -> set[tuple[int, ...]]:
    """Hits, misses and A, B, C to 0.1 MHz of the roots, κ by κ between neighbouring points of the grid."""
    table, f, height = field.table, field.peaks.frequency_mhz[seeds], field.peaks.log_intensity[seeds]
    strongest = np.sort(field.peaks.frequency_mhz[field.order[:250]])
    j = table.quanta[:, 0].astype(float)
    points = np.arange(len(table.kappa))[BOUNDS.points(table.kappa)]

    def parts(rows: Floats) -> tuple[Floats, Floats]:
        upper, lower = table.upper[rows], table.lower[rows]
        return j[upper] * (j[upper] + 1) - j[lower] * (j[lower] + 1), (
            table.levels[:, upper, 0] - table.levels[:, lower, 0]
        )

    jj, energy = parts(lines)
    further_jj, further = parts(companions)
    energy, out = energy[points], set()
    for first, two, three in itertools.permutations(range(len(f)), 3):
        if np.ptp(height[[first, two, three]]) >= RATIO:
            continue
        determinant = jj[0] * energy[:, 1] - jj[1] * energy[:, 0]  # Cramer's rule of f = jj s + E d for two lines
        s_at = (f[first] * energy[:, 1] - f[two] * energy[:, 0]) / determinant
        d_at = (jj[0] * f[two] - jj[1] * f[first]) / determinant
        third = jj[2] * s_at + energy[:, 2] * d_at
        for n in np.flatnonzero((third[:-1] - f[three]) * (third[1:] - f[three]) < 0):
            w = (f[three] - third[n]) / (third[n + 1] - third[n])
            s, d = (x[n] + w * (x[n + 1] - x[n]) for x in (s_at, d_at))
            k = points[n]
            top = np.array([s + d, s + d * (table.kappa[k] + w * (table.kappa[k + 1] - table.kappa[k])), s - d])
            if (top < BOUNDS.low).any() or (top > BOUNDS.high).any() or 1 / top[2] > (1 / top[0] + 1 / top[1]) / 0.985:
                continue
            at = further_jj * s + d * (further[k] + w * (further[k + 1] - further[k]))
            at = at[(at >= 8000) & (at < 18000)]
            centre = 8000 + BIN_MHZ * (np.floor((at - 8000) / BIN_MHZ) + 0.5)
            apart = np.floor(np.abs(centre[:, None] - strongest).min(axis=1) / 0.02)
            hits = int((apart < max(NEAR_MHZ, 2 * SOFTNESS * top[1]) / 0.02).sum())
            if hits >= need and hits >= len(at) - hits:
                out.add((hits, len(at) - hits, *np.round(top * 10).astype(int).tolist()))
    return out


def test_roots_are_those_of_a_plain_loop() -> None:
    """Of three families; the top that made the lines is among the roots."""
    field = field_of()
    chosen = families(field.table, BOUNDS, (8000.0, 18000.0), (1.0, 4.0), np.random.default_rng(2), 200, 60)
    chosen = [family for family in chosen if family.kind == 1][:3]
    right, total = 0, 0
    for family in chosen:
        exact = frequencies(TOP, family.lines)
        seeds = np.unique(
            [
                *(int(np.argmin(np.abs(field.peaks.frequency_mhz - line))) for line in exact),
                *range(0, len(field.peaks), 25),
            ]
        )
        computed = search_roots(field, family, seeds, 2)
        change = field.jj[field.table.upper[family.lines]] - field.jj[field.table.lower[family.lines]]
        lines = family.lines[np.argsort(-np.abs(change), kind="stable")]
        expected = plain_roots(field, lines, family.companions, seeds, 2)
        compiled = {(int(h), int(m), *np.round(10 * np.array(top)).astype(int).tolist()) for h, m, *top in computed}
        # a crossing and its return between two looks, four points of κ apart, are seen by the plain loop alone
        assert compiled <= expected
        assert len(compiled) >= 0.97 * len(expected)
        total += len(expected)
        right += any(np.abs(top / TOP - 1).max() < 1e-3 for top in computed[:, 2:])
    assert right == len(chosen)
    assert total >= 3


def plain_joint(f: Floats, height: Floats, sigma: Floats, peaks: PeakList) -> float:
    """ln Π (1 - p + p max Gaussians over density), each peak once."""
    total, free = 0.0, np.ones(len(peaks), dtype=bool)
    for at, h, error in zip(f, height, sigma, strict=True):
        seen = DETECTED / (1 + np.exp(-(h - peaks.log_threshold) / (0.4 * SPREAD)))
        if seen < 0.02:
            continue
        x, y = (peaks.frequency_mhz - at) / error, (peaks.log_intensity - h) / SPREAD
        ratio = np.where(free & (np.abs(x) <= 4), np.exp(-(x**2 + y**2) / 2 - peaks.log_density), 0.0)
        best = int(np.argmax(ratio))
        if ratio[best] > 0:
            free[best] = False
        total += np.log(1 - seen + seen * ratio[best] / (2 * np.pi * error * SPREAD))
    return float(total)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_likelihood_ratio_is_the_product_of_lines(seed: int) -> None:
    rng, peaks = np.random.default_rng(seed), field_of(seed).peaks
    f = np.concatenate(
        [peaks.frequency_mhz[::2] + 0.1 * rng.normal(size=len(peaks.frequency_mhz[::2])), rng.uniform(8000, 18000, 9)]
    )
    height, sigma = rng.uniform(1.0, 4.0, len(f)), np.full(len(f), 0.2)
    value = ratio_at(peaks, f, height, 0.2)
    assert value == pytest.approx(plain_joint(f, height, sigma, peaks), rel=1e-12)
    assert value != pytest.approx(plain_joint(f + 0.05, height, sigma, peaks), rel=1e-3)


def test_likelihood_ratios_along_a_line_are_those_of_each_place() -> None:
    rng, peaks = np.random.default_rng(15), field_of(5).peaks
    f, move = rng.choice(peaks.frequency_mhz, 20) + rng.normal(size=20), rng.normal(size=20)
    height, sigma, t = rng.uniform(1.0, 4.0, 20), rng.uniform(0.2, 2.0, 20), np.linspace(-4, 4, 17)
    values = _kernels.joint_ratios_along(
        f,
        move,
        t,
        height,
        sigma,
        peaks.frequency_mhz,
        peaks.log_intensity,
        peaks.log_density,
        peaks.log_threshold,
        SPREAD,
        DETECTED,
    )
    plain = [plain_joint(f + x * move, height, sigma, peaks) for x in t]
    assert len(set(np.round(plain, 6))) == len(t)  # the places differ
    np.testing.assert_allclose(values, plain, rtol=1e-12)


def test_the_best_scale_is_that_of_all_trials() -> None:
    """Trials that cannot win end early; the best remains, and nothing below the least."""
    rng, peaks = np.random.default_rng(16), field_of(6).peaks
    f = np.concatenate(
        [peaks.frequency_mhz[::3] + 0.1 * rng.normal(size=len(peaks.frequency_mhz[::3])), rng.uniform(8000, 18000, 9)]
    )
    expected, sigma = -np.sort(-rng.uniform(-3.0, 0.0, len(f))), np.full(len(f), 0.2)
    trials = {
        float(scale): plain_joint(f, expected + scale, sigma, peaks)
        for n in range(8)
        for scale in peaks.log_intensity[np.abs(peaks.frequency_mhz - f[n]) <= 3 * sigma[n]] - expected[n]
    }
    high = max(trials, key=lambda scale: trials[scale])
    arguments = (
        f, expected, sigma, peaks.frequency_mhz, peaks.log_intensity, peaks.log_density, peaks.log_threshold, SPREAD, DETECTED, 8,
    )  # fmt: skip
    value, scale = _kernels.best_scale(*arguments, 0.0)
    assert len(trials) > 3
    assert trials[high] > 10
    assert scale == pytest.approx(high, abs=0.25 * SPREAD)  # nearer trials count as one
    assert value == pytest.approx(trials[high], abs=0.5)
    assert _kernels.best_scale(*arguments, value - 1e-6) == (value, scale)
    assert _kernels.best_scale(*arguments, value + 1e-6) == (0.0, -np.inf)


@pytest.mark.parametrize("seed", [1, 2])
def test_second_lines_within_the_bounds(seed: int) -> None:
    """The ranges of seeds at each κ are those whose A, B, C are within 3 % of the bounds and not beyond a planar top."""
    rng, kappa = np.random.default_rng(seed), np.linspace(-0.99, 0.99, 25)
    difference, jj = rng.normal(size=(3, 25)) + np.array([[6.0], [-3.0], [1.0]]), np.array([6.0, 4.0, 0.0])
    seeds, bounds = np.sort(rng.uniform(2000, 30000, 200)), BOUNDS.array
    linear = _sweep._linear(difference, jj, kappa)
    begin, end = np.empty(25, np.int64), np.empty(25, np.int64)
    largest = _sweep._most_asymmetric(kappa, 0.95)
    inside = 0
    for first in seeds[::10]:
        _sweep._seconds_within(first, jj, linear, largest, seeds, bounds, begin, end)
        for k in range(25):
            matrix = np.array([[jj[0], difference[0, k]], [jj[1], difference[1, k]]])
            mean, half = np.linalg.solve(matrix, np.stack([np.full(len(seeds), first), seeds]))
            a, b, c = mean + half, mean + kappa[k] * half, mean - half
            within = (half > 0) & (c * (a + b) > 0.95 * a * b)
            for values, low, high in zip((a, b, c), bounds[::2], bounds[1::2], strict=True):
                within &= (values > 0.97 * low) & (values < 1.03 * high)
            np.testing.assert_array_equal(np.flatnonzero(within), np.arange(begin[k], end[k]))
            inside += int(within.sum())
    assert inside > 50


def test_the_nearest_peaks_in_frequency_and_height() -> None:
    rng, peaks = np.random.default_rng(17), field_of(7, 200).peaks
    centre, height, errors = (
        rng.choice(peaks.frequency_mhz, 300) + rng.normal(size=300),
        rng.uniform(1.0, 4.0, 300),
        rng.uniform(0.5, 8.0, 300),
    )
    chosen = _kernels.nearest_peaks(
        centre, height, errors, 3.5, 1.5, peaks.frequency_mhz, peaks.log_intensity, peaks.log_density, SPREAD, 12
    )
    for line, peak in enumerate(chosen.tolist()):
        near = np.flatnonzero(np.abs(peaks.frequency_mhz - centre[line]) < 3.5 * errors[line])
        higher = (peaks.log_intensity[near] - height[line]) / SPREAD
        cost = ((peaks.frequency_mhz[near] - centre[line]) / errors[line]) ** 2 + higher**2
        best = int(np.argmin(cost)) if 0 < len(near) < 12 else -1
        likely = best >= 0 and 7 * errors[line] * np.exp(peaks.log_density[near[best]]) * 4 * SPREAD < 1.5
        assert peak == (near[best] if likely and abs(higher[best]) < 3 else -1)
    assert 50 < (chosen >= 0).sum() < 250


def test_the_best_temperature_and_ratio_of_a_rigid_top() -> None:
    """Of all lines of a type the forty strongest, the scale proposed by the peaks near the eight strongest."""
    field = field_of()
    table, peaks = field.table, field.peaks
    j = table.quanta[:, 0]
    f = frequencies(TOP, np.arange(len(table.upper)))
    i = (
        (np.arccos(-(2 * TOP[1] - TOP[0] - TOP[2]) / (TOP[0] - TOP[2])) - table.theta[0])
        / (table.theta[-1] - table.theta[0])
        * 100
    )
    strength = table.strength[int(i)] + (i % 1) * (table.strength[int(i) + 1] - table.strength[int(i)])
    rows = np.flatnonzero((table.kind == 1) & (f > 8000) & (f < 18000) & (strength > 1e-3))
    x = (np.arccos(-(2 * TOP[1] - TOP[0] - TOP[2]) / (TOP[0] - TOP[2])) - table.theta[0]) / (
        table.theta[1] - table.theta[0]
    )
    reduced = table.levels[int(x), :, 0] + (x % 1) * (table.levels[int(x) + 1, :, 0] - table.levels[int(x), :, 0])
    energy = (TOP[0] + TOP[2]) / 2 * j * (j + 1) + (TOP[0] - TOP[2]) / 2 * reduced
    best = (0.0, 0.0)
    for temperature in field.temperatures:
        expected = np.log(strength[rows] * f[rows] ** 2) - energy[table.lower[rows]] / (MHZ_PER_K * temperature)
        strongest = list[int]()
        for n in np.argsort(-expected).tolist():
            if len(strongest) < 40 and all(abs(f[rows[n]] - f[rows[m]]) >= 0.3 for m in strongest):
                strongest.append(n)
        g, e, sigma = (
            f[rows[strongest]],
            expected[strongest],
            np.full(len(strongest), max(ROUGH_MHZ, SOFTNESS * TOP[1])),
        )
        scales = list[float]()
        for n in range(8):
            for p in np.flatnonzero(np.abs(peaks.frequency_mhz - g[n]) <= 3 * sigma[n]):
                scale = peaks.log_intensity[p] - e[n]
                if all(abs(other - scale) >= 0.25 * SPREAD for other in scales):  # nearer ones count as one
                    scales.append(scale)
                    best = max(best, (plain_joint(g, e + scale, sigma, peaks), float(temperature)))
    ratios, temperatures = quick_ratios(field, np.array([TOP, 1.01 * TOP]), 1)
    assert ratios[0] == pytest.approx(best[0], abs=0.05)  # the interpolation of E_κ here is linear
    assert temperatures[0] == best[1]
    assert ratios[1] < ratios[0] / 2


def test_the_highest_are_those_of_a_sort() -> None:
    height = np.random.default_rng(4).normal(size=500)
    for most in (1, 7, 600):
        np.testing.assert_array_equal(_kernels._highest(height, most), np.argsort(-height, kind="stable")[:most])
    np.testing.assert_array_equal(_kernels._highest(np.array([2.0, 3.0, 3.0, 1.0]), 2), [1, 2])
