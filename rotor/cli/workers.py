"""The processes of --workers, with a bar; apart, since concurrent.futures costs milliseconds that most commands need not spend."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from typing import Any

from rotor.reports.progress import progress_bar


@contextmanager
def working(workers: int, what: str) -> Iterator[Executor | None]:
    """An executor with a bar on standard error; None for one worker without a terminal."""
    from rotor.scenes.worker_processes import WorkerProcesses

    with ExitStack() as stack:
        pool = None if workers == 1 else stack.enter_context(WorkerProcesses(workers))
        advance = stack.enter_context(progress_bar(what)) if sys.stderr.isatty() else None
        yield Counted(pool, advance) if pool or advance else None


class Counted(Executor):
    """An executor, or this process if it is None, that reports the number of finished pieces of a `map`, the one way it is used."""

    def __init__(self, pool: Executor | None, advance: Callable[[int, int], object] | None) -> None:
        self._pool, self._advance = pool, advance

    def map(
        self, fn: Callable[..., Any], *iterables: Iterable[Any], timeout: float | None = None, chunksize: int = 1
    ) -> Iterator[Any]:
        """`map` of all pieces in order."""
        pieces = list(zip(*iterables, strict=False))
        results = (
            self._pool.map(fn, *zip(*pieces, strict=True), timeout=timeout, chunksize=chunksize)
            if self._pool is not None and pieces
            else (fn(*piece) for piece in pieces)
        )
        for done, result in enumerate(results, 1):
            if self._advance is not None:
                self._advance(done, len(pieces))
            yield result
