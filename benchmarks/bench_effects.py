"""An absent effect costs nothing: free motion through `integrate` with an empty list beside the bare compiled loop.

    python benchmarks/bench_effects.py [--json benchmarks/results/effects.json]

Also what each effect costs where it is present, per step of one body and per step and body of a thousand; and two effects on
one body and one field on 10⁵ bodies, compiled and with every effect called from Python, in turns in the same run.
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
from rotor.classical.effects.drag import LinearDrag
from rotor.classical.effects.drive import PeriodicDrive
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.effects.gyrostat import SpinningRotor
from rotor.classical.effects.torques import ConstantTorque
from rotor.classical.integrators import lie_runge_kutta, splitting
from rotor.classical.integrators._step_kernels import rotations, rows
from rotor.classical.integrators.driven_batch import propagate_driven
from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
from rotor.classical.integrators.method import Method, integrate
from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting
from rotor.geometry.rotations import IDENTITY, uniform

MOMENTS, MOMENTUM, STEP = np.array([1.0, 1.875, 2.875]), np.array([0.5, 0.75, 1.0]), 0.05
EFFECTS = {
    "constant torque": ConstantTorque([0.1, 0.0, 0.0]),
    "periodic drive": PeriodicDrive([0.1, 0.0, 0.0], 1.0),
    "spinning rotor": SpinningRotor([0.0, 0.0, 0.5]),
    "changing inertia": ChangingInertia(lambda t: MOMENTS * (1.0 + 0.1 * np.sin(t))),
    "permanent dipole": PermanentDipole([0.3, 0.2, 0.5], [0.0, 0.0, 0.7]),
    "linear drag": LinearDrag([0.01, 0.02, 0.01]),
    "induced dipole": InducedDipole([0.3, 0.2, 0.5], [0.0, 0.0, 0.7]),
    "gravity about a pivot": GravityAboutPivot(1.0, [0.0, 0.0, 0.5], [0.0, 0.0, -1.0]),
}

PAIRS: dict[str, tuple[Method, list[str]]] = {
    "order 2, dipole and drive": (SymmetricTopSplitting(STEP), ["permanent dipole", "periodic drive"]),
    "order 2, dipole and rotor": (SymmetricTopSplitting(STEP), ["permanent dipole", "spinning rotor"]),
    "order 4, dipole and drive": (SymmetricTopSplitting(STEP, 4), ["permanent dipole", "periodic drive"]),
    "order 8 adaptive, drag and drive": (LieRungeKutta(fixed_step=0.2), ["linear drag", "periodic drive"]),
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


def compiled_beside_called() -> dict[str, float]:
    """Steps a second of one body under two effects: in the compiled loop, and with both called from Python at every step."""
    table = {}
    for name, (method, names) in PAIRS.items():
        effects, length = [EFFECTS[name] for name in names], getattr(method, "fixed_step", None) or STEP
        speed = {}
        for form, few, steps in (("compiled", 0, 200_000), ("called", np.inf, 2_000)):
            splitting.WORTH_LOADING = lie_runge_kutta.PLAIN_STEPS = few  # type: ignore[assignment]
            span = [0.0, length * steps]
            run = lambda m=method, s=span, e=effects: integrate(m, MOMENTS, MOMENTUM, s, effects=e)  # noqa: E731
            run()
            speed[form] = 1e6 / microseconds(run, steps, 5)
        table |= {f"{name}, {form}, a second": value for form, value in speed.items()}
        table[f"{name}: compiled / called"] = speed["compiled"] / speed["called"]
    return table


def crowd_in_field(bodies: int = 100_000, steps: int = 40) -> dict[str, float]:
    """Body-steps a second of 10⁵ bodies in one field on one core: blocks, and `integrate` with the field called from Python."""
    rng, effects = np.random.default_rng(1), [EFFECTS["permanent dipole"]]
    momenta, attitudes, span = rng.normal(size=(bodies, 3)), uniform(bodies, rng=rng), [0.0, 0.01 * steps]
    splitting.WORTH_LOADING = np.inf  # type: ignore[assignment]
    blocks = lambda: propagate_driven(MOMENTS, momenta, attitudes, 0.01, steps, effects)  # noqa: E731
    one_by_one = lambda: integrate(SymmetricTopSplitting(0.01), MOMENTS, momenta, span, attitudes, effects)  # noqa: E731
    blocks()
    speed = [1e6 / microseconds(run, bodies * steps, 3) for run in (blocks, one_by_one)]
    names = [f"10⁵ bodies in a field, {form}, a second" for form in ("blocks", "called")]
    return dict(zip(names, speed, strict=True)) | {"10⁵ bodies in a field: blocks / called": speed[0] / speed[1]}


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
        if getattr(effect, "needs_velocity", False):
            continue
        alone = microseconds(lambda e=effect: integrate(method, MOMENTS, MOMENTUM, long, effects=[e]), 1000, 3)
        many = microseconds(lambda e=effect: integrate(method, MOMENTS, crowd, short, effects=[e]), 100_000, 3)
        table[f"{name}, one body"], table[f"{name}, per body of 1000"] = alone, many
    table |= compiled_beside_called() | crowd_in_field()
    for name, value in table.items():
        unit = "" if "/" in name else " a second" if "a second" in name else " µs a step"
        print(f"{name.removesuffix(', a second'):56s} {value:14.3f}{unit}")
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
