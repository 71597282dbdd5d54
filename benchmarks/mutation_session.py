"""One session of pytest in which the package is loaded and all tests are collected; every mutant runs in a fork of it.

A change inside a function replaces its code in the fork, so that neither the package is imported nor tests are collected again.
The statement that is changed counts its runs: a test that is green without having reached it says nothing, and tests of a file that
reaches it come sooner. Other changes (compiled kernels, statements of modules) need processes of their own: mutation.py.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
import gc
import importlib
import json
import os
import pkgutil
import resource
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from mutants import Mutant

PATIENCE = 3.0  # a test that takes so many times as long as without the change has seen it


NextTest = Callable[[tuple[str, bool] | None], str | None]  # given the last test and whether it reached the statement


class Unpatchable(Exception):
    """The change is in no function that Python runs itself."""


def functions(folder: Path) -> dict[tuple[str, str, int], list[FunctionType]]:
    """Functions of the package that are loaded, by file, name and first line."""
    prefix = f"{folder}/rotor/"
    out: dict[tuple[str, str, int], list[FunctionType]] = defaultdict(list)
    for candidate in gc.get_objects():
        if type(candidate) is FunctionType and candidate.__code__.co_filename.startswith(prefix):
            code = candidate.__code__
            file = os.path.relpath(code.co_filename, folder)
            out[file, code.co_qualname, code.co_firstlineno].append(candidate)
    return out


def codes(code: CodeType) -> Iterator[CodeType]:
    """A code and those inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from codes(constant)


def marked(source: bytes, statements: dict[int, int], path: str) -> dict[tuple[str, int], CodeType]:
    """Outermost functions by name and first line, compiled with a mark before the statements of the given lines; others have none."""
    tree = ast.parse(source)
    wanted: set[tuple[str, int]] = set()
    for line, number in statements.items():
        function = _outermost(tree, line)
        if function is not None and _mark(function, line, number):
            wanted.add((function.name, min([function.lineno, *(d.lineno for d in function.decorator_list)])))
    whole = codes(compile(tree, path, "exec", dont_inherit=True))
    return {(c.co_qualname, c.co_firstlineno): c for c in whole if (c.co_name, c.co_firstlineno) in wanted}


def _mark(function: ast.AST, line: int, number: int) -> bool:
    """Put a call that counts before the innermost statement of a line."""
    places = [
        (block, k)
        for node in ast.walk(function)
        for block in (getattr(node, name, None) for name in ("body", "orelse", "finalbody"))
        if isinstance(block, list)
        for k, statement in enumerate(block)
        if isinstance(statement, ast.stmt) and statement.lineno == line
    ]
    for block, k in places[-1:]:
        mark = ast.parse(f"__reached__.add({number})").body[0]
        for node in ast.walk(mark):
            ast.copy_location(node, block[k])
        block.insert(k, mark)
    return bool(places)


def _outermost(tree: ast.Module, line: int) -> ast.FunctionDef | ast.AsyncFunctionDef | None:
    """The function of the module or of a class in whose body the line is."""
    bodies = [tree.body]
    while bodies:
        for node in bodies.pop():
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.body[0].lineno <= line <= (
                node.end_lineno or 0
            ):
                return node
            if isinstance(node, ast.ClassDef | ast.If | ast.Try | ast.With):
                bodies.append(node.body)
    return None


