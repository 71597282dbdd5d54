"""Processes that share work, each on its own: one that is killed costs the piece that it was at, not the others.

A `ProcessPoolExecutor` is broken for good when one of its processes ends, as the system ends one that takes too much memory. Here every
process is a pool of one, which is started again. Each takes one thread of BLAS: several processes of several threads wait for each other.

On Linux the modules of the work are imported once, by a server from which the processes are forked; elsewhere by each of them. The server
can start before anything else of a command is loaded (`start_ahead`).
"""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process
from queue import SimpleQueue
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_STARTING = threading.Lock()  # the environment is that of the whole process
_METHOD = "forkserver" if sys.platform == "linux" else "spawn"  # a fork after imports is not safe on macOS
_COMMON = (
    "rotor.scenes.sweep.run",
    "rotor.formats.read_write",
    "rotor.formats.tables",
    "rotor.quantum.estimates.budgets",
)
_OF_SMILES = ("rdkit.Chem", "rdkit.Chem.rdDistGeom", "rdkit.Chem.rdForceFieldHelpers", "rotor.molecules.readers.smiles")
_KIND = re.compile(r"""\bkind"?\s*[=:]\s*["'](\w+)["']""")


class WorkerKilledError(RuntimeError):
    """The process that computed a piece has ended before it was done."""


class WorkerProcesses(Executor):
    """An executor of processes that do not depend on each other."""

    def __init__(self, number: int) -> None:
        """So many processes."""
        self._threads = ThreadPoolExecutor(number)
        self._free: SimpleQueue[ProcessPoolExecutor] = SimpleQueue()
        self._ended = False
        self._pools = {_started_process() for _ in range(number)}
        for pool in self._pools:
            self._free.put(pool)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """One call, in the next process that is free; its future has WorkerKilledError where that process ends."""
        return self._threads.submit(self._call, fn, args, kwargs)

    def _call(self, fn: Callable[..., T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> T:
        pool = self._free.get()
        try:
            return pool.submit(fn, *args, **kwargs).result()
        except BrokenProcessPool:
            self._pools.discard(pool)
            pool.shutdown(wait=False)
            if not self._ended:
                pool = _started_process()
                self._pools.add(pool)
            raise WorkerKilledError("its process was ended from outside, as by lack of memory") from None
        finally:
            self._free.put(pool)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes when they have done what was submitted, or, of that, only what has begun."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        for pool in tuple(self._pools):
            pool.shutdown(wait, cancel_futures=cancel_futures)

    def terminate(self) -> None:
        """End the processes now; what they were at is lost."""
        self._ended = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for pool in tuple(self._pools):
            for process in (getattr(pool, "_processes", None) or {}).values():  # public from Python 3.14 on
                process.terminate()
        self.shutdown()


@contextmanager
def worker_processes(number: int) -> Iterator[WorkerProcesses]:
    """So many processes until the end of the context; where it ends with an error or Ctrl-C, they are ended at once."""
    pool = WorkerProcesses(number)
    try:
        yield pool
    except BaseException:
        pool.terminate()
        raise
    pool.shutdown()


def start_ahead(scene_text: str = "") -> None:
    """Begin the server that imports what computing a scene needs, where there is one, and do not wait for it.

    scene_text: of its file; what it needs beyond the rest, by its kind and by what names its molecules. Modules that cannot be imported
    are left to the work itself. Without effect once the server runs.
    """
    if _METHOD != "forkserver":
        return
    from multiprocessing import forkserver

    kinds = tuple(f"rotor.verbs.{name}" for name in _KIND.findall(scene_text)[:1])
    smiles = _OF_SMILES if any(sign in scene_text for sign in ("SMILES:", ".csv", ".sdf", ".mol")) else ()
    forkserver.set_forkserver_preload([*_COMMON, *kinds, *smiles])
    with _one_thread():
        forkserver.ensure_running()


@contextmanager
def _one_thread() -> Iterator[None]:
    """One thread of BLAS for processes that start inside."""
    with _STARTING:
        before = {name: os.environ.get(name) for name in _ONE_THREAD}
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


def _started_process() -> ProcessPoolExecutor:
    """A pool of one process that has started with one thread of BLAS, whatever this process has."""
    start_ahead()
    pool = ProcessPoolExecutor(
        1, mp_context=get_context(_METHOD), initializer=_begin, initargs=(_environment(), gc.get_threshold())
    )
    with _one_thread():
        try:
            pool.submit(_nothing)
        except (EOFError, ConnectionError):  # the server was ended from outside; another one is started
            pool.submit(_nothing)
    return pool


def _nothing() -> None:
    """The first piece: a process is started when it has one."""


def _environment() -> dict[str, str]:
    """That of this process with one thread of BLAS; a server has the environment of its own start."""
    return {**os.environ, **dict.fromkeys(_ONE_THREAD, "1")}


def _begin(environment: dict[str, str], threshold: tuple[int, int, int]) -> None:
    """Take the environment of the process that began, and its threshold of the search for cycles, 5 to 15 % of a point at Python's.

    Ctrl-C reaches all processes of a terminal: the one that began ends the others, which end with it whatever ends it.
    """
    os.environ.clear()
    os.environ.update(environment)
    gc.freeze()  # modules stay: they are not searched for what is no longer used
    gc.set_threshold(*threshold)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end_with_parent() -> None:
    """Wait for the end of the process that began, and end this one; a worker alone would wait for pieces for ever."""
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)
