"""Tests in the order in which they are likely to see a change: by rare words that they share, imports, and what they are known to reach."""

from __future__ import annotations

import ast
import json
import math
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from mutants import Mutant
from mutation_session import NextTest

REACHED, NOT_REACHED = 2.0, 0.7  # weight of the other tests of a file where a test reached the statement, or did not
UNREACHED_MOST = 20  # test functions in a row that do not reach it, before the rest is left out
WORD = re.compile(r"\w+")
NEAR = (
    0.25,
    0.1,
    0.05,
    0.08,
)  # worth of an import of the module, its folder, the folder above; of a word in the file's name


def imported(text: str) -> set[str]:
    """Modules and names that a file imports, with their paths."""
    out = set(re.findall(r"\brotor(?:\.\w+)+", text))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            out |= {f"{node.module}.{alias.name}" for alias in node.names}
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
        for path in sorted((folder / "tests").rglob("test_*.py")):
            file, text = str(path.relative_to(folder)), path.read_text("utf-8")
            self.files[file] = set(WORD.findall(text)) | set(WORD.findall(path.stem.replace("_", " ")))
            self.imports[file] = imported(text)
            for node in ast.parse(text).body:
                slow = isinstance(node, ast.FunctionDef) and any(
                    "slow" in ast.unparse(decorator) for decorator in node.decorator_list
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
                    for child in ast.walk(node):
                        name = child.id if isinstance(child, ast.Name) else getattr(child, "attr", "")
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
                    node.value
                    for node in ast.walk(node)
                    if isinstance(node, ast.Constant) and isinstance(node.value, str)
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

    def ranked(self, mutant: Mutant) -> dict[str, float]:
        """The module itself, for its doctests, and the test functions with their scores, the highest first."""
        words = self.words(mutant)
        file_scores = {
            file: self.score(words, known) / 3 + self.near(mutant, file) for file, known in self.files.items()
        }
        scores = {
            test: self.score(words, known) + file_scores[test.split("::")[0]] for test, known in self.tests.items()
        }
        best = sorted((test for test, score in scores.items() if score > 0), key=lambda test: -scores[test])
        first = [mutant.file] if ">>>" in ast.unparse(self.trees[mutant.file]) else []
        return {**dict.fromkeys(first, math.inf), **{test: scores[test] for test in best}}

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


class Reach:
    """Which tests reach which mutants: known for all from every run of a test."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known: dict[str, dict[str, Any]] = {}
        for row in rows(path):
            self.add(row, write=False)

    def add(self, row: dict[str, Any], write: bool = True) -> None:
        """One more run of a test; one in a process in which others ran before may find their results stored."""
        known = self.known.setdefault(row["test"], {**row, "reached": []})
        known["reached"] = sorted({*known["reached"], *row["reached"]})
        if write:
            append(self.path, row)

    def scores(self, number: int, ranked: dict[str, float]) -> dict[str, float]:
        """Tests that reach come first, the quick before the slow; then the others of their files; those that do not last."""
        files: dict[str, float] = defaultdict(lambda: 1.0)
        for test, row in self.known.items():
            files[test.split("::")[0]] *= REACHED if number in row["reached"] else NOT_REACHED
        out = {}
        for test in ranked.keys() | {test for test, row in self.known.items() if number in row["reached"]}:
            row, score = self.known.get(test, {"reached": [], "seconds": 0.3}), ranked.get(test, 1e-3)
            if number in row["reached"]:
                out[test] = 1e6 * (score + 0.01) / (0.3 + row["seconds"])
            else:
                weight = min(max(files[test.split("::")[0]], 0.05), 100.0)
                out[test] = score * weight * (0.01 if test in self.known else 1.0)
        return out

    def chosen(self, number: int, ranked: dict[str, float], tests: set[str], most_missed: float) -> NextTest:
        """The best of some tests again and again; what one reaches changes the scores of its file."""
        scores = {test: score for test, score in self.scores(number, ranked).items() if test in tests}
        factors: dict[str, float] = defaultdict(lambda: 1.0)
        missed = 0

        def chosen(last: tuple[str, bool] | None) -> str | None:
            nonlocal missed
            if last:
                missed = 0 if last[1] else missed + 1
                factors[last[0].split("::")[0]] *= REACHED if last[1] else NOT_REACHED
            if not scores or missed >= most_missed:
                return None
            best = max(scores, key=lambda test: scores[test] * factors[test.split("::")[0]])
            del scores[best]
            return best

        return chosen


def rows(path: Path) -> list[dict[str, Any]]:
    """Lines of JSON; none where there is no file."""
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


def append(path: Path, row: dict[str, Any]) -> None:
    """One more line of JSON."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")
