"""What a command may do only where the whole process is its own, not where another program calls `rotor.cli.run`."""

from __future__ import annotations

import atexit
import gc
import os
import sys
import threading
from contextlib import suppress
from typing import NoReturn

_OWN = False  # set by the console script
_ALLOCATIONS = 50_000  # objects between two searches for cycles; Python's 700 take 5 to 15 % of a prediction


def begin() -> None:
    """The process is that of the command. Until the work begins nothing is looked for that is no longer used: modules stay."""
    global _OWN
    _OWN = True
    gc.disable()
    _open_missing_streams()


def _open_missing_streams() -> None:
    """A standard stream that was closed before the start is the null device.

    Otherwise the next file that is opened would take its number, and what is printed would go there or fail.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):  # in the order of their numbers
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  # for as long as the process lives


def begin_work() -> None:
    """What is loaded stays; from here on memory that is no longer used is found again."""
    if _OWN:
        gc.freeze()
        gc.set_threshold(_ALLOCATIONS)
        gc.enable()


def end(code: int) -> NoReturn:
    """The process ends with this exit code, without taking modules and arrays apart one by one, which takes 0.02 to 0.04 s.

    What was registered for the end runs, and what was printed is written. Where threads still run, or a debugger, a profiler or a
    measurement of coverage looks on, Python ends as always.
    """
    if not _OWN or threading.active_count() > 1 or sys.gettrace() is not None or sys.getprofile() is not None:
        sys.exit(code)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # of an output that is full or closed: `run` has said so
            stream.flush()
    os._exit(code)


def leave_compiler_out() -> None:
    """For short work: kernels run as the plain Python that they are written in; compiling them would take seconds, once.

    Numba reads its variable when it is loaded; where it is already there, or the process is another program's, nothing changes.
    """
    if _OWN and "numba" not in sys.modules:
        os.environ["NUMBA_DISABLE_JIT"] = "1"


_ONE_THREAD_TO = 100  # the highest J up to which it was measured that one thread takes no longer


def one_thread_of_blas(jmax: int | None = None) -> None:
    """For small blocks: OpenBLAS takes one thread, as several only wait for each other, on a busy machine for ten times as long.

    OpenBLAS reads its variable when numpy is loaded; where it is already there, the user has set the variable, J goes beyond 100, or the
    process is another program's, nothing changes.
    """
    if _OWN and "numpy" not in sys.modules and (jmax is None or jmax <= _ONE_THREAD_TO):
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
