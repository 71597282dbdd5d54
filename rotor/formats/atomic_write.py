"""Results are written beside and renamed: a reader of the path finds the whole file, the old one, or none.

What is not finished stands in a folder `.rotor-...` beside the result, locked as long as its process lives. A process that is
killed leaves its folder behind; the next one that writes there finds it unlocked and removes it.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any

from rotor.temporary import locked_folder

PREFIX = ".rotor-"
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # the disk, a quota, the largest file allowed, the device


class DoesNotFitError(ValueError):
    """A result that the format of one file cannot hold; files of other formats are written all the same."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path to write to, in a folder of its own beside; moved to `path` when the block ends, removed when it fails.

    A link is followed, so that the file it names is replaced and the link stays. What is no regular file (a pipe,
    a device such as /dev/null) cannot be renamed over and is used as it is.

    Raises FileNotFoundError when the folder does not exist, IsADirectoryError when `path` is a folder.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_path(Path(folder) / "a.txt") as unfinished:
    ...         _ = unfinished.write_text("whole")
    ...     [(file.name, file.read_text()) for file in Path(folder).iterdir()]
    [('a.txt', 'whole')]
    """
    target = resolved(path)
    if target.is_dir():
        raise IsADirectoryError(f"{path}: is a folder; give the name of a file to write")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {target.parent}; make it first")
    with naming(path):
        if target.exists() and not target.is_file():
            yield target
            return
        with unfinished_folder(target.parent) as folder:
            unfinished = folder / target.name
            yield unfinished
            os.replace(unfinished, target)


@contextmanager
def open_atomic(path: str | os.PathLike[str], mode: str = "wb", **options: Any) -> Iterator[IO[Any]]:
    """An open file, text or binary by `mode`, that takes the place of `path` when the block ends without an error.

    `options` are those of `open`, such as `encoding` and `newline`.
    """
    with atomic_path(path) as unfinished, open(unfinished, mode, **options) as handle:
        yield handle


@contextmanager
def naming(path: str | os.PathLike[str]) -> Iterator[None]:
    """Inside, an OSError of writing names this path, not the unfinished file; a library's own error of a full disk is one too."""
    try:
        yield
    except Exception as error:
        code = error.errno if isinstance(error, OSError) and error.errno else _code_of_full_disk(str(error))
        if code is None:
            raise
        raise OSError(code, os.strerror(code), os.fspath(path)) from error


def _code_of_full_disk(text: str) -> int | None:
    """The number of the system's error that a library's own text names."""
    return next((code for code in FULL if os.strerror(code) in text or f'"errno":"{code}"' in text), None)


def resolved(path: str | os.PathLike[str]) -> Path:
    """The path that links lead to; ValueError where they lead in a circle."""
    try:
        os.stat(path)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise ValueError(
                f"{os.fspath(path)}: is a link that leads back to itself; remove it or name a file"
            ) from None
    return Path(os.path.realpath(path))


def place(made: Path, path: Path) -> None:
    """Move a finished file to its place, through links, into a device or a pipe, and onto another file system."""
    target = resolved(path)
    replaces = target.is_file() or not target.exists()
    if replaces and made.stat().st_dev == target.parent.stat().st_dev:
        with naming(path):
            os.replace(made, target)
        return
    with atomic_path(path) as unfinished, open(made, "rb") as source, open(unfinished, "wb") as copy:
        shutil.copyfileobj(source, copy)


def unfinished_folder(parent: Path) -> AbstractContextManager[Path]:
    """A new folder in `parent`, locked and at the end removed; those of processes that were killed are removed first."""
    return locked_folder(parent, PREFIX)


def write_together(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Write several files, each by its writer of a path: all appear at the end, with what a writer puts beside them, or none.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_together({Path(folder) / "a.txt": lambda path: path.write_text("whole")})
    ...     (Path(folder) / "a.txt").read_text()
    'whole'
    """
    with ExitStack() as stack:
        moves: list[tuple[Path, Path]] = []
        for target, write in writers.items():
            beside = stack.enter_context(unfinished_folder(target.parent))
            with naming(target):
                write(beside / target.name)
            moves += [(made, target.parent / made.name) for made in sorted(beside.iterdir())]
        for made, path in moves:
            place(made, path)
