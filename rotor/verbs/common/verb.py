"""The class Verb: inputs become a request, the request an answer, the answer tables, files and a report; Tool: one without scenes."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotor.frozen import dataclass
from rotor.reports.screen import Part, json_text, json_with_rows
from rotor.requests.field import OUTPUT, all_fields, declared
from rotor.requests.fill import Entries, naming, read_fields, read_instance, written_fields
from rotor.requests.readers import Field, Flag, Names, Text, Whole
from rotor.table import Table
from rotor.verbs.common.outputs import Output, Report

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.requests.numerics import Numerics


Note = Callable[[str], None]


def silent(_: str) -> None:
    """Discard a remark."""


@dataclass(frozen=True, eq=False, repr=False)
class Place:
    """Where a call is made. folder: of the files that it reads. note: takes remarks."""

    folder: str | os.PathLike[str] = "."
    note: Note = silent


@dataclass(frozen=True, eq=False, repr=False)
class Subject:
    """The molecule or other object that a verb computes.

    values: fields of the request. molecules: their inputs. text: as typed. note: takes remarks.
    departures: for each of several molecules, the inputs in which it differs from the conditions. further: further inputs as entered.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    molecules: tuple[Any, ...] = ()
    text: str = ""
    note: Note = silent
    departures: tuple[Mapping[str, Any], ...] = ()
    further: Any = None

    @property
    def top(self) -> Any:
        """The top of a molecule."""
        return self.values["top"]


@dataclass(frozen=True, eq=False, repr=False)
class Work:
    """Conditions of a calculation.

    executor: shares the work. shown: display options. files: by the name of the output. note: takes remarks.
    progress: whether a terminal shows it. provenance: of files that grow during the calculation. view: of the picture.
    at_end: takes functions to call at the end of the command. from_scene: whether a scene is run.
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
class ErrorsShown:
    """Options of all verbs."""

    errors: bool = declared(False, Flag(), "Print the table of errors: each source with its size")


@dataclass(frozen=True, eq=False, repr=False)
class Shown(ErrorsShown):
    """Options of verbs whose report ends with sources."""

    sources: bool = declared(False, Flag(), "Print the sources of the numbers in full")


@dataclass(frozen=True, eq=False, repr=False)
class LinesShown(Shown):
    """Options of verbs whose report has the strongest lines."""

    top_lines: int = declared(20, Whole(0), "Number of strongest lines shown", option="--top", panel=OUTPUT)


@dataclass(frozen=True, eq=False, repr=False)
class Extra:
    """An option that sets several fields: `--j 2:5` for jmin and jmax.

    metavar: empty for an option without a value. read: returns values by identity from the text; options of single fields override them;
    None: the verb reads all extras together. files: paths by output, of an option that names several files.
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

    @property
    def field(self) -> Field:
        """The option as a field."""
        reader = Names(self.metavar) if self.many else Text(metavar=self.metavar) if self.metavar else Flag()
        return Field(
            reader, self.help, option=self.option, name=self.option, panel=self.panel or OUTPUT, common=self.common
        )


class SubjectKind:
    """Kind of subject that a verb computes; this base class stands for none.

    fields: its inputs. scene_fields: keys that a scene alone has, before its first table.
    """

    fields: Mapping[str, Field] = {}
    scene_fields: ClassVar[tuple[Field, ...]] = ()

    @property
    def options(self) -> Mapping[str, Field]:
        """The inputs that have options on the command line."""
        return self.fields

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read and check the inputs of the subject."""
        return Subject(note=place.note)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The subject as a scene in the folder holds it, by dotted key."""
        return {}


