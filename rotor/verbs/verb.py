"""What a verb consists of, and its course: inputs become a request, the request an answer, the answer tables, files and a report."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotor.reports.screen import json_text, json_with_rows, plain
from rotor.requests.field import Field, all_fields, declared
from rotor.requests.fill import Entries, read_fields, read_instance, renaming, written_fields
from rotor.requests.readers import Flag
from rotor.table import Table
from rotor.verbs.names import SCENE_VERBS as SCENE_VERBS
from rotor.verbs.names import declared_verbs as declared_verbs
from rotor.verbs.names import verb_of as verb_of
from rotor.version import version

if TYPE_CHECKING:
    from concurrent.futures import Executor


PICTURES = (".png", ".pdf", ".svg")
Note = Callable[[str], None]


def silent(_: str) -> None:
    """Discards a remark."""


@dataclass(frozen=True, eq=False, repr=False)
class Place:
    """Where a call is made. folder: from which files that are read are counted. note: takes remarks."""

    folder: str | os.PathLike[str] = "."
    note: Note = silent


@dataclass(frozen=True, eq=False, repr=False)
class Subject:
    """What is computed of. values: fields of the request. molecules: as they were asked for. text: as typed. note: takes remarks.
    departures: of several molecules, the inputs in which each differs from the conditions.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    molecules: tuple[Any, ...] = ()
    text: str = ""
    note: Note = silent
    departures: tuple[Mapping[str, Any], ...] = ()

    @property
    def top(self) -> Any:
        """The top, where there is one."""
        return self.values["top"]


@dataclass(frozen=True, eq=False, repr=False)
class Work:
    """How an answer is made. executor: shares the work. shown: options of the verb itself. files: by the name of the output. note: takes
    remarks. progress: whether a terminal shows it. provenance: of files that grow. view: of the picture. at_end: takes what is done at the
    end of a command. from_scene: whether a scene is run.
    """

    executor: Executor | None = None
    shown: Any = None
    files: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    note: Note = silent
    progress: bool = False
    provenance: Mapping[str, Any] = field(default_factory=dict)
    view: Any = None
    at_end: Callable[[Callable[[], object]], object] = lambda end: None
    from_scene: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """What a report and files are made from. content: as of the JSON. shown: options of the verb. typed: what was given.
    provenance: of files. view: of a picture. sources: printed whole. executor: shares the work of further tables. made: those that
    several files need.
    """

    content: Mapping[str, Any]
    shown: Any
    given: Entries = field(default_factory=Entries)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    view: Any = None
    sources: bool = False
    executor: Executor | None = None
    made: dict[str, Any] = field(default_factory=dict)

    @property
    def command(self) -> dict[str, Any]:
        """The provenance of pictures: the command or the scene alone."""
        return {name: self.provenance[name] for name in ("command", "scene") if name in self.provenance}


Writer = Callable[[Any, Path, Report], None]


@dataclass(frozen=True, eq=False, repr=False)
class Output:
    """A file that a verb writes. name: of the key in [outputs] and of the option. write: by default the table itself, by its suffix.

    of: the table of an answer that is written, where it is not that of the verb. grows: the answer itself writes it. many: repeatable.
    scene: whether scenes have it too. required: a verb that is there to write this file.
    """

    name: str
    suffixes: tuple[str, ...]
    help: str
    write: Writer | None = None
    example: str = ""
    of: Callable[[Any], Any] | None = None
    option: str = ""
    grows: bool = False
    many: bool = False
    scene: bool = True
    required: bool = False

    @property
    def flag(self) -> str:
        """The option."""
        return self.option or "--" + self.name.replace("_", "-")


@dataclass(frozen=True, eq=False, repr=False)
class ErrorsShown:
    """Options of every verb."""

    errors: bool = declared(False, Flag(), "Print the table of errors: each source with its size", option="--errors")


@dataclass(frozen=True, eq=False, repr=False)
class Shown(ErrorsShown):
    """Options of every verb whose report ends with sources."""

    sources: bool = declared(False, Flag(), "Print the sources of the numbers in full", option="--sources")


def no_notes(answer: Any) -> Iterable[str]:
    """No remarks."""
    return ()


@dataclass(frozen=True, eq=False, repr=False)
class Extra:
    """An option of the command line that stands for fields: `--j 2:5` for jmin and jmax. metavar: empty for an option without a value.
    read: values by identity from the text, which what was typed itself overrides; None: the verb reads all of them together. files: paths
    by the names of outputs, of an option that stands for several files.
    """

    option: str
    metavar: str
    help: str
    read: Callable[[Any], Mapping[str, Any]] | None = None
    instead_of: tuple[str, ...] = ()
    panel: str = ""
    common: bool = False
    many: bool = False
    files: Callable[[str], Mapping[str, str]] | None = None


