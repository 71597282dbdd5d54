"""Every scene of examples/scenes that asks for an accuracy: its plan beside what really happened, and what one step coarser would do.

    python benchmarks/scenes_measured.py [--only SCENE ...] [--page]

Each scene is measured in a process of its own; benchmarks/results/scenes_measured.json and docs/validation/scenes_measured.md are
written. Seconds
are of the processor, the second run, without start-up and compilation; memory is the peak of what Python and NumPy allocate in one run.
The error is against a calculation about a hundred times finer, or the exact value, by the knobs that `rotor accuracy` sweeps. --page
measures nothing.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
import tracemalloc
from dataclasses import asdict, dataclass
from pathlib import Path

from rotor.scenes.accuracy_sweep import Row, WorkPrecision, work_precision
from rotor.scenes.run import run_scene
from rotor.scenes.scene import Scene, read_scene
from rotor.thermodynamics.gas.numerics import quantile

ROOT = Path(__file__).resolve().parents[1]
SCENES, RESULTS = ROOT / "examples" / "scenes", ROOT / "benchmarks" / "results" / "scenes_measured.json"
PAGE = ROOT / "docs" / "validation" / "scenes_measured.md"
LIMIT_SECONDS = 60.0
LONG_SECONDS = 5.0
CHEAPEST = "nothing cheaper"

HEAD = """# Scenes: the plan beside what happened

Made by `python benchmarks/scenes_measured.py`: the scenes of `examples/scenes` that ask for an accuracy. "Stated" is the error that
the result says it reached; "found" is that against a calculation about a hundred times finer, or against the exact value. "Coarser" is
the same with the knob one step coarser: one J less, ten times the tolerance, about half of the molecules, 3 fs instead of 2. Seconds are of
the processor of a shared machine, without start-up and compilation, and with the search of the settings; memory is the peak that
one run allocates. The error of a gas is the root mean square of eight, times the quantile of the confidence that is stated, 2.58.

| scene | asked | chosen | stated | found | coarser | seconds: plan, run | MB: plan, run |
|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Knob:
    """A knob of a scene. found, coarser: errors with its setting and with the one before it."""

    name: str
    error_of: str
    unit: str
    setting: str
    found: float
    coarser_setting: str | None
    coarser: float | None


@dataclass(frozen=True)
class Measured:
    """One scene. how: which settings were chosen. knobs: whose errors are those that the accuracy is of."""

    scene: str
    asked: float
    unit: str
    how: str
    stated: float
    knobs: tuple[Knob, ...]
    plan_seconds: float
    run_seconds: float
    plan_mb: float
    run_mb: float


# which knobs move the error that the accuracy of a kind is of; of others (a cut, J max of a list) lines are lost, not accuracy
KNOBS = {
    "stark": ("energy",), "align": ("cosine",), "thermo": ("Q", "U", "C_v"), "tumble": ("attitude",),
    "gas": ("temperature",), "fluid": ("conserved energy per degree",),
}  # fmt: skip


def asking() -> list[str]:
    """Names of the scenes that ask for an accuracy."""
    return [
        path.stem for path in sorted(SCENES.glob("*.toml")) if getattr(read_scene(path), "accuracy", None) is not None
    ]


def one_point(name: str) -> Scene:
    """A scene without its sweep, whose other values are those of the file."""
    return read_scene(SCENES / f"{name}.toml").replaced(sweep=None)


def without_files(scene: Scene) -> Scene:
    return scene.replaced(outputs={})


def measure(name: str) -> Measured:
    scene = without_files(one_point(name))
    plan = scene.plan(folder=SCENES)
    with tempfile.TemporaryDirectory() as out:

        def run() -> object:
            return run_scene(scene, folder=SCENES, out=out)

        seconds, result = 0.0, None
        for _ in range(2):  # the first has imports and compilation in it, which matter to a short run alone
            if seconds < LONG_SECONDS:
                start = time.process_time()
                result = run()
                seconds = time.process_time() - start
        tracemalloc.start()
        run()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    reached = result.reached
    table = work_precision(scene, folder=SCENES, limit_seconds=LIMIT_SECONDS)
    computed = knobs(
        table, KNOBS.get(scene.kind, ()), quantile(result.request.confidence) if scene.kind == "gas" else 1.0
    )
    return Measured(
        name,
        reached.asked,
        reached.unit,
        reached.how,
        reached.error,
        computed,
        plan.seconds,
        seconds,
        plan.memory_mb,
        peak / 1e6,
    )


