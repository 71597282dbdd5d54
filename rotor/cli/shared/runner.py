"""The one course of every verb on the command line: read, check, answer, then files, JSON and the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import process
from rotor.cli.shared.command import refuse_overwriting
from rotor.cli.shared.output import ComputationError, Files, answering, deliver, note
from rotor.cli.shared.plot_options import PLOT_NAMES, picture_settings
from rotor.reports.progress import elapsed_time
from rotor.requests.fill import Given
from rotor.verbs.verb import NoAnswerError, Place, Report, Subject, Verb, Work, files_of

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import typer


OWN_PROGRESS = ("fluid", "fit")  # verbs that show every step or iteration from the first one on


def run_verb(verb: Verb, context: typer.Context, typed: Mapping[str, Any]) -> None:
    """Carry out a verb with the texts that were typed, by identity."""
    typed, given = with_files(verb, typed), Given(with_extras(verb, typed), "option")
    shown = verb.read_shown(given)
    with as_typed(verb, typed):
        files, growing = asked_files(verb, typed), growing_files(verb, typed)
        refuse_overwriting({**files.paths, **growing.paths}, inputs_of(verb, typed))
    view = picture_settings(verb, typed, "--plot" in files.paths)
    request, subject = verb.read(given, Place(".", note))
    outputs = by_name(files, growing)
    request = request if verb.adapt is None else verb.adapt(request, outputs, given)
    if "--json" in files.screen:
        outputs["json"] = ()
    if verb.check is not None:
        verb.check(request, outputs, shown)
    if verb.short(request):
        process.leave_compiler_out()
    head = {"command": str(context.obj), "input": subject.text}
    with working(verb, typed) as executor:
        with answering() if verb.sound else naming(verb):
            work = Work(executor, shown, outputs, note, True, head)
            with nullcontext() if verb.name in OWN_PROGRESS else elapsed_time("computing"):
                answer = answer_of(verb, request, work)
        report = report_of(verb, answer, head, given, view, executor)
        refuse_nothing_to_draw(verb, answer, files)
        for text in verb.notes(answer):
            note(text)
        withhold(verb, answer, files)
        report.content["files"] = [*growing.names, *files.names]  # type: ignore[index]
        writers = {flag_of(verb, name): write for name, write in files_of(verb, answer, report).items()}
        if "--save-scene" in files.paths:
            named = by_name(files, growing)
            written = {name: value for name, value in typed.items() if name not in outputs or name in named}
            writers["--save-scene"] = scene_writer(verb, request, subject, given, written)
        with naming(verb), reaching():
            deliver(
                files, writers, lambda: verb.json(answer, report.content), lambda: show_answer(verb, answer, report)
            )
        if reason := verb.failure(answer):
            raise ComputationError(reason)


def show_answer(verb: Verb, answer: Any, report: Report) -> None:
    """The report of a verb, with the table of errors where it is requested."""
    verb.show(answer, report)
    if getattr(report.shown, "errors", False):
        from rotor.reports.error_table import show_errors

        show_errors(report.content)


def answer_of(verb: Verb, request: Any, work: Work) -> Any:
    """The answer; one that was not reached is no mistake of the user."""
    with reaching():
        return verb.answer(request, work)


@contextmanager
def reaching() -> Iterator[None]:
    """Inside, an answer that is not reached is no mistake of the user."""
    try:
        yield
    except NoAnswerError as error:
        raise ComputationError(str(error)) from error


def report_of(
    verb: Verb, answer: Any, head: Mapping[str, Any], given: Given, view: Any, executor: Executor | None = None
) -> Report:
    """What the report, the JSON and the files are made from. head: command or scene, and input."""
    from rotor.version import version

    shown = verb.read_shown(given)
    with answering():
        content = {"rotor_version": version(), **head, **answer.facts(), **verb.content(answer, shown)}
    provenance = {**head, **{name: content[name] for name in ("errors",) if name in content}}
    return Report(content, shown, given, provenance, view, bool(getattr(shown, "sources", False)), executor)


def with_files(verb: Verb, typed: Mapping[str, Any]) -> dict[str, Any]:
    """The texts, options that stand for several files replaced by these."""
    files: dict[str, Any] = {}
    for one in verb.extras:
        if one.files is not None and one.option in typed:
            files |= one.files(typed[one.option])
    return {**files, **typed}


@contextmanager
def as_typed(verb: Verb, typed: Mapping[str, Any]) -> Iterator[None]:
    """Inside, a ValueError about a file of an option that stands for several files names that option."""
    try:
        yield
    except ValueError as error:
        flag, text = str(error).partition(" ")[::2]
        for one in verb.extras:
            if (
                one.files is not None
                and any(flag == flag_of(verb, name) for name in one.files(""))
                and one.option in typed
            ):
                raise ValueError(f"{one.option} {text}") from None
        raise


def withhold(verb: Verb, answer: Any, files: Files) -> None:
    """Leave out the files that are not written, with a note."""
    reasons: dict[str, list[str]] = {}
    for name, reason in verb.withheld(answer, list(by_name(files))).items():
        reasons.setdefault(reason, []).append(files.paths.pop(flag_of(verb, name)).name)
    for reason, names in reasons.items():
        note(f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} not written: {reason}")


def with_extras(verb: Verb, typed: Mapping[str, Any]) -> dict[str, Any]:
    """The texts, options that stand for others replaced by what they mean."""
    values = {name: value for name, value in typed.items() if name in verb.fields}
    for one in verb.extras:
        if one.option not in typed or one.read is None:
            continue
        if double := next((other for other in one.instead_of if other in typed), None):
            raise ValueError(f"{one.option} and {verb.fields[double].flag}: give one of them")
        try:
            values = {**one.read(typed[one.option]), **values}
        except ValueError as error:
            raise ValueError(f"{one.option}: {error}") from None
    if verb.read_extras is not None:
        values |= verb.read_extras({one.option: typed[one.option] for one in verb.extras if one.option in typed})
    return values


def inputs_of(verb: Verb, typed: Mapping[str, Any]) -> dict[str, Any]:
    """What was typed and may name a file that is read."""
    outputs = {one.name for one in verb.outputs} | {"json", "save_scene", *PLOT_NAMES}
    return {name: value for name, value in typed.items() if name not in outputs}


def verb_name(option: str) -> str:
    """The name of a file by its option, as it is derived from it."""
    return option.strip().removeprefix("--").replace("-", "_")


def flag_of(verb: Verb, name: str) -> str:
    """The option of a file by its name."""
    return verb.output(name).flag


def asked_files(verb: Verb, typed: Mapping[str, Any]) -> Files:
    """The files to write when all is done, each with a suffix that can be written."""
    files = Files()
    _ask(files, verb, typed, grows=False)
    files.ask("--save-scene", typed.get("save_scene"), (".toml",))
    files.ask_json(typed.get("json"))
    return files


def growing_files(verb: Verb, typed: Mapping[str, Any]) -> Files:
    """The files that grow while the answer is made."""
    files = Files()
    _ask(files, verb, typed, grows=True)
    return files


def _ask(files: Files, verb: Verb, typed: Mapping[str, Any], grows: bool) -> None:
    for one in verb.outputs:
        for number, path in enumerate(_paths(typed.get(one.name)) if one.grows == grows else ()):
            files.ask(one.flag + " " * number, path, one.suffixes)


def by_name(*groups: Files) -> dict[str, tuple[Path, ...]]:
    """The paths of files by the names of their outputs."""
    found: dict[str, tuple[Path, ...]] = {}
    for files in groups:
        for option, path in files.paths.items():
            name = {"trajectory": "trajectories"}.get(verb_name(option), verb_name(option))
            found[name] = (*found.get(name, ()), path)
    return found


def _paths(value: Any) -> tuple[str, ...]:
    return () if value is None else value if isinstance(value, tuple) else (value,)


def refuse_nothing_to_draw(verb: Verb, answer: Any, files: Files) -> None:
    """ComputationError where a picture or a profile is asked for and there is nothing to show in it."""
    drawn = [name for name in ("--plot", "--profile-csv") if name in files.paths]
    if drawn and (reason := verb.nothing(answer)):
        raise ComputationError(f"{drawn[0]}: {reason}")


@contextmanager
def naming(verb: Verb) -> Iterator[None]:
    """Inside, a ValueError that names a field of the request names its option."""
    from rotor.requests.fill import renaming

    with renaming({one.name: one.flag for one in verb.fields.values() if one.flag}):
        yield


def working(verb: Verb, typed: Mapping[str, Any]) -> Any:
    """The executor that --workers asks for; None of a verb that has no such option."""
    if not verb.workers:
        return nullcontext()
    from rotor.cli.shared.workers import working as pool
    from rotor.requests.readers import Whole

    try:
        count = Whole().read(typed.get("workers", 1))
    except ValueError as error:
        raise ValueError(f"--workers: {error}") from None
    executor: Executor | Any = pool(count, verb.workers.split()[0])
    return executor


def scene_writer(verb: Verb, request: Any, subject: Subject, given: Given, typed: Mapping[str, Any]) -> Any:
    """What writes the scene that gives the same tables again; a note names files that a scene does not write."""
    outputs = {one.name: typed[one.name] for one in verb.outputs if one.scene and one.name in typed}
    if left := [one.flag for one in verb.outputs if not one.scene and one.name in typed]:
        note(f"the scene writes no {', '.join(left)}; its other files are those of this command")

    def write(path: Path) -> None:
        """The scene as text."""
        from rotor.scenes.scene_file import write_scene
        from rotor.scenes.structures import saved_scene

        folder = Path(typed["save_scene"]).parent
        write_scene(saved_scene(verb, request, subject, folder, outputs, given), path)

    return write
