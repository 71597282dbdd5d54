"""A random sample of mutants of the package, each run on the tests that reach it.

    python benchmarks/mutation.py ../mutants --mutants 300 --seed 24             # goes on where it was stopped
    python benchmarks/mutation.py ../mutants --later tests/test_x.py             # survivors on tests written since
    python benchmarks/mutation.py ../mutants --survivors --equivalent 34 43      # what is left, and the share killed

The folder gets a copy of the checkout (beside it, so that ../shared is found). All tests are collected once, and each mutant runs in a
fork of that session (mutation_session.py): tests that are known to reach the change first, then the likeliest by the words that they
share with it (mutation_ranking.py), until one is red that is green without the change. It survives if none is red within its budget of
processor time; a larger budget goes on with the survivors where they stopped. Changes of compiled kernels and of statements of modules
run in processes of their own. State: mutants.jsonl, results.jsonl and reach.jsonl in the folder, a line each.

mutmut 3 changes the package as a whole, one trampoline a function, and leaves decorated functions alone, the compiled kernels among
them; cosmic-ray has one test command for all mutants. Neither draws a sample or picks tests by coverage in 700 modules, hence this file.
Which changes there are, and what is left out: mutants.py.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import resource
import shutil
import signal
import socket
import sys
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mutants import Mutant, sample
from mutation_ranking import UNREACHED_MOST, Reach, Selection, append, rows
from mutation_session import Session, Unpatchable

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("rotor", "tests", "docs", "data", "examples", "benchmarks", ".ci", ".github")
FIRST, NEXT, MOST = 6, 24, 300  # test functions of a run, and of a mutant
QUIET = (
    "-q",
    "-n",
    "0",
    "-p",
    "no:cacheprovider",
    "--no-header",
    "--hypothesis-seed=0",
    "-W",
    "ignore::pytest.PytestAssertRewriteWarning",
)


LIBRARIES = (
    "numpy", "scipy.linalg", "scipy.optimize", "scipy.stats", "scipy.interpolate", "numba", "matplotlib.pyplot", "pytest", "hypothesis",
    "typer", "ase.io", "ase.build", "rdkit.Chem.AllChem", "qutip", "mpmath", "pandas",
)  # fmt: skip


def prepared(folder: Path, checkout: Path, count: int, seed: int) -> list[Mutant]:
    """The mutants; at first the copy is made and they are drawn."""
    drawn = folder / "mutants.jsonl"
    if not drawn.exists():
        folder.mkdir(parents=True, exist_ok=True)
        for name in COPIED:
            shutil.copytree(checkout / name, folder / name, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.pyc"))
        for path in checkout.iterdir():
            if path.is_file() and path.name != ".git":
                shutil.copy2(path, folder)
        shutil.copytree(folder / "rotor", folder / "original" / "rotor")
        for mutant in sample(folder, count, seed):
            append(drawn, asdict(mutant))
    return [Mutant(**{**row, "names": tuple(row["names"])}) for row in rows(drawn)]


def restored(folder: Path, files: Iterable[str]) -> None:
    """The files of the copy as they were."""
    for file in files:
        shutil.copy2(folder / "original" / file, folder / file)


def forked(folder: Path, arguments: list[str], seconds: float) -> int:
    """Exit code of pytest in a forked process whose libraries are loaded; -9 and the like where its processor time is over."""
    child = os.fork()
    if child == 0:
        log = os.open(folder / "last.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.chdir(folder)
        os.environ["PYTHONPATH"] = str(folder)
        sys.path.insert(0, str(folder))
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 5))
        import pytest

        os._exit(int(pytest.main([*QUIET, *arguments])))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class Fresh:
    """A process with the libraries but without the package, which forks for every mutant that no running session can take."""

    def __init__(self, folder: Path, mutants: list[Mutant]) -> None:
        self.socket, theirs = socket.socketpair()
        if os.fork() == 0:
            sys.dont_write_bytecode = True
            self.socket.close()
            with theirs.makefile("rw") as file:
                for line in file:
                    request = json.loads(line)
                    row = judged(folder, mutants[request["number"]], request["tests"], request["budget"])
                    print(json.dumps(row), file=file, flush=True)
            os._exit(0)
        theirs.close()
        self.file = self.socket.makefile("rw")

    def judged(self, number: int, tests: list[str], budget: float) -> dict[str, Any]:
        """Whether a test is red, in processes that load the package anew."""
        print(json.dumps({"number": number, "tests": tests, "budget": budget}), file=self.file, flush=True)
        row: dict[str, Any] = json.loads(self.file.readline())
        return row


# Mutants run


def run(folder: Path, mutants: list[Mutant], arguments: argparse.Namespace) -> None:
    """Run the mutants that have no result of a budget yet, the small budget first; with test files of `later`, survivors on these alone.

    With numbers of mutants these alone, and nothing is recorded.
    """
    import pytest

    fresh, selection, until = Fresh(folder, mutants), Selection(folder), time.time() + 60 * arguments.minutes

    def work(session: Session) -> None:
        sources = {m.file: (folder / "original" / m.file).read_bytes() for m in mutants}
        session.marks = session.patches(dict(enumerate(mutants)), sources)
        reach = Reach(folder / "reach.jsonl")
        for budget in arguments.budget:
            done = finished(folder)
            left = [n for n in range(len(mutants)) if is_left(n, done.get(n), budget, arguments)]
            for number in sorted(left, key=lambda n: (mutants[n].compiled or not mutants[n].statement, n)):
                if time.time() > until:
                    return
                mutant, last = mutants[number], None if arguments.only else done.get(number)
                doctests = [test for test in session.items if test.startswith(f"{mutant.file}::")]
                ranked = {**dict.fromkeys(doctests, 10.0), **selection.ranked(mutant)}
                most_missed = math.inf if arguments.later else UNREACHED_MOST
                row = mutant_result(folder, mutant, number, last, budget, session, reach, ranked, most_missed, fresh)
                if not arguments.only:
                    append(folder / "results.jsonl", {**row, "later": bool(arguments.later)})
                place = number, f"{mutant.file}:{mutant.line}", mutant.operator
                note(
                    folder, *place, row["result"], row["by"], len(row["reached"]), "of", len(row["tests"]), row["wall"]
                )

    os.chdir(folder)
    os.environ["PYTHONPATH"] = str(folder)
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = False  # until the mutants begin
    plugin = Session(folder, work)
    pytest.main([*QUIET, *(arguments.later or ["tests", "rotor"])], plugins=[plugin])
    if plugin.failed:
        raise plugin.failed


def is_left(number: int, last: dict[str, Any] | None, budget: float, arguments: argparse.Namespace) -> bool:
    """Whether a mutant is to be run."""
    if arguments.only:
        return number in arguments.only
    mine = number % arguments.part[1] == arguments.part[0] - 1
    if arguments.later:
        return mine and last is not None and last["result"] != "killed"
    return mine and (last is None or (last["result"] != "killed" and last["budget"] < budget))


def note(folder: Path, *words: object) -> None:
    """A line on the progress; standard output belongs to pytest."""
    with (folder / "progress.log").open("a") as file:
        print(time.strftime("%H:%M:%S"), *words, file=file)


def mutant_result(
    folder: Path,
    mutant: Mutant,
    number: int,
    last: dict[str, Any] | None,
    budget: float,
    session: Session,
    reach: Reach,
    ranked: dict[str, float],
    most_missed: float,
    fresh: Fresh,
) -> dict[str, Any]:
    """The result of a mutant, which is in the file on the disk meanwhile, for tests that start processes."""
    started, before = time.time(), last or {"tests": [], "reached": []}
    left = session.items.keys() - set(before["tests"])
    source = (folder / "original" / mutant.file).read_bytes()
    try:
        (folder / mutant.file).write_bytes(mutant.applied(source))
        try:
            row, seen = session.judged(number, mutant, source, reach.chosen(number, ranked, left, most_missed), budget)
            for item in seen:
                reach.add(item)
        except Unpatchable:
            tests = [test for test in ranked if test not in before["tests"]]
            row = fresh.judged(number, tests, budget) | {"reached": ["?"]}
    finally:
        restored(folder, [mutant.file])
    row["tests"] = before["tests"] + row["tests"]
    row["reached"] = before["reached"] + row["reached"]
    return {"number": number, **row, "budget": budget, "wall": round(time.time() - started, 1)}


def finished(folder: Path) -> dict[int, dict[str, Any]]:
    """The last result of every mutant."""
    return {row["number"]: row for row in rows(folder / "results.jsonl")}


def judged(folder: Path, mutant: Mutant, tests: list[str], budget: float) -> dict[str, Any]:
    """Whether a test is red, the likeliest first, up to the budget."""
    stored = (
        (folder / "rotor").rglob("*.nb[ic]") if mutant.compiled else ()
    )  # those of changed kernels are written anew
    caches = {path: path.read_bytes() for path in stored}
    before, ran = processor_time(), []
    batches = [tests[:FIRST], *(tests[k : k + NEXT] for k in range(FIRST, min(len(tests), MOST), NEXT))]
    try:
        for batch in filter(None, batches):
            left = budget - (processor_time() - before)
            if left < 1 and ran:
                break
            code = forked(folder, ["-x", *batch], left + (240 if mutant.compiled else 0))
            ran += batch
            if code == -signal.SIGXCPU and len(ran) > len(batch):
                ran = ran[: -len(batch)]
                break  # the budget is over inside a later batch: nothing is known
            if code == -signal.SIGXCPU:
                return {"result": "undecided", "by": "a loop without an end, or slow tests", "tests": []}
            if code not in (0, 5):
                return {"result": "killed", "by": culprit(folder) if code > 0 else f"signal {-code}", "tests": ran}
    finally:
        for path, content in caches.items():
            path.write_bytes(content)
    return {"result": "survived", "by": "", "tests": ran}


def check(folder: Path) -> list[str]:
    """Tests that killed a mutant and are red without one, too: no evidence."""
    tests = sorted({row["by"] for row in finished(folder).values() if "::" in row["by"]})
    forked(folder, tests, 3600)
    return re.findall(
        r"^(?:FAILED|ERROR) (.*?)(?: - |$)", (folder / "last.log").read_text("utf-8", errors="replace"), re.M
    )


def processor_time() -> float:
    """Of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def culprit(folder: Path) -> str:
    """The first test that was red."""
    match = re.search(
        r"^(?:FAILED|ERROR) (.*?)(?: - |$)", (folder / "last.log").read_text("utf-8", errors="replace"), re.M
    )
    return match[1] if match else "no start"


