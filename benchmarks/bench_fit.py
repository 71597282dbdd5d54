"""One iteration of a fit to 500, 5,000 and 25,000 lines; what is left after each iteration; and what a tolerance costs.

    OPENBLAS_NUM_THREADS=1 python benchmarks/bench_fit.py [--json benchmarks/results/fit.json]
    OPENBLAS_NUM_THREADS=1 python benchmarks/bench_fit.py --picture docs/pictures/fit_accuracy.png

One iteration is levels, derivatives, residuals, QR and the step; lines are synthetic with normal errors of 20 kHz.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from rotor.fitting.assignment import Assignments, assignments, levels_in
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import Parameters, parameters
from rotor.fitting.result import Fit
from rotor.fitting.search.residuals import Search
from rotor.quantum.labels.labelled import LevelModel, level_model
from rotor.quantum.solve import solve_levels
from rotor.statistics.least_squares import _Linear, _State
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

TRUE = Constants(
    A=8572.05, B=3640.12, C=2790.97, DeltaJ=1.1e-3, DeltaJK=-2.4e-3, DeltaK=1.1e-2, deltaJ=3.1e-4, deltaK=1.9e-3,
    PhiJ=2e-9, PhiJK=-1e-8, PhiKJ=4e-8, PhiK=9e-8, phiJ=8e-10, phiJK=5e-9, phiK=3e-8, reduction="A",
)  # fmt: skip
ERROR_MHZ = 0.02
NAMES = ("j", "ka", "kc")


def lines_of(constants: Constants, count: int, jmax: int = 60) -> Assignments:
    """So many a- and b-type lines to J max, drawn at random, with normal errors."""
    rng = np.random.default_rng(count)
    levels = solve_levels(Top(constants), jmax)
    labels = np.stack([levels.quanta[name] for name in NAMES], axis=1)
    upper = rng.integers(len(labels), size=40 * count)
    lower = rng.integers(len(labels), size=40 * count)
    change = labels[upper] - labels[lower]
    near = (np.abs(change[:, 0]) <= 1) & (np.abs(change[:, 1]) <= 1) & (upper != lower)
    while near.sum() < count:
        more = rng.integers(len(labels), size=(2, 40 * count))
        upper, lower = np.concatenate([upper[near], more[0]]), np.concatenate([lower[near], more[1]])
        change = labels[upper] - labels[lower]
        near = (np.abs(change[:, 0]) <= 1) & (np.abs(change[:, 1]) <= 1) & (upper != lower)
    up, low = upper[near][:count], lower[near][:count]
    frequency = levels.energy_mhz[up] - levels.energy_mhz[low] + ERROR_MHZ * rng.normal(size=count)
    return assignments(NAMES, labels[up], labels[low], frequency, ERROR_MHZ)


def iteration_ms(lines: Assignments, free: Parameters, model: LevelModel, repeats: int) -> float:
    """The fastest of some iterations, processor time."""
    _, upper, lower = levels_in(lines)
    used = np.ones(len(lines), dtype=bool)
    search = Search(lines, model, free, FitOptions(), upper, lower, lines.error_mhz, used)

    points = cycle([free.start * (1 + 1e-12), free.start * (1 - 1e-12)])  # the last point is not computed again

    def round_() -> None:
        point = next(points)
        state = _State.at(point, *search.evaluate(point))
        _Linear.at_state(state, state.norms, np.zeros(len(free.start))).step(0.0)

    return 1e3 * fastest(round_, repeats)


def fastest(run: Callable[[], object], repeats: int) -> float:
    """Seconds of processor time of the fastest of some runs, after one that does not count."""
    run()
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        seconds.append(time.process_time() - start)
    return min(seconds)


def one_state() -> list[dict[str, Any]]:
    """15 constants, J to 60."""
    rows = []
    for count in (500, 5_000, 25_000):
        lines = lines_of(TRUE, count)
        free = parameters(TRUE, list(TRUE.values))
        model = level_model(TRUE, levels_in(lines)[0])
        rows.append(
            {"case": "15 constants, J ≤ 60", "lines": count, "iteration_ms": iteration_ms(lines, free, model, 20)}
        )
    return rows


def starts(share: float) -> Constants:
    """The true constants, each off by its own part: all by one factor would be one step."""
    off = 1 + share * np.random.default_rng(1).normal(size=len(TRUE.values))
    pairs = zip(TRUE.values.items(), off.tolist(), strict=True)
    return TRUE.replace(**{name: value * factor for (name, value), factor in pairs})


def iterations(count: int = 500, jmax: int = 30, share: float = 0.03) -> list[dict[str, float]]:
    """What is left after each iteration, in standard errors, and the time so far."""
    lines, start = lines_of(TRUE, count, jmax), starts(share)
    free, rows = parameters(start, list(TRUE.values)), list[dict[str, float]]()

    def fitted(most: int, tolerance: float = 1e-4) -> Fit:
        return fit_lines(lines, start, free, FitOptions(most_iterations=most, tolerance=tolerance))

    best = fitted(100, 1e-9)
    for most in range(1, 20):
        computed = fitted(most)
        left = float(np.abs((computed.values - best.values) / best.errors).max())
        seconds = fastest(lambda most=most: fitted(most), 3)  # type: ignore[misc]
        rows.append({"iterations": len(computed.minimum.iterations), "off_sigma": left, "ms": 1e3 * seconds})
        if computed.converged:
            break
    return rows


def work_precision(count: int = 500, jmax: int = 30, share: float = 0.03) -> list[dict[str, float]]:
    """Tolerance of the search, iterations, seconds of processor time of the whole fit, and how far its constants are from the minimum
    in standard errors, the worst of 15."""
    lines, start = lines_of(TRUE, count, jmax), starts(share)
    free, rows = parameters(start, list(TRUE.values)), list[dict[str, float]]()

    def fitted(tolerance: float) -> Fit:
        return fit_lines(lines, start, free, FitOptions(tolerance=tolerance, poor_rms=1e12))

    best = fitted(1e-9)
    for tolerance in 10.0 ** np.arange(5, -8, -1):
        computed = fitted(tolerance)
        rows.append({
            "tolerance": float(tolerance),
            "iterations": len(computed.minimum.iterations),
            "seconds": fastest(lambda tolerance=tolerance: fitted(tolerance), 3),  # type: ignore[misc]
            "off_sigma": float(np.abs((computed.values - best.values) / best.errors).max()),
        })  # fmt: skip
    return rows


CURVES = ((500, 30, 0.001), (500, 30, 0.03), (5_000, 60, 0.001))  # lines, J max, how far the start is off


def picture(path: Path) -> None:
    """Error against time of the fits of CURVES, a point for each iteration until the search ends by itself."""
    from rotor.plots.picture import GREY, PALETTE, new_figure, save, styled

    with styled():
        figure = new_figure()
        axes = figure.add_subplot()
        facts = {}
        for color, (count, jmax, share) in zip(PALETTE, CURVES, strict=False):
            rows = iterations(count, jmax, share)
            label = f"{count} lines, J ≤ {jmax}, start {100 * share:g} % off"
            facts[label] = rows
            x, y = [row["ms"] for row in rows], [max(row["off_sigma"], 1e-9) for row in rows]
            axes.loglog(x, y, "o-", color=color, label=label, markersize=3.5)
            for row, cost, other in zip(rows, x, y, strict=True):
                axes.annotate(f"{row['iterations']:g}", (cost, other), xytext=(3, 3), textcoords="offset points")
        axes.axhline(1.0, color=GREY, linewidth=0.7)
        axes.axhline(1e-4, color=GREY, linewidth=0.7, linestyle="--")
        axes.set_title("Fits of 15 constants; numbers: iterations")
        axes.set_xlabel("Processor time of the whole fit (ms)")
        axes.set_ylabel("Largest error of a constant\n(standard errors)")
        low, high = axes.get_xlim()
        axes.set_xlim(0.9 * low, 1.1 * high)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("{x:g}")
        figure.legend(loc="outside lower left")
    save(figure, path, "Fits: accuracy against time", facts)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    if arguments.picture:
        picture(arguments.picture)
        return
    computed = {"one_state": one_state(), "iterations": iterations(), "work_precision": work_precision()}
    for rows in computed.values():
        for row in rows:
            print(
                "  ".join(
                    f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
                )
            )
    if arguments.json:
        arguments.json.write_text(json.dumps(computed, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
