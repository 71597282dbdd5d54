"""Locked folders for unfinished work, and locked files: a lock lasts as long as its process.

A killed process leaves its folder behind. The next process that makes a folder of the same kind in the same place finds it unlocked and
removes it.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def locked_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """A new locked folder in `parent` whose name begins with `prefix`; removed at the end. Abandoned folders are removed first.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as place, locked_folder(Path(place), "work-") as folder:
    ...     folder.name.startswith("work-"), folder.is_dir()
    (True, True)
    """
    _remove_abandoned(parent, prefix)
    folder, lock = _locked_folder(parent, prefix)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _locked_folder(parent: Path, prefix: str) -> tuple[Path, int | None]:
    """The folder and its lock; repeated if another process takes the folder as abandoned before it is locked."""
    while True:
        folder = parent / f"{prefix}{os.urandom(8).hex()}"  # as tempfile.mkdtemp, which takes 2 ms to load
        folder.mkdir(0o700)
        try:
            lock = _lock(folder)
        except BlockingIOError:  # that process removes it now
            continue
        if folder.exists():
            return folder, lock
        if lock is not None:
            os.close(lock)


def _lock(folder: Path) -> int | None:
    """An open descriptor that holds the lock of a folder; None if it is gone, or without file locks.

    Raises BlockingIOError if another process holds the lock.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    handle = None
    try:
        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if handle is not None:
            os.close(handle)
        if isinstance(error, BlockingIOError):
            raise
        return None
    return handle


def _remove_abandoned(parent: Path, prefix: str) -> None:
    """Remove folders and lock files of killed processes; those in use are locked."""
    with suppress(OSError):  # the folder cannot be listed
        for folder in filter(_is_ours, parent.glob(f"{prefix}*")):
            with suppress(BlockingIOError):
                _remove_unlocked(folder)


def _remove_unlocked(folder: Path) -> None:
    """Remove a folder or lock file; BlockingIOError if it is in use."""
    lock = _lock(folder)
    if lock is None:
        return
    if folder.is_dir():
        shutil.rmtree(folder, ignore_errors=True)
    else:
        folder.unlink(missing_ok=True)
    os.close(lock)


def _is_ours(path: Path) -> bool:
    """Whether this is a folder or a lock file, not a link."""
    return not path.is_symlink() and (path.is_dir() or path.name.startswith(_LOCK))


@contextmanager
def locked_file(path: str | os.PathLike[str]) -> Iterator[None]:
    """Hold the right to write a file until the end of the context.

    The lock is a small file beside it, `.rotor-lock-NAME`, which disappears with its process. A pipe or device needs none; file systems
    without locks have none.

    Raises ValueError, with the number of its process, if another run holds the lock.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, locked_file(Path(folder) / "a.csv"):
    ...     [path.name for path in Path(folder).iterdir()]
    ['.rotor-lock-a.csv']
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        yield
        return
    lock = target.parent / f"{_LOCK}{target.name}"
    if len(os.fsencode(lock.name)) > _LONGEST_NAME:
        import hashlib

        lock = lock.with_name(f"{_LOCK}{hashlib.sha256(os.fsencode(target.name)).hexdigest()}")
    handle = _locked_handle(lock, path)
    try:
        yield
    finally:
        if handle is not None:
            with suppress(OSError):
                lock.unlink()
            os.close(handle)


_LOCK = ".rotor-lock-"
_LONGEST_NAME = 255  # bytes, on the usual file systems


def _locked_handle(lock: Path, path: str | os.PathLike[str]) -> int | None:
    """An open descriptor with the lock of a file; None without file locks, or if the folder is not writable."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    while True:
        try:
            handle = os.open(lock, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        except OSError:  # the folder is not writable: writing the file will fail with the reason
            return None
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.read(handle, 20).decode("ascii", "replace").strip()
            os.close(handle)
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                return None
            process = f" (process {holder})" if holder else ""
            raise ValueError(
                f"{os.fspath(path)}: another run{process} is writing this file; wait for it, or give another name"
            ) from None
        if _is_same_file(handle, lock):
            os.ftruncate(handle, 0)
            os.write(handle, str(os.getpid()).encode("ascii"))
            return handle
        os.close(handle)  # the previous run just ended and removed its lock


def _is_same_file(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except OSError:
        return False
