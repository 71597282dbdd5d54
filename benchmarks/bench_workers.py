"""Sweeps over lists of SMILES (levels J <= 3, rows in one Parquet file) in one process and with two workers.

    python benchmarks/bench_workers.py [rounds]

Both commands take their turn in every round. Wall is the median of the rounds. Processor is user and system time of the command and of
all its processes, the least of the rounds, since a busy machine only adds to it. The processor time of one process is fitted as
start + n work over the lists of one size of molecule. Two workers are at most (start + n work) / (start + n work / 2) times as fast
(Amdahl). Results go to benchmarks/results/workers.json.
"""

from __future__ import annotations

import ctypes
import itertools
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

RESULTS = Path(__file__).parent / "results" / "workers.json"
ROUNDS = 5
PR_SET_CHILD_SUBREAPER = 36  # linux/prctl.h: processes whose parent has ended become children of this process
LISTS = (("2 to 5", (2, 5), (1, 30, 100, 300)), ("6 to 10", (6, 10), (1, 30, 100)))  # heavy atoms, molecules
UNITS = ("C", "N", "O", "C(C)", "C(F)", "C=", "C(=O)")
SCENE = """schema = 1
kind = "levels"
molecule = "list.csv"
[observables]
jmax = 3
[outputs]
parquet = "levels.parquet"
"""


def chains(fewest: int, most: int) -> list[str]:
    """SMILES of chains with this number of heavy atoms, each molecule once, in a fixed order."""
    from rdkit import Chem, RDLogger

    RDLogger.DisableLog("rdApp.*")
    kept: dict[str, None] = {}
    for length in range(1, most + 1):
        for units in itertools.islice(itertools.product(UNITS, repeat=length), 0, None, max(1, 7 ** (length - 4))):
            text = "".join(units)
            if any(pair in text for pair in ("NN", "NO", "ON", "OO", "=C=")):
                continue
            molecule = Chem.MolFromSmiles(text)
            if molecule is not None and fewest <= molecule.GetNumHeavyAtoms() <= most:
                kept[Chem.MolToSmiles(molecule)] = None
    return list(kept)


def spread(texts: list[str], number: int) -> list[str]:
    """This many of the texts, at equal distances."""
    return [texts[at] for at in np.linspace(0, len(texts) - 1, number).round().astype(int)]


def times(smiles: list[str], workers: int) -> tuple[float, float]:
    """Wall and processor seconds of a sweep over the molecules."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "scene.toml").write_text(SCENE, encoding="utf-8")
        Path(folder, "list.csv").write_text("\n".join(["smiles", *smiles]) + "\n", encoding="utf-8")
        words = [sys.executable, "-m", "rotor", "run", "scene.toml", "--workers", str(workers)]
        before, start = _children_s(), time.perf_counter()
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
        wall = time.perf_counter() - start
        _await_all()
        return wall, _children_s() - before


def _children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _await_all() -> None:
    """Wait for the server of the workers, which ends after the command."""
    while True:
        try:
            os.wait()
        except ChildProcessError:
            return


def measured(smiles: list[str], rounds: int) -> dict[str, Any]:
    """Medians of the wall and least processor times, in one process and with two workers."""
    runs: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    for _ in range(rounds):
        for workers, done in runs.items():
            done.append(times(smiles, workers))
    wall = {workers: statistics.median(row[0] for row in done) for workers, done in runs.items()}
    processor = {workers: min(row[1] for row in done) for workers, done in runs.items()}
    ratios = sorted(one[0] / two[0] for one, two in zip(runs[1], runs[2], strict=True))
    return {
        "molecules": len(smiles),
        "wall_s": [round(wall[1], 3), round(wall[2], 3)],
        "processor_s": [round(processor[1], 3), round(processor[2], 3)],
        "faster": round(statistics.median(ratios), 2),
        "faster_range": [round(ratios[0], 2), round(ratios[-1], 2)],
    }


def add_bounds(rows: list[dict[str, Any]]) -> None:
    """Add to rows of one size of molecule the start and the work of a molecule in one process, and Amdahl's bound."""
    numbers = np.array([row["molecules"] for row in rows], float)
    seconds = np.array([row["processor_s"][0] for row in rows])
    work, start = np.polyfit(numbers, seconds, 1, w=1 / seconds)
    for row, number in zip(rows, numbers, strict=True):
        row["start_s"], row["work_ms"] = round(start, 3), round(1e3 * work, 2)
        row["bound"] = round((start + number * work) / (start + number * work / 2), 2)


def main() -> None:
    """Run all lists and write the table."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    table = {}
    for name, atoms, counts in LISTS:
        texts = chains(*atoms)
        table[name] = [measured(spread(texts, count), rounds) for count in counts]
        add_bounds(table[name])
        for row in table[name]:
            print(name, row, flush=True)
    load = os.getloadavg()[0]
    RESULTS.write_text(json.dumps({"rounds": rounds, "load": round(load, 1), "lists": table}, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
