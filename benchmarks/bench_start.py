"""Whole commands as a user meets them: processes from start to end, beside `python -c "import numpy, typer, rich.table"`.

    python benchmarks/bench_start.py [rounds]
    python benchmarks/bench_start.py --published ../shared/reference [rounds]

All commands take their turn in every round, so that a change of the machine's speed meets all alike; the median of the rounds
counts (seven unless given), as a ratio to the imports alone. "First" runs have an empty cache of compiled code. The last rows
are of one process: making a list in memory. SPCAT makes the same lists in the first two rounds where it is on the PATH; else its column
has the seconds of its own process on a quiet machine of this kind. Results go to benchmarks/results/start.json.

--published: predictions from published .var and .int files with errors, in processor time net of `rotor info water` in the same round
(20 rounds unless given), beside SPCAT's whole process. Results go to benchmarks/results/published.json.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SPCAT = shutil.which("spcat") or ""
SPCAT_ROUNDS = 2  # half a minute for its longest list
RESULTS = Path(__file__).parent / "results" / "start.json"
BASE = 'python -c "import numpy, typer, rich.table"'
TOP = ["--constants", "A=8572 B=3640 C=2790 MHz", "--dipole-abc", "1.201,1.916,0.365", "--q", "93882.35", "--top", "0"]
TUMBLE = ["tumble", "water", "--times", "0:1:11"]


@dataclass(frozen=True)
class Case:
    """One command. goal: of its ratio to the imports alone, of its seconds, or of its seconds beyond the later runs (`first`)."""

    name: str
    arguments: tuple[str, ...]
    ratio: float | None = None
    seconds: float | None = None
    beyond: str = ""
    spcat_s: float | None = None


def _list(jmax: int, cut: str) -> tuple[str, ...]:
    return ("-m", "rotor", "spectrum", *TOP, "--jmax", str(jmax), "--min-lgint", cut, "--cat", "out.cat")


IN_MEMORY = """
import time
from rotor.spectra.lines import line_list
from rotor.tops.top import Top
top = Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.201, 1.916, 0.365))
line_list(top, jmax=40, min_lgint={cut}, q=93882.35)
best = 9e9
for _ in range(3):
    start = time.perf_counter()
    line_list(top, jmax=200, min_lgint={cut}, q=93882.35)
    best = min(best, time.perf_counter() - start)
print(best)
"""
CASES = (
    Case(BASE, ("-c", "import numpy, typer, rich.table")),
    Case("python -c 'import rotor'", ("-c", "import rotor")),
    Case("rotor info water", ("-m", "rotor", "info", "water"), ratio=2.0),
    Case("rotor spectrum water", ("-m", "rotor", "spectrum", "water"), ratio=2.0),
    Case("J ≤ 60 above 1e-12, .cat", _list(60, "-12"), ratio=4.0, spcat_s=0.18),
    Case("J ≤ 100 above 1e-12, .cat", _list(100, "-12"), ratio=5.0, spcat_s=0.67),
    Case("J ≤ 150 above 1e-12, .cat", _list(150, "-12"), spcat_s=1.5),
    Case("J ≤ 60 all lines, .cat", _list(60, "none"), spcat_s=0.70),
    Case("J ≤ 100 all lines, .cat", _list(100, "none"), ratio=3.7 / 3.5 / 0.16, spcat_s=3.7),
    Case("J ≤ 150 all lines, .cat", _list(150, "none"), ratio=16 / 5 / 0.16, spcat_s=16.0),
    Case("rotor tumble water", ("-m", "rotor", *TUMBLE)),
    Case("first: rotor info water", ("-m", "rotor", "info", "water"), beyond="rotor info water", seconds=2.0),
    Case(
        "first: rotor spectrum water", ("-m", "rotor", "spectrum", "water"), beyond="rotor spectrum water", seconds=2.0
    ),
    Case("first: J ≤ 60 above 1e-12", _list(60, "-12"), beyond="J ≤ 60 above 1e-12, .cat", seconds=2.0),
    Case("first: J ≤ 100 all lines", _list(100, "none"), beyond="J ≤ 100 all lines, .cat", seconds=2.0),
    Case("first: rotor tumble water", ("-m", "rotor", *TUMBLE), beyond="rotor tumble water", seconds=2.0),
)
SPCAT_INT = "rigid top\n 0 1 93882.35 0 {jmax} {cut} -99 99999999.0 300.0\n 1 1.201\n 2 1.916\n 3 0.365\n"
SPCAT_VAR = """rigid top
   3    0    0    0    0.0000E+000    1.0000E+003    1.0000E+000 1.0000000000