def exchanged(folder: Path, mutants: list[Mutant], table: Path) -> None:
    """Results as a table of CSV: read where the folder has none, written where it has."""
    import csv

    if not (folder / "results.jsonl").exists():
        for row in csv.DictReader(table.read_text("utf-8").splitlines()):
            known = {
                "number": int(row["number"]),
                "result": row["result"],
                "by": row["by"],
                "later": row["later"] == "yes",
            }
            append(folder / "results.jsonl", known | {"budget": float(row["budget"]), "tests": [], "reached": []})
        return
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["number", "file", "line", "operator", "before", "after", "result", "by", "budget", "later"])
        for number, row in sorted(finished(folder).items()):
            mutant = mutants[number]
            change = [" ".join(text.split())[:60] for text in (mutant.before, mutant.after)]
            later = "yes" if row.get("later") else "no"
            place = [number, mutant.file, mutant.line, mutant.operator]
            writer.writerow([*place, *change, row["result"], row["by"], row["budget"], later])


def summary(folder: Path, mutants: list[Mutant], equivalent: list[int]) -> str:
    """Killed within the budget and by tests written since, with Wilson's intervals of 95 %, and what survived."""
    results = sorted(finished(folder).values(), key=lambda row: row["number"])
    counts = Counter(row["result"] for row in results)
    killed = {row["number"] for row in results if row["result"] == "killed"}
    later = {row["number"] for row in results if row.get("later") and row["number"] in killed}
    total = len({row["number"] for row in results} - (set(equivalent) - killed))  # what is killed is not equivalent
    texts = [
        f"{len(results)} of {len(mutants)} mutants run: {dict(counts)}; {len(results) - total} of them equivalent",
        f"killed within the budget: {len(killed - later)} of {total}, {wilson(len(killed - later), total)}",
        f"with tests written since: {len(killed)} of {total}, {wilson(len(killed), total)}",
    ]
    for row in results:
        mutant, number = mutants[row["number"]], row["number"]
        if number not in killed:
            mark = " equivalent" if number in equivalent else ""
            change = f"[{mutant.operator}] {mutant.before!r} -> {mutant.after!r}"
            reached = f"({len(row['reached'])} of {len(row['tests'])} tests reach it)"
            texts.append(f"{number} {mutant.file}:{mutant.line} {change} {reached}{mark}")
    return "\n".join(texts)