class Session:
    """Plugin of pytest that runs mutants in place of the tests."""

    def __init__(self, folder: Path, work: Callable[[Session], None]) -> None:
        self.folder, self.work = folder, work
        self.items: dict[str, list[Any]] = defaultdict(list)
        self.functions: dict[tuple[str, str, int], list[FunctionType]] = {}
        self.green: dict[str, float | None] = {}  # seconds of tests without a mutant; None where red
        self.marks: list[tuple[FunctionType, CodeType]] = []  # of all mutants, without their changes
        self.failed: BaseException | None = None

    def pytest_collection(self, session: Any) -> None:
        """Load the package before its tests are collected."""
        import rotor

        for module in pkgutil.walk_packages(rotor.__path__, "rotor."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)

    def pytest_runtestloop(self, session: Any) -> bool:
        """Run the mutants."""
        sys.dont_write_bytecode = True  # from here on the files may be changed
        for item in session.items:
            self.items[item.nodeid.split("[")[0]].append(item)
        self.functions = functions(self.folder)
        gc.collect()
        gc.freeze()
        try:
            self.work(self)
        except BaseException as error:
            self.failed = error
        return True

    def patches(self, mutants: dict[int, Mutant], sources: dict[str, bytes]) -> list[tuple[FunctionType, CodeType]]:
        """Functions that are loaded, and their codes with marks at the statements of mutants by number."""
        out = []
        for file, source in sources.items():
            here = {m.statement: n for n, m in mutants.items() if m.file == file and m.statement and not m.compiled}
            for name, code in marked(source, here, str(self.folder / file)).items():
                loaded = self.functions.get((file, *name), [])
                out += [
                    (function, code)
                    for function in loaded
                    if len(function.__code__.co_freevars) == len(code.co_freevars)
                ]
        return out

    def judged(
        self, number: int, mutant: Mutant, source: bytes, next_test: NextTest, budget: float
    ) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Whether a test is red, up to the budget of processor time; and what its tests reach of all mutants."""
        patches = self.patches({number: mutant}, {mutant.file: mutant.applied(source)})
        if not patches:
            raise Unpatchable(mutant.file)
        row: dict[str, Any] = {"result": "survived", "by": "", "tests": [], "reached": []}
        reach = []
        events = self._forked(lambda tell: _run(self, tell, next_test, number, [*self.marks, *patches], budget), budget)
        for kind, test, value in events:
            if kind == "time":
                seen = self._sees(test, value)
            else:
                seconds, reached = value
                reach.append({"test": test, "seconds": round(seconds, 2), "reached": reached})
                row["reached"] += [test] if number in reached else []
                seen = kind == "red" and self._sees(test, None)
            if seen:
                row |= {"result": "killed", "by": f"{test}{' (time)' if kind == 'time' else ''}"}
            else:
                row["tests"].append(test)
        return row, reach

    def _sees(self, test: str, seconds: float | None) -> bool:
        """Whether a test that was red, or did not end in some seconds, is green and quick without the change."""
        if test not in self.green:
            limit = max(60.0, 2 * (seconds or 0.0))
            ((_, _, self.green[test]),) = self._forked(lambda tell: _run_plain(self, tell, test), limit)[-1:] or [
                ("", "", None)
            ]
        usual = self.green[test]
        return usual is not None and (seconds is None or seconds > PATIENCE * usual + 1)

    def _forked(self, work: Callable[[Callable[..., None]], None], seconds: float) -> list[tuple[str, str, Any]]:
        """What a fork tells; a test inside which the processor time was over ends it with `time`."""
        value = self.folder / "events.jsonl"
        value.write_text("")
        limit = int(seconds) + 3
        child = os.fork()
        if child == 0:
            os.setpgid(0, 0)
            log = os.open(self.folder / "last.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
            signal.alarm(20 * limit)  # a test that waits
            with value.open("a") as file:
                try:
                    work(lambda *event: print(json.dumps(event), file=file, flush=True))
                finally:
                    os._exit(0)
        os.waitpid(child, 0)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # what its tests have left
        events = [json.loads(line) for line in value.read_text().splitlines()]
        starts = [event for event in events if event[0] == "start"]
        ends = [event for event in events if event[0] != "start"]
        if len(starts) > len(ends):
            ends.append(["time", starts[-1][1], max(limit - starts[-1][2], 0.0)])
        return [(kind, test, value) for kind, test, value in ends]


def _test(session: Session, test: str) -> str:
    """Run a test function with all parameters: green, red, or skipped."""
    from _pytest.runner import runtestprotocol

    for item in session.items[test]:
        reports = runtestprotocol(item, log=False, nextitem=None)
        bad = [report for report in reports if report.failed]
        if bad:
            print(bad[0].longreprtext)
            return "red"
    return "green"


def _patched(patches: list[tuple[FunctionType, CodeType]]) -> set[int]:
    """Put in the codes; numbers of the marks that are passed from now on."""
    reached: set[int] = set()
    builtins.__reached__ = reached  # type: ignore[attr-defined]
    for function, code in patches:
        function.__code__ = code
    return reached


def _run(
    session: Session,
    tell: Callable[..., None],
    next_test: NextTest,
    number: int,
    patches: list[tuple[FunctionType, CodeType]],
    budget: float,
) -> None:
    """In a fork: the change, then tests until one is red."""
    reached = _patched(patches)
    start = time.process_time()
    test = next_test(None)
    while test and (before := time.process_time()) - start < budget:
        tell("start", test, before - start)
        reached.clear()
        result = _test(session, test)
        tell(result, test, [time.process_time() - before, sorted(reached)])
        if result == "red":
            return
        test = next_test((test, number in reached))


def _run_plain(session: Session, tell: Callable[..., None], test: str) -> None:
    """In a fork: a test without a change."""
    started = time.process_time()
    result = _test(session, test)
    tell("plain", test, time.process_time() - started if result == "green" else None)
