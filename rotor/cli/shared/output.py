"""Output of a command: notes, JSON, and files that are written together or not at all."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rotor.checks import NoAnswerError
from rotor.temporary import locked_file

Writer = Callable[[Path], None]
_HELD = ExitStack()  # locks of the files that the command will write


def release_files() -> None:
    """Release the locks of the files at the end of a command."""
    _HELD.close()


def at_end(done: Callable[[], object]) -> None:
    """Call a function at the end of the command."""
    _HELD.callback(done)


@contextmanager
def answering() -> Iterator[None]:
    """Context in which a ValueError is no mistake of the user, whose input has been checked: it becomes a NoAnswerError."""
    try:
        yield
    except ValueError as error:
        raise NoAnswerError(str(error)) from error
    except MemoryError as error:
        raise NoAnswerError(
            "not enough memory for so many lines; a lower J max, a range or a higher cut needs less"
        ) from error


def note(text: str) -> None:
    """Print a remark on standard error."""
    print("note:", text, file=sys.stderr)


@dataclass(frozen=True)
class Files:
    """Requested files by the name of the output: checked before the work, written together after it.

    flags: their options. growing: outputs that are written during the work. on_screen: outputs that go to standard output.
    """

    paths: dict[str, tuple[Path, ...]] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)
    growing: set[str] = field(default_factory=set)
    on_screen: set[str] = field(default_factory=set)

    @property
    def names(self) -> list[str]:
        """The paths as texts; those of growing files first."""
        ordered = sorted(self.paths, key=lambda name: name not in self.growing)
        return [str(path) for name in ordered for path in self.paths[name]]

    @property
    def pending(self) -> list[str]:
        """The outputs that are written after the work."""
        return [name for name in self.paths if name not in self.growing]

    def ask_json(self, path: str | None) -> None:
        """Add the JSON: to a file, or to standard output (`-`)."""
        if path == "-":
            self.on_screen.add("json")
        else:
            self.ask("json", "--json", path, (".json",))

    def ask(self, name: str, option: str, path: str | None, suffixes: Sequence[str]) -> None:
        """Add a file; ValueError for a suffix that the option does not write, and for a folder that is missing or closed."""
        if path is None:
            return
        target = Path(path)
        if not target.name.lower().endswith(tuple(suffixes)):
            raise ValueError(f"{option} {path}: the name must end in {' or '.join(suffixes)}")
        end = _resolved(option, target)
        if target.is_dir():
            raise ValueError(f"{option} {path}: is a folder; give the name of a file to write")
        if not target.parent.is_dir():
            raise ValueError(f"{option} {path}: there is no folder {target.parent}; make it first")
        if not os.access(target.parent, os.W_OK):
            raise ValueError(f"{option} {path}: cannot write in {target.parent}: no permission")
        if any(end == _resolved(option, other) for others in self.paths.values() for other in others):
            raise ValueError(f"{option} {path}: another option writes the same file")
        _HELD.enter_context(locked_file(end))
        self.paths[name] = (*self.paths.get(name, ()), target)
        self.flags[name] = option

    def write(self, writers: Mapping[str, Writer]) -> list[str]:
        """Write all files into folders beside their places, then rename them: all appear, or none.

        Returns the reasons for files that are left out because their format cannot hold the result.
        """
        from rotor.formats.atomic_write import FULL, DoesNotFitError, naming, place, unfinished_folder

        left_out = list[str]()
        with ExitStack() as stack:
            moves: list[tuple[Path, Path]] = []
            for name, target in ((output, path) for output in self.pending for path in self.paths[output]):
                option = self.flags[name]
                try:
                    folder = stack.enter_context(unfinished_folder(target.parent))
                except OSError as error:
                    if error.errno in FULL:
                        raise OSError(error.errno, error.strerror, str(target)) from error
                    raise ValueError(f"{option} {target}: cannot write in {target.parent}: {error.strerror}") from None
                try:
                    with naming(target):
                        writers[name](folder / target.name)
                except DoesNotFitError as error:
                    left_out.append(f"{option}: {target} is not written: {error}")
                    continue
                moves += [(file, target.parent / file.name) for file in sorted(folder.iterdir())]
            for file, path in moves:
                place(file, path)
        return left_out


def _resolved(option: str, path: Path) -> Path:
    from rotor.formats.atomic_write import resolved

    try:
        return resolved(path)
    except ValueError as error:
        raise ValueError(f"{option} {error}") from None


def deliver(files: Files, writers: Mapping[str, Writer], json: Callable[[], str], show: Callable[[], None]) -> None:
    """Write all files, the JSON among them, then print the JSON if requested, else the report by `show`.

    Raises NoAnswerError at the end for files whose format cannot hold the result.
    """
    left_out = files.write({**writers, "json": lambda path: write_text(path, json())})
    if files.on_screen:
        print(json(), end="")
    else:
        show()
    if left_out:
        raise NoAnswerError("; ".join(left_out))


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 with line feeds."""
    path.write_text(text, encoding="utf-8", newline="\n")