def knobs(table: WorkPrecision, errors_of: tuple[str, ...], widening: float) -> tuple[Knob, ...]:
    """What was found with the setting of the scene and with the one before, times the quantile of a confidence."""
    results = []
    for (name, error_of, unit), rows in table.curves().items():
        place = next((n for n, row in enumerate(rows) if row.own), None)
        if error_of not in errors_of or place is None:
            continue
        before = next((row for row in reversed(rows[:place]) if coarser(row, rows[place])), None)
        results.append(
            Knob(
                name, error_of, unit, rows[place].setting, widening * rows[place].error,
                None if before is None else before.setting, None if before is None else widening * before.error,
            )
        )  # fmt: skip
    return tuple(results)


def coarser(row: Row, reference: Row) -> bool:
    """Whether a setting is a step coarser: of a length of a step by a quarter at least, else any that comes before."""
    return row.knob != "numerics.step" or float(row.setting) >= 1.25 * float(reference.setting)


def page(rows: list[Measured]) -> str:
    """The whole page."""
    return HEAD + "".join(line(row) for row in rows) + tail(rows)


def line(row: Measured) -> str:
    unit = f" {row.unit}" if row.unit else ""
    computed = "<br>".join(
        f"{k.name.removeprefix('numerics.')} {k.setting}: {k.found:.1e}" + _unit(k) for k in row.knobs
    )
    coarser = (
        "nothing is cheaper" if CHEAPEST in row.how or not row.knobs
        else "<br>".join(f"{k.coarser_setting}: {k.coarser:.1e}" + _unit(k) for k in row.knobs if k.coarser is not None)
    )  # fmt: skip
    seconds, memory = f"{row.plan_seconds:.2g}, {row.run_seconds:.2g}", f"{row.plan_mb:.2g}, {row.run_mb:.2g}"
    return f"| {row.scene} | {row.asked:g}{unit} | {row.how} | {row.stated:.1e} | {computed} | {coarser} | {seconds} | {memory} |\n"


def _unit(knob: Knob) -> str:
    return f" {knob.unit} of {knob.error_of}" if knob.error_of in ("Q", "U", "C_v") else f" {knob.unit}".rstrip()


def in_unit_asked(row: Measured, error: float, knob: Knob) -> float:
    """An error in the unit of the accuracy: percent become parts where that is a number."""
    return error / 100.0 if knob.unit == "%" and row.unit == "" else error


def misses(row: Measured) -> list[str]:
    """The knobs of a scene that one step coarser would miss its accuracy."""
    return [
        knob.name
        for knob in row.knobs
        if knob.coarser is not None and in_unit_asked(row, knob.coarser, knob) > row.asked
    ]


def tail(rows: list[Measured]) -> str:
    """Which scenes could be coarser."""
    spared = [row.scene for row in rows if CHEAPEST not in row.how and row.knobs and not misses(row)]
    if not spared:
        return "\nOne step coarser at least one knob of every scene misses its accuracy.\n"
    return (
        f"\nOne step coarser at least one knob of every scene misses its accuracy, but of {', '.join(spared)}: there the estimate is "
        "larger than the error.\n"
    )


def read_results() -> list[Measured]:
    """What was measured last, by name of scene."""
    if not RESULTS.exists():
        return []
    return [
        Measured(**{**record, "knobs": tuple(Knob(**knob) for knob in record["knobs"])})
        for record in json.loads(RESULTS.read_text(encoding="utf-8"))
    ]


def write(rows: list[Measured]) -> None:
    text = ",\n".join(json.dumps(asdict(row), ensure_ascii=False) for row in rows)
    RESULTS.write_text(f"[\n{text}\n]\n", encoding="utf-8")
    PAGE.write_text(page(rows), encoding="utf-8", newline="\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", choices=asking())
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--measure", help=argparse.SUPPRESS)  # one scene, in this process
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(asdict(measure(arguments.measure)), ensure_ascii=False))
        return
    known = {record.scene: record for record in read_results()}
    for name in [] if arguments.page else arguments.only or asking():
        command = [sys.executable, __file__, "--measure", name]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        record = json.loads(done.stdout.splitlines()[-1])
        known[name] = Measured(**{**record, "knobs": tuple(Knob(**knob) for knob in record["knobs"])})
        print(line(known[name]), end="", flush=True)
    write([known[name] for name in asking() if name in known])


if __name__ == "__main__":
    main()