def wilson(hits: int, total: int) -> str:
    """A share with its 95 % interval: E. B. Wilson, J. Am. Stat. Assoc. 22, 209 (1927)."""
    if not total:
        return "none of none"
    z, share = 1.96, hits / total
    centre = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z / (1 + z * z / total) * math.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    return f"{share:.1%} ({centre - half:.1%} to {centre + half:.1%})"


def main() -> None:
    """Draw, reach, run, as far as not done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--checkout", type=Path, default=ROOT)
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--seed", type=int, default=24)
    parser.add_argument("--minutes", type=float, default=math.inf, help="no further mutant after this")
    parser.add_argument(
        "--budget",
        type=float,
        nargs="+",
        default=[8.0, 30.0],
        help="seconds of processor time a mutant, and of survivors",
    )
    parser.add_argument("--part", type=int, nargs=2, default=(1, 1), metavar=("K", "N"), help="every Nth mutant")
    parser.add_argument(
        "--equivalent", type=int, nargs="+", default=[], help="numbers judged equivalent, for the share"
    )
    parser.add_argument("--table", type=Path, help="results as CSV, read into a new folder, written from another")
    parser.add_argument(
        "--later", nargs="+", default=[], help="files of tests written since: survivors are run on these"
    )
    parser.add_argument("--only", nargs="+", type=int, default=[], help="numbers of mutants; nothing is recorded")
    parser.add_argument("--check", action="store_true", help="run the tests that killed on the package as it is")
    parser.add_argument("--survivors", action="store_true")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    os.environ |= {
        "PYTHONDONTWRITEBYTECODE": "1",
        "MPLBACKEND": "Agg",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    mutants = prepared(folder, arguments.checkout.resolve(), arguments.mutants, arguments.seed)
    if arguments.check:
        print("red without a mutant:", check(folder))
    elif not arguments.survivors:
        for library in LIBRARIES:
            __import__(library)  # once, before children are forked
        if arguments.later:
            shutil.copytree(arguments.checkout.resolve() / "tests", folder / "tests", dirs_exist_ok=True)
        run(folder, mutants, arguments)
    if arguments.table:
        exchanged(folder, mutants, arguments.table)
    print(summary(folder, mutants, arguments.equivalent))


if __name__ == "__main__":
    main()
