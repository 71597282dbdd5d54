"""A random sample of mutants of the package, each run on the tests that reach it.

    python benchmarks/mutation.py ../mutants --mutants 300 --seed 24      # goes on where it was stopped
    python benchmarks/mutation.py ../mutants --survivors                  # what is left, and the share killed

The folder gets a copy of the checkout (beside it, so that ../shared is found). Each mutant is written into the copy, and tests run, the
likeliest to see it first (`Selection`), until a test is red. It survives if no test is red within its budget of processor time;
`--budget 200` later goes on with the survivors where they stopped. State: mutants.jsonl and results.jsonl in the folder, a line each.

mutmut 3 changes the package as a whole, one trampoline a function, and leaves decorated functions alone, the compiled kernels among
them; cosmic-ray has one test command for all mutants. Neither draws a sample or picks tests by coverage in 700 modules, hence this file.
Which changes there are, and what is left out: mutants.py.
"""

from __future__ import annotations

import argparse
import ast
import json
import math
import os
import re
import resource
import shutil
import signal
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from mutants import Mutant, sample

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("rotor", "tests", "docs", "data", "examples", "benchmarks", ".ci", ".github")
WORD = re.compile(r"\w+")
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


NEAR = (
    0.25,
    0.1,
    0.05,
    0.08,
)  # worth of an import of the module, its folder, the folder above; of a word in the file's name
LIBRARIES = (
    "numpy", "scipy.linalg", "scipy.optimize", "scipy.stats", "scipy.interpolate", "numba", "matplotlib.pyplot", "pytest", "hypothesis",
    "typer", "ase.io", "ase.build", "rdkit.Chem.AllChem", "qutip", "mpmath", "pandas",
)  # fmt: skip


def rows(path: Path) -> list[dict[str, Any]]:
    """Lines of JSON; none where there is no file."""
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


