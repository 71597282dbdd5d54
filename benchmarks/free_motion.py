"""What the exact free motion costs: per evaluation, per body set up, beside one period of an adaptive stepper.

Run with `python benchmarks/free_motion.py` from the project's root; prints one line per case. Goals: an evaluation
under 0.4 µs with phases in double-double, under 0.2 µs in plain double, on one core.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from rotor.classical.euler import gyroscopic_term
from rotor.classical.free import Phases, free_motion
from rotor.rotations import IDENTITY

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
    rng = np.random.default_rng(1)
    times = rng.uniform(0.0, 1e6, TIMES)
    free_motion(*BODIES["linear"]).at(0.0)  # compiles, or reads what was compiled
    modes: tuple[Phases, Phases] = ("double", "double-double")
    for name, (moments, momentum) in BODIES.items():
        motion = free_motion(moments, momentum)
        cost = [seconds(lambda m=motion, p=phases: m.at(times, p)) / TIMES * 1e6 for phases in modes]  # type: ignore[misc]
        print(f"{name:28s} {cost[0]:.3f} µs in double, {cost[1]:.3f} µs in double-double per evaluation")
    for n in (1, 1_000, 100_000):
        moments, momenta = rng.uniform(0.3, 3.0, (n, 3)), rng.normal(size=(n, 3))
        spent = seconds(lambda i=moments, m=momenta: free_motion(i, m), 3)  # type: ignore[misc]
        print(f"setting up {n:6d} bodies          {spent / n * 1e6:10.1f} µs per body")
    print(f"scipy DOP853, rtol 1e-12       {seconds(stepped_period, 2) * 1e6:10.0f} µs for one period, one body")


def stepped_period() -> None:
    """One period of the water-like body by an adaptive Runge-Kutta of order 8."""
    moments, momentum = (np.array(x) for x in BODIES["asymmetric (water-like)"])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        (m1, m2, m3), (w1, w2, w3), (q0, q1, q2, q3) = y[:3], y[:3] / moments, y[3:]
        turning = [
            -q1 * w1 - q2 * w2 - q3 * w3,
            q0 * w1 + q2 * w3 - q3 * w2,
            q0 * w2 + q3 * w1 - q1 * w3,
            q0 * w3 + q1 * w2 - q2 * w1,
        ]
        return np.array([*gyroscopic_term(m1, m2, m3, w1, w2, w3), *(0.5 * rate for rate in turning)])

    start = np.concatenate([momentum, IDENTITY])
    solve_ivp(rates, (0.0, 20.6947551192268), start, method="DOP853", rtol=1e-12, atol=1e-12)


if __name__ == "__main__":
    main()
