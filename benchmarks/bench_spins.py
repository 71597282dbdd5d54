"""Spectra with nuclear spins and with several states, in memory and whole processes, beside SPCAT where it is on the PATH.

    python benchmarks/bench_spins.py [--rounds 7] [--json benchmarks/results/spins.json] [--picture docs/pictures/hyperfine_methods.png]

Cases of SPCAT's files stand in tests/oracles: vinyl chloride with 35Cl, CH2Cl2 with two 35Cl, formamide with 14N, and two states that
Coriolis terms couple; the first and the third also up to F = 30. Four such states up to J = 30 and five nuclei (two 14N, three H with
spin-rotation) up to N = 10 are made here. In each round every program runs once, one after the other; the median of the rounds
counts. Times of one run may be compared with each other only.
"""

from __future__ import annotations

import argparse
import json
import platform
import resource
import shutil
import statistics
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
TO_F_30 = ("vinylcl35_quad", "formamide_quad")
NUCLEI = (
    "chi_aa(14N_1)=-4.2 chi_bb-cc(14N_1)=0.3 chi_ab(14N_1)=1.5 chi_aa(14N_2)=1.9 chi_bb-cc(14N_2)=5.7 chi_ab(14N_2)=0.5 "
    "C_aa(1H_1)=0.01 C_bb(1H_1)=0.005 C_aa(1H_2)=0.012 C_bb(1H_2)=0.004 C_aa(1H_3)=0.009 C_cc(1H_3)=0.003 MHz"
)
METHODS = ("first-order", "N-diagonal", "exact")


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of a run, and what it returned."""
    start = time.perf_counter()
    process = run()
    return time.perf_counter() - start, process


def median(run: Callable[[], Any], rounds: int) -> tuple[float, Any]:
    """The median of the seconds of some rounds, and what the last one returned."""
    seconds = [timed(run) for _ in range(rounds)]
    return statistics.median(seconds for seconds, _ in seconds), seconds[-1][1]


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


def write_four_states(folder: Path, jmax: int) -> None:
    """The same four states as files four.var and four.int of SPCAT."""
    rows = [(f"{11 * v:02d}", 150_000.0 * v) for v in range(1, 4)]
    for v in range(4):
        constants = (9000.0 + 20 * v, 3000.0 - 3 * v, 2300.0 - 2 * v)
        rows += [(f"{axis}00{11 * v:02d}", value) for axis, value in zip("123", constants, strict=True)]
    for v in range(1, 4):
        rows += [(f"6000{v - 1}{v}", 300.0), (f"6100{v - 1}{v}", 1.0)]
    lines = [f"{code:>13s} {value:22.15E} 1.0E-37 /x" for code, value in rows]
    head = ["four states", f" {len(rows)} 0 0 0 0.0 1.0E+3 1.0 1.0", f"a 1 4 0 {jmax} 0 1 1 1 0 1 0"]
    (folder / "four.var").write_text("\n".join([*head, *lines, ""]), encoding="ascii")
    dipoles = [f" {f'{v}{v}{axis}' if v else axis} {mu}" for v in range(4) for axis, mu in ((1, 1.0), (2, 0.5))]
    head = ["four states", f"21 99001 1.0E+05 0 {jmax} -8 -12 9999.99 300.0"]
    (folder / "four.int").write_text("\n".join([*head, *dipoles, ""]), encoding="ascii")


def write_to_f_30(case: str, folder: Path) -> None:
    """The files of a case with FEND = 30 and KNMAX = 32, so that no K is left out."""
    for suffix, line, place, value in ((".int", 1, 4, "30"), (".var", 2, 4, "32")):
        rows = (ORACLES / case / f"{case}{suffix}").read_text(encoding="ascii").splitlines()
        fields = rows[line].split()
        fields[place] = value
        rows[line] = " ".join(fields)
        (folder / f"{case}{suffix}").write_text("\n".join([*rows, ""]), encoding="ascii")


def whole_process(path: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "rotor", "spectrum", str(path), "--cat", f"{folder}/a.cat"]
        subprocess.run(command, check=True, capture_output=True)


def spcat(program: str, path: Path) -> None:
    """The compiled program on a copy of the same files."""
    with tempfile.TemporaryDirectory() as folder:
        for suffix in (".int", ".var"):
            shutil.copy(path.with_suffix(suffix), folder)
        subprocess.run([program, path.stem], cwd=folder, check=True, capture_output=True)


def beside_spcat(path: Path, rounds: int) -> dict[str, Any]:
    """Median seconds of one input in memory, as a whole process, and of SPCAT, round by round."""
    programs: dict[str, Callable[[], Any]] = {
        "in memory": partial(predict_file, path),
        "whole process": partial(whole_process, path),
    }
    if program := shutil.which("spcat"):
        programs["SPCAT, whole process"] = partial(spcat, program, path)
    prediction = predict_file(path)  # what is loaded and kept once is not part of a round
    times: dict[str, list[float]] = {name: [] for name in programs}
    for _ in range(rounds):
        for name, run in programs.items():
            times[name].append(timed(run)[0])
    row: dict[str, Any] = {"lines": len(prediction.lines)} | {
        name: statistics.median(seconds) for name, seconds in times.items()
    }
    if program:
        row["in memory / SPCAT"] = row["in memory"] / row["SPCAT, whole process"]
    return row


def measure(rounds: int) -> dict[str, dict[str, Any]]:
    """Seconds by case and program."""
    out = {case: beside_spcat(ORACLES / case / f"{case}.int", rounds) for case in FILES}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case in TO_F_30:
            write_to_f_30(case, folder)
            out[f"{case}, F <= 30"] = beside_spcat(folder / f"{case}.int", rounds)
        write_four_states(folder, 30)
        out["four states, J <= 30"] = beside_spcat(folder / "four.int", rounds)
    out["four states, J <= 30"]["in memory, line_list"] = median(partial(four_states, 30), rounds)[0]
    seconds, computed = median(partial(spectrum_of_five, 10), max(1, rounds // 2))
    out["five nuclei, N <= 10"] = {"lines": len(computed), "in memory": seconds}
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
        timings = {}
        for method in METHODS:
            seconds, (computed, _) = median(partial(sorted_energies, top, nmax, method), rounds)
            timings[method] = (seconds, float(np.abs(computed - exact).max()))
        out[name] = timings
    return out


def picture(computed: dict[str, dict[str, tuple[float, float]]], path: Path) -> None:
    """Largest error of a level against time, a point a method."""
    from rotor.plots.work_precision import Panel, Point, plot_work_precision

    curves = {
        name: [Point(method, *points[method], own=method == "exact") for method in METHODS]
        for name, points in computed.items()
    }
    panel = Panel("Methods for hyperfine structure", "energy of a level (MHz)", curves, joined=False)
    plot_work_precision([panel], path, facts={"made by": "benchmarks/bench_spins.py"})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    times, curves = measure(options.rounds), methods(options.rounds)
    for case, row in times.items():
        print(f"{case:24s}", ", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{v} {k}" for k, v in row.items()))
    for name, row in curves.items():
        print(name, ", ".join(f"{method}: {s:.3g} s, {error:.2g} MHz" for method, (s, error) in row.items()))
    if options.json:
        content = {
            "machine": platform.machine(),
            "python": platform.python_version(),
            "times": times,
            "methods": curves,
        }
        options.json.write_text(json.dumps(content, indent=1), encoding="utf-8")
    if options.picture:
        picture(curves, options.picture)


if __name__ == "__main__":
    main()
