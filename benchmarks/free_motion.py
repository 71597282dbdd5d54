"""What the exact free motion costs: per evaluation, per body set up, beside one period of an adaptive stepper.

    python benchmarks/free_motion.py [--json benchmarks/results/free_motion.json]

Goal: an evaluation under 0.2 µs on one core.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from rotor.classical.free.free_motion import free_motion
from rotor.geometry.quaternions import cross, product
from rotor.geometry.rotations import IDENTITY

BODIES = {
    "asymmetric (water-like)": ((1.0, 1.875, 2.875), (0.5, 0.75, 1.0)),
    "1e-6 from the unstable axis": ((1.0, 1.875, 2.875), (1e-6, 0.75, 1e-6)),
    "symmetric": ((1.0, 1.0, 1.7), (0.5, 0.75, 1.0)),
    "on the separatrix": ((3.0, 4.0, 6.0), (0.7, 0.2, 0.7)),
    "linear": ((0.0, 1.0, 1.0), (0.0, 0.75, 1.0)),
}
TIMES = 1_000_000


def seconds(action: Callable[[], object], repeats: int = 5) -> float:
    """The shortest of several runs."""
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        spent.append(time.perf_counter() - start)
    return min(spent)


def main() -> None:
    """Measure, print, and write a file if asked."""
    parser = argparse.ArgumentParser(description="cost of the exact free motion")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rng, table = np.random.default_rng(1), {}
    times = rng.uniform(0.0, 1e6, TIMES)
    free_motion(*BODIES["linear"]).at(0.0)  # compiles, or reads what was compiled
    for name, (moments, momentum) in BODIES.items():
        motion = free_motion(moments, momentum)
        table[f"one evaluation, {name}"] = seconds(lambda m=motion: m.at(times)) / TIMES * 1e6  # type: ignore[misc]
    for n in (1, 1_000, 100_000):
        moments, momenta = rng.uniform(0.3, 3.0, (n, 3)), rng.normal(size=(n, 3))
        spent = seconds(lambda i=moments, m=momenta: free_motion(i, m), 3)  # type: ignore[misc]
        table[f"setting up {n} bodies, each"] = spent / n * 1e6
    table["scipy DOP853, rtol 1e-12, one period, one body"] = seconds(stepped_period, 2) * 1e6
    for name, value in table.items():
        print(f"{name:50s} {value:12.3f} µs")
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


def stepped_period() -> None:
    """One period of the water-like body by an adaptive Runge-Kutta of order 8."""
    moments, momentum = (np.array(x) for x in BODIES["asymmetric (water-like)"])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        momentum, omega = y[:3], y[:3] / moments
        turning = product(y[3:], (0.0, *omega))
        return np.array([*cross(momentum, omega), *(0.5 * rate for rate in turning)])

    start = np.concatenate([momentum, IDENTITY])
    solve_ivp(rates, (0.0, 20.6947551192268), start, method="DOP853", rtol=1e-12, atol=1e-12)


if __name__ == "__main__":
    main()