a 1 1 0 {jmax} 0 1 1 1 0 1 0
        10000   8.572000000000000E+03 1.00000000E-037 /A
        20000   3.640000000000000E+03 1.00000000E-037 /B
        30000   2.790000000000000E+03 1.00000000E-037 /C
"""
MEMORY = {"J ≤ 200 above 1e-12, in memory": ("-12", 0.22), "J ≤ 200 all lines, in memory": ("None", None)}


PUBLISHED = {  # the .var below the folder of reference files, or below tests/oracles; the .int; SPCAT's recorded seconds
    "CH3CN": ("fits/ch3cn_MeCN/v2008_results/ch3cn_MeCN.var", "fits/ch3cn_MeCN/ch3cn_MeCN.int", 0.1),
    "Ar-SO2": ("fits/ar-so2/v2008_results/ar-so2.var", "fits/ar-so2/ar-so2.int", None),
    "FSO3": ("kinds/fso3/fso3.var", "kinds/fso3/fso3.int", None),
    "O2": ("kinds/o2/o2.var", "kinds/o2/o2.int", None),
}
PUBLISHED_RESULTS = RESULTS.with_name("published.json")


def _environment() -> dict[str, str]:
    """Of an installation: this package, its modules compiled to bytecode once."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return environment | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}


def run(case: Case, folder: Path) -> float:
    """Seconds of one process, in a folder for what it writes; a first run has a cache of its own."""
    environment = _environment()
    with tempfile.TemporaryDirectory() as cache:
        if case.beyond:
            environment["NUMBA_CACHE_DIR"] = cache
        started = time.perf_counter()
        subprocess.run([sys.executable, *case.arguments], capture_output=True, check=True, cwd=folder, env=environment)
        return time.perf_counter() - started


def run_spcat(case: Case, folder: Path) -> float:
    """Seconds of SPCAT for the same list: all lines, or those above the cut."""
    jmax, cut = (case.arguments[case.arguments.index(option) + 1] for option in ("--jmax", "--min-lgint"))
    texts = {"int": SPCAT_INT, "var": SPCAT_VAR}
    for suffix, text in texts.items():
        filled = text.format(jmax=jmax, cut="-99" if cut == "none" else cut)
        (folder / f"list.{suffix}").write_text(filled, encoding="utf-8")
    started = time.perf_counter()
    subprocess.run([SPCAT, "list"], capture_output=True, check=True, cwd=folder)
    return time.perf_counter() - started


def in_memory(cut: str) -> float:
    """Seconds of the best of three lists to J = 200 in one process."""
    environment = _environment()
    code = IN_MEMORY.format(cut=cut)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True, env=environment)
    return float(done.stdout)


def measured(rounds: int) -> tuple[dict[str, list[float]], dict[str, list[float]], dict[str, list[float]]]:
    """Seconds of every process in every round, after one round that fills the cache of compiled code: ours, lists, SPCAT's."""
    times: dict[str, list[float]] = {case.name: [] for case in CASES}
    peer: dict[str, list[float]] = {case.name: [] for case in CASES if SPCAT and case.spcat_s is not None}
    lists: dict[str, list[float]] = {name: [] for name in MEMORY}
    with tempfile.TemporaryDirectory() as name:
        for turn in range(-1, rounds):
            for case in CASES:
                if turn >= 0 or not case.beyond:
                    seconds = run(case, Path(name))
                    times[case.name] += [seconds] if turn >= 0 else []
                if 0 <= turn < SPCAT_ROUNDS and case.name in peer:
                    peer[case.name].append(run_spcat(case, Path(name)))
            for title, (cut, _) in MEMORY.items():
                lists[title] += [in_memory(cut)] if turn >= 0 else []
    return times, lists, peer


