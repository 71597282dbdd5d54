"""Output of a command: notes, JSON and files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.checks import NoAnswerError

if TYPE_CHECKING:  # the command line starts without numpy
    from rotor.verbs.outputs import Files

HELD = ExitStack()  # locks of the files that the command will write


def release_files() -> None:
    """Release the locks of the files at the end of a command."""
    HELD.close()


def at_end(done: Callable[[], object]) -> None:
    """Call a function at the end of the command."""
    HELD.callback(done)


def note(text: str) -> None:
    """Print a remark on standard error."""
    print("note:", text, file=sys.stderr)


def deliver(
    files: Files, writers: Mapping[str, Callable[[Path], None]], json: Callable[[], str], show: Callable[[], None]
) -> None:
    """Write all files, the JSON among them, then print the JSON or the table that goes to standard output, else the report by `show`.

    Raises NoAnswerError at the end for files whose format cannot hold the result.
    """
    left_out = files.write({**writers, "json": lambda path: write_text(path, json())}, leave_out=True)
    try:
        if not files.on_screen:
            show()
        elif files.on_screen == ["json"]:
            print(json(), end="")
        else:
            print_table(writers[files.on_screen[0]])
    except KeyboardInterrupt as stop:
        written = f"; {', '.join(files.names)}: written before" if files.names else ""
        raise KeyboardInterrupt(*stop.args or (f"interrupted while the report was printed{written}",)) from None
    if left_out:
        raise NoAnswerError("; ".join(left_out))


def print_table(write: Callable[[Path], None]) -> None:
    """Print what a function writes as CSV."""
    from shutil import copyfileobj
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        path = Path(folder, "table.csv")
        write(path)
        with path.open(encoding="utf-8", newline="") as lines:
            copyfileobj(lines, sys.stdout)


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 with line feeds."""
    path.write_text(text, encoding="utf-8", newline="\n")
