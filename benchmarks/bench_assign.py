"""Constants from peak lists of known truth: how often right, how sure, how fast; and spectra with frequencies redrawn.

    python benchmarks/bench_assign.py --cases 1000 [--first 0] [--json benchmarks/results/assign.json]
    python benchmarks/bench_assign.py --shared ../shared/reference/broadband
    python benchmarks/bench_assign.py --redrawn 100

A species is right where A, B, C are within five standard errors and 0.1 % of the truth, A that is said to be open left out. Shares have
Wilson's intervals of 95 %. Times are of the processor, without the compiler's.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from broadband_cases import make_case

from rotor.assignment.answer import AssignAnswer, AssignedSpecies
from rotor.assignment.peaks import PeakList, peak_list
from rotor.assignment.request import AssignRequest, answer_assign

LEAST_SNR = 100.0
Truth = tuple[int, PeakList, float, list[tuple[float, ...]]]


def own(first: int, count: int) -> Iterator[Truth]:
    """Cases of the generator with enough signal: number, peaks, signal-to-noise ratio, constants of the main species."""
    seed = first
    while count:
        case = make_case(seed)
        seed += 1
        if case.signal_to_noise < LEAST_SNR or len(case.peaks) < 2:
            continue
        count -= 1
        mains = [tuple(one.constants[:3].tolist()) for one in case.species if one.parent is None]
        yield case.seed, peak_list(*case.peaks.T, band_mhz=case.band_mhz), case.signal_to_noise, mains


def shared(folder: Path) -> Iterator[Truth]:
    """The lists of a folder."""
    for path in sorted(folder.glob("truth/*.json")):
        truth = json.loads(path.read_text())
        if truth["signal_to_noise"] < LEAST_SNR:
            continue
        with gzip.open(folder / f"{truth['case']}.csv.gz", "rt") as text:
            rows = np.array(list(csv.reader(text))[1:], dtype=float)
        mains = [(s["A"], s["B"], s["C"]) for s in truth["species"] if "isotopologue_of" not in s]
        low, high = truth["range_mhz"]
        yield (
            int(truth["case"][-3:]),
            peak_list(*rows.T, band_mhz=(float(low), float(high))),
            truth["signal_to_noise"],
            mains,
        )


def redrawn(peaks: PeakList, seed: int) -> PeakList:
    """The same intensities at frequencies drawn again within each 200 MHz."""
    rng = np.random.default_rng(seed)
    f = np.floor(peaks.frequency_mhz / 200) * 200 + 200 * rng.random(len(peaks))
    return peak_list(np.clip(f, *peaks.band_mhz), peaks.intensity, peaks.uncertainty_mhz, band_mhz=peaks.band_mhz)


def is_right(one: AssignedSpecies, truth: tuple[float, ...]) -> bool:
    """Whether the constants are those of the truth."""
    values, errors = one.refined.values[:3], one.refined.errors[:3]
    off = np.abs(values - np.array(truth))
    closed = np.array([name not in one.refined.open_constants for name in "ABC"])
    return bool(closed[1:].all() and (off[closed] < np.minimum(5 * errors, 1e-3 * values)[closed]).all())


def wilson(count: int, total: int, z: float = 1.96) -> tuple[float, float]:
    """Interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 209 (1927))."""
    if not total:
        return 0.0, 1.0
    p, d = count / total, 1 + z * z / total
    centre = (p + z * z / 2 / total) / d
    half = z * math.sqrt(p * (1 - p) / total + z * z / 4 / total**2) / d
    return centre - half, centre + half


def share(count: int, total: int) -> dict[str, Any]:
    """A share with its interval."""
    low, high = wilson(count, total)
    return {"count": count, "of": total, "share": count / max(total, 1), "low": low, "high": high}


def row_of(case: Truth, answer: AssignAnswer, seconds: float) -> dict[str, Any]:
    """What is recorded of a case."""
    number, peaks, snr, truths = case
    found = [
        {
            "right": [n for n, truth in enumerate(truths) if is_right(one, truth)],
            "word": one.word, "probability": one.probability, "evidence": float(one.grown.evidence), "lines": one.grown.lines,
            "types": one.kind,
        }
        for one in answer.species
    ]  # fmt: skip
    a, b, c = truths[0]
    return {
        "case": number, "peaks": len(peaks), "signal_to_noise": snr, "kappa": (2 * b - a - c) / (a - c), "species": len(truths),
        "found": found, "seconds": seconds,
    }  # fmt: skip


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares over all cases."""
    strongest = sum(any(0 in one["right"] for one in row["found"]) for row in rows)
    first = sum(bool(row["found"]) and 0 in row["found"][0]["right"] for row in rows)
    certain = [one for row in rows for one in row["found"] if one["word"] == "certain"]
    wrong = sum(any(one["word"] == "certain" and not one["right"] for one in row["found"]) for row in rows)
    wrong_first = sum(
        bool(row["found"]) and row["found"][0]["word"] == "certain" and not row["found"][0]["right"] for row in rows
    )
    times = [row["seconds"] for row in rows]
    return {
        "cases": len(rows),
        "strongest_found": share(strongest, len(rows)),
        "strongest_first": share(first, len(rows)),
        "lists_with_a_certain_and_wrong_species": share(wrong, len(rows)),
        "first_certain_and_wrong": share(wrong_first, len(rows)),
        "certain_species": len(certain),
        "seconds_median": float(np.median(times)) if times else None,
        "seconds_95": float(np.quantile(times, 0.95)) if times else None,
    }


def run(cases: Iterator[Truth], null: bool) -> list[dict[str, Any]]:
    """Every case in turn."""
    answer_assign(AssignRequest(peak_list([7000.0, 9000.0], [1.0, 1.0])))  # compiles
    rows = []
    for case in cases:
        peaks = redrawn(case[1], case[0]) if null else case[1]
        started = time.process_time()
        answer = answer_assign(AssignRequest(peaks, seconds=120))
        rows.append(row_of(case, answer, time.process_time() - started))
        print(
            rows[-1]["case"],
            [(one["right"], one["word"], round(one["evidence"])) for one in rows[-1]["found"]],
            flush=True,
        )
    return rows


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--shared", type=Path)
    parser.add_argument("--redrawn", type=int, default=0)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    cases = shared(asked.shared) if asked.shared else own(asked.first, asked.redrawn or asked.cases)
    rows = run(cases, bool(asked.redrawn))
    result = summary(rows)
    if asked.redrawn:
        result = {"cases": len(rows), "not_found": share(sum(not row["found"] for row in rows), len(rows))}
    print(json.dumps(result, indent=1))
    if asked.json:
        asked.json.write_text(json.dumps({"summary": result, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
