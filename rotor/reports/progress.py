"""Progress displays on standard error; they appear only on a terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SHOW_AFTER_S = 2.0  # shorter work shows nothing


class _Display:
    """State shared by the displays: how many bars are open, and when a line was last written (s, monotonic clock)."""

    bars = 0
    last_line = -SHOW_AFTER_S


@contextmanager
def elapsed_time(what: str) -> Iterator[None]:
    """Show the elapsed time of work that takes longer than two seconds, unless a bar or a progress line is shown already.

    While kernels are compiled, the line says so.
    """
    if not sys.stderr.isatty():
        yield
        return
    start, ended, written = time.monotonic(), threading.Event(), threading.Event()

    def show() -> None:
        """Rewrite one line each second."""
        pause = SHOW_AFTER_S
        while not ended.wait(pause):
            pause = min(1.0, SHOW_AFTER_S)
            if not _Display.bars and time.monotonic() - _Display.last_line > SHOW_AFTER_S:
                text = "compiling, at the first use only" if _is_compiling() else what
                print(f"\r{text}: {time.monotonic() - start:.0f} s \x1b[K", end="", file=sys.stderr, flush=True)
                written.set()

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        if written.is_set():
            print("\r\x1b[2K", end="", file=sys.stderr, flush=True)  # clear the line


def _is_compiling() -> bool:
    """Whether a kernel is being compiled; does not load the compiler."""
    kernels = sys.modules.get("rotor.kernels")
    return kernels is not None and kernels.compilations.running > 0


@contextmanager
def _open_bar() -> Iterator[None]:
    _Display.bars += 1
    try:
        yield
    finally:
        _Display.bars -= 1


def sum_progress() -> Callable[[int, int], None] | None:
    """Callback that rewrites a line with the J solved so far, for sums longer than two seconds; None without a terminal."""
    if not sys.stderr.isatty():
        return None
    start = time.monotonic()

    def show(j: int, last: int) -> None:
        """Write J so far and the expected last J, once two seconds have passed."""
        if time.monotonic() - start > SHOW_AFTER_S:
            _Display.last_line = time.monotonic()
            print(f"\rlevels solved to J = {j} of about {last} ", end="", file=sys.stderr, flush=True)

    return show


@contextmanager
def rewritten_line(width: int) -> Iterator[Callable[[str], None]]:
    """Function that rewrites a line on standard error, which is cleared at the end; without a terminal, it does nothing."""
    if not sys.stderr.isatty():
        yield lambda text: None
        return
    yield lambda text: print(f"\r{text[-width:]:{width}s}", end="", file=sys.stderr)
    print("\r" + " " * width + "\r", end="", file=sys.stderr)


@contextmanager
def counting(total: int, what: str) -> Iterator[Callable[[int], object]]:
    """Function that advances a bar by a count."""
    done = 0
    with progress_bar(what) as show:

        def advance(count: int) -> None:
            """Show the count so far."""
            nonlocal done
            done += count
            show(done, total)

        yield advance


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], object]]:
    """Bar with pieces done, elapsed time and time left; call it with (done, total). It does nothing without a terminal."""
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