NOTHING = SubjectKind()


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Verb:
    """A verb: its inputs, its calculation, its files and its report.

    about: one line. examples: of the command line. start: values that a template sets.
    request: a dataclass of declared fields. subject: kind of the subject. shown: dataclass of display options.
    extras: options that set several fields; read_extras: reads them together.
    build: makes the request if its fields alone do not. adapt: changes the request for the requested files.
    check: refuses a request that does not fit the files of a command or a scene.
    answer: computes a request. table: of an answer, by default its `table`; rows: its key in the JSON.
    records: rows of the JSON if not the table.
    results: a few numbers of an answer with rows, by name with units, for the table of a sweep.
    content: further keys of the JSON. notes: remarks on an answer, by default its `notes`. failure: reason why an answer is not a result.
    outputs: files. withheld: reasons why some of them are not written. stated: keys of the JSON in the provenance of files.
    show: the parts of the report, which are printed with blank lines about tables. stepwise: whether every step is shown from the start.
    lists_files: whether the report names its files by itself.
    drawn: unit of the picture's horizontal axis, None if it cannot be changed. spectral: whether the picture is a spectrum.
    scaled: whether it has --plot-scale. nothing: reason why there is nothing to draw.
    workers: what --workers shares out. short: whether plain Python answers before the compiler would be loaded.
    numerics: "module:name" of a `rotor.requests.numerics.Numerics`. accuracy: observables of an accuracy goal in a scene.
    invariants: what a plan calls quantities that do not change.
    small_blocks: whether its matrices are small blocks, for which threads of BLAS cost time (read by `rotor.verbs`).
    sound: whether an accepted request contains no user error.
    other: verb that takes over if one of its options is typed; instead: these options in words.
    """

    name: str
    about: str
    examples: str
    request: type
    answer: Callable[[Any, Work], Any]
    rows: str
    show: Callable[[Any, Report], Iterable[Part | None]]
    results: Callable[[Any], Mapping[str, Any]] = lambda answer: {}
    outputs: tuple[Output, ...]
    subject: SubjectKind
    table: Callable[[Any], Table] = lambda answer: answer.table
    shown: type = Shown
    content: Callable[[Any, Any], Mapping[str, Any]] = lambda answer, shown: {}
    notes: Callable[[Any], Iterable[str]] = lambda answer: getattr(answer, "notes", ())
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
    invariants: str = "good numbers"
    small_blocks: bool = False
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
    lists_files: bool = False
    stated: tuple[str, ...] = ()
    other: Verb | None = None
    instead: str = ""
    has_scenes: ClassVar[bool] = True

    def load_numerics(self) -> Numerics:
        """Accuracy goals, knobs and plan; by default those of the fields alone."""
        from rotor.requests.numerics import Numerics

        module, _, name = self.numerics.partition(":")
        numerics: Numerics = getattr(import_module(module), name) if module else Numerics()
        return numerics

    def compute(self, request: Any) -> Any:
        """The answer to a request, with default display options and without messages."""
        return self.answer(request, Work(shown=self.read_shown(Entries()), from_scene=True))

    @property
    def has_json(self) -> bool:
        """Whether the verb has JSON."""
        return True

    @cached_property
    def fields(self) -> dict[str, Field]:
        """All declared inputs by identity: of the subject, the request and the display."""
        return {**self.subject.fields, **all_fields(self.request), **all_fields(self.shown)}

    @cached_property
    def named(self) -> tuple[Field, ...]:
        """The inputs and the files, as errors name them."""
        return (*self.fields.values(), *(output.field for output in self.outputs))

    @cached_property
    def options(self) -> dict[str, Field]:
        """The inputs with options on the command line."""
        inputs = {**self.subject.options, **all_fields(self.request), **all_fields(self.shown)}
        return {name: item for name, item in inputs.items() if item.flag and not item.hidden}

    def verb_for(self, typed: Collection[str]) -> Verb:
        """This verb, or `other` if one of its options is typed (by identity).

        Raises ValueError for typed options that `other` does not have.
        """
        other = self.other
        if other is None:
            return self
        names = {output.name for output in other.outputs} - {output.name for output in self.outputs}
        alone = names | (other.options.keys() - self.options.keys()) | (set() if self.workers else {"workers"})
        if alone.isdisjoint(typed):
            return self
        for name, option in self.options.items():
            if name in typed and name not in other.options:
                raise ValueError(f"{option.flag}: expected without {other.instead}")
        if "save_scene" in typed:
            raise ValueError(f"--save-scene: {other.instead} have no place in a scene; expected without them")
        return other

    def read(self, entries: Entries, place: Place) -> tuple[Any, Subject]:
        """The request and its subject.

        Raises ValueError, with the input in the user's style, for invalid values.
        """
        early = Entries(
            {name: value for name, value in entries.values.items() if name not in self.subject.fields}, entries.style
        )
        check_early(self.request, early)
        with naming(self.named, entries.style, plain=False):
            subject = self.subject.read(entries, place, self)
            with naming(all_fields(self.request).values(), entries.style):
                if self.build is not None:
                    return self.build(self, entries, subject), subject
                values = read_fields(self.request, entries, subject)
                return self.request(**subject.values, **values), subject

    def read_shown(self, entries: Entries) -> Any:
        """The display options."""
        return read_instance(self.shown, entries)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """Content of a scene in the folder that repeats the request, by dotted key."""
        return {**self.subject.saved(request, subject, folder), **written_fields(request)}

    def facts(self, answer: Any) -> Mapping[str, Any]:
        """What the JSON says of an answer."""
        facts: Mapping[str, Any] = answer.facts()
        return facts

    def json(self, answer: Any, content: Mapping[str, Any]) -> str:
        """The content as JSON text, with all rows."""
        table = self.table(answer) if self.records is None else self.records(answer)
        return (
            json_text({**content, self.rows: content.get(self.rows)})
            if table is None
            else json_with_rows(table, self.rows, content)
        )


