"""What 10⁸ steps do to energy, |L| and |q|: every integrator on one water-like top.

    python benchmarks/bench_drift.py [--steps 100000000] [--json benchmarks/results/drift.json]

At 10⁴, 10⁵, ... steps: the relative change of the energy, as the mean over the steps of one period (the energy of a
splitting oscillates along the period), and of |L| and |q|. Rounding of 1e-16 a step in one direction would reach 1e-8.
A step of order 8 of a splitting is 17 of order 2, so 10⁷ of them are taken; the Lie-group method, in numpy, takes 10⁵.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from rotor.classical.free.free_motion import free_motion
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import Method, integrate
from rotor.classical.integrators.moser_veselov import MoserVeselov
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting

MOMENTS, MOMENTUM = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0])
PERIOD = float(free_motion(MOMENTS, MOMENTUM).period)


def window(method: Method, momentum: np.ndarray, attitude: np.ndarray, per_period: int) -> dict[str, float]:
    """Mean energy over one period from here, and the lengths here."""
    motion = integrate(method, MOMENTS, momentum, PERIOD / per_period * np.arange(per_period), attitude)
    lengths = np.linalg.norm(momentum), np.linalg.norm(attitude)
    return {"energy": float(np.mean(motion.energy)), "|L|": float(lengths[0]), "|q|": float(lengths[1])}


def drift(method: Method, per_period: int, most: int) -> list[dict[str, float]]:
    """Relative changes at 10⁴, 10⁵, ... steps."""
    momentum, attitude, done, rows = MOMENTUM, np.array([1.0, 0, 0, 0]), 0, []
    first = window(method, momentum, attitude, per_period)
    for exponent in range(4, 12):
        target = 10**exponent
        if target > most:
            break
        leg = integrate(method, MOMENTS, momentum, [0.0, PERIOD / per_period * (target - done)], attitude)
        momentum, attitude = leg.momentum[-1], leg.attitude[-1]
        here = window(method, momentum, attitude, per_period)
        rows.append({"steps": float(target), **{key: here[key] / first[key] - 1.0 for key in first}})
        done = target
    return rows


def main() -> None:
    """Run all, print, write."""
    parser = argparse.ArgumentParser(description="drift of the invariants over many steps")
    parser.add_argument("--steps", type=int, default=10**8)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    cases = {
        "rotations, order 2, 80 steps a period": (RotationSplitting(PERIOD / 80), 80, arguments.steps),
        "symmetric top, order 2, 80 steps a period": (SymmetricTopSplitting(PERIOD / 80), 80, arguments.steps),
        "rotations, order 8, 80 steps a period": (RotationSplitting(PERIOD / 80, 8), 80, arguments.steps // 10),
        "symmetric top, order 8, 80 steps a period": (SymmetricTopSplitting(PERIOD / 80, 8), 80, arguments.steps // 10),
        "Moser-Veselov 8, 40 steps a period": (MoserVeselov(PERIOD / 40, 8), 40, arguments.steps),
        "Moser-Veselov exact, 20 steps a period": (MoserVeselov(PERIOD / 20, 0), 20, arguments.steps),
        "Lie-group, order 8, 80 steps a period": (LieRungeKutta(fixed_step=PERIOD / 80), 80, arguments.steps // 1000),
    }
    table = {}
    for name, (method, per_period, most) in cases.items():
        table[name] = drift(method, per_period, most)
        for row in table[name]:
            print(f"{name:42s}", "  ".join(f"{key} {value:9.2g}" for key, value in row.items()), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
