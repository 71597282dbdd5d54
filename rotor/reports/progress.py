"""How far a calculation is, on standard error, where that is a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def sum_progress() -> Callable[[int, int], None] | None:
    """A line on a terminal, rewritten as a sum over levels goes on, for sums that take longer than two seconds; else None."""
    if not sys.stderr.isatty():
        return None
    start = time.monotonic()

    def show(j: int, last: int) -> None:
        """How far the levels are solved, after two seconds."""
        if time.monotonic() - start > 2.0:
            print(f"\rlevels solved to J = {j} of about {last} ", end="", file=sys.stderr, flush=True)

    return show


@contextmanager
def counting(total: int, what: str) -> Iterator[Callable[[int], object] | None]:
    """What advances a bar on standard error; None where that is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn(what), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.advance(task, done)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], object]]:
    """On a terminal, a bar on standard error: so many pieces of so many are done, the time until now and the time left."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, total: None
        return
    left = (TextColumn("left"), TimeRemainingColumn())
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn(what), TimeElapsedColumn(), *left)
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
