"""What accuracy costs in alignment and Stark maps, beside QuTiP's sesolve at its best settings and scipy's expm_multiply.

    python benchmarks/bench_alignment.py [--json FILE] [--picture FILE] [--long]

One core (set OMP_NUM_THREADS=1). Times are those of the processor spent in this process, best of several calls, everything from the
top to the trace in them. Default problem: OCS, B = 6081.492 MHz, Δα = 4.04 Å³, 1e13 W/cm². --long adds 300 K and iodobenzene.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rotor.alignment.acting import acted_on
from rotor.alignment.align import align
from rotor.alignment.pulse import RAD_PER_PS_MHZ, GaussianPulse
from rotor.alignment.qutip_objects import block_objects, solve_windows
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.solved_space import field_space
from rotor.tops.top import Top

OCS = Top.from_constants("B=6081.492 MHz", dipole_abc_debye=(0.71519, 0, 0)).with_polarizability(
    np.diag([4.04, 0, 0]), ""
)
IODOBENZENE = Top.from_constants("A=5669.126 B=750.414293 C=662.636162 MHz").with_polarizability(
    np.diag([21.5, 15.3, 10.2]), ""
)
INDOLE = Top.from_constants("A=3877.826 B=1636.047 C=1150.8997 MHz", dipole_abc_debye=(1.376, 1.40, 0))
PERIOD = 82.2167


def median(call: Callable[[], Any], times: int) -> tuple[float, Any]:
    """Milliseconds of the processor, median of some calls after one that warms up, and the result."""
    result = call()
    taken = []
    for _ in range(times):
        start = time.process_time()
        result = call()
        taken.append(time.process_time() - start)
    return 1e3 * statistics.median(taken), result


def traces(long: bool) -> list[dict[str, Any]]:
    """Our propagator on the problems that have goals, its own error estimate beside each."""
    short, full = GaussianPulse(1e13, 0.05), GaussianPulse(1e13, 1.0)
    cases: list[tuple[str, Top, GaussianPulse, dict[str, Any], float]] = [
        ("OCS, J = 0, 50 fs, 4001 times", OCS, short, {"state": {"j": 0}, "m": 0, "tolerance": 1e-9}, 1.0),
        ("OCS, 10 K, 50 fs", OCS, short, {"temperature_k": 10.0, "tolerance": 1e-7}, 30.0),
        ("OCS, 10 K, 1 ps", OCS, full, {"temperature_k": 10.0, "tolerance": 1e-6}, 100.0),
    ]
    if long:
        slow = GaussianPulse(1e12, 0.3)
        cases += [
            ("OCS, 300 K, 50 fs", OCS, short, {"temperature_k": 300.0, "tolerance": 1e-8}, 500.0),
            ("iodobenzene, 1 K", IODOBENZENE, slow, {"temperature_k": 1.0, "tolerance": 1e-4}, 3000.0),
        ]
    out = []
    for name, top, pulse, settings, goal in cases:
        first = pulse.window_ps[0 if "state" in settings else 1]
        times = np.linspace(first, 2 * PERIOD, 4001)
        calls = 3 if goal > 400 else 10 if goal > 10 else 200
        milliseconds, trace = median(lambda: align(top, pulse, times, **settings), calls)  # noqa: B023
        out.append(
            {
                "case": name,
                "ms": milliseconds,
                "goal_ms": goal,
                "error_estimate": trace.error_estimate,
                "states": trace.states,
            }
        )
    return out


def maps() -> list[dict[str, Any]]:
    """Stark maps of 201 fields."""
    fields = np.linspace(0, 200, 201)
    cases = [("Stark map, OCS, J ≤ 2", OCS, 1e-6, 3.0), ("Stark map, indole, J ≤ 2", INDOLE, 1e-3, 2500.0)]
    out = []
    for name, top, tolerance, goal in cases:
        rounds = 3 if goal > 400 else 50
        milliseconds, computed = median(lambda: stark_map(top, fields, tolerance_mhz=tolerance), rounds)  # noqa: B023
        out.append(
            {"case": name, "ms": milliseconds, "goal_ms": goal, "jmax": computed.jmax, "states": len(computed.curves())}
        )
    return out


def work_precision() -> dict[str, list[tuple[float, float]]]:
    """(error, ms) of J = 0, 50 fs, 4001 times for several settings of each method; the truth is that of rotor at 1e-12."""
    pulse, times = GaussianPulse(1e13, 0.05), np.linspace(-0.175, 2 * PERIOD, 4001)
    truth = align(OCS, pulse, times, state={"j": 0}, tolerance=1e-12, jmax=40).cosines["cos2theta"]
    curves: dict[str, list[tuple[float, float]]] = {"rotor": [], "QuTiP vern7": [], "scipy expm_multiply": []}
    for tolerance in (1e-1, 1e-2, 1e-3, 1e-9, 1e-10):
        taken, trace = median(lambda: align(OCS, pulse, times, state={"j": 0}, tolerance=tolerance), 41)  # noqa: B023
        curves["rotor"].append((float(np.abs(trace.cosines["cos2theta"] - truth).max()), taken))
    objects = block_objects(OCS, [pulse], jmax=30)
    for tolerance in (1e-6, 1e-8, 1e-10, 1e-12):
        options = {"method": "vern7", "rtol": tolerance, "atol": 1e-2 * tolerance, "nsteps": 10**6, "progress_bar": ""}
        taken, computed = median(lambda: solve_windows(objects, objects.state("0"), times, options=options), 3)  # noqa: B023
        curves["QuTiP vern7"].append((float(np.abs(computed["cos2theta"] - truth).max()), taken))
    for steps in (64, 256, 1024, 4096):
        taken, signal = median(lambda: exponentials(steps, times), 1)  # noqa: B023
        curves["scipy expm_multiply"].append((float(np.abs(signal - truth).max()), taken))
    return curves


def exponentials(steps: int, times: np.ndarray) -> np.ndarray:
    """The midpoint rule with scipy's expm_multiply through the pulse, exact phases after it; times inside are left as they come."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import expm_multiply

    pulse = GaussianPulse(1e13, 0.05)
    contraction = Contraction(acted_on(OCS, "polarizability"), np.diag([0, 0, 1.0]))
    block = field_space(OCS, 30, [contraction]).blocks(0)[0]
    matrix, energies = block.matrix(contraction), RAD_PER_PS_MHZ * block.energies_mhz
    square = block.matrix(Contraction(np.diag([1.0, 0, 0]), np.diag([0, 0, 1.0])))
    first, last = pulse.window_ps
    edges = np.unique(np.concatenate([np.linspace(first, last, steps + 1), times[times < last]]))
    state, out = np.eye(len(block), 1, dtype=complex)[:, 0], np.full(len(times), 1 / 3)
    free, operator = (
        diags_array(energies),
        diags_array([np.diag(matrix), np.diag(matrix, 1), np.diag(matrix, 1)], offsets=[0, 1, -1]),
    )
    for a, b in itertools.pairwise(edges):
        strength = float(pulse.strength(np.array([(a + b) / 2]))[0])
        state = expm_multiply(-1j * (b - a) * (free - strength * operator), state)
        out[times == b] = float((state.conj() @ square @ state).real)
    after = times >= last
    later = np.exp(-1j * np.outer(energies, times[after] - last)) * state[:, None]
    out[after] = np.einsum("nt,nt->t", later.conj(), square @ later).real
    return out


