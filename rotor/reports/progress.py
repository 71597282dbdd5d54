"""How far a calculation is, on standard error, where that is a terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SHOW_AFTER_S = 2.0  # shorter work shows nothing


class _Shown:
    """What else shows how far the work is: bars that are open, and when a line was last written."""

    bars = 0
    last_line = -SHOW_AFTER_S


@contextmanager
def elapsed_time(what: str) -> Iterator[None]:
    """On a terminal, work that takes longer than two seconds shows its time, unless a bar or line of its own says how far it is."""
    if not sys.stderr.isatty():
        yield
        return
    start, ended, written = time.monotonic(), threading.Event(), threading.Event()

    def show() -> None:
        """The time every second, in one line."""
        pause = SHOW_AFTER_S
        while not ended.wait(pause):
            pause = min(1.0, SHOW_AFTER_S)
            if not _Shown.bars and time.monotonic() - _Shown.last_line > SHOW_AFTER_S:
                print(f"\r{what}: {time.monotonic() - start:.0f} s ", end="", file=sys.stderr, flush=True)
                written.set()

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        if written.is_set():
            print("\r\x1b[2K", end="", file=sys.stderr, flush=True)  # the line is empty again


@contextmanager
def _open_bar() -> Iterator[None]:
    _Shown.bars += 1
    try:
        yield
    finally:
        _Shown.bars -= 1


def sum_progress() -> Callable[[int, int], None] | None:
    """A line on a terminal, rewritten as a sum over levels goes on, for sums that take longer than two seconds; else None."""
    if not sys.stderr.isatty():
        return None
    start = time.monotonic()

    def show(j: int, last: int) -> None:
        """How far the levels are solved, after two seconds."""
        if time.monotonic() - start > SHOW_AFTER_S:
            _Shown.last_line = time.monotonic()
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
    with _open_bar(), Progress(*columns, console=Console(stderr=True), transient=True) as bar:
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
    with _open_bar(), Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
