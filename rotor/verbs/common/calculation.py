"""The course of every calculation, from the command line, a scene or Python: read, check, answer; then report, JSON and files."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import NoAnswerError
from rotor.frozen import dataclass
from rotor.reports.screen import plain
from rotor.requests.field import OUTPUTS
from rotor.requests.fill import Entries, naming, refuse_misfits
from rotor.table import Table, errors_html
from rotor.verbs.common.outputs import Output, Report
from rotor.verbs.common.verb import Place, Subject, Verb, Work
from rotor.version import version

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.requests.accuracy import Accuracy, Reached, Stated
    from rotor.requests.knob import Choice

HYPERFINE = "effects.hyperfine"  # identity of the option that adds hyperfine structure


class NoResultError(NoAnswerError):
    """A valid scene without a result, such as a fit that does not converge; no file is written."""


@dataclass(frozen=True, eq=False, repr=False)
class Calculation:
    """A verb with its inputs.

    work: files, remarks and provenance. folder: of the files that the inputs name. stated: the requested accuracy.
    """

    verb: Verb
    entries: Entries
    work: Work
    folder: str | os.PathLike[str] = "."
    stated: Stated = None

    @cached_property
    def inputs(self) -> tuple[Any, Subject]:
        """The request, checked as far as possible before the calculation, and its subject."""
        verb, work, entered = self.verb, self.work, self.entries.values
        inputs = {name for name, value in entered.items() if value is not None}
        files = {f"{OUTPUTS}{name}" for name in work.files}
        refuse_misfits(verb.named, inputs | files, self.entries.style)
        with _shown_time(work.progress):  # an .int file is predicted here
            request, subject = verb.read(self.entries, Place(self.folder, work.note))
        if missing := next((each.flag for each in verb.outputs if each.required and each.name not in work.files), ""):
            raise ValueError(f"{missing} is missing; --help shows what the command takes")
        if verb.adapt is not None:
            request = verb.adapt(request, work.files, self.entries)
        if verb.check is not None and self.entries.style != "name":
            with naming(verb.named, self.entries.style):
                verb.check(request, work.files, work.shown)
        return request, subject

    @property
    def request(self) -> Any:
        """The request."""
        return self.inputs[0]

    @property
    def provenance(self) -> Mapping[str, Any]:
        """The command and its subject, or the scene."""
        subject = {} if self.work.from_scene else {"input": self.inputs[1].text}
        return {**self.work.provenance, **subject}

    @cached_property
    def accuracy(self) -> Accuracy | None:
        """The requested accuracy; None without one."""
        if self.stated is None:
            return None
        from rotor.requests.accuracy import read_accuracy

        return read_accuracy(self.stated, self.verb.load_numerics(), self.entries)

    @cached_property
    def choice(self) -> Choice | None:
        """Settings for the requested accuracy; None without one."""
        with naming(self.verb.named, self.entries.style):
            goal = self.accuracy
            return None if goal is None else goal.chosen(self.request, self.entries, self.verb.compute)

    def run(self, executor: Executor | None = None) -> Outcome:
        """Answer the request, with settings for the requested accuracy.

        Raises NoResultError, and ValueError for a file that cannot be written, of a scene.
        """
        start, choice = time.perf_counter(), self.choice
        return self.answer(self.request if choice is None else choice.request, choice, executor, start)

    def answer(
        self, request: Any, choice: Choice | None = None, executor: Executor | None = None, start: float | None = None
    ) -> Outcome:
        """Answer a request. choice: its settings. start: of the measured time (s)."""
        verb, work = self.verb, replace(self.work, executor=executor, provenance=self.provenance)
        start = time.perf_counter() if start is None else start
        with self._answering(), _shown_time(work.progress and not verb.stepwise):
            answer = verb.answer(request, work)
        if work.from_scene:
            self._refuse_incomplete(answer)
        seconds = time.perf_counter() - start
        reached = None if choice is None or self.accuracy is None else self.accuracy.reached(answer, choice)
        return Outcome(self, request, answer, seconds, reached, executor)

    def _answering(self) -> AbstractContextManager[None]:
        """Context of the answer: a ValueError names inputs as the user does; if no input can be wrong, it is a NoAnswerError."""
        typed = self.entries.style == "option"
        return answering() if typed and self.verb.sound else naming(self.verb.named, self.entries.style)

    def _refuse_incomplete(self, answer: Any) -> None:
        if reason := self.verb.failure(answer):
            raise NoResultError(f"{reason}; 'rotor {self.verb.name}' shows it nevertheless")
        for name, reason in self.verb.withheld(answer, list(self.work.files)).items():
            raise ValueError(f"outputs.{name}: {reason}")


@dataclass(frozen=True, eq=False, repr=False)
class Outcome:
    """The answer to a request. seconds: that it took. reached: the error, if an accuracy is requested. executor: shared the work."""

    calculation: Calculation
    request: Any
    answer: Any
    seconds: float = 0.0
    reached: Reached | None = None
    executor: Executor | None = None

    @property
    def verb(self) -> Verb:
        """The verb."""
        return self.calculation.verb

    @property
    def subject(self) -> Subject:
        """The subject of the verb."""
        return self.calculation.inputs[1]

    @property
    def files(self) -> tuple[Path, ...]:
        """The files of the calculation, which its command or scene writes."""
        return tuple(path for paths in self.calculation.work.files.values() for path in paths)

    @cached_property
    def table(self) -> Table:
        """The main table: lines, levels, states, ..."""
        return self.verb.table(self.answer)

    @cached_property
    def report(self) -> Report:
        """Data of the report, the JSON and the files."""
        verb, work, answer = self.verb, self.calculation.work, self.answer
        head = self.calculation.provenance
        with _shown_time(work.progress):
            facts = {**verb.facts(answer), **verb.content(answer, work.shown)}
        content = {"rotor_version": version(), **head, **facts}
        stated = {name: plain(content[name]) for name in ("errors", *verb.stated) if name in content}
        with_spins = f"rotor {verb.name if HYPERFINE in verb.fields else 'spectrum'} --hyperfine"
        sources = bool(getattr(work.shown, "sources", False))
        accuracy = {} if self.reached is None else {"accuracy": asdict(self.reached)}
        entries, provenance = self.calculation.entries, {**head, **accuracy, **stated}
        return Report(content, work.shown, entries, provenance, work.view, sources, with_spins, self.executor)

    def json(self) -> str:
        """The JSON."""
        return self.verb.json(self.answer, self.report.content)

    def writer(self, output: Output) -> Callable[[Path], None]:
        """A function that writes an output, by the output's own function or as a table."""
        if (by_function := output.write) is not None:
            return lambda path: by_function(self.answer, path, self.report)
        if (table_of := output.of) is not None:
            return lambda path: self.write_table(table_of(self.answer, self.report), path)
        return lambda path: self.write_table(self.table, path)

    def write_table(self, table: Table, path: Path) -> None:
        """Write a table in the format of the suffix, with its provenance."""
        from rotor.formats import write

        write(table, path, settings=dict(self.report.provenance))

    def _repr_html_(self) -> str:
        """The table and the line of errors, for notebooks."""
        return self.table._repr_html_() + errors_html(self.answer)

    @property
    def writers(self) -> Mapping[str, Callable[[Path], None]]:
        """Functions that write the files, by output, except those that grow during the calculation."""
        return {output.name: self.writer(output) for output in self.verb.outputs if not output.grows}


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


def _shown_time(shown: bool) -> AbstractContextManager[None]:
    """Context that shows the elapsed time on a terminal."""
    if not shown:
        return nullcontext()
    from rotor.reports.progress import elapsed_time

    return elapsed_time("computing")
