"""Spectra with nuclear spins and with several states, whole processes and in memory, beside SPCAT where it is on the PATH.

    python benchmarks/bench_spins.py [--rounds 5] [--json benchmarks/results/spins.json] [--picture docs/pictures/hyperfine_methods.png]

Cases of SPCAT's files stand in tests/oracles: vinyl chloride with 35Cl, CH2Cl2 with two 35Cl, formamide with 14N, and two states that
Coriolis terms couple. Four such states up to J = 30 and five nuclei (two 14N, three H with spin-rotation) up to N = 10 are made here.
Every program is timed in each of several rounds and the best of each counts. Times of one run may be compared with each other only.
"""

from __future__ import annotations

import argparse
import json
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.spcat.predict import predict_file
from rotor.quantum.effects.interactions import InteractingStates
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.solve import solve_levels
from rotor.spectra.lines import line_list
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

ORACLES = Path(__file__).resolve().parents[1] / "tests" / "oracles"
FILES = ("vinylcl35_quad", "ch2cl2_2quad", "formamide_quad", "two_state_coriolis")
NUCLEI = (
    "chi_aa(14N_1)=-4.2 chi_bb-cc(14N_1)=0.3 chi_ab(14N_1)=1.5 chi_aa(14N_2)=1.9 chi_bb-cc(14N_2)=5.7 chi_ab(14N_2)=0.5 "
    "C_aa(1H_1)=0.01 C_bb(1H_1)=0.005 C_aa(1H_2)=0.012 C_bb(1H_2)=0.004 C_aa(1H_3)=0.009 C_cc(1H_3)=0.003 MHz"
)
METHODS = ("first-order", "N-diagonal", "exact")


def best(run: Callable[[], Any], rounds: int) -> tuple[float, Any]:
    """Seconds of the fastest round, and what the last one returned."""
    seconds, found = [], None
    for _ in range(rounds):
        start = time.perf_counter()
        found = run()
        seconds.append(time.perf_counter() - start)
    return min(seconds), found


def five_nuclei() -> Top:
    """Two 14N and three H on an asymmetric top without symmetry."""
    spins = SpinConstants.parse(NUCLEI)
    return Top.from_constants("A=10000 B=3500 C=2600 MHz", dipole_abc_debye=(1.0, 0.5, 0.0), spin_constants=spins)


def one_nucleus() -> Top:
    """A chlorine whose tensor is far from the principal axes: χ_bc joins the two levels of each Ka."""
    spins = SpinConstants.parse("chi_aa(35Cl)=-57 chi_bb-cc(35Cl)=-4 chi_ab(35Cl)=30 chi_bc(35Cl)=20 MHz")
    return Top.from_constants("A=54000 B=6030 C=5445 MHz", dipole_abc_debye=(1.0, 0.5, 0.0), spin_constants=spins)


def four_states(jmax: int) -> Any:
    """Four states, each coupled with the next by Coriolis and Fermi terms."""
    values: dict[str, float] = {}
    for v in range(1, 4):
        values |= {
            f"E[{v}]": 150_000.0 * v,
            f"A[{v}]": 9000.0 + 20 * v,
            f"B[{v}]": 3000.0 - 3 * v,
            f"C[{v}]": 2300.0 - 2 * v,
        }
        values |= {f"G_c[{v - 1},{v}]": 300.0, f"F_ab[{v - 1},{v}]": 1.0}
    dipoles = {(v, v): (1.0, 0.5, 0.0) for v in range(1, 4)}
    top = Top.from_constants("A=9000 B=3000 C=2300 MHz", dipole_abc_debye=(1.0, 0.5, 0.0))
    effects = (*SEMI_RIGID, InteractingStates(values, {}, dipoles))
    return line_list(top, jmax=jmax, temperature_k=300.0, effects=effects, min_lgint=-8.0, q=1e5)


def spectrum_of_five(nmax: int) -> Any:
    top = five_nuclei()
    return line_list(top, jmax=nmax, temperature_k=3.0, effects=effects_of(top, True), min_lgint=-6.0)