def append(path: Path, row: dict[str, Any]) -> None:
    """One more line of JSON."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")


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


# Which tests come first


def imported(text: str) -> set[str]:
    """Modules and names that a file imports, with their paths."""
    out = set(re.findall(r"\brotor(?:\.\w+)+", text))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            out |= {f"{node.module}.{one.name}" for one in node.names}
    return out


class Selection:
    """Test functions in the order in which they are likely to see a change.

    The words of a change are the names of its function, class and module, of the functions that call it (half the weight), and of their
    callers (a quarter); and the words of the messages beside it. A test function counts those that stand in it, each by its rarity among
    the tests, and adds a third of the count of its file,
    and what the file imports beside the change.
    """

    def __init__(self, folder: Path) -> None:
        self.files: dict[str, set[str]] = {}
        self.tests: dict[str, set[str]] = {}
        self.imports: dict[str, set[str]] = {}
        for path in sorted((folder / "tests").glob("test_*.py")):
            file, text = str(path.relative_to(folder)), path.read_text("utf-8")
            self.files[file] = set(WORD.findall(text)) | set(WORD.findall(path.stem.replace("_", " ")))
            self.imports[file] = imported(text)
            for node in ast.parse(text).body:
                slow = isinstance(node, ast.FunctionDef) and any(
                    "slow" in ast.unparse(one) for one in node.decorator_list
                )
                if isinstance(node, ast.FunctionDef) and node.name.startswith("test") and not slow:
                    self.tests[f"{file}::{node.name}"] = set(
                        WORD.findall(ast.unparse(node).replace("_", " ") + ast.unparse(node))
                    )
        self.frequency = Counter(word for words in self.tests.values() for word in words)
        self.trees = {
            str(p.relative_to(folder)): ast.parse(p.read_bytes()) for p in sorted((folder / "rotor").rglob("*.py"))
        }
        self.callers: dict[str, set[str]] = defaultdict(set)
        for file, tree in self.trees.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef):
                    for one in ast.walk(node):
                        name = one.id if isinstance(one, ast.Name) else getattr(one, "attr", "")
                        self.callers[name] |= {node.name, Path(file).stem}

    def words(self, mutant: Mutant) -> dict[str, float]:
        """Words of a change with their weights."""
        stem = Path(mutant.file).stem
        inside = {stem: 1.0, **dict.fromkeys(mutant.names, 1.0)}
        messages: set[str] = set()
        for node in ast.walk(self.trees[mutant.file]):
            at_it = getattr(node, "lineno", 0) <= mutant.line <= (getattr(node, "end_lineno", 0) or 0)
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and at_it:
                inside[node.name] = 1.0
            if isinstance(node, ast.Raise | ast.If) and at_it:
                texts = [
                    one.value for one in ast.walk(node) if isinstance(one, ast.Constant) and isinstance(one.value, str)
                ]
                messages |= {word for text in texts for word in WORD.findall(text) if len(word) > 3}
        edge, weight = set(inside), 1.0
        for _ in range(2):
            weight /= 2
            edge = {caller for name in edge if len(self.callers[name]) < 40 for caller in self.callers[name]} - set(
                inside
            )
            inside |= dict.fromkeys(edge, weight)
        for word in stem.strip("_").split("_"):
            inside.setdefault(word, 0.4)
        for word in messages:
            inside.setdefault(word, 0.6)
        return {name: weight for name, weight in inside.items() if len(name) > 2}

    def ranked(self, mutant: Mutant) -> list[str]:
        """The module itself, for its doctests, and the test functions with a score, the highest first."""
        words = self.words(mutant)
        of_file = {file: self.score(words, known) / 3 + self.near(mutant, file) for file, known in self.files.items()}
        scores = {test: self.score(words, known) + of_file[test.split("::")[0]] for test, known in self.tests.items()}
        best = sorted((test for test, score in scores.items() if score > 0), key=lambda test: -scores[test])
        return ([mutant.file] if ">>>" in ast.unparse(self.trees[mutant.file]) else []) + best

    def near(self, mutant: Mutant, file: str) -> float:
        """How near the modules are that a test file imports: the module itself, its folder, the folder above."""
        module = mutant.file.removesuffix(".py").replace("/", ".")
        folder = module.rpartition(".")[0]
        top = ".".join(module.split(".")[:2])
        inside = [
            any(name == part or name.startswith(f"{part}.") for name in self.imports[file])
            for part in (module, folder, top)
        ]
        named = any(word in Path(file).stem.split("_") for word in module.split(".")[1:])
        return float(np.dot([*inside, named], NEAR))

    def score(self, words: dict[str, float], known: set[str]) -> float:
        """How rare the words are that a text shares; each further one counts less, so that many callers do not outweigh the function."""
        rare = sorted(
            (weight / (2 + self.frequency[word]) for word, weight in words.items() if word in known), reverse=True
        )
        return sum(value / (1 + rank) for rank, value in enumerate(rare))


def restored(folder: Path, files: Iterable[str]) -> None:
    """The files of the copy as they were, with their dates: compiled kernels are stored under these."""
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


# Mutants run


def run(folder: Path, mutants: list[Mutant], minutes: float, budget: float) -> None:
    """Run the mutants that have no result of this budget yet."""
    selection, done = Selection(folder), finished(folder)
    until = time.time() + 60 * minutes
    for number, mutant in enumerate(mutants):
        last = done.get(number)
        if time.time() > until or (last and (last["result"] == "killed" or last["budget"] >= budget)):
            continue
        started = time.time()
        tests = [test for test in selection.ranked(mutant) if not last or test not in last["tests"]]
        try:
            (folder / mutant.file).write_bytes(mutant.applied((folder / "original" / mutant.file).read_bytes()))
            row = judged(folder, mutant, tests, budget)
        finally:
            restored(folder, [mutant.file])
        row["tests"] = (last["tests"] if last else []) + row["tests"]
        append(
            folder / "results.jsonl",
            {"number": number, **row, "budget": budget, "wall": round(time.time() - started, 1)},
        )
        print(
            number,
            mutant.file,
            mutant.line,
            mutant.operator,
            row["result"],
            row["by"],
            f"{time.time() - started:.0f} s",
            flush=True,
        )


def finished(folder: Path) -> dict[int, dict[str, Any]]:
    """The last result of every mutant."""
    return {row["number"]: row for row in rows(folder / "results.jsonl")}


def judged(folder: Path, mutant: Mutant, tests: list[str], budget: float) -> dict[str, Any]:
    """Whether a test is red, the likeliest first, up to the budget."""
    caches = stale_caches(folder, mutant) if mutant.compiled else {}
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
    found = re.search(
        r"^(?:FAILED|ERROR) (.*?)(?: - |$)", (folder / "last.log").read_text("utf-8", errors="replace"), re.M
    )
    return found[1] if found else "no start"


def stale_caches(folder: Path, mutant: Mutant) -> dict[Path, bytes]:
    """Compiled kernels that may hold what is changed, removed, with their content."""
    stems = {Path(mutant.file).stem}
    kernels = [path for path in (folder / "rotor").rglob("*.py") if "njit" in path.read_text("utf-8")]
    grown = 0
    while grown != len(stems):
        grown = len(stems)
        stems |= {path.stem for path in kernels if stems & set(WORD.findall(path.read_text("utf-8")))}
    caches = {}
    for kernel in kernels:
        if kernel.stem in stems:
            for path in (kernel.parent / "__pycache__").glob(f"{kernel.stem}.*.nb*"):
                caches[path] = path.read_bytes()
                path.unlink()
    return caches


def summary(folder: Path, mutants: list[Mutant]) -> str:
    """Killed and survived, with Wilson's interval of 95 %, and what survived."""
    results = sorted(finished(folder).values(), key=lambda row: row["number"])
    counts = Counter(row["result"] for row in results)
    killed, total = counts["killed"], len(results)
    texts = [f"{total} of {len(mutants)} mutants run: {dict(counts)}; killed {wilson(killed, total)}"]
    for row in results:
        mutant = mutants[row["number"]]
        if row["result"] != "killed":
            texts.append(f"{row['number']} {mutant.file}:{mutant.line} [{mutant.operator}] {mutant.before!r} -> {mutant.after!r} "
                         f"({len(row['tests'])} tests: {' '.join(row['tests'][:3])} ...)")  # fmt: skip
    return "\n".join(texts)


def wilson(hits: int, total: int) -> str:
    """A share with its 95 % interval: E. B. Wilson, J. Am. Stat. Assoc. 22, 209 (1927)."""
    z, share = 1.96, hits / max(total, 1)
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
        "--budget", type=float, default=25.0, help="seconds of processor time a mutant; a larger one resumes survivors"
    )
    parser.add_argument("--check", action="store_true", help="run the tests that killed on the package as it is")
    parser.add_argument("--survivors", action="store_true")
    given = parser.parse_args()
    folder = given.folder.resolve()
    os.environ |= {
        "PYTHONDONTWRITEBYTECODE": "1",
        "MPLBACKEND": "Agg",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    sys.dont_write_bytecode = True
    mutants = prepared(folder, given.checkout.resolve(), given.mutants, given.seed)
    if given.check:
        print("red without a mutant:", check(folder))
    elif not given.survivors:
        for library in LIBRARIES:
            __import__(library)  # once, before children are forked
        run(folder, mutants, given.minutes, given.budget)
    print(summary(folder, mutants))


if __name__ == "__main__":
    main()
