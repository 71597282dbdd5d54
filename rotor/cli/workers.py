"""The processes of --workers, with a bar; apart, since concurrent.futures costs milliseconds that most commands need not spend."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from rotor.reports.progress import progress_bar


@contextmanager
def working(workers: int, what: str) -> Iterator[Executor | None]:
    """An executor with a bar on standard error; None for one worker without a terminal."""
    terminal = sys.stderr.isatty()
    if workers == 1:
        with progress_bar(what) if terminal else _nothing() as advance:
            yield Counted(None, advance) if advance else None
        return
    from rotor.scenes.worker_processes import worker_processes

    with worker_processes(workers) as pool, progress_bar(what) if terminal else _nothing() as advance:
        yield Counted(pool, advance)


@contextmanager
def _nothing() -> Iterator[None]:
    yield None


class Counted(Executor):
    """An executor, or this process if it is None, that reports the number of finished pieces of a `map`."""

    def __init__(self, pool: Executor | None, advance: Callable[[int, int], object] | None) -> None:
        self._pool, self._advance = pool, advance

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """One call, in the pool or at once."""
        if self._pool is not None:
            return self._pool.submit(fn, *args, **kwargs)
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future

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
