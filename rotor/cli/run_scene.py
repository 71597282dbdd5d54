"""`rotor run`: one scene, or all points of its sweep."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import NoAnswerError
from rotor.cli.shared import process
from rotor.cli.shared.output import Files, answering, deliver, note
from rotor.cli.shared.workers import MOST_WORKERS
from rotor.reports.screen import Table, evenly, json_with_rows, show_parts, show_table
from rotor.requests.field import NUMERICS, OUTPUT, REQUIRED, declared
from rotor.requests.fill import Entries
from rotor.requests.readers import Flag, Text, Whole
from rotor.table import counted
from rotor.verbs.tool import Tool
from rotor.verbs.verb import Place

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import typer

    from rotor.scenes.scene import Scene, SceneResult
    from rotor.scenes.sweep import SweepResult
    from rotor.table import Table as Columns

SHOWN = 20  # rows of the table, and reasons of failed points, in the report
SHOWN_OF_REASON = 3  # points listed for one reason

EXAMPLES = """\b
Examples:
  rotor run s.toml
  rotor run s.toml --out results --json -
  rotor run sweep.toml --workers 4
  rotor run sweep.toml --retry-failed
  rotor run sweep.toml --dask tcp://head:8786"""


SWEEP = "Sweep"


@dataclass(frozen=True)
class Options:
    """The scene, the folder of its files, and the processes that share the work."""

    scene: str = declared(REQUIRED, Text(), "A scene file", option="SCENE")
    out: str = declared(
        ".", Text(metavar="FOLDER"), "Folder of the files that the scene names in [outputs]", panel=OUTPUT
    )
    workers: int | None = declared(
        None, Whole(1, MOST_WORKERS), "Spread the points of a sweep, or the work, over N processes", panel=NUMERICS
    )
    dask: str | None = declared(
        None,
        Text(metavar="ADDRESS"),
        "Use the workers of a Dask scheduler instead: tcp://head:8786",
        panel=NUMERICS,
    )
    dask_tls: str | None = declared(
        None,
        Text(metavar="CA,CERT,KEY"),
        "PEM files of an encrypted cluster: authority, certificate, key",
        panel=NUMERICS,
    )
    record: str | None = declared(
        None,
        Text(metavar="FILE"),
        "Record of finished points; by default SCENE.sweep.jsonl in the folder of --out",
        panel=SWEEP,
    )
    retry_failed: bool = declared(False, Flag(), "Run failed points again", panel=SWEEP)
    errors: bool = declared(False, Flag(), "Print the table of errors: each source with its size", panel=OUTPUT)


def run_declared(verb: Tool, context: typer.Context, typed: Mapping[str, Any]) -> None:
    """Run a scene, write the files that it names, and report; a sweep resumes where it stopped."""
    from rotor.cli.shared.runner import refuse_overwriting
    from rotor.scenes.outputs import refuse_outside
    from rotor.scenes.scene_file import read_scene
    from rotor.scenes.sweep import is_sweep

    options: Options = verb.read(Entries(typed, "option"), Place())[0]
    if not Path(options.out).is_dir():
        raise ValueError(f"--out {options.out}: there is no such folder; make it first")
    scene = read_scene(options.scene)
    swept = is_sweep(scene, _folder(options))
    for name, set_by_user in (("--record", options.record is not None), ("--retry-failed", options.retry_failed)):
        if set_by_user and not swept:
            raise ValueError(f"{name}: this scene has no sweep")
    if swept and options.errors:
        raise ValueError("--errors: needs a single scene; files of a sweep hold the errors of each point")
    refuse_outside(scene, options.out)
    files = Files()
    files.ask_json(typed.get("json"))
    refuse_overwriting(files, {"scene": options.scene})
    process.begin_work()
    with _workers(options) as pool:
        if swept:
            _sweep(scene, options, files, pool, context.obj)
        else:
            _single(scene, options, files, pool, context.obj)


@contextmanager
def _workers(options: Options) -> Iterator[Executor | None]:
    """A pool of processes or of cluster workers; None for a single process."""
    number = options.workers
    if options.dask is not None:
        if number is not None:
            raise ValueError("--workers and --dask: give one of them; the cluster has its own workers")
        with _dask_pool(options.dask, options.dask_tls) as cluster:
            yield cluster
        return
    if options.dask_tls is not None:
        raise ValueError("--dask-tls: goes with --dask, the address of a scheduler")
    if number is None or number == 1:
        yield None
        return
    from rotor.scenes.worker_processes import worker_processes

    with worker_processes(number) as pool:
        yield pool


@contextmanager
def _dask_pool(address: str, certificates: str | None) -> Iterator[Executor]:
    from contextlib import ExitStack

    from rotor.scenes.cluster import dask_executor, tls_security

    files = [] if certificates is None else certificates.split(",")
    if files and len(files) != 3:
        raise ValueError(f"--dask-tls {certificates}: expected three files: authority, certificate, key")
    with ExitStack() as stack:
        try:
            pool = stack.enter_context(dask_executor(address, tls_security(*files) if files else None))
        except ValueError as error:
            raise ValueError(f"--dask: {error}") from None
        yield pool


