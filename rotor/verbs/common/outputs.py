"""Files of a verb, written together or not at all, and the data of its report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.requests.field import OUTPUT, OUTPUTS, REQUIRED
from rotor.requests.fill import Entries
from rotor.requests.readers import Field, Names, Rule, Text
from rotor.temporary import locked_file

if TYPE_CHECKING:
    from concurrent.futures import Executor

PICTURES = (".png", ".pdf", ".svg")


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """Data of a report and its files.

    content: of the JSON. shown: display options. entries: as entered. provenance: of files. view: of a picture.
    sources: whether to print them in full. with_spins: the command that adds hyperfine structure.
    executor: shares the work of derived tables. cache: derived tables that several files need.
    """

    content: Mapping[str, Any]
    shown: Any
    entries: Entries = field(default_factory=Entries)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    view: Any = None
    sources: bool = False
    with_spins: str = ""
    executor: Executor | None = None
    cache: dict[str, Any] = field(default_factory=dict)

    @property
    def command(self) -> dict[str, Any]:
        """The provenance of pictures: the command or the scene alone."""
        return {name: self.provenance[name] for name in ("command", "scene") if name in self.provenance}

    @property
    def picture_options(self) -> Mapping[str, Any]:
        """The options of a picture that follow from its view."""
        from rotor.plots.view import WHOLE

        if isinstance(self.view, Mapping):
            return self.view
        return {} if self.view in (None, WHOLE) else {"view": self.view}


Writer = Callable[[Any, Path, Report], None]


@dataclass(frozen=True, eq=False, repr=False)
class Output:
    """A file that a verb writes.

    name: of the option, and of the key in [outputs]. write: by default writes the table in the format of the suffix.
    of: returns the written table, from the answer and its report, if it is not that of the verb. grows: written during the calculation.
    many: repeatable. scene: whether scenes have it too. required: whether the verb exists to write this file. rule: as of a field.
    """

    name: str
    suffixes: tuple[str, ...]
    help: str
    write: Writer | None = None
    example: str = ""
    of: Callable[[Any, Report], Any] | None = None
    option: str = ""
    grows: bool = False
    many: bool = False
    scene: bool = True
    required: bool = False
    rule: Rule | None = None

    @property
    def flag(self) -> str:
        """The option."""
        return self.option or "--" + self.name.replace("_", "-")

    @property
    def field(self) -> Field:
        """The option, and the key of a scene, as a field."""
        reader = Names("FILE") if self.many else Text(metavar="FILE")
        return Field(
            reader, self.help, f"{OUTPUTS}{self.name}", self.flag, common=True, example=[self.example] if self.many else self.example,
            panel=OUTPUT, default=REQUIRED if self.required else () if self.many else None, rule=self.rule,
        )  # fmt: skip


@dataclass(frozen=True)
class Files:
    """Requested files by the name of the output: checked before the work, written together after it.

    called: how errors name them. growing: outputs that are written during the work. on_screen: the output that goes to standard output
    in place of the report, if any.
    """

    paths: dict[str, tuple[Path, ...]] = field(default_factory=dict)
    called: dict[str, str] = field(default_factory=dict)
    growing: set[str] = field(default_factory=set)
    on_screen: list[str] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """The paths as texts; those of growing files first."""
        ordered = sorted(self.paths, key=lambda name: name not in self.growing)
        return [str(path) for name in ordered for path in self.paths[name]]

    @property
    def pending(self) -> list[str]:
        """The outputs that are written after the work."""
        return [name for name in self.paths if name not in self.growing]

    def add(self, name: str, called: str, path: str | Path, suffixes: Sequence[str]) -> None:
        """Add a file; ValueError for a suffix that the output does not write, and for a folder that is missing or closed."""
        from rotor.formats.atomic_write import check_target, resolved

        target = Path(path)
        try:
            end = check_target(target, suffixes)
        except ValueError as error:
            raise ValueError(f"{called} {error}") from None
        if any(end == resolved(other) for others in self.paths.values() for other in others):
            raise ValueError(f"{called} {path}: another output writes the same file")
        self.paths[name] = (*self.paths.get(name, ()), target)
        self.called[name] = called

    def lock(self, stack: ExitStack) -> None:
        """Keep other processes from writing the files until the stack is closed."""
        from rotor.formats.atomic_write import resolved

        for path in sorted(resolved(path) for paths in self.paths.values() for path in paths):
            stack.enter_context(locked_file(path))

    def write(self, writers: Mapping[str, Callable[[Path], object]], *, leave_out: bool = False) -> list[str]:
        """Write all files that do not grow into folders beside their places, then rename them: all appear, or none.

        leave_out: whether files whose format cannot hold the result are left out; the reasons are returned.
        """
        if not self.pending:  # nothing is loaded
            return []
        from rotor.formats.atomic_write import write_together

        names = {path: name for name in self.pending for path in self.paths[name]}
        by_path = {path: writers[name] for path, name in names.items()}
        left_out = write_together(
            by_path, called=lambda path: f"{self.called[names[path]]} {path}", leave_out=leave_out
        )
        return [
            f"{self.called[names[path]].rstrip(':')}: {path} is not written: {error}"
            for path, error in left_out.items()
        ]


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 with line feeds."""
    path.write_text(text, encoding="utf-8", newline="\n")


def table_file(
    name: str, what: str, example: str = "", of: Callable[[Any, Report], Any] | None = None, **more: Any
) -> Output:
    """Output for a table in the format that ends its name, such as csv, parquet or profile_csv."""
    kind = name.rpartition("_")[2]
    help_ = f"Write {what} as {'CSV' if kind == 'csv' else kind.title()}"
    return Output(name, (f".{kind}",), help_, example=example, of=of, **more)


def tables(what: str, stem: str, **more: Any) -> tuple[Output, Output]:
    """Outputs for a table as CSV and as Parquet. stem: of the file names in a template."""
    csv, parquet = (table_file(kind, what, f"{stem}.{kind}", **more) for kind in ("csv", "parquet"))
    return csv, parquet


def draw_answer(answer: Any, path: Path, report: Report, **options: Any) -> None:
    """Draw an answer, or an object of it. options: of the picture."""
    from rotor.plots.show import write_picture

    write_picture(answer, path, report.command, **report.picture_options, **options)


def drawing(**options: Callable[[Any, Report], Any]) -> Writer:
    """Function that draws an answer with options that follow from it and its report."""
    return lambda answer, path, report: draw_answer(
        answer, path, report, **{name: option(answer, report) for name, option in options.items()}
    )


def picture(help: str, example: str = "", draw: Writer = draw_answer, rule: Rule | None = None) -> Output:
    """Output for the picture of an answer."""
    return Output("plot", PICTURES, f"{help} (.png, .pdf, .svg)", draw, example, rule=rule)