class SubjectKind:
    """What a verb computes of; the base class: of nothing."""

    fields: Mapping[str, Field] = {}

    @property
    def options(self) -> Mapping[str, Field]:
        """Those of them that are options of the command line."""
        return self.fields

    def read(self, given: Entries, place: Place, verb: Verb) -> Subject:
        """What was given, read and checked."""
        return Subject(note=place.note)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """What a scene in a folder holds of it, by dotted key."""
        return {}

    def scene_fields(self) -> list[tuple[str, Any, Any]]:
        """Name, type and default of what a scene has of it beside plain tables."""
        return []

    tables_read: tuple[str, ...] = ()  # keys that are read whole

    def tables(self, content: dict[str, Any]) -> dict[str, Any]:
        """The tables of a scene, with those of the subject as its inputs read them."""
        return content


NOTHING = SubjectKind()


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Verb:
    """One verb.

    about: one line. examples: of the command line. request: a dataclass of declared fields. answer: of a request. table: of an answer,
    and rows: its key in the JSON. show: prints the report. outputs: files. subject: what is computed of. shown: options of printing and
    files, a dataclass of declared fields. content: further keys of the JSON. notes: remarks on an answer. nothing: why there is nothing
    to draw. drawn: unit of the horizontal axis of the picture, None where there is none to change; spectral: a picture of a spectrum;
    scaled: with --plot-scale. workers: what --workers spreads. start: what a template has switched on. extras: options that stand for
    several fields. short: of a request that plain Python answers before a compiler would be loaded.
    accuracy: of what a scene may ask one. numerics: "module:name" of a `rotor.requests.numerics.Numerics`, loaded where it is used.
    sound: a request that was accepted has no mistake of the user.

    withheld: of files that are named, why some are not written. failure: why an answer that is shown is no result.
    build: makes the request, where its fields alone do not. adapt: the request to the files that are asked for. check: of a request beside
    these files. read_extras: values by identity from the texts of all extras. records: the rows of the JSON, where they are not the table.
    stepwise: it shows every step from the first one on. stated: keys of the JSON that its files have in their
    provenance. other: a verb that takes the place of this one where an option that it alone has is typed; instead: these options, in words.
    """

    name: str
    about: str
    examples: str
    request: type
    answer: Callable[[Any, Work], Any]
    table: Callable[[Any], Table]
    rows: str
    show: Callable[[Any, Report], None]
    outputs: tuple[Output, ...]
    subject: SubjectKind
    shown: type = Shown
    content: Callable[[Any, Any], Mapping[str, Any]] = lambda answer, shown: {}
    notes: Callable[[Any], Iterable[str]] = no_notes
    nothing: Callable[[Any], str] = lambda answer: ""
    drawn: str | None = ""
    spectral: bool = False
    scaled: bool = True
    workers: str = ""
    start: Mapping[str, Any] = field(default_factory=dict)
    extras: tuple[Extra, ...] = ()
    accuracy: str = ""
    accuracy_example: Any = "1 kHz"
    numerics: str = ""
    sound: bool = True
    short: Callable[[Any], bool] = lambda request: False
    withheld: Callable[[Any, Sequence[str]], Mapping[str, str]] = lambda answer, names: {}
    failure: Callable[[Any], str] = lambda answer: ""
    build: Callable[[Verb, Entries, Subject], Any] | None = None
    adapt: Callable[[Any, Mapping[str, Any], Entries], Any] | None = None
    check: Callable[[Any, Mapping[str, Any], Any], None] | None = None
    read_extras: Callable[[Mapping[str, Any]], Mapping[str, Any]] | None = None
    records: Callable[[Any], Table | None] | None = None
    stepwise: bool = False
    stated: tuple[str, ...] = ()
    other: Verb | None = None
    instead: str = ""
    has_scenes: ClassVar[bool] = True

    def load_numerics(self) -> Any:
        """How accuracy is chosen, swept and planned; the knobs of the fields alone where nothing else is named."""
        from rotor.requests.numerics import Numerics

        module, _, name = self.numerics.partition(":")
        return getattr(import_module(module), name) if module else Numerics()

    @property
    def has_json(self) -> bool:
        """Whether there is a JSON of it."""
        return True

    @cached_property
    def fields(self) -> dict[str, Field]:
        """Every declared input by its identity: of the subject, the request and of what is shown."""
        return {**self.subject.fields, **all_fields(self.request), **all_fields(self.shown)}

    @cached_property
    def options(self) -> dict[str, Field]:
        """The declared inputs that the command line has options for."""
        inputs = {**self.subject.options, **all_fields(self.request), **all_fields(self.shown)}
        return {name: one for name, one in inputs.items() if one.flag and not one.hidden}

    @cached_property
    def parameters(self) -> dict[str, Field]:
        """The inputs of the command line: the options, and those of the verb that may take the place."""
        return self.options if self.other is None else {**self.other.options, **self.options}

    @cached_property
    def every_output(self) -> tuple[Output, ...]:
        """The files of the command line: its own, and those of the verb that may take the place."""
        names = {output.name for output in self.outputs}
        others = () if self.other is None else self.other.outputs
        return (*self.outputs, *(output for output in others if output.name not in names))

    @property
    def spread(self) -> str:
        """What --workers spreads, here or in the verb that may take the place."""
        return self.workers or ("" if self.other is None else self.other.workers)

    def by_what(self, typed: Collection[str]) -> Verb:
        """The verb for what was typed, by identity: the other one where an option that it alone has is typed.

        Raises ValueError for what that has not.
        """
        other = self.other
        if other is None:
            return self
        names = {output.name for output in self.every_output} - {output.name for output in self.outputs}
        alone = names | (other.options.keys() - self.options.keys()) | (set() if self.workers else {"workers"})
        if alone.isdisjoint(typed):
            return self
        for name, one in self.options.items():
            if name in typed and name not in other.options:
                raise ValueError(f"{one.flag}: expected without {other.instead}")
        if "save_scene" in typed:
            raise ValueError(f"--save-scene: {other.instead} are no part of a scene; expected without them")
        return other

    def read(self, given: Entries, place: Place) -> tuple[Any, Subject]:
        """The request that was asked for, and of what.

        Raises ValueError, with the input as the user calls it, for what cannot be.
        """
        early = Entries(
            {name: value for name, value in given.values.items() if name not in self.subject.fields}, given.style
        )
        check_early(self.request, early)
        subject = self.subject.read(given, place, self)
        names = {one.name: one.called(given.style) for one in all_fields(self.request).values()}
        with renaming(names):
            if self.build is not None:
                return self.build(self, given, subject), subject
            values = read_fields(self.request, given, subject)
            return self.request(**subject.values, **values), subject

    def read_shown(self, given: Entries) -> Any:
        """The options of the verb itself."""
        return read_instance(self.shown, given)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """What a scene in a folder holds, by dotted key, to ask for the same again."""
        return {**self.subject.saved(request, subject, folder), **written_fields(request)}

    def stated_in(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """What the provenance of files has of the content of the JSON."""
        return {name: plain(content[name]) for name in self.stated if name in content}

    def json(self, answer: Any, content: Mapping[str, Any]) -> str:
        """The content as JSON text, with all rows."""
        table = self.table(answer) if self.records is None else self.records(answer)
        return (
            json_text({**content, self.rows: content.get(self.rows)})
            if table is None
            else json_with_rows(table, self.rows, content)
        )

    def output(self, name: str) -> Output:
        """A file by its name."""
        return next(one for one in self.outputs if one.name == name)


def report_of(
    verb: Verb, answer: Any, head: Mapping[str, Any], given: Entries, view: Any = None, executor: Executor | None = None
) -> Report:
    """What the report, the JSON and the files are made from. head: command or scene, and input."""
    shown = verb.read_shown(given)
    content = {"rotor_version": version(), **head, **answer.facts(), **verb.content(answer, shown)}
    provenance = {**head, **{name: content[name] for name in ("errors",) if name in content}, **verb.stated_in(content)}
    return Report(content, shown, given, provenance, view, bool(getattr(shown, "sources", False)), executor)


def tables(what: str, stem: str) -> tuple[Output, Output]:
    """The table of a verb as CSV and as Parquet. stem: of the example of a template."""
    return (
        Output("csv", (".csv",), f"Write {what} as CSV", example=f"{stem}.csv"),
        Output("parquet", (".parquet",), f"Write {what} as Parquet", example=f"{stem}.parquet"),
    )


def check_early(structure: type, given: Entries) -> None:
    """ValueError for a text that no subject could make right: before anything is read."""
    for one in all_fields(structure).values():
        if given.has(one):
            one.read(given.of(one), given.style)


def files_of(verb: Verb, answer: Any, report: Report) -> dict[str, Callable[[Path], None]]:
    """What writes each file of a verb, by its name."""

    def writer(one: Output) -> Callable[[Path], None]:
        """What writes a file: by its function, or the table itself."""
        if (by_function := one.write) is not None:
            return lambda path: by_function(answer, path, report)

        def rows(path: Path) -> None:
            """The table as a file."""
            from rotor.formats import write

            write((one.of or verb.table)(answer), path, settings=dict(report.provenance))

        return rows

    return {one.name: writer(one) for one in verb.outputs if not one.grows}
