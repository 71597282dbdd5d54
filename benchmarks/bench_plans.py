"""Planned seconds and memory beside those of the run: processor time without start-up and compilation, and peak of what is allocated.

    python benchmarks/bench_plans.py [--only CASE ...]

All scenes of examples/scenes, and others that are longer, so that both stand above what is always there. Plans hold within a factor of 3
above a second, and above a megabyte. Each case has a process of its own; the seconds of a run are the median of three, after one that may
compile; of a run beyond some seconds, one. benchmarks/results/plans.json is written, and tests/scenes/test_scenes_measured.py reads
it. A run that is traced for its memory takes several times as long; its seconds are those of another.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from rotor.requests.plan import traced
from rotor.scenes.plan import plan_of
from rotor.scenes.run import run_scene
from rotor.scenes.scene import Scene, make_scene, read_scene

ROOT = Path(__file__).resolve().parents[1]
FOLDER, RESULTS = ROOT / "examples" / "scenes", ROOT / "benchmarks" / "results" / "plans.json"
REPEATS, LONG_SECONDS = 3, 5.0
CHANGED = {  # longer: tables with the numbers that are changed
    "water_gas": {"numerics": {"molecules": 300_000}},
    "rigid_water": {"conditions": {"steps": 1500, "molecules": 216}},
    "formamide_hyperfine": {"conditions": {"temperature": "300 K", "range": None}, "numerics": {"jmax": None}},
    "tennis_racket": {"conditions": {"times": "0:500:1000001"}},
    "driven_chaos": {"conditions": {"times": "0:30:200001"}},
    "unbalanced_wheel": {"conditions": {"times": "0:200:101"}},
    "satellite_body_torque": {"conditions": {"times": "0:3000:101"}},
    "rattleback": {"conditions": {"times": "0:20:4001"}},
    "ocs_alignment": {"conditions": {"temperature": "100 K"}},
    "ocs_stark_map": {"conditions": {"field": "0:200kV/cm:200001"}},
}
COARSER = {
    "satellite_body_torque": "1e-5 rad",
    "unbalanced_wheel": "1e-7 rad",
}  # accuracies that so long a motion allows
OTHERS: dict[str, Scene] = {
    "SO2, every line": make_scene("spectrum", molecule="SO2",
        conditions={"temperature": "300 K"},
        observables={"min_lgint": "none"},
    ),
    "CH3OH, lines to 300 K": make_scene("spectrum", molecule="CH3OH", conditions={"temperature": "300 K"}),
    "SO2, levels to 400": make_scene("levels", molecule="SO2", observables={"jmax": 400}),
    "OCS, levels to 100000": make_scene("levels", molecule="OCS", observables={"jmax": 100_000}),
    "formaldehyde, Stark map": make_scene("stark", molecule="H2CO", conditions={"field": "0:100kV/cm:2001"}),
    "a top in magnetic fields": make_scene("zeeman", molecule="H2CO", magnetic={"g": [0.6, -0.2, 0.3]}, conditions={"field": "0:20T:1001"}
    ),
    "water, 400 temperatures": make_scene("thermo", molecule="water", conditions={"temperature": "10:1000K:400"}),
    "CO2, Raman lines": make_scene("raman", molecule="CO2"),
    "C1 and C2 of 50000 molecules": make_scene("gas", molecule="water", observables={"times": "0:1ps:101"}, numerics={"molecules": 50_000}
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Planned:
    """One case: what its plan says and what its run took."""

    case: str
    planned_seconds: float
    taken_seconds: float
    planned_mb: float
    taken_mb: float


def cases() -> dict[str, Scene]:
    """All scenes that are measured, without files and sweeps."""
    results: dict[str, Scene] = {}
    for path in sorted(FOLDER.glob("*.toml")):
        scene = read_scene(path)
        results[path.stem] = scene.replaced(outputs={}, sweep=None)
    for name, tables in CHANGED.items():
        scene = results[name]
        changes = {table: {**scene.content.get(table, {}), **new} for table, new in tables.items()}
        changes |= {"accuracy": COARSER[name]} if name in COARSER else {}
        if "numerics" in tables or name == "driven_chaos":
            changes["accuracy"] = None  # the numbers are given here; chaos allows none for so long
        results[f"{name}, longer"] = scene.replaced(**changes)
    return results | OTHERS


def measure(case: str) -> Planned:
    """Plan and run a case in this process."""
    scene = cases()[case]
    plan = plan_of(scene, FOLDER)
    with tempfile.TemporaryDirectory() as out:

        def run() -> object:
            return run_scene(scene, folder=FOLDER, out=out)

        taken = [_seconds(run)]
        if taken[0] < LONG_SECONDS:
            taken = [_seconds(run) for _ in range(REPEATS)]
        memory = traced(run)[1]
    return Planned(case, plan.seconds, statistics.median(taken), plan.memory_mb, memory)


def _seconds(call: object) -> float:
    start = time.process_time()
    call()  # type: ignore[operator]
    return time.process_time() - start


def within(planned: float, taken: float, least: float) -> bool:
    """Whether both are below what matters, or within a factor of 3."""
    return max(planned, taken) < least or 1 / 3 < planned / taken < 3


def line(planned: Planned) -> str:
    ratios = planned.planned_seconds / planned.taken_seconds, planned.planned_mb / planned.taken_mb
    missed = (
        ""
        if within(planned.planned_seconds, planned.taken_seconds, 1.0)
        and within(planned.planned_mb, planned.taken_mb, 1.0)
        else "  MISSED"
    )
    return (
        f"{planned.case:28s} seconds: planned {planned.planned_seconds:8.3g}, "
        f"taken {planned.taken_seconds:8.3g}, ratio {ratios[0]:5.2f}    "
        f"MB: planned {planned.planned_mb:8.3g}, taken {planned.taken_mb:8.3g}, ratio {ratios[1]:5.2f}{missed}"
    )


def read_results() -> dict[str, Planned]:
    """What was measured last."""
    stored = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    return {row["case"]: Planned(**row) for row in stored}


def main() -> None:
    """Measure and store."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--missing", action="store_true", help="those that have no figure yet")
    parser.add_argument("--measure", help=argparse.SUPPRESS)  # one case, in this process
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(asdict(measure(arguments.measure)), ensure_ascii=False))
        return
    known, names = read_results(), list(cases())
    for case in arguments.only or [name for name in names if not (arguments.missing and name in known)]:
        done = subprocess.run([sys.executable, __file__, "--measure", case], capture_output=True, text=True, check=True)
        known[case] = Planned(**json.loads(done.stdout.splitlines()[-1]))
        print(line(known[case]), flush=True)
        text = ",\n".join(json.dumps(asdict(known[name]), ensure_ascii=False) for name in names if name in known)
        RESULTS.write_text(f"[\n{text}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