def picture(curves: dict[str, list[tuple[float, float]]], path: Path) -> None:
    """Error against time, one curve a method."""
    from rotor.plots.picture import new_figure, save, styled

    with styled():
        figure = new_figure((4.8, 3.4))
        axes = figure.add_subplot()
        for (name, points), marker in zip(curves.items(), "osD", strict=False):
            axes.loglog(
                [ms for _, ms in points],
                [max(error, 1e-13) for error, _ in points],
                f"{marker}-",
                label=name.replace("ours", "rotor"),
            )
        axes.set_xlabel("Processor time (ms)")
        axes.set_ylabel("Largest error of ⟨cos²θ⟩")
        axes.set_title("OCS from J = 0, pulse of 50 fs, 4001 times")
        axes.legend()
    save(figure, path, "work and precision", {"made by": "benchmarks/bench_alignment.py"})


def main() -> None:
    """Print the tables; write them and the picture where asked."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--long", action="store_true")
    arguments = parser.parse_args()
    rows = traces(arguments.long) + maps()
    for row in rows:
        print(
            f"{row['case']:32s} {row['ms']:10.2f} ms  (goal {row['goal_ms']:g})  {row.get('error_estimate', 0):.1e}  {row['states']} states"
        )
    curves = work_precision()
    for name, points in curves.items():
        print(f"{name:22s}", "  ".join(f"{error:.1e} in {ms:.2f} ms" for error, ms in points))
    if arguments.json:
        arguments.json.write_text(json.dumps({"cases": rows, "work_precision": curves}, indent=1) + "\n")
    if arguments.picture:
        picture(curves, arguments.picture)


if __name__ == "__main__":
    main()
