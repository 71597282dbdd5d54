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
    """Write all files, the JSON among them, then print the JSON if requested, else the report by `show`.

    Raises NoAnswerError at the end for files whose format cannot hold the result.
    """
    left_out = files.write({**writers, "json": lambda path: write_text(path, json())}, leave_out=True)
    if files.on_screen:
        print(json(), end="")
    else:
        show()
    if left_out:
        raise NoAnswerError("; ".join(left_out))


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 with line feeds."""
    path.write_text(text, encoding="utf-8", newline="\n")