def verb_of(name: str) -> Verb:
    """The verb of this name; only its module is imported."""
    verb: Verb = import_module(f"rotor.verbs.{name}").VERB
    return verb


def facts_named(facts: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """The facts with these names; those that an answer does not have are left out."""
    return {name: facts[name] for name in names if name in facts}


def check_early(structure: type, entries: Entries) -> None:
    """Raise ValueError for a value that is wrong for every subject, before any file is read."""
    for declaration in all_fields(structure).values():
        if entries.has(declaration):
            declaration.read(entries.of(declaration), entries.style)


@dataclass(frozen=True, eq=False, repr=False)
class NoDisplayOptions:
    """For verbs without display options."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Tool(Verb):
    """A verb without scenes; its display options are fields of its request.

    of: the field that names the input, for JSON and provenance. text: JSON text if it is not the facts; None: the verb has no JSON.
    """

    table: Callable[[Any], Any] = lambda answer: None
    rows: str = ""
    outputs: tuple[Output, ...] = ()
    subject: SubjectKind = NOTHING
    shown: type = NoDisplayOptions
    drawn: str | None = None
    scaled: bool = False
    sound: bool = False
    of: str = ""
    text: Callable[[Any, Mapping[str, Any]], str] | None = lambda answer, content: json_text(content)
    has_scenes: ClassVar[bool] = False

    @property
    def has_json(self) -> bool:
        """Whether the verb has JSON."""
        return self.text is not None

    def read(self, entries: Entries, place: Place) -> tuple[Any, Subject]:
        """The request; its field `of` is the subject."""
        request = read_instance(self.request, entries)
        source = getattr(request, self.of, "")
        return request, Subject(text=source if isinstance(source, str) else " ".join(source), note=place.note)

    def facts(self, answer: Any) -> Mapping[str, Any]:
        """What the JSON says of an answer; nothing without JSON."""
        return super().facts(answer) if self.has_json else {}

    def json(self, answer: Any, content: Mapping[str, Any]) -> str:
        """The JSON text."""
        return "" if self.text is None else self.text(answer, content)