def processor_s(command: list[str], folder: Path) -> float:
    """Processor time of one process in a folder."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, capture_output=True, check=True, cwd=folder, env=_environment())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def published(reference: Path, rounds: int) -> None:
    """Measure predictions from published files in turn, print a table, write the figures."""
    rotor = [sys.executable, "-m", "rotor"]
    info: list[float] = []
    times: dict[str, list[float]] = {name: [] for name in PUBLISHED}
    peer: dict[str, list[float]] = {name: [] for name in PUBLISHED}
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        for name, (*files, _) in PUBLISHED.items():
            for file in files:
                root = ROOT / "tests" / "oracles" if file.startswith("kinds") else reference
                (folder / f"{name}{Path(file).suffix}").write_bytes((root / file).read_bytes())
        for turn in range(-1, rounds):
            seconds = processor_s([*rotor, "info", "water"], folder)
            info += [seconds] if turn >= 0 else []
            for name, measured_s in times.items():
                command = [*rotor, "spectrum", f"{name}.int", "--cat", f"list_{name}.cat", "--top", "0"]
                seconds = processor_s(command, folder)
                measured_s += [seconds] if turn >= 0 else []
                if SPCAT and turn >= 0:
                    peer[name].append(processor_s([SPCAT, name], folder))
    rows = []
    print(f"rotor info water: {statistics.median(info):.3f} s")
    print(f"{'input':8} {'net median s':>12} {'net mean':>8} {'net best':>8} {'SPCAT s':>8} {'goal':>6}")
    for name, (*_, recorded) in PUBLISHED.items():
        net = [whole - base for whole, base in zip(times[name], info, strict=True)]
        row = {"what": name, "net_median_s": statistics.median(net), "net_mean_s": statistics.mean(net)}
        row["net_best_s"] = min(times[name]) - min(info)
        theirs = statistics.median(peer[name]) if peer[name] else recorded
        texts = (f"{theirs:.3f}", f"{2 * theirs:.2f}") if theirs else ("", "")
        row |= {"spcat_s": theirs, "spcat_here": bool(peer[name])}
        rows.append(row)
        figures = " ".join(f"{row[key]:{width}.3f}" for key, width in zip(list(row)[1:4], (12, 8, 8), strict=True))
        print(f"{name:8} {figures} {texts[0]:>8} {texts[1]:>6}")
    content = {
        "rounds": rounds,
        "info_water_median_s": statistics.median(info),
        "load": os.getloadavg()[1],
        "rows": rows,
    }
    PUBLISHED_RESULTS.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def main(rounds: int) -> None:
    """Measure, print a table with the goals, write the figures."""
    times, lists, peer = measured(rounds)
    medians = {name: statistics.median(values) for name, values in times.items()}
    rows = []
    print(f"{'what':36} {'median s':>8} {'best':>6} {'ratio':>6} {'goal':>6}  {'SPCAT s':>7}")
    for case in CASES:
        ratio = medians[case.name] / medians[BASE]
        row = {"what": case.name, "median_s": medians[case.name], "best_s": min(times[case.name]), "ratio": ratio}
        goal, reached = "", True
        if case.ratio is not None:
            goal, reached = f"{case.ratio:.1f}", ratio <= case.ratio
            row["goal_ratio"] = case.ratio
        if case.beyond and case.seconds is not None:
            row["longer_s"] = medians[case.name] - medians[case.beyond]
            goal, reached = f"+{row['longer_s']:.1f}", row["longer_s"] <= case.seconds
        theirs = ""
        if case.spcat_s is not None:
            seconds = statistics.median(peer[case.name]) if case.name in peer else case.spcat_s
            row["spcat_s"], theirs = seconds, f"{seconds:.3f}"
            row["spcat_here"] = case.name in peer
        rows.append(row)
        print(f"{case.name:36} {row['median_s']:8.3f} {row['best_s']:6.3f} {ratio:6.2f} {goal:>6}{' ' if reached else '!'} "
              f"{theirs:>7}", flush=True)  # fmt: skip
    for title, values in lists.items():
        row = {"what": title, "median_s": statistics.median(values), "best_s": min(values)}
        if MEMORY[title][1] is not None:
            row["goal_s"] = MEMORY[title][1]
        rows.append(row)
        print(f"{title:36} {row['median_s']:8.3f} {row['best_s']:6.3f}        {MEMORY[title][1] or ''}")
    machine = (
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    )
    text = json.dumps({"machine": machine, "rounds": rounds, "rows": rows}, indent=1, ensure_ascii=False)
    RESULTS.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--published"]:
        published(Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 20)
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 7)
