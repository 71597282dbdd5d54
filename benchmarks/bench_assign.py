"""Constants from peak lists of known truth: how often right, how sure, how fast; and spectra with frequencies redrawn.

    python benchmarks/bench_assign.py --cases 1000 [--first 0] [--state rows.jsonl] [--minutes 30]
    python benchmarks/bench_assign.py --shared ../shared/reference/broadband
    python benchmarks/bench_assign.py --cases 300 --guess         # A, B, C of the strongest species known to 3 %, one species
    python benchmarks/bench_assign.py --cases 100 --redrawn
    python benchmarks/bench_assign.py --isotopologues --json benchmarks/results/assign_13c.json  # 13C species of ten molecules
    python benchmarks/bench_assign.py --cases 0 --state rows.jsonl --json benchmarks/results/assign.json  # the summary again

A species is right where A, B, C are within five standard errors and 0.1 % of those of a species of the truth, 13C species among them; A
that is said to be open left out. Shares have Wilson's intervals of 95 %. Times are of the processor, without the compiler's. With a state
file, cases that it holds are not run again. Seeds of cases are independent, so that the first of them are a fair sample of all.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import itertools
import json
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from broadband_cases import make_case
from isotopologue_cases import isotopologue_cases

from rotor.assignment.answer import AssignAnswer, AssignedSpecies
from rotor.assignment.assign import answer_assign
from rotor.assignment.peaks.peak_list import PeakList, peak_list
from rotor.assignment.request import AssignRequest

LEAST_SNR = 100.0
CERTAIN = "certain"
ENOUGH_LINES = 6  # of a 13C species above six times the noise
EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)  # of probabilities in the reliability diagram


@dataclass(frozen=True)
class Truth:
    """A list with its truth: constants (3,) of each species, its strength, the place of its parent or None, and facts that the list is
    sorted by."""

    number: int
    peaks: PeakList
    signal_to_noise: float
    constants: list[tuple[float, ...]]
    strengths: list[float]
    parents: list[int | None]
    facts: dict[str, Any]


def kind_of(dipole: Sequence[float]) -> str:
    """The type with the greatest dipole component."""
    return "abc"[int(np.argmax(np.abs(dipole)))]


def simulated(first: int, count: int) -> Iterator[Truth]:
    """Cases of the generator with enough signal."""
    seed = first
    while count:
        case = make_case(seed)
        seed += 1
        if case.signal_to_noise < LEAST_SNR or len(case.peaks) < 2:
            continue
        count -= 1
        facts = {
            "band_mhz": list(case.band_mhz), "temperature_k": case.temperature_k, "split": case.split,
            "main_lines": case.main_lines, "foreign": case.foreign / len(case.peaks), "type": kind_of(case.species[0].dipole),
        }  # fmt: skip
        yield Truth(
            case.seed, peak_list(*case.peaks.T, band_mhz=case.band_mhz), case.signal_to_noise,
            [tuple(component.constants[:3].tolist()) for component in case.species],
            [component.strength for component in case.species], [component.parent for component in case.species], facts,
        )  # fmt: skip


def shared(folder: Path) -> Iterator[Truth]:
    """The lists of a folder."""
    for path in sorted(folder.glob("truth/*.json")):
        truth = json.loads(path.read_text())
        if truth["signal_to_noise"] < LEAST_SNR:
            continue
        with gzip.open(folder / f"{truth['case']}.csv.gz", "rt") as text:
            rows = np.array(list(csv.reader(text))[1:], dtype=float)
        species, (low, high) = truth["species"], truth["range_mhz"]
        yield Truth(
            int(truth["case"][-3:]), peak_list(*rows.T, band_mhz=(float(low), float(high))), truth["signal_to_noise"],
            [(s["A"], s["B"], s["C"]) for s in species], [s["strength"] for s in species],
            [s.get("isotopologue_of") for s in species],
            {"temperature_k": truth["temperature_k"], "main_lines": truth["main_lines_seen"], "type": kind_of(species[0]["dipole_abc"])},
        )  # fmt: skip


def redrawn(peaks: PeakList, seed: int) -> PeakList:
    """The same intensities at frequencies drawn again within each 200 MHz."""
    rng = np.random.default_rng(seed)
    f = np.floor(peaks.frequency_mhz / 200) * 200 + 200 * rng.random(len(peaks))
    return peak_list(np.clip(f, *peaks.band_mhz), peaks.intensity, peaks.uncertainty_mhz, band_mhz=peaks.band_mhz)


def is_right(species: AssignedSpecies, truth: tuple[float, ...]) -> bool:
    """Whether the constants are those of the truth."""
    values, errors = species.refined.values[:3], species.refined.errors[:3]
    off = np.abs(values - np.array(truth))
    closed = np.array([name not in species.refined.open_constants for name in "ABC"])
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
    species = [
        {
            "right": [n for n, truth in enumerate(case.constants) if is_right(component, truth)],
            "word": component.word, "probability": component.probability,
            "evidence": float(component.grown.evidence), "lines": component.grown.lines,
            "types": component.kind,
        }
        for component in answer.species
    ]  # fmt: skip
    a, b, c = case.constants[0]
    return {
        "case": case.number, "peaks": len(case.peaks), "signal_to_noise": case.signal_to_noise, "kappa": (2 * b - a - c) / (a - c),
        "species": sum(parent is None for parent in case.parents), "parents": case.parents, "strengths": case.strengths,
        "found": species, "seconds": seconds,
        **case.facts,
    }  # fmt: skip


def has(row: dict[str, Any], number: int) -> bool:
    """Whether a species of the truth is among the answers."""
    return any(number in entry["right"] for entry in row["found"])


def second_strongest(row: dict[str, Any]) -> int:
    """The species second in strength, 13C species left out; in old rows, which have no strengths, the second of the list."""
    parents = [n for n, parent in enumerate(row["parents"]) if parent is None]
    return sorted(parents, key=lambda n: -row["strengths"][n])[1] if "strengths" in row else parents[1]


def wrong_and_certain(row: dict[str, Any]) -> bool:
    """Whether an answer that is no species of the truth is called certain."""
    return any(entry["word"] == CERTAIN and not entry["right"] for entry in row["found"])


def reliability(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of the answers within limits of the stated probability: their mean probability and the share that is right."""
    stated = np.array([entry["probability"] for row in rows for entry in row["found"]])
    right = np.array([bool(entry["right"]) for row in rows for entry in row["found"]])
    out = []
    for low, high in itertools.pairwise(EDGES):
        inside = (stated >= low) & ((stated < high) | (high == EDGES[-1]))
        mean = float(stated[inside].mean()) if inside.any() else None
        out.append({"from": low, "to": high, "stated": mean, **share(int(right[inside].sum()), int(inside.sum()))})
    return out


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares over all cases."""
    several = [row for row in rows if row["species"] > 1]
    second = sum(has(row, second_strongest(row)) for row in several)
    first = [row["found"][0] for row in rows if row["found"]]
    times = [row["seconds"] for row in rows]
    return {
        "cases": len(rows),
        "strongest_found": share(sum(has(row, 0) for row in rows), len(rows)),
        "strongest_first": share(sum(0 in species["right"] for species in first), len(rows)),
        "second_found": share(second, len(several)),
        "lists_with_a_certain_and_wrong_species": share(sum(map(wrong_and_certain, rows)), len(rows)),
        "first_certain_and_wrong": share(
            sum(species["word"] == CERTAIN and not species["right"] for species in first), len(rows)
        ),
        "lists_without_any_species": share(sum(not row["found"] for row in rows), len(rows)),
        "certain_species": sum(entry["word"] == CERTAIN for row in rows for entry in row["found"]),
        "reliability": reliability(rows),
        "seconds_median": float(np.median(times)) if times else None,
        "seconds_95": float(np.quantile(times, 0.95)) if times else None,
        "within_10_s": share(sum(seconds <= 10 for seconds in times), len(times)),
    }


def request_of(case: Truth, guess: bool, null: bool) -> AssignRequest:
    """Nothing known, or A, B, C of the strongest species with errors of up to 3 % that are drawn by the number of the case."""
    peaks = redrawn(case.peaks, case.number) if null else case.peaks
    if not guess:
        return AssignRequest(peaks, seconds=120)
    off = np.random.default_rng([case.number, 3]).uniform(-0.03, 0.03, 3)
    a, b, c = sorted(((1 + off) * case.constants[0]).tolist(), reverse=True)
    return AssignRequest(peaks, guess_mhz=(a, b, c), seconds=120)


def run(cases: Iterator[Truth], guess: bool, null: bool, state: Path | None, minutes: float) -> list[dict[str, Any]]:
    """Every case in turn, those of the state file first."""
    answer_assign(AssignRequest(peak_list([7000.0, 9000.0], [1.0, 1.0])))  # compiles
    rows = [json.loads(line) for line in state.read_text().splitlines()] if state and state.exists() else []
    known, end = {row["case"] for row in rows}, time.monotonic() + 60 * minutes
    for case in cases:
        if time.monotonic() > end:
            break
        if case.number in known:
            continue
        request = request_of(case, guess, null)
        started = time.process_time()
        answer = answer_assign(request)
        row = row_of(case, answer, time.process_time() - started)
        rows.append(row)
        if state:
            with state.open("a") as file:
                file.write(json.dumps(row) + "\n")
        print(
            row["case"],
            [(entry["right"], entry["word"], round(entry["evidence"])) for entry in row["found"]],
            flush=True,
        )
    return rows


def run_isotopologues() -> dict[str, Any]:
    """13C species of ten molecules from a geometry with 1 % of strain: found, wrong, and the time for them."""
    rows = []
    for case in isotopologue_cases():
        plain = AssignRequest(case.peaks, seconds=120)
        answer_assign(plain)  # so that families of the band are there
        started = time.process_time()
        answer_assign(plain)
        middle = time.process_time()
        answer = answer_assign(replace(plain, molecule=case.molecule, isotopologues=True))
        ended = time.process_time()
        labelled = [component for component in answer.species if component.isotopologue]
        right = [
            assigned.isotopologue
            for assigned in labelled
            if is_right(assigned, case.substituted.get(assigned.isotopologue, (0.0, 0.0, 0.0)))
        ]
        rows.append({
            "smiles": case.smiles, "peaks": len(case.peaks),
            "parent": any(is_right(component, case.parent) for component in answer.species),
            "species": [{"label": label, "lines": lines, "right": label in right} for label, lines in case.visible.items()],
            "wrong": len(labelled) - len(right), "seconds": ended - middle, "seconds_without": middle - started,
        })  # fmt: skip
        print(rows[-1], flush=True)
    species = [component for row in rows for component in row["species"]]
    enough = [component for component in species if component["lines"] >= ENOUGH_LINES]
    result = {
        "right_of_all": share(sum(component["right"] for component in species), len(species)),
        "right_of_those_with_enough_lines": share(sum(entry["right"] for entry in enough), len(enough)),
        "enough_lines": ENOUGH_LINES,
        "wrong": sum(row["wrong"] for row in rows),
    }
    return {"summary": result, "rows": rows}


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--shared", type=Path)
    parser.add_argument("--guess", action="store_true")
    parser.add_argument("--redrawn", action="store_true")
    parser.add_argument("--state", type=Path)
    parser.add_argument("--minutes", type=float, default=600.0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--isotopologues", action="store_true")
    chosen = parser.parse_args()
    if chosen.isotopologues:
        result = run_isotopologues()
        print(json.dumps(result["summary"], indent=1))
        if chosen.json:
            chosen.json.write_text(json.dumps(result, indent=1) + "\n")
        return
    cases = shared(chosen.shared) if chosen.shared else simulated(chosen.first, chosen.cases)
    rows = run(cases, chosen.guess, chosen.redrawn, chosen.state, chosen.minutes)
    result = summary(rows)
    print(json.dumps(result, indent=1))
    if chosen.json:
        chosen.json.write_text(json.dumps({"summary": result, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
