"""Results are written beside and renamed: a reader of the path finds the whole file, the old one, or none."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path in the same folder to write to; renamed to `path` when the block ends, removed when it fails.

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
    target = Path(path).resolve()
    if target.is_dir():
        raise IsADirectoryError(f"{path}: is a folder; give the name of a file to write")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {target.parent}; make it first")
    if target.exists() and not target.is_file():
        yield target
        return

    import secrets

    unfinished = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        yield unfinished
        os.replace(unfinished, target)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def open_atomic(path: str | os.PathLike[str], mode: str = "wb", **options: Any) -> Iterator[IO[Any]]:
    """An open file, text or binary by `mode`, that takes the place of `path` when the block ends without an error.

    `options` are those of `open`, such as `encoding` and `newline`.
    """
    with atomic_path(path) as unfinished, open(unfinished, mode, **options) as handle:
        yield handle


def write_together(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Write several files, each by its writer of a path: all appear at the end, with what a writer puts beside them, or none.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_together({Path(folder) / "a.txt": lambda path: path.write_text("whole")})
    ...     (Path(folder) / "a.txt").read_text()
    'whole'
    """
    import tempfile

    with ExitStack() as stack:
        moves: list[tuple[Path, Path]] = []
        for target, write in writers.items():
            beside = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix=".rotor-", dir=target.parent)))
            write(beside / target.name)
            moves += [(made, target.parent / made.name) for made in sorted(beside.iterdir())]
        for made, place in moves:
            os.replace(made, place.resolve())
