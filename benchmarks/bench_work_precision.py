"""What accuracy costs in time: attitude error after 1000 periods against time per period, for every integrator.

    python benchmarks/bench_work_precision.py [--picture docs/pictures/work_precision.png] [--json FILE]

One water-like top, I = (1, 1.875, 2.875), L = (0.5, 0.75, 1), one core. The exact solution is shown for one evaluation
per period, its preparation left out; all other times are those of whole calls. Time is that of the processor spent in this
process, which other work on the machine disturbs less than the clock on the wall.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import Method, integrate
from rotor.classical.integrators.moser_veselov import MoserVeselov
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting
from rotor.geometry.quaternions import cross, product
from rotor.geometry.rotations import IDENTITY, distance

MOMENTS, MOMENTUM, PERIODS = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0]), 1000

Curve = list[tuple[float, float]]


def scipy_motion(tolerance: float, span: float) -> np.ndarray:
    """Attitude at the end of `span` by scipy's DOP853 on L and q."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        m1, m2, m3, w, x, y_, z = y.tolist()
        w1, w2, w3 = m1 / MOMENTS[0], m2 / MOMENTS[1], m3 / MOMENTS[2]
        turning = product((w, x, y_, z), (0.0, w1, w2, w3))
        return [*cross((m1, m2, m3), (w1, w2, w3)), *(0.5 * part for part in turning)]

    start = [*MOMENTUM, *IDENTITY]
    return solve_ivp(rates, (0.0, span), start, "DOP853", t_eval=[span], rtol=tolerance, atol=tolerance).y[3:, -1]


def timed(run: Callable[[], np.ndarray], repeats: int) -> tuple[float, np.ndarray]:
    """Microseconds per period, median of the runs, and the attitude."""
    seconds, attitude = [], IDENTITY
    for _ in range(repeats):
        start = time.process_time()
        attitude = run()
        seconds.append(time.process_time() - start)
    return statistics.median(seconds) / PERIODS * 1e6, attitude


def curve(make: Callable[[float], Method], settings: list[float], repeats: int = 3) -> Curve:
    """(µs per period, error) for each setting; a setting that a method refuses is left out and listed."""
    motion = free_motion(MOMENTS, MOMENTUM)
    span = PERIODS * float(motion.period)
    exact, points = motion.at(span)[1], []
    for setting in settings:
        try:
            method = make(setting)
            cost, attitude = timed(lambda m=method: integrate(m, MOMENTS, MOMENTUM, [0.0, span]).attitude[-1], repeats)
        except ValueError as refusal:
            print(f"left out: {refusal}")
            continue
        points.append((cost, float(distance(attitude, exact))))
    return points


def exact_point() -> Curve:
    """One evaluation per period for 1000 periods; the error is that at t = 10⁶, 48,000 periods, against 50 digits."""
    motion = free_motion(MOMENTS, MOMENTUM)
    times = float(motion.period) * np.arange(1, PERIODS + 1)
    cost, _ = timed(lambda: motion.at(times)[1][-1], 5)
    truth = (0.18396472966240838, -0.12579834796681974, 0.37906201650949952, 0.89813347645481284)
    return [(cost, float(distance(motion.at(1e6)[1], truth)))]


def curves() -> dict[str, Curve]:
    """All of them."""
    period = float(free_motion(MOMENTS, MOMENTUM).period)
    table: dict[str, Curve] = {}
    steps = {2: [640, 1280, 2560, 5120], 4: [80, 160, 320, 640], 6: [40, 80, 160, 320], 8: [20, 40, 80, 120]}
    for name, kind in (("rotations", RotationSplitting), ("symmetric top", SymmetricTopSplitting)):
        for order in (2, 4, 8):
            counts = steps[order]
            table[f"{name}, order {order}"] = curve(lambda n, k=kind, o=order: k(period / n, o), counts)
    for order in (4, 8):
        table[f"Moser-Veselov {order}"] = curve(lambda n, o=order: MoserVeselov(period / n, o), [20, 40, 80, 160, 320])
    table["Moser-Veselov exact, 14 ms to prepare"] = curve(lambda n: MoserVeselov(period / n, 0), [14, 20, 28, 40])
    table["Lie-group DOP853"] = curve(lambda tolerance: LieRungeKutta(tolerance), [1e-8, 1e-9, 1e-10, 1e-11])
    span = PERIODS * period
    exact = free_motion(MOMENTS, MOMENTUM).at(span)[1]
    plain = []
    for tolerance in (1e-7, 1e-8, 1e-9, 1e-10, 1e-12):
        cost, attitude = timed(lambda t=tolerance: scipy_motion(t, span), 1)
        plain.append((cost, float(distance(attitude, exact))))
    table["scipy DOP853"] = plain
    table["exact, 48,000 periods"] = exact_point()
    return table


def draw(table: dict[str, Curve], picture: Path) -> None:
    """The work-precision picture."""
    from rotor.plots.picture import BLUE, GREEN, GREY, ORANGE, PALETTE, new_figure, save, styled

    looks = {"rotations": (BLUE, "o"), "symmetric": (GREEN, "s"), "Moser": (ORANGE, "^")}
    looks |= {"Lie": (PALETTE[3], "D"), "scipy": (GREY, "v"), "exact": ("black", "*")}
    dashes = {"2": ":", "4": "--", "8": "-"}
    with styled():
        figure = new_figure((5.2, 4.6))
        axes = figure.add_subplot()
        for name, points in table.items():
            color, marker = next(look for key, look in looks.items() if name.startswith(key))
            cost, error = np.array(points).T
            size = 12 if marker == "*" else 5
            axes.loglog(error, cost, color=color, marker=marker, ms=size, ls=dashes.get(name[-1], "-."), label=name)
        axes.invert_xaxis()
        axes.set_xlabel("Error of the attitude after 1000 periods (rad)")
        axes.set_ylabel("Processor time of a period (µs)")
        axes.set_title("Free rotation of an asymmetric top")
        axes.grid(alpha=0.25)
        figure.legend(loc="outside lower center", ncols=2, fontsize=7.5)
    save(figure, picture, "work and precision", {"made by": "benchmarks/bench_work_precision.py"})


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description="work-precision of the integrators")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    table = curves()
    for name, points in table.items():
        print(f"{name:38s}", "  ".join(f"{cost:9.3g} µs {error:8.1e}" for cost, error in points))
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    if arguments.picture:
        draw(table, arguments.picture)


if __name__ == "__main__":
    main()