def whole_process(case: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "rotor",
            "spectrum",
            str(ORACLES / case / f"{case}.int"),
            "--cat",
            f"{folder}/a.cat",
        ]
        subprocess.run(command, check=True, capture_output=True)


def spcat(program: str, case: str) -> None:
    """The compiled program on a copy of the same files."""
    with tempfile.TemporaryDirectory() as folder:
        for suffix in (".int", ".var"):
            shutil.copy(ORACLES / case / f"{case}{suffix}", folder)
        subprocess.run([program, case], cwd=folder, check=True, capture_output=True)


def measure(rounds: int) -> dict[str, dict[str, Any]]:
    """Seconds by case and program."""
    program, out = shutil.which("spcat"), {}
    for case in FILES:
        inside, found = best(lambda case=case: predict_file(ORACLES / case / f"{case}.int"), rounds)
        out[case] = {
            "lines": len(found.lines),
            "in memory": inside,
            "whole process": best(partial(whole_process, case), rounds)[0],
        }
        if program:
            out[case]["SPCAT, whole process"] = best(partial(spcat, program, case), rounds)[0]
    for name, run in (
        ("four states, J <= 30", partial(four_states, 30)),
        ("five nuclei, N <= 10", partial(spectrum_of_five, 10)),
    ):
        seconds, found = best(run, max(1, rounds // 2))
        out[name] = {"lines": len(found), "in memory": seconds}
    out["five nuclei, N <= 10"]["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return out


def sorted_energies(top: Top, nmax: int, method: str) -> tuple[np.ndarray, float]:
    levels = solve_levels(top, nmax, effects=effects_of(top, True, method))
    return levels.energy_mhz[np.lexsort(list(levels.quanta.values()))], len(levels)


def methods(rounds: int) -> dict[str, dict[str, tuple[float, float]]]:
    """Seconds and largest error of a level in MHz by case and method."""
    out: dict[str, dict[str, tuple[float, float]]] = {}
    for name, top, nmax in (
        ("³⁵Cl (χ to 57 MHz), N ≤ 30", one_nucleus(), 30),
        ("two ¹⁴N and three H, N ≤ 10", five_nuclei(), 10),
    ):
        exact, _ = sorted_energies(top, nmax, "exact")
        own = {}
        for method in METHODS:
            seconds, (found, _) = best(partial(sorted_energies, top, nmax, method), rounds)
            own[method] = (seconds, float(np.abs(found - exact).max()))
        out[name] = own
    return out


def picture(found: dict[str, dict[str, tuple[float, float]]], path: Path) -> None:
    """Largest error of a level against time, a point a method."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for name, own in found.items():
        seconds = [own[method][0] for method in METHODS]
        errors = [
            max(own[method][1], 1e-9) for method in METHODS
        ]  # the exact one counts as far as digits of energies go
        axes.loglog(seconds, errors, "o-", label=name)
        for method, x, y in zip(METHODS, seconds, errors, strict=True):
            above = 5 if method == "first-order" else -11
            axes.annotate(method, (x, y), xytext=(4, above), textcoords="offset points", fontsize=8)
    axes.set_xlabel("time for all levels (s)")
    axes.set_ylabel("largest error of a level (MHz)")
    axes.margins(x=0.25, y=0.15)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    times, own = measure(options.rounds), methods(options.rounds)
    for case, row in times.items():
        print(f"{case:24s}", ", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{v} {k}" for k, v in row.items()))
    for name, row in own.items():
        print(name, ", ".join(f"{method}: {s:.3g} s, {error:.2g} MHz" for method, (s, error) in row.items()))
    if options.json:
        content = {"machine": platform.machine(), "python": platform.python_version(), "times": times, "methods": own}
        options.json.write_text(json.dumps(content, indent=1), encoding="utf-8")
    if options.picture:
        picture(own, options.picture)


if __name__ == "__main__":
    main()
