"""`rotor run`: one scene, or all points of its sweep."""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import leaving
from rotor.cli.shared_options import MOST_WORKERS, SceneFile
from rotor.frozen import dataclass
from rotor.reports.progress import elapsed_time, progress_bar
from rotor.reports.screen import Part, Table, evenly, json_with_rows
from rotor.requests.field import NUMERICS, OUTPUT, declared
from rotor.requests.fill import within
from rotor.requests.readers import Flag, Rule, Text, Whole
from rotor.table import counted
from rotor.verbs.common.outputs import Report
from rotor.verbs.common.verb import ErrorsShown, Tool, Work

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.scenes.scene import Scene
    from rotor.scenes.sweep import SweepResult
    from rotor.table import Table as Columns
    from rotor.verbs.common.calculation import Outcome

SHOWN = 20  # rows of the table, and reasons of failed points, in the report
SHOWN_OF_REASON = 3  # points listed for one reason
SHOWN_NOTES = 3  # notes on the molecules of a sweep

EXAMPLES = """\
  rotor run s.toml
  rotor run s.toml --out results --json -
  rotor run sweep.toml --workers 4
  rotor run sweep.toml --retry-failed
  rotor run sweep.toml --dask tcp://head:8786"""


SWEEP = "Sweep"


@dataclass(frozen=True)
class Options(SceneFile):
    """The scene, the folder of its files, and the processes that share the work."""

    out: str = declared(
        ".", Text(metavar="FOLDER"), "Folder of the files that the scene names in [outputs]", panel=OUTPUT
    )
    workers: int | None = declared(
        None,
        Whole(1, MOST_WORKERS),
        "Spread the points of a sweep, or the work, over N processes",
        panel=NUMERICS,
        rule=Rule(excludes=("dask",), why="the cluster has its own workers"),
    )
    dask: str | None = declared(
        None, Text(metavar="ADDRESS"), "Use the workers of a Dask scheduler instead: tcp://head:8786", panel=NUMERICS
    )
    dask_tls: str | None = declared(
        None,
        Text(metavar="CA,CERT,KEY"),
        "PEM files of an encrypted cluster: authority, certificate, key",
        panel=NUMERICS,
        rule=Rule(("dask",)),
    )
    record: str | None = declared(
        None,
        Text(metavar="FILE"),
        "Record of finished points; by default SCENE.sweep.jsonl in the folder of --out",
        panel=SWEEP,
    )
    retry_failed: bool = declared(False, Flag(), "Run failed points again", panel=SWEEP)


@dataclass(frozen=True)
class SceneRun:
    """A scene that was run."""

    options: Options
    scene: Scene
    result: Outcome
    failure: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        """Remarks on the inputs and on the answer, each once."""
        result = self.result
        remarks = [*self.remarks, *result.verb.notes(result.answer), *self.facts().get("notes", ())]
        return list(dict.fromkeys(remarks))

    def facts(self) -> dict[str, Any]:
        """The facts of the answer, and those of the run."""
        result = self.result
        content = result.report.content
        head = {"scene": self.options.scene, "kind_of_scene": self.scene.kind}
        accuracy = None if result.reached is None else asdict(result.reached)
        run = {"accuracy": accuracy, "seconds": result.seconds}
        return {"rotor_version": content["rotor_version"], **head, **content, **head, **run}

    def json(self, content: Mapping[str, Any]) -> str:
        """The JSON of the verb."""
        files = [str(path) for path in self.result.files]
        return self.result.verb.json(self.result.answer, {**content, "files": files})

    def parts(self, report: Report) -> Iterator[Part | None]:
        """The title of the scene and the report of its verb, then files and seconds of the run."""
        result = self.result
        parts = [*result.verb.show(result.answer, replace(result.report, content=report.content))]
        if title := self.scene.title:
            heading = parts.pop(0) if parts and isinstance(parts[0], str) else ""
            yield f"{title}\n{heading}".rstrip()
        yield from parts
        files = ", ".join(map(str, result.files)) or "none: [outputs] names none"
        yield [("files", files), ("seconds", f"{result.seconds:.3g}"), *_accuracy(result)]


@dataclass(frozen=True)
class SweepRun:
    """A sweep that was run. record: file of the finished points."""

    options: Options
    kind: str
    result: SweepResult
    record: str
    notes: tuple[str, ...] = ()

    @property
    def failure(self) -> str:
        """The failed points, grouped by reason; empty without any."""
        from rotor.scenes.sweep.points import text_of

        result, reasons = self.result, dict[str, list[str]]()
        for point in result.failed:
            reasons.setdefault(point["error"], []).append(text_of(point["values"]))
        if not reasons:
            return ""
        listed = [
            f"{'; '.join(points[:SHOWN_OF_REASON])}{' and others' if len(points) > SHOWN_OF_REASON else ''}: {reason}"
            for reason, points in reasons.items()
        ]
        more = f"; and {len(listed) - SHOWN} more reasons, see {self.record}" if len(listed) > SHOWN else ""
        count = f"{counted(len(result.failed), 'point')} of {len(result)} failed (--retry-failed runs them again)"
        return f"{count}: {' | '.join(listed[:SHOWN])}{more}"

    def facts(self) -> dict[str, Any]:
        """Points computed now and points that failed."""
        failed = [{"values": dict(point["values"]), "error": point["error"]} for point in self.result.failed]
        counts = {"record": self.record, "computed": self.result.computed, "failed": failed}
        return {"scene": self.options.scene, "kind_of_scene": self.kind, **counts}

    def json(self, content: Mapping[str, Any]) -> str:
        """The facts and all points."""
        return json_with_rows(self.result, "points", {**content, "files": list(self.result.files)})

    def parts(self, report: Report) -> list[Part | None]:
        """A table of points."""
        return [_sampled_rows(self.result)]


