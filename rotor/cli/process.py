"""The process of a command: its settings, made by the console script alone and not by `rotor.cli.run`, and what is released at its end."""

from __future__ import annotations

import atexit
import gc
import os
import sys
import threading
from contextlib import ExitStack, suppress
from typing import NoReturn

HELD = ExitStack()  # what is released at the end of the command: locks of the files that it will write, a session
_OWN = False  # set by the console script
_ALLOCATIONS = 50_000  # objects between two searches for cycles; Python's 700 take 5 to 15 % of a prediction


def begin() -> None:
    """Mark the process as that of the command. Garbage collection waits until the work begins: modules stay loaded."""
    global _OWN
    _OWN = True
    gc.disable()
    _open_missing_streams()


def _open_missing_streams() -> None:
    """Open the null device for standard streams that were closed before the start.

    Otherwise the next opened file would take their numbers, and output would go into it or fail.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):  # in the order of their numbers
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # for as long as the process lives


def begin_work() -> None:
    """Exempt loaded modules from garbage collection, and start it."""
    if _OWN:
        gc.freeze()
        gc.set_threshold(_ALLOCATIONS)
        gc.enable()


def end(code: int) -> NoReturn:
    """End the process with this exit code, without the release of modules and arrays, which takes 0.02 to 0.04 s.

    Functions registered with atexit run, and output is flushed. With running threads, a debugger, a profiler or a measurement of
    coverage, Python ends as usual.
    """
    if not _OWN or threading.active_count() > 1 or sys.gettrace() is not None or sys.getprofile() is not None:
        sys.exit(code)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # of an output that is full or closed: `run` has said so
            stream.flush()
    os._exit(code)


def leave_compiler_out() -> None:
    """Run kernels as plain Python: for short work, compiling them would take seconds.

    Numba reads its variable when it is loaded. No effect if it is loaded already, or in the process of another program.
    """
    if _OWN and "numba" not in sys.modules:
        os.environ["NUMBA_DISABLE_JIT"] = "1"


_ONE_THREAD_TO = 200  # the highest J up to which products of blocks take less than a fifth of the time of a list


def one_thread_of_blas(jmax: int | None = None) -> None:
    """Limit OpenBLAS to one thread: for small blocks several wait for each other, on a busy machine ten times as long.

    OpenBLAS reads its variable when numpy is loaded. No effect if numpy is loaded already, if the user has set the variable, for J
    beyond 200, or in the process of another program.
    """
    if _OWN and "numpy" not in sys.modules and (jmax is None or jmax <= _ONE_THREAD_TO):
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
