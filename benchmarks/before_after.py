"""Two source trees of rotor on the same work, in turns: what a change costs or gains, as ratios after/before.

    python benchmarks/before_after.py BEFORE AFTER [--rounds 5] [--only TEXT] [--processor] [--json FILE]

BEFORE and AFTER are folders with rotor/ and benchmarks/ in them, such as two git worktrees. Each piece of work is
that of the tree's own bench_lines.py, bench_tops.py and bench_fluid.py, then whole processes. One process a tree and
piece, which wait for each other; a ratio is that of the fastest rounds, since whatever else the machine does only adds.
Memory is the peak of each process. With --processor seconds are those of the processor, for a machine that does other work too.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

CONSTANTS = "A=8572 B=3640 C=2790 MHz"
LINES = [
    (60, "memory, all"),
    (100, "memory, all"),
    (100, "memory, > -12"),
    (150, "memory, all"),
    (100, "sorted .cat, all"),
]
WORK = [
    *(f"lines J <= {jmax} {work}" for jmax, work in LINES),
    "tops, 100,000 free bodies, 1 core",
    "fluid, 1000 molecules, reaction field",
    "fluid, 1000 molecules, Ewald",
]
COMMANDS = {
    "rotor info water": ["info", "water"],
    "rotor spectrum water": ["spectrum", "water"],
    "rotor spectrum, J <= 60 above 1e-12 to a .cat": [
        *("spectrum", "--constants", CONSTANTS, "--dipole-abc", "1.201,1.916,0.365"),
        *("--jmax", "60", "--min-lgint", "-12", "--top", "1", "--cat", "out.cat"),
    ],
}


def work_of(name: str, folder: Path) -> Callable[[], float]:
    """A function that does a piece of work once and returns its seconds."""
    if name.startswith("lines"):
        import bench_lines

        jmax, what = next((j, what) for j, what in LINES if name == f"lines J <= {j} {what}")
        return lambda: float(bench_lines.measure(jmax, what)["seconds"])
    if name.startswith("tops"):
        import bench_tops

        return lambda: 1e5 * 20 / bench_tops.ours(100_000, 20)["rotor, 1 core"]
    return _fluid(name.endswith("Ewald"), folder)


def _fluid(ewald: bool, folder: Path) -> Callable[[], float]:
    import bench_fluid

    settings = bench_fluid.Settings(electrostatics="ewald") if ewald else bench_fluid.Settings()
    pieces = bench_fluid.ours(bench_fluid.water("spce", 1000, folder), settings, 25 if ewald else 100)
    next(pieces)
    return lambda: float(next(pieces))


def serve(name: str, folder: Path, processor: bool) -> None:
    """The process of one tree: a line in, the seconds of one round out; at the end the peak of memory."""
    run = work_of(name, folder)
    for line in sys.stdin:
        if line.startswith("memory"):
            print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, flush=True)
            continue
        before = time.process_time()
        seconds = run()
        print(time.process_time() - before if processor else seconds, flush=True)


def in_turns(
    name: str, trees: list[Path], rounds: int, folder: Path, processor: bool
) -> Iterator[tuple[list[float], float]]:
    """For each tree the seconds of its rounds and its peak of memory in MB."""
    processes = [_process(name, tree, folder, processor) for tree in trees]
    seconds: list[list[float]] = [[] for _ in trees]
    for k in range(rounds + 1):
        for taken, process in zip(seconds, processes, strict=True):
            answer = _ask(process, "go")
            if k:
                taken.append(answer)
    for taken, process in zip(seconds, processes, strict=True):
        yield taken, _ask(process, "memory")
        process.stdin.close()
        process.wait()


def _process(name: str, tree: Path, folder: Path, processor: bool) -> subprocess.Popen[str]:
    path = os.pathsep.join([str(tree), str(tree / "benchmarks")])
    command = [sys.executable, "-P", __file__, "--serve", name, "--folder", str(folder)]
    command += ["--processor"] if processor else []
    return subprocess.Popen(
        command, env=os.environ | {"PYTHONPATH": path}, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def _ask(process: subprocess.Popen[str], word: str) -> float:
    process.stdin.write(word + "\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def _children() -> float:
    """Processor time of the processes that have ended, in seconds."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def commands(words: list[str], trees: list[Path], rounds: int, folder: Path, processor: bool) -> list[list[float]]:
    """Seconds of whole processes, the trees taking turns."""
    seconds: list[list[float]] = [[] for _ in trees]
    for k in range(rounds + 1):
        for taken, tree in zip(seconds, trees, strict=True):
            clock = _children if processor else time.perf_counter
            started = clock()
            subprocess.run(
                [sys.executable, "-m", "rotor", *words],
                env=os.environ | {"PYTHONPATH": str(tree)},
                cwd=folder,
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            if k:
                taken.append(clock() - started)
    return seconds


def main() -> None:
    """Measure, print and save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", nargs="*", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help="only the work whose name holds this text")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--processor", action="store_true", help="processor time")
    parser.add_argument("--serve")
    parser.add_argument("--folder", type=Path)
    arguments = parser.parse_args()
    if arguments.serve:
        return serve(arguments.serve, arguments.folder, arguments.processor)
    trees = [tree.resolve() for tree in arguments.trees]
    table = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for work in (work for work in WORK if arguments.only in work):
            (before, old), (after, new) = in_turns(work, trees, arguments.rounds, folder, arguments.processor)
            table[work] = _row(work, before, after) | {"memory_mb_before": old, "memory_mb_after": new}
            print(f"    peak memory {old:.0f} MB before, {new:.0f} MB after", flush=True)
        for work, words in ((work, words) for work, words in COMMANDS.items() if arguments.only in work):
            before, after = commands(words, trees, 2 * arguments.rounds, folder, arguments.processor)
            table[work] = _row(work, before, after)
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return None


def _row(work: str, before: list[float], after: list[float]) -> dict[str, float]:
    row = {"seconds_before": min(before), "seconds_after": min(after), "ratio": min(after) / min(before)}
    print(f"{work:50s} {min(before):9.4f} s {min(after):9.4f} s   ratio {row['ratio']:.3f}", flush=True)
    return row


if __name__ == "__main__":
    main()
