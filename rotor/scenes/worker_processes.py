"""Independent worker processes: one that is killed loses only its current piece of work.

A `ProcessPoolExecutor` breaks for good when one of its processes ends, for instance killed for lack of memory. Here each process is a
pool of one, which is restarted. Each uses one BLAS thread, since several processes with several threads wait for each other.

On Linux a server imports the common modules once, and the processes are forked from it; elsewhere each process imports them. The server
can start before anything else of a command is loaded (`start_ahead`).
"""

from __future__ import annotations

import gc
import os
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
_STARTING = threading.Lock()  # guards os.environ, which all threads share
_METHOD = "forkserver" if sys.platform == "linux" else "spawn"  # a fork after imports is not safe on macOS
_COMMON = (
    "rotor.scenes.sweep.run",
    "rotor.formats.read_write",
    "rotor.formats.tables",
    "rotor.molecules.bonds",
    "rotor.quantum.estimates.budgets",
    "rotor.quantum.effects.of_top",
    "rotor.tops.plausible",
)
_SMILES_MODULES = (
    "rdkit.Chem",
    "rdkit.Chem.rdDistGeom",
    "rdkit.Chem.rdForceFieldHelpers",
    "rotor.molecules.readers.smiles",
    "rotor.molecules.readers.read",
    "rotor.molecules.symmetry.point_group",
    "rotor.tops.spins.spin_statistics",
)


class WorkerKilledError(RuntimeError):
    """A worker process ended before its piece was done."""


class WorkerProcesses(Executor):
    """An executor of processes that do not depend on each other, until the end of its context; an error or Ctrl-C ends them at once."""

    def __init__(self, number: int) -> None:
        """Start `number` processes."""
        self._threads = ThreadPoolExecutor(number)
        self._free: SimpleQueue[ProcessPoolExecutor] = SimpleQueue()
        self._ended = False
        self._pools = {_started_process() for _ in range(number)}
        for pool in self._pools:
            self._free.put(pool)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call in the next free process; the future raises WorkerKilledError if that process ends."""
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
        """End the processes after all submitted calls, or with cancel_futures after the running ones."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        for pool in tuple(self._pools):
            pool.shutdown(wait, cancel_futures=cancel_futures)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        (self.shutdown if kind is None else self.terminate)()

    def terminate(self) -> None:
        """End the processes at once; their current pieces are lost."""
        self._ended = True
        self._threads.shutdown(wait=False, cancel_futures=True)
        for pool in tuple(self._pools):
            for process in (getattr(pool, "_processes", None) or {}).values():  # public from Python 3.14 on
                process.terminate()
        self.shutdown()


def start_ahead(scene_text: str = "") -> None:
    """Start the server that imports the modules of a scene's calculation, if the platform has one, without waiting for it.

    scene_text: of the scene file; its kind and molecules decide on further modules. Modules that cannot be imported are left to the
    work itself. No effect once the server runs.
    """
    if _METHOD != "forkserver":
        return
    from multiprocessing import forkserver

    from rotor.verbs import kind_in

    kinds = tuple(f"rotor.verbs.{name}" for name in [kind_in(scene_text)] if name)
    smiles = (
        _SMILES_MODULES
        if any(sign in scene_text for sign in ("SMILES:", "InChI=", ".csv", ".smi", ".sdf", ".mol"))
        else ()
    )
    forkserver.set_forkserver_preload([*_COMMON, *kinds, *smiles])
    with _one_thread():
        forkserver.ensure_running()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Context in which started processes have one BLAS thread."""
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
    """A pool of one running process with one BLAS thread."""
    start_ahead()
    pool = ProcessPoolExecutor(
        1, mp_context=get_context(_METHOD), initializer=_begin, initargs=(_environment(), gc.get_threshold())
    )
    with _one_thread():
        try:
            pool.submit(_nothing)
        except (EOFError, ConnectionError):  # the server was killed; submit starts another
            pool.submit(_nothing)
    return pool


def _nothing() -> None:
    """First piece of work: submitting it starts the process."""


def _environment() -> dict[str, str]:
    """This process's environment, with one BLAS thread; the server holds an older copy."""
    return {**os.environ, **dict.fromkeys(_ONE_THREAD, "1")}


def _begin(environment: dict[str, str], threshold: tuple[int, int, int]) -> None:
    """Take over the parent's environment and its threshold of garbage collection (Python's default costs 5 to 15 % of a point).

    Ctrl-C reaches all processes of a terminal, so workers ignore it: the parent ends them, and they end with it.
    """
    os.environ.clear()
    os.environ.update(environment)
    gc.freeze()  # exempt imported modules from garbage collection
    gc.set_threshold(*threshold)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end_with_parent() -> None:
    """Wait for the end of the parent process, then exit; an orphaned worker would wait for work forever."""
    if (parent := parent_process()) is not None:
        parent.join()
        os._exit(1)
