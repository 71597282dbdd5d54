"""An absent effect costs nothing: free motion through `integrate` with an empty list beside the bare compiled loop.

    python benchmarks/bench_effects.py [--json benchmarks/results/effects.json]

Also what each effect costs where it is present, per step of one body and per step and body of a thousand.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rotor.classical.effects.changing_inertia import ChangingInertia
from rotor.classical.effects.dipole_in_field import InducedDipole, PermanentDipole
from rotor.classical.effects.drive import PeriodicDrive
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.effects.torques import ConstantTorque
from rotor.classical.integrators._step_kernels import rotations, rows
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import RotationSplitting
from rotor.geometry.rotations import IDENTITY

MOMENTS, MOMENTUM, STEP = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0]), 0.05
EFFECTS = {
    "constant torque": ConstantTorque([0.1, 0.0, 0.0]),
    "periodic drive": PeriodicDrive([0.1, 0.0, 0.0], 1.0),
    "spinning rotor": SpinningRotor([0.0, 0.0, 0.5]),
    "changing inertia": ChangingInertia(lambda t: MOMENTS * (1.0 + 0.1 * np.sin(t))),
    "permanent dipole": PermanentDipole([0.3, 0.2, 0.5], [0.0, 0.0, 0.7]),
    "induced dipole": InducedDipole([0.3, 0.2, 0.5], [0.0, 0.0, 0.7]),
    "gravity about a pivot": GravityAboutPivot(1.0, [0.0, 0.0, 0.5], [0.0, 0.0, -1.0]),
}


def microseconds(run: Callable[[], object], steps: int, repeats: int = 7) -> float:
    """Processor time of one step in the fastest of some runs."""
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        seconds.append(time.process_time() - start)
    return min(seconds) / steps * 1e6


def bare(steps: int) -> None:
    """The compiled loop without anything around it."""
    state = rows(MOMENTUM[None], np.asarray(IDENTITY)[None])
    rotations(state, np.zeros_like(state), 1.0 / MOMENTS[None], STEP, np.ones(1), steps)


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description="cost of effects")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    method, steps = RotationSplitting(STEP), 500_000
    span = [0.0, STEP * steps]
    table = {
        "bare loop": microseconds(lambda: bare(steps), steps),
        "no effects": microseconds(lambda: integrate(method, MOMENTS, MOMENTUM, span), steps),
    }
    table["no effects / bare loop"] = table["no effects"] / table["bare loop"]
    crowd, long, short = np.tile(MOMENTUM, (1000, 1)), [0.0, STEP * 1000], [0.0, STEP * 100]
    for name, effect in EFFECTS.items():
        alone = microseconds(lambda e=effect: integrate(method, MOMENTS, MOMENTUM, long, effects=[e]), 1000, 3)
        many = microseconds(lambda e=effect: integrate(method, MOMENTS, crowd, short, effects=[e]), 100_000, 3)
        table[f"{name}, one body"], table[f"{name}, per body of 1000"] = alone, many
    for name, value in table.items():
        print(f"{name:40s} {value:8.3f}" + ("" if "/" in name else " µs a step"))
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
