"""Folders of unfinished work, locked as long as their process lives.

A process that is killed leaves its folder behind; the next one that makes one of the same kind in the same place finds it unlocked
and removes it.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def locked_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """A new folder in `parent` whose name begins with `prefix`, locked and at the end removed; abandoned ones are removed first.

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
    """The folder and its lock; made again where another process took it for abandoned before it was locked."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        lock = _lock(folder)
        if folder.exists():
            return folder, lock
        if lock is not None:
            os.close(lock)


def _lock(folder: Path) -> int | None:
    """An open descriptor that holds the lock of a folder; None where it is locked, gone, or the system has no such locks."""
    try:
        import fcntl
    except ImportError:  # not on Windows
        return None
    handle = None
    try:
        handle = os.open(folder, os.O_RDONLY)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if handle is not None:
            os.close(handle)
        return None
    return handle


def _remove_abandoned(parent: Path, prefix: str) -> None:
    """Remove the folders of killed processes; one that is in use is locked."""
    with suppress(OSError):  # a folder that cannot be listed has nothing that can be removed
        for folder in parent.glob(f"{prefix}*"):
            lock = _lock(folder) if folder.is_dir() and not folder.is_symlink() else None
            if lock is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(lock)
