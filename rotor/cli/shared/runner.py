"""The runner of all verbs on the command line: read, check, answer, then files, JSON and the report."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import NoAnswerError
from rotor.cli.shared import process
from rotor.cli.shared.output import HELD, at_end, deliver, note
from rotor.cli.shared.plot_options import PLOT_NAMES, picture_settings, picture_style
from rotor.reports.screen import show_parts
from rotor.requests.fill import Entries
from rotor.verbs.calculation import Calculation, Outcome, answering
from rotor.verbs.molecule import is_file
from rotor.verbs.outputs import Files, Report
from rotor.verbs.verb import Verb, Work

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import typer


def run_verb(verb: Verb, context: typer.Context, typed: Mapping[str, Any]) -> None:
    """Carry out a verb. typed: texts of the options by identity."""
    verb = verb.verb_for(typed.keys())
    no_inputs = places_of(verb)
    inputs = {name: value for name, value in typed.items() if name not in no_inputs}
    values = {name: value for name, value in inputs.items() if name in verb.fields}
    extras = {name: value for name, value in inputs.items() if name not in values}
    entries = Entries({**fields_of_extras(verb, extras, values.keys()), **values}, "option")
    places = with_files(verb, {name: value for name, value in typed.items() if name not in inputs})
    shown = verb.read_shown(entries)
    with as_typed(verb, places):
        files = files_of_options(verb, places)
        if files.paths:
            refuse_overwriting(files, inputs)
    view = picture_settings(verb, places, "plot" in files.paths)
    outputs = {**files.paths, **dict.fromkeys(files.on_screen, ())}
    work = Work(None, shown, outputs, note, True, {"command": str(context.obj)}, view, at_end)
    calculation = Calculation(verb, entries, work)
    if verb.short(calculation.request):
        process.leave_compiler_out()
    process.begin_work()
    with picture_style(places), working(verb, places.get("workers", 1)) as executor:
        outcome = calculation.run(executor)
        answer = outcome.answer
        with answering():
            report = outcome.report
        refuse_nothing_to_draw(verb, answer, files)
        for text in verb.notes(answer):
            note(text)
        withhold(verb, answer, files)
        report.content["files"] = files.names  # type: ignore[index]
        writers = dict(outcome.writers)
        if "save_scene" in files.paths:
            named = {name: places[name] for name in files.paths}
            writers["save_scene"] = scene_writer(outcome, named)
        with verb.naming("option"):
            deliver(files, writers, outcome.json, partial(show_answer, verb, answer, report))
        if reason := verb.failure(answer):
            raise NoAnswerError(reason)


def show_answer(verb: Verb, answer: Any, report: Report) -> None:
    """Print the report of a verb and its files, with the table of errors if requested."""
    parts = [*verb.show(answer, report)]
    if report.content.get("files") and not verb.lists_files:
        parts.append([("files", ", ".join(report.content["files"]))])
    if getattr(report.shown, "errors", False):
        from rotor.reports.error_table import error_parts

        parts += error_parts(report.content)
    show_parts(parts)


def places_of(verb: Verb) -> set[str]:
    """The options of files, pictures and processes, which do not change the results."""
    files = {each.name for each in verb.outputs} | {each.option for each in verb.extras if each.files is not None}
    return files | ({"json", "save_scene", "workers", *PLOT_NAMES} - verb.fields.keys())


def with_files(verb: Verb, typed: Mapping[str, Any]) -> dict[str, Any]:
    """The texts by output; options that name several files are replaced by these files."""
    files: dict[str, Any] = {}
    for extra in verb.extras:
        if extra.files is not None and extra.option in typed:
            files |= extra.files(typed[extra.option])
    return {**files, **typed}


@contextmanager
def as_typed(verb: Verb, typed: Mapping[str, Any]) -> Iterator[None]:
    """Context in which a ValueError about a file names the option that was typed, which may stand for several files."""
    try:
        yield
    except ValueError as error:
        flag, text = str(error).partition(" ")[::2]
        for extra in verb.extras:
            if (
                extra.files is not None
                and any(flag == verb.output(name).flag for name in extra.files(""))
                and extra.option in typed
            ):
                raise ValueError(f"{extra.option} {text}") from None
        raise


def withhold(verb: Verb, answer: Any, files: Files) -> None:
    """Leave out the withheld files, with a note."""
    reasons: dict[str, list[str]] = {}
    for name, reason in verb.withheld(answer, files.pending).items():
        reasons.setdefault(reason, []).extend(path.name for path in files.paths.pop(name))
    for reason, names in reasons.items():
        note(f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} not written: {reason}")


def fields_of_extras(verb: Verb, typed: Mapping[str, Any], others: Collection[str]) -> dict[str, Any]:
    """Values by identity from the typed options that set several fields. others: identities of the other inputs."""
    values: dict[str, Any] = {}
    for extra in verb.extras:
        if extra.option not in typed or extra.read is None:
            continue
        if double := next((other for other in extra.instead_of if other in others), None):
            raise ValueError(f"{extra.option} and {verb.fields[double].flag}: give one of them")
        try:
            values |= extra.read(typed[extra.option])
        except ValueError as error:
            raise ValueError(f"{extra.option}: {error}") from None
    return values if verb.read_extras is None else {**values, **verb.read_extras(typed)}


def files_of_options(verb: Verb, typed: Mapping[str, Any]) -> Files:
    """The files to write; ValueError for a suffix or folder in which they cannot be written."""
    files = Files(growing={output.name for output in verb.outputs if output.grows})
    for output in verb.outputs:
        paths = typed.get(output.name, ())
        if paths == "-" and ".csv" in output.suffixes and not output.grows:
            files.on_screen.append(output.name)
            continue
        for path in paths if isinstance(paths, tuple) else (paths,):
            files.add(output.name, output.flag, path, output.suffixes)
    if "save_scene" in typed:
        files.add("save_scene", "--save-scene", typed["save_scene"], (".toml",))
    if typed.get("json") == "-":
        files.on_screen.append("json")
    elif "json" in typed:
        files.add("json", "--json", typed["json"], (".json",))
    if len(files.on_screen) > 1:
        raise ValueError(
            f"{' and '.join(f'--{name} -' for name in files.on_screen)}: one of them can go to standard output"
        )
    files.lock(HELD)
    return files


def refuse_overwriting(files: Files, typed: Mapping[str, Any]) -> None:
    """Raise ValueError if a file to write is an input. typed: texts that may name files to read."""
    texts = [text for value in typed.values() for text in (value if isinstance(value, tuple) else (value,))]
    inputs = {os.path.realpath(text) for text in texts if isinstance(text, str) and is_file(text)}
    for name, paths in files.paths.items():
        for path in paths:
            if os.path.realpath(path) in inputs:
                raise ValueError(f"{files.called[name]} {path}: is an input of this command; give another name")


def refuse_nothing_to_draw(verb: Verb, answer: Any, files: Files) -> None:
    """Raise NoAnswerError for a picture or profile without content."""
    drawn = [name for name in ("plot", "profile_csv") if name in files.paths]
    if drawn and (reason := verb.nothing(answer)):
        raise NoAnswerError(f"{files.called[drawn[0]]}: {reason}")


def working(verb: Verb, workers: Any) -> Any:
    """The executor of --workers; None for a verb without this option."""
    if not verb.workers:
        return nullcontext()
    from rotor.cli.shared.workers import working as pool
    from rotor.requests.readers import Whole

    try:
        count = Whole().read(workers)
    except ValueError as error:
        raise ValueError(f"--workers: {error}") from None
    executor: Executor | Any = pool(count, verb.workers.split()[0])
    return executor


def scene_writer(outcome: Outcome, typed: Mapping[str, Any]) -> Any:
    """A function that writes the scene of the command; a note names files that a scene does not write."""
    verb = outcome.verb
    outputs = {output.name: typed[output.name] for output in verb.outputs if output.scene and output.name in typed}
    if left := [output.flag for output in verb.outputs if not output.scene and output.name in typed]:
        note(f"the scene writes no {', '.join(left)}; its other files are those of this command")

    def write(path: Path) -> None:
        """The scene as text."""
        from rotor.scenes.run import saved_scene
        from rotor.scenes.scene import write_scene

        write_scene(saved_scene(outcome, Path(typed["save_scene"]).parent, outputs), path)

    return write
