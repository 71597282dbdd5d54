"""Atomic writing of files: a result is written elsewhere and renamed, so that the path never holds a partial file.

Unfinished files are in a folder `.rotor-...` next to the result, locked while their process lives. A killed process leaves its folder; the
next process that writes there finds it unlocked and removes it.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any

from rotor.temporary import locked_folder

PREFIX = ".rotor-"
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # the disk, a quota, the largest file allowed, the device


class DoesNotFitError(ValueError):
    """A result that a format cannot hold; files of other formats are still written."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path to write to, in a separate folder; the file moves to `path` when the block ends, and is removed when it fails.

    A link is followed: its target is replaced and the link remains. Pipes and devices such as /dev/null cannot be replaced and are written
    directly.

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
    """An open file, text or binary by `mode`, that replaces `path` when the block ends without an error.

    `options` are those of `open`, such as `encoding` and `newline`.
    """
    with atomic_path(path) as unfinished, open(unfinished, mode, **options) as handle:
        yield handle


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file; an existing one is replaced at the end or not at all."""
    with open_atomic(path) as handle:
        handle.write(content)


@contextmanager
def naming(path: str | os.PathLike[str]) -> Iterator[None]:
    """Context in which an OSError names this path instead of the unfinished file; errors of libraries for a full disk are converted."""
    try:
        yield
    except Exception as error:
        code = error.errno if isinstance(error, OSError) and error.errno else _full_disk_code(str(error))
        if code is None:
            raise
        raise OSError(code, os.strerror(code), os.fspath(path)) from error


def _full_disk_code(text: str) -> int | None:
    """The number of the system error in the text of a library's error."""
    return next((code for code in FULL if os.strerror(code) in text or f'"errno":"{code}"' in text), None)


def resolved(path: str | os.PathLike[str]) -> Path:
    """The target of links; ValueError for circular links."""
    try:
        os.stat(path)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise ValueError(f"{os.fspath(path)}: is a link that points to itself; remove it or name a file") from None
    return Path(os.path.realpath(path))


def place(finished: Path, path: Path) -> None:
    """Move a finished file to its place, through links, into a device or a pipe, and onto another file system."""
    target = resolved(path)
    replaces = target.is_file() or not target.exists()
    if replaces and finished.stat().st_dev == target.parent.stat().st_dev:
        with naming(path):
            os.replace(finished, target)
        return
    with atomic_path(path) as unfinished, open(finished, "rb") as source, open(unfinished, "wb") as copy:
        shutil.copyfileobj(source, copy)


def unfinished_folder(parent: Path) -> AbstractContextManager[Path]:
    """A new locked folder in `parent`, removed at the end; folders of killed processes are removed first."""
    return locked_folder(parent, PREFIX)


def check_target(path: Path, suffixes: Sequence[str]) -> Path:
    """The target of links of a file to write; ValueError for another suffix, a folder, and a folder that is missing or closed.

    >>> check_target(Path("a.txt"), (".csv", ".parquet"))
    Traceback (most recent call last):
        ...
    ValueError: a.txt: the name must end in .csv or .parquet
    """
    if not path.name.lower().endswith(tuple(suffixes)):
        raise ValueError(f"{path}: the name must end in {' or '.join(suffixes)}")
    target = resolved(path)
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; give the name of a file to write")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}; make it first")
    if not os.access(path.parent, os.W_OK):
        raise ValueError(f"{path}: cannot write in {path.parent}: no permission")
    return target


def write_together(
    writers: Mapping[Path, Callable[[Path], object]], *, called: Callable[[Path], str] = str, leave_out: bool = False
) -> dict[Path, DoesNotFitError]:
    """Write several files, each by its writer: all appear at the end, with accompanying files, or none.

    called: name of a file in errors. leave_out: whether files whose format cannot hold the result are left out; their errors are returned.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_together({Path(folder) / "a.txt": lambda path: path.write_text("whole")})
    ...     (Path(folder) / "a.txt").read_text()
    {}
    'whole'
    """
    left_out: dict[Path, DoesNotFitError] = {}
    with ExitStack() as stack:
        moves: list[tuple[Path, Path]] = []
        for target, write in writers.items():
            try:
                beside = stack.enter_context(unfinished_folder(target.parent))
            except OSError as error:
                if error.errno in FULL:
                    raise OSError(error.errno, error.strerror, str(target)) from error
                raise ValueError(f"{called(target)}: cannot write in {target.parent}: {error.strerror}") from None
            try:
                with naming(target):
                    write(beside / target.name)
            except DoesNotFitError as error:
                if not leave_out:
                    raise
                left_out[target] = error
                continue
            moves += [(finished, target.parent / finished.name) for finished in sorted(beside.iterdir())]
        for finished, path in moves:
            place(finished, path)
    return left_out
