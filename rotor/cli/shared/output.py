"""Output of a command: notes, JSON, and files that are written together or not at all."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import field
from pathlib import Path

from rotor.checks import NoAnswerError
from rotor.frozen import dataclass
from rotor.temporary import locked_file

Writer = Callable[[Path], None]
_HELD = ExitStack()  # locks of the files that the command will write


def release_files() -> None:
    """Release the locks of the files at the end of a command."""
    _HELD.close()


def at_end(done: Callable[[], object]) -> None:
    """Call a function at the end of the command."""
    _HELD.callback(done)


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

    def add_json(self, path: str | None) -> None:
        """Add the JSON: to a file, or to standard output (`-`)."""
        if path == "-":
            self.on_screen.add("json")
        else:
            self.add("json", "--json", path, (".json",))

    def add(self, name: str, option: str, path: str | None, suffixes: Sequence[str]) -> None:
        """Add a file; ValueError for a suffix that the option does not write, and for a folder that is missing or closed."""
        if path is None:
            return
        from rotor.formats.atomic_write import check_target, resolved

        target = Path(path)
        try:
            end = check_target(target, suffixes)
        except ValueError as error:
            raise ValueError(f"{option} {error}") from None
        if any(end == resolved(other) for others in self.paths.values() for other in others):
            raise ValueError(f"{option} {path}: another option writes the same file")
        _HELD.enter_context(locked_file(end))
        self.paths[name] = (*self.paths.get(name, ()), target)
        self.flags[name] = option

    def write(self, writers: Mapping[str, Writer]) -> list[str]:
        """Write all files into folders beside their places, then rename them: all appear, or none.

        Returns the reasons for files that are left out because their format cannot hold the result.
        """
        from rotor.formats.atomic_write import write_together

        names = {path: name for name in self.pending for path in self.paths[name]}
        flags = {path: self.flags[name] for path, name in names.items()}
        by_path = {path: writers[name] for path, name in names.items()}
        left_out = write_together(by_path, called=lambda path: f"{flags[path]} {path}", leave_out=True)
        return [f"{flags[path]}: {path} is not written: {error}" for path, error in left_out.items()]


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
