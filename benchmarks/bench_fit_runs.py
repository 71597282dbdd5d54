"""Whole runs of `rotor fit case.par` beside SPFIT's, and one iteration of each: several states, spins, one state.

    python benchmarks/bench_fit_runs.py [--rounds 9] [--spfit PATH] [--only twelve] [--json benchmarks/results/fit_runs.json]

The cases are lines made for known constants (tests/helpers/fit_kinds.py) with normal errors of 20 kHz and starts a little off.
Processes take their turn in every round, so that a change of the machine's speed meets all alike. What counts is processor time,
user and system, of the whole process, one thread; the median of the rounds and the fastest. An iteration of SPFIT is its whole run over its
iterations; here it is levels, derivatives, residuals, QR and step. SPFIT is taken from the PATH unless it is given.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers"), str(ROOT / "benchmarks")]

from fit_kinds import Kind, write_case  # noqa: E402

QUARTIC = "299 -1.1e-3 -DJ\n1199 -6.2e-3 -DJK\n2099 -2.5e-2 -DK\n40199 -3.1e-4 d1\n41099 -4.0e-3 dK\n"
SEXTIC = "399 2e-9 HJ\n1299 -1e-8 HJK\n2199 4e-8 HKJ\n3099 9e-8 HK\n40299 8e-10 h1\n41199 5e-9 hJK\n42099 3e-8 hK\n"
ROTATION = "10099 14500.1 A\n20099 4200.2 B\n30099 3300.3 C\n"
OTHERS = ((1, 252000.0, -55.5, -3.2, -2.0), (2, 288000.0, 44.0, 2.5, -1.5), (3, 330000.0, 14.0, 1.5, -0.5))


def _above(*states: int) -> str:
    """Origins and changes of A, B, C of excited states."""
    return "".join(
        f"{v}{v} {e} E{v}\n100{v}{v} {a} dA{v}\n200{v}{v} {b} dB{v}\n300{v}{v} {c} dC{v}\n"
        for v, e, a, b, c in OTHERS
        if v in states
    )


def _each(states: int) -> str:
    """All of A, B, C, quartic and sextic constants of every state, in place of those of all states together."""
    rows = [row.split() for row in (ROTATION + QUARTIC + SEXTIC).splitlines()]
    word = ""
    for v in range(states):
        for place, (code, value, label) in enumerate(rows):
            change = OTHERS[v - 1][2 + place] if v and place < 3 else 0.0
            word += f"{code[:-2]}{v}{v} {float(value) * (1 + 0.01 * v if place > 2 else 1) + change!r} {label}{v}\n"
    return word + "".join(f"{v}{v} {OTHERS[v - 1][1]} E{v}\n" for v in range(1, states))


def _lit(states: int) -> str:
    return "\n".join([f"{v}{v}1 1.0" for v in range(states)] + [f"{v}{v}2 0.7" for v in range(states)])


TWELVE = "\n".join(
    ["1009999 9500.0 A", "2009999 3200.0 B", "3009999 2500.0 C", "29999 -8e-4 -DJ", "119999 -4e-3 -DJK", "209999 -1e-2 -DK"]
    + ["4019999 -2e-4 d1"]
    + [f"{101 * v} {150000.0 * ((v + 1) // 2) + 9000.0 * (v % 2)!r} E{v}" for v in range(1, 12)]
    + [
        row
        for v in range(1, 12)
        for row in (
            f"{1000000 + 101 * v} {-12.0 + 1.7 * v!r} dA{v}",
            f"{2000000 + 101 * v} {0.6 - 0.13 * v!r} dB{v}",
            f"-{3000000 + 101 * v} {-0.6 + 0.13 * v!r} dC{v}",  # tied, -dB
        )
    ]
    + [f"{20000000 + 101 * v + 1} {300.0 + 20 * v!r} Ga{v}" for v in range(1, 11, 2)]
)  # fmt: skip
COUPLED_3 = "200012 900.0 Ga12\n210012 2.5 Fbc12\n12 850.0 W12\n400002 510.0 Gb\n410002 -1.3 Fac\n"
COUPLED_4 = "200012 900.0 Ga12\n210012 2.5 Fbc12\n400013 300.0 Gb13\n200023 500.0 Ga23\n"

CASES = {  # how far the start is off, and the lines
    "one state, J ≤ 60": (1e-3, Kind(
        "a 1 1 0 60 0 1 1 1 0 1 0", (ROTATION + QUARTIC + SEXTIC).replace("99 ", "00 "), "1 1.0\n2 .7", 60, 500,
    )),
    "one state, J ≤ 60, 5,000 lines": (1e-3, Kind(
        "a 1 1 0 60 0 1 1 1 0 1 0", (ROTATION + QUARTIC + SEXTIC).replace("99 ", "00 "), "1 1.0\n2 .7", 60, 5000,
    )),
    "two states, Fermi coupling, J ≤ 60": (1e-6, Kind(
        "a 1 2 0 40 0 1 1 1 0 1 0",
        ROTATION + QUARTIC + "11 60000.0 E1\n10011 -55.5 dA1\n20011 -3.2 dB1\n30011 -2.0 dC1\n1 850.0 W01\n101 0.01 WJ\n",
        _lit(2), 60, 8573, held="W01",
    )),
    "three states, Fermi and Coriolis coupling, J ≤ 40": (1e-4, Kind(
        "a 1 3 0 40 0 1 1 1 0 1 0", ROTATION + QUARTIC + _above(1, 2) + COUPLED_3, _lit(3), 40, 8573, held="W12 E1 E2",
    )),
    "three states, 57 parameters, J ≤ 50": (1e-6, Kind(
        "a 1 3 0 50 0 1 1 1 0 1 0",
        _each(3) + COUPLED_3 + "200112 .01 GaJ\n201012 .02 GaK\n400102 .01 GbJ\n401002 .02 GbK\n210112 1e-4 FbcJ\n410102 1e-4 FacJ\n",
        _lit(3), 50, 8573, held="W12",
    )),
    "four states, Coriolis coupling, J ≤ 60": (1e-6, Kind(
        "a 1 4 0 40 0 1 1 1 0 1 0", ROTATION + QUARTIC + _above(1, 2, 3) + COUPLED_4, _lit(4), 60, 8573, held="E1 E2 E3",
    )),
    "twelve states, J ≤ 22": (1e-7, Kind(
        "a 1 12 0 30 0 1 1 1 0 1 0", TWELVE, "\n".join(f"{101 * v:03d}{i} 1.0" for v in range(12) for i in (1, 2)), 22, 2500,
        held="E1 E3 E5 E7 E9 E11",
    )),
    "two chlorines, F ≤ 12": (1e-4, Kind(
        "a 44 1 0 20 0 3 1 1 0 1 0",
        "10000 9500.5 A\n20000 3600.1 B\n30000 2780.2 C\n200 -1e-3 -DJ\n1100 -2.1e-2 -DJK\n110010000 -66.5 1.5Xaa1\n"
        "110040000 -3.1 X-1\n220010000 -20.5 1.5Xaa2\n220040000 -4.1 X-2\n", "1 2.0\n2 0.5", 12, 350,
    )),
    "chlorine and nitrogen, F ≤ 9": (1e-4, Kind(
        "a 34 1 0 20 0 1 1 1 0 1 0",
        "10000 22500.5 A\n20000 3700.1 B\n30000 3180.2 C\n200 -1e-3 -DJ\n1100 -2.1e-2 -DJK\n110010000 -69.5 1.5Xaa_Cl\n"
        "110040000 -3.1 X-_Cl\n220010000 -5.1 1.5Xaa_N\n220040000 -0.6 X-_N\n110610000 21.0 Xab_Cl\n10010000 0.002 Caa\n",
        "1 2.0\n2 0.5", 9, 400,
    )),
    "one quadrupole nucleus, F ≤ 16": (1e-4, Kind(
        "a 3 1 0 20 0 1 1 1 0 1 0",
        (ROTATION + QUARTIC).replace("99 ", "00 ") + "110010000 -6.3 1.5Xaa\n110040000 0.8 X-\n", "1 2.0\n2 0.6", 16, 400,
    )),
    "three spins, ten quantum numbers": (1e-4, Kind(
        "a 332 2 0 12 0 1 1 1 0 1 0",
        "10099 52500.5 A\n20099 11700.1 B\n30099 9580.2 C\n299 -1e-2 -DJ\n11 900.0 E1\n10011 30.0 dA1\n10010099 -120.0 eaa\n"
        "10020099 30.0 ebb\n10030099 11.0 ecc\n120000099 20.0 aF1\n120010099 13.0 Taa1\n220010099 -4.0 1.5Xaa2\n"
        "330010099 -2.0 1.5Xaa3\n", "001 2.0\n112 0.5\n002 0.6\n111 2.0", 4, 300, ten=True, held="E1",
    )),
    "symmetric top, one spin, two states": (1e-4, Kind(
        "s -3 2 0 20 0 6 2 2 0 1 0",
        "1099 139000.0 A-B\n199 9200.0 B\n299 -3.8e-3 -DJ\n1199 -0.177 -DJK\n11 30000.0 E1\n111 -27.0 dB1\n"
        "110010099 -6.3 1.5eQq\n10000099 1.7e-3 C\n", "001 3.92\n111 3.92", 16, 350, held="A-B E1",
    )),
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    """Processor time of a process, iterations of its search, weighted rms."""

    seconds: float
    iterations: int
    rms: float


def processor_time(command: list[str], folder: Path) -> float:
    """Seconds of user and system time of a process; RuntimeError with what it said where it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    our_run = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }  # else compiled each time
    environment = our_run | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr}{done.stdout[-300:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rotor_run(folder: Path) -> Run:
    """`rotor fit case.par --out fitted`: report, .par and .var, as SPFIT writes them."""
    seconds = processor_time([sys.executable, "-m", "rotor", "fit", "case.par", "--out", "fitted"], folder)
    text = (folder / "fitted.fit").read_text()
    iterations, rms = re.search(r"after (\d+) iterations", text), re.search(r"weighted rms\s+([^\s;]+)", text)
    assert iterations is not None, text[:500]
    assert rms is not None, text[:500]
    return Run(seconds, int(iterations[1]), float(rms[1]))


def spfit_run(folder: Path, program: str) -> Run:
    """SPFIT on a copy of the same files, since it writes over its .par."""
    here = folder / "spfit"
    here.mkdir(exist_ok=True)
    for suffix in ("par", "lin"):
        shutil.copy(folder / f"case.{suffix}", here / f"case.{suffix}")
    seconds = processor_time([program, "case"], here)
    text = (here / "case.fit").read_text(errors="replace")
    matches = re.findall(r"END OF ITERATION\s+(\d+) OLD, NEW RMS ERROR=\s*(\S+)", text)
    return Run(seconds, len(matches), float(matches[-1][1]))


def iteration(folder: Path) -> float:
    """Milliseconds of an iteration, measured in a process of its own."""
    import numpy as np
    from bench_fit import fastest

    from rotor.fitting.assignment import levels_in
    from rotor.fitting.search.residuals import Search
    from rotor.formats.spcat.fits.fit_input import read_fit
    from rotor.quantum.labels.labelled import level_model
    from rotor.statistics.least_squares import _Linear, _State

    fit_input = read_fit(folder / "case.par")
    labels, upper, lower = levels_in(fit_input.lines)
    model = (
        fit_input.model(labels)
        if fit_input.model
        else level_model(fit_input.constants, labels, kmax=fit_input.options.kmax)
    )
    used = np.ones(len(fit_input.lines), dtype=bool)
    start = fit_input.parameters.start
    search = Search(
        fit_input.lines, model, fit_input.parameters, fit_input.options, upper, lower, fit_input.lines.error_mhz, used
    )

    points = cycle([start * (1 + 1e-12), start * (1 - 1e-12)])  # neither the start nor the last point is computed again

    def iterate() -> None:
        point = next(points)
        state = _State.at(point, *search.evaluate(point))
        _Linear.at_state(state, state.norms, np.zeros(len(start))).step(0.0)

    return 1e3 * fastest(iterate, 9)


def measured(name: str, folder: Path, rounds: int, program: str | None) -> dict[str, Any]:
    """A row of the table."""
    share, kind = CASES[name]
    if not (folder / "case.par").exists():
        folder.mkdir(parents=True, exist_ok=True)
        write_case(folder, "case", kind, share)
    ours, theirs = list[Run](), list[Run]()
    rotor_run(folder)  # does not count
    for _ in range(rounds):
        ours.append(rotor_run(folder))
        if program:
            theirs.append(spfit_run(folder, program))
    row: dict[str, Any] = {
        "case": name,
        "lines": kind.lines,
        "parameters": len(re.findall(r"1\.0+E\+36", (folder / "case.par").read_text())),
        "run_s": statistics.median(timing.seconds for timing in ours),
        "run_fastest_s": min(timing.seconds for timing in ours),
        "iterations": ours[-1].iterations,
        "weighted_rms": ours[-1].rms,
        "iteration_ms": iteration(folder),
    }
    if theirs:
        row |= {
            "spfit_run_s": statistics.median(timing.seconds for timing in theirs),
            "spfit_fastest_s": min(timing.seconds for timing in theirs),
            "spfit_iterations": theirs[-1].iterations,
            "spfit_rms": theirs[-1].rms,
            "spfit_iteration_ms": 1e3 * min(timing.seconds for timing in theirs) / theirs[-1].iterations,
        }
    return row


def text_of(row: dict[str, Any]) -> str:
    """A row as a line of text."""
    ours = f"run {row['run_s']:.2f} ({row['run_fastest_s']:.2f}) s, {row['iterations']} it., one {row['iteration_ms']:.2f} ms"
    if "spfit_run_s" not in row:
        return f"{row['case']}: {ours}"
    return (
        f"{row['case']}, {row['lines']} lines, {row['parameters']} parameters: {ours} | SPFIT run {row['spfit_run_s']:.2f} "
        f"({row['spfit_fastest_s']:.2f}) s, {row['spfit_iterations']} it., one {row['spfit_iteration_ms']:.2f} ms | run / SPFIT "
        f"{row['run_s'] / row['spfit_run_s']:.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--spfit", default=shutil.which("spfit"))
    parser.add_argument("--only", default="", help="cases whose names have this in them")
    parser.add_argument("--folder", type=Path, help="where the cases are, made there where they are missing")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder, rows = arguments.folder or Path(temporary), []
        for number, name in enumerate(CASES):
            if arguments.only in name:
                rows.append(measured(name, folder.resolve() / str(number), arguments.rounds, arguments.spfit))
                print(text_of(rows[-1]), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
