"""Run a sweep: unfinished points are spread over an executor, and each is recorded once it has finished or failed."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from rotor.checks import NoAnswerError
from rotor.formats.atomic_write import FULL
from rotor.frozen import dataclass
from rotor.scenes.run import run_scene
from rotor.scenes.scene import Scene, checked_scene, scene_text
from rotor.scenes.sweep.combined import KEY_LENGTH, CombinedFile
from rotor.scenes.sweep.inputs import InputHashes
from rotor.scenes.sweep.points import Point, check_first, points
from rotor.scenes.sweep.record import Record, SweepResult, appended, read_records
from rotor.temporary import locked_file
from rotor.verbs.common.calculation import Outcome

AHEAD = 200  # submitted points that have not begun: workers never wait, and memory stays bounded


@dataclass(frozen=True)
class Job:
    """A point on its way to a worker."""

    key: str
    point: Point
    folder: str
    out: str
    combined: tuple[str, ...]


def run_sweep(
    scene: Scene,
    *,
    folder: str | os.PathLike[str] = ".",
    out: str | os.PathLike[str] = ".",
    record: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    retry_failed: bool = False,
    on_point: Callable[[Record], None] = lambda _: None,
    progress: Callable[[int, int], object] = lambda done, total: None,
) -> SweepResult:
    """Run the unfinished points of a sweep. A point that fails is recorded with its reason, and the others run.

    A point is finished if the record has its key (a hash of its scene, of the contents of the files that it reads, and of the version
    of the package) and its files exist.

    Parameters
    ----------
    scene : Scene
        With a sweep, or with a list of molecules as its molecule. Rows of all points go into one file where outputs.parquet or
        outputs.csv is a name without a swept key in braces.
    folder, out : path
        Folders of the files that are read and of those that are written.
    record : path, optional
        A file with a line for each finished point; locked during the run.
    executor : Executor, optional
        Shares the points: `rotor.scenes.worker_processes.WorkerProcesses`, or any other.
    retry_failed : bool, optional
        Run failed points of the record again.
    on_point : callable
        Called with the record of each finished point.
    progress : callable
        Called with the numbers of finished points and of all points.

    Returns
    -------
    SweepResult
        In the order of the points; `failed` has those that failed.

    Raises
    ------
    ValueError
        Before any point runs: for swept names that the scene does not have, and files that cannot be written.
    """
    checked_scene(scene)
    sweep = points(scene, folder)
    check_first(sweep, out)
    joined = CombinedFile.of(tuple(sweep.combined.values()), out)
    finished = 0
    with ExitStack() as stack:
        for path in (record, *(() if joined is None else joined.targets)):
            if path is not None:
                stack.enter_context(locked_file(path))
        done = dict(read_records(record))
        joined_keys = None if joined is None else joined.keys()
        keys: list[str] = []

        def missing() -> Iterator[Job]:
            """Jobs of the points without a result; finished points are counted on the way."""
            nonlocal finished
            hashes = InputHashes(folder)
            for point in sweep:
                key = hashes.key(point.content, point.values)
                keys.append(key)
                if _is_finished(done.get(key), retry_failed, joined_keys):
                    finished += 1
                    progress(finished, len(sweep))
                else:
                    yield Job(key, point, os.fspath(folder), os.fspath(out), tuple(sweep.combined.values()))
            if joined is not None and executor is not None:  # while others compute
                joined.load()

        if joined is not None:
            joined.open_folder()
        append, computed = stack.enter_context(appended(record)), 0
        for result in _computed(missing(), executor):
            done[result["key"]] = result
            append(result)
            computed, finished = computed + 1, finished + 1
            on_point(result)
            progress(finished, len(sweep))
        if joined is not None:
            joined.join([key for key in keys if "error" not in done[key]], scene_text(scene))
    combined = () if joined is None else tuple(target.resolve() for target in joined.targets)
    return SweepResult(tuple(done[key] for key in keys), computed, combined)


def _is_finished(record: Record | None, retry_failed: bool, joined_keys: set[str] | None) -> bool:
    """Whether a point is not run again: it failed before, or its files and its rows in the file of all points exist."""
    if record is None:
        return False
    if "error" in record:
        return not retry_failed
    has_rows = joined_keys is None or record["key"][:KEY_LENGTH] in joined_keys
    return has_rows and all(Path(file).is_file() for file in record["files"])


def _computed(jobs: Iterable[Job], executor: Executor | None) -> Iterator[Record]:
    """The records of all jobs, in the order in which they finish."""
    if executor is None:
        yield from map(run_point, jobs)
        return
    waiting: dict[Future[Record], Job] = {}
    done: SimpleQueue[Future[Record]] = SimpleQueue()  # a search among all waiting futures takes 1 ms a point
    try:
        for job in jobs:
            future = executor.submit(run_point, job)
            waiting[future] = job
            future.add_done_callback(done.put)
            while len(waiting) >= AHEAD or not done.empty():
                yield _record_of(ready := done.get(), waiting.pop(ready))
        while waiting:
            yield _record_of(ready := done.get(), waiting.pop(ready))
    finally:
        for future in waiting:
            future.cancel()


def _record_of(future: Future[Record], job: Job) -> Record:
    """The record of a finished job."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError):  # no further job can be submitted
        raise
    except OSError as error:  # a disk that is full, see run_point
        raise OSError(error.errno, error.strerror, error.filename) from error
    except Exception as error:  # the worker was killed, or the cluster has lost it
        return _failed(job, f"{error}" or type(error).__name__, 0.0)


def run_point(job: Job) -> Record:
    """Run a point and return its record, with the error if it fails.

    Raises OSError if the disk is full: then no other point can be written either.
    """
    start = time.perf_counter()
    try:
        result = run_scene(job.point.scene, folder=job.folder, out=job.out)
        files = [str(path.resolve()) for path in result.files]
        joined = CombinedFile.of(job.combined, job.out)
        if joined is not None:
            joined.write_part(job.key, job.point.values, result.table)
        results = _results(result)
    except (ValueError, NoAnswerError) as error:
        return _failed(job, str(error), time.perf_counter() - start)
    except MemoryError:
        return _failed(job, "not enough memory", time.perf_counter() - start)
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL:
            raise
        return _failed(job, f"{type(error).__name__}: {error}; this is a defect", time.perf_counter() - start)
    notes = getattr(getattr(result.request, "top", None), "notes", ())
    return {
        "key": job.key,
        "values": dict(job.point.values),
        "rows": len(result.table),
        "seconds": round(result.seconds, 6),
        "files": files,
        "results": results,
        **({"notes": list(notes)} if notes else {}),
    }


def _results(result: Outcome) -> dict[str, Any]:
    """The results of the verb that are finite numbers; none of an answer without rows."""
    numbers = result.verb.results(result.answer) if len(result.table) else {}
    plain = {name: value.item() if hasattr(value, "item") else value for name, value in numbers.items()}
    return {name: value for name, value in plain.items() if value is not None and math.isfinite(value)}


def _failed(job: Job, reason: str, seconds: float) -> Record:
    return {"key": job.key, "values": dict(job.point.values), "seconds": round(seconds, 6), "error": reason}
