"""A free gas of 10⁶ molecules followed over 1000 times, streamed: by the exact motion, and by steps with their error.

    python benchmarks/bench_gas.py [--molecules 1000000] [--times 1000] [--json benchmarks/results/gas.json]

C1 of the dipole and C2 of a tensor of water at 300 K are averaged, molecules in pieces of 10,000 on two threads. The stepper moves
the same molecules; its error is the largest difference of both curves from the exact ones.
"""

from __future__ import annotations

import argparse
import json
import platform
import resource
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import rotor
from rotor.classical.free.free_motion import free_motion
from rotor.classical.gas.ensembles import free_gas_correlations, stepped_gas_correlations
from rotor.units import ASE_TIME_PS, EV_PER_K

END_PS, TEMPERATURE_K, THREADS = 2.0, 300.0, 2
STEPS = (1, 4)  # between two times


def measured(molecules: int, count: int) -> dict[str, float | str]:
    """Seconds, rates, errors."""
    water = rotor.read("water")
    moments, kt = np.array(water.moments_u_angstrom2), EV_PER_K * TEMPERATURE_K
    times = np.linspace(0.0, END_PS, count) / ASE_TIME_PS
    probe = {"vector": water.dipole_abc_debye, "tensor": np.diag([1.0, 0.3, -0.5])}
    free_motion(moments, [1.0, 2.0, 3.0]).at(0.0)  # compiled before the clock starts
    free_gas_correlations(moments, kt, times[:2], molecules=2, rng=np.random.default_rng(1), **probe)
    stepped_gas_correlations(moments, kt, times[1], 2, molecules=2, rng=np.random.default_rng(1), steps=4, **probe)
    with ThreadPoolExecutor(THREADS) as pool:
        start, busy = time.perf_counter(), time.process_time()
        exact = free_gas_correlations(
            moments, kt, times, molecules=molecules, rng=np.random.default_rng(6), executor=pool, **probe
        )
        seconds = time.perf_counter() - start
        table: dict[str, float | str] = {
            "machine": f"{platform.machine()}, {THREADS} threads, shared with other work",
            "molecules": molecules,
            "times": count,
            "exact, seconds": seconds,
            "exact, processor seconds": time.process_time() - busy,
            "standard error of C1 at the last time": float(exact.c1_error[-1]),
        }
        for steps in STEPS:
            start, busy = time.perf_counter(), time.process_time()
            stepped = stepped_gas_correlations(
                moments, kt, float(times[1]), count, steps=steps, molecules=molecules, rng=np.random.default_rng(6),
                executor=pool, **probe,
            )  # fmt: skip
            seconds = time.perf_counter() - start
            table[f"{steps} steps between times, seconds"] = seconds
            table[f"{steps} steps between times, processor seconds"] = time.process_time() - busy
            table[f"{steps} steps between times, error of C1"] = largest(stepped.c1, exact.c1)
            table[f"{steps} steps between times, error of C2"] = largest(stepped.c2, exact.c2)
    table["peak memory, MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return table


def largest(a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference of two curves."""
    return float(np.abs(a - b).max())


def main() -> None:
    """Measure, print, and write a file if asked."""
    parser = argparse.ArgumentParser(description="a free gas, exact and stepped")
    parser.add_argument("--molecules", type=int, default=1_000_000)
    parser.add_argument("--times", type=int, default=1000)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    table = measured(arguments.molecules, arguments.times)
    for name, value in table.items():
        print(f"{name:45s} {value if isinstance(value, str) else format(value, '.4g')}")
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