def _folder(options: Options) -> Path:
    return Path(options.scene).parent


def _single(scene: Scene, options: Options, files: Files, pool: Executor | None, command: str) -> None:
    from rotor.reports.progress import elapsed_time
    from rotor.scenes.run import run_scene

    with elapsed_time("computing"):
        result = run_scene(scene, folder=_folder(options), out=options.out, executor=pool)
    for remark in _notes(result):
        note(remark)
    _deliver(result, options, files, command)


def _deliver(result: SceneResult, options: Options, files: Files, command: str) -> None:
    """Print the report of the verb, then files and seconds of the run."""
    from rotor.reports.error_table import error_parts
    from rotor.scenes.calculation import Calculation

    scene, calculation = result.scene, Calculation(result.scene)
    verb = calculation.verb
    head = {"command": command, "input": options.scene, "scene": options.scene, "kind_of_scene": scene.kind}
    with answering():
        report = calculation.report(result.answer, head)
    content = {**report.content, **_run_facts(result)}

    def show() -> None:
        """The report, after the title of the scene."""
        if scene.title:
            print(scene.title)
        files_text = ", ".join(map(str, result.files)) or "none: [outputs] names none"
        run = [("files", files_text), ("seconds", f"{result.seconds:.3g}"), *_accuracy(result)]
        show_parts([*verb.show(result.answer, report), run, *(error_parts(content) if options.errors else [])])

    deliver(files, {}, lambda: verb.json(result.answer, content), show)


def _run_facts(result: SceneResult) -> dict[str, Any]:
    accuracy = None if result.reached is None else asdict(result.reached)
    return {"accuracy": accuracy, "seconds": result.seconds, "files": [str(path) for path in result.files]}


def _notes(result: SceneResult) -> list[str]:
    top = getattr(result.request, "top", None)
    facts = result.answer.facts()
    return list(dict.fromkeys([*(top.notes if top is not None else ()), *facts.get("notes", ())]))


def _accuracy(result: SceneResult) -> list[tuple[str, str]]:
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


def _sweep(scene: Scene, options: Options, files: Files, pool: Executor | None, command: str) -> None:
    import rotor
    from rotor.reports.progress import progress_bar
    from rotor.scenes.sweep import run_sweep

    record = options.record or str(Path(options.out) / f"{Path(options.scene).stem}.sweep.jsonl")
    start = time.monotonic()
    with progress_bar("points") as advance:
        result = run_sweep(
            scene,
            folder=_folder(options),
            out=options.out,
            record=record,
            executor=pool,
            retry_failed=options.retry_failed,
            progress=advance,
        )
    seconds = time.monotonic() - start
    head = {"rotor_version": rotor.__version__, "command": command, "scene": options.scene, "kind_of_scene": scene.kind}
    failed = [{"values": dict(point["values"]), "error": point["error"]} for point in result.failed]
    content = {**head, "record": record, "computed": result.computed, "failed": failed, "files": list(result.files)}
    text = lambda: json_with_rows(result, "points", content)  # noqa: E731
    deliver(files, {}, text, lambda: _show_sweep(result))
    print(_summary(result, record, seconds), file=sys.stderr)
    if failed:
        raise NoAnswerError(_failures(result, record))


def _summary(result: SweepResult, record: str, seconds: float) -> str:
    """One line: number of points, points computed now and before, failures."""
    before = len(result) - result.computed
    parts = [f"{result.computed} computed now in {seconds:.3g} s"]
    parts += [f"{before} done before ({record})"] if before else []
    parts += [f"{len(result.failed)} failed"] if result.failed else []
    return f"{counted(len(result), 'point')}: {', '.join(parts)}"


def _failures(result: SweepResult, record: str) -> str:
    """The failed points, grouped by reason."""
    from rotor.scenes.sweep.points import text_of

    reasons: dict[str, list[str]] = {}
    for point in result.failed:
        reasons.setdefault(point["error"], []).append(text_of(point["values"]))
    listed = [
        f"{'; '.join(points[:SHOWN_OF_REASON])}{' and others' if len(points) > SHOWN_OF_REASON else ''}: {reason}"
        for reason, points in reasons.items()
    ]
    more = f"; and {len(listed) - SHOWN} more reasons, see {record}" if len(listed) > SHOWN else ""
    hint = "--retry-failed runs them again"
    return (
        f"{counted(len(result.failed), 'point')} of {len(result)} failed ({hint}): {' | '.join(listed[:SHOWN])}{more}"
    )


def _show_sweep(result: SweepResult) -> None:
    show_table(_sampled_rows(result))


VERB = Tool(
    name="run",
    about="Run a scene, write the files that it names, and report; a sweep resumes where it stopped.",
    examples=EXAMPLES,
    request=Options,
    of="scene",
    answer=lambda request, work: None,
    show=lambda answer, report: (),
)