def answer(options: Options, work: Work) -> SceneRun | SweepRun:
    """Run a scene, or the points of its sweep that are not done."""
    from rotor.scenes.run import refuse_outside
    from rotor.scenes.sweep import is_sweep

    if not Path(options.out).is_dir():
        raise ValueError(f"--out {options.out}: there is no such folder; make it first")
    scene = options.read()
    swept = is_sweep(scene, options.folder)
    if not swept and (options.record is not None or options.retry_failed):
        raise ValueError(f"{'--retry-failed' if options.record is None else '--record'}: this scene has no sweep")
    if swept and work.shown.errors:
        raise ValueError("--errors: needs a single scene; files of a sweep hold the errors of each point")
    refuse_outside(scene, options.out)
    with _workers(options) as pool:
        return _sweep(scene, options, pool) if swept else _single(scene, options, pool)


def _workers(options: Options) -> AbstractContextManager[Executor | None]:
    """Context with a pool of processes or of cluster workers; None for a single process."""
    if options.dask is not None:
        return _dask_pool(options.dask, options.dask_tls)
    if options.workers in (None, 1):
        return nullcontext()
    from rotor.scenes.worker_processes import WorkerProcesses

    return WorkerProcesses(options.workers)


@contextmanager
def _dask_pool(address: str, certificates: str | None) -> Iterator[Executor]:
    """The workers of a Dask cluster; errors of the connection name the option."""
    from rotor.scenes.cluster import dask_executor, tls_security

    files = [] if certificates is None else certificates.split(",")
    if files and len(files) != 3:
        raise ValueError(f"--dask-tls {certificates}: expected three files: authority, certificate, key")
    with ExitStack() as stack:
        with within("--dask"):
            pool = stack.enter_context(dask_executor(address, tls_security(*files) if files else None))
        yield pool


def _single(scene: Scene, options: Options, pool: Executor | None) -> SceneRun:
    from rotor.scenes.run import run_scene

    with elapsed_time("computing"):
        remarks = list[str]()
        result = run_scene(scene, folder=options.folder, out=options.out, executor=pool, note=remarks.append)
        return SceneRun(options, scene, result, remarks=tuple(remarks))


def _accuracy(result: Outcome) -> list[tuple[str, str]]:
    """The requested accuracy beside the numerical error, and beside larger errors if they are estimated."""
    reached = result.reached
    if reached is None:
        return []
    unit = f" {reached.unit}" if reached.unit else ""
    budget = getattr(result.answer, "errors", None)
    larger = "" if budget is None or budget.unit != reached.unit else budget.shortfall(reached.asked)
    text = f"{reached.asked:g}{unit}: numerical error at most {reached.error:.2g}{unit} ({reached.how})"
    return [("accuracy", text + (f"; {larger}" if larger else ""))]


def _sampled_rows(table: Columns) -> Table:
    """Evenly spaced rows of a table."""
    count, columns = len(table), table.columns
    cells = [[_cell(column[row]) for column in columns.values()] for row in evenly(count, SHOWN)]
    return Table("all rows" if len(cells) == count else f"{len(cells)} of {count} rows", list(columns), cells)


def _cell(value: Any) -> str:
    number = hasattr(value, "dtype") and value.dtype.kind == "f"
    # NaN: a quantity that the molecule lacks, such as A of a linear one
    return ("-" if math.isnan(value) else f"{value:.8g}") if number else str(value)


def _sweep(scene: Scene, options: Options, pool: Executor | None) -> SweepRun:
    from rotor.scenes.sweep import run_sweep

    record = options.record or str(Path(options.out) / f"{Path(options.scene).stem}.sweep.jsonl")
    start = time.monotonic()
    with progress_bar("points") as advance, leaving((record, "has the finished points; the same command continues")):
        result = run_sweep(
            scene,
            folder=options.folder,
            out=options.out,
            record=record,
            executor=pool,
            retry_failed=options.retry_failed,
            progress=advance,
        )
    print(_summary(result, record, time.monotonic() - start), file=sys.stderr)
    return SweepRun(options, scene.kind, result, record, _notes(result, record))


def _notes(result: SweepResult, record: str) -> tuple[str, ...]:
    """The notes on the molecules, each once with the number of its points; warnings first, then the most frequent."""
    counts = Counter(text for point in result.records for text in dict.fromkeys(point.get("notes", ())))
    ordered = sorted(counts, key=lambda text: (not text.startswith("WARNING"), -counts[text]))
    listed = [f"{text} ({counts[text]} of {counted(len(result), 'point')})" for text in ordered[:SHOWN_NOTES]]
    more = len(ordered) - len(listed)
    return (*listed, *([f"{counted(more, 'more note')} on molecules: see {record}"] if more > 0 else []))


def _summary(result: SweepResult, record: str, seconds: float) -> str:
    """One line: number of points, points computed now and before, failures."""
    before = len(result) - result.computed
    parts = [f"{result.computed} computed now in {seconds:.3g} s"]
    parts += [f"{before} done before ({record})"] if before else []
    parts += [f"{len(result.failed)} failed"] if result.failed else []
    return f"{counted(len(result), 'point')}: {', '.join(parts)}"


VERB = Tool(
    name="run",
    about="Run a scene, write the files that it names, and report; a sweep resumes where it stopped.",
    examples=EXAMPLES,
    request=Options,
    of="scene",
    shown=ErrorsShown,
    answer=answer,
    failure=lambda answer: answer.failure,
    text=lambda answer, content: answer.json(content),
    show=lambda answer, report: answer.parts(report),
    lists_files=True,
    stepwise=True,
)
