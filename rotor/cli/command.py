"""The command of a verb, made from its declaration: one option for each input and file, help in panels, and its course.

A command reads and checks its texts, answers, then writes files and prints JSON or the report.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Callable, Collection, Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import typer
import typer.core

from rotor.checks import NoAnswerError
from rotor.cli import process
from rotor.cli.process import HELD
from rotor.cli.shared_options import MOST_WORKERS, PLOT_NAMES, picture_fields, picture_settings, picture_style
from rotor.reports.screen import show_parts
from rotor.requests.field import NUMERICS, OUTPUT, PANELS, REQUIRED, panel_of
from rotor.requests.fill import Entries, naming, within
from rotor.requests.readers import Field, Flag, Text, Whole
from rotor.verbs.common.calculation import Calculation, Outcome, answering
from rotor.verbs.common.molecule import is_file
from rotor.verbs.common.outputs import Files, Report, write_text
from rotor.verbs.common.verb import Verb, Work

JSON_HELP = "Everything printed, as JSON; - is standard output"
FILE, COUNT = Text(metavar="FILE"), Text(metavar="N")
SCENE_HELP = "Write down the scene, which 'rotor run' gives again (.toml)"


def options_of(verb: Verb) -> dict[str, Field]:
    """Every option of a verb, by identity of the input or name of the file; those of a tool are few, and --help shows all."""
    verbs = (verb,) if verb.other is None else (verb.other, verb)
    fields = {name: field for each in verbs for name, field in each.options.items()}
    fields |= {extra.option: extra.field for extra in verb.extras}
    fields |= {output.name: output.field for each in verbs for output in each.outputs}
    if verb.has_json:
        fields["json"] = Field(FILE, JSON_HELP, name="json", panel=OUTPUT, common=True)
    if verb.has_scenes:
        fields["save_scene"] = Field(FILE, SCENE_HELP, name="save_scene", panel=OUTPUT)
    if any(output.name == "plot" for output in verb.outputs):
        fields |= {name: field for name, field in picture_fields().items() if name not in _left_out(verb)}
    if spread := verb.workers or (verb.other and verb.other.workers):
        fields["workers"] = Field(COUNT, f"Processes over which {spread} are spread", name="workers", panel=NUMERICS)
    return fields if verb.has_scenes else {name: replace(field, common=True) for name, field in fields.items()}


def _left_out(verb: Verb) -> set[str]:
    if verb.drawn is None:
        return {*PLOT_NAMES} - {"style"}
    return ({"plot_unit"} if not verb.spectral else set()) | (set() if verb.scaled else {"plot_scale"})


def command_of(verb: Verb) -> Callable[..., None]:
    """A function for typer that runs a verb, with one parameter for each of its options."""
    options = {
        re.sub(r"\W", "_", field.flag.strip("-").lower()) + "_": (name, field)
        for name, field in options_of(verb).items()
    }
    few = all(field.common for _, field in options.values())  # --help shows them all, and --help-all the same
    show = typer.Option(False, "--help-all", is_eager=True, callback=_show_all, help="Show all options.", hidden=few)
    defaults = {"context": (inspect.Parameter.empty, typer.Context), "help_all": (show, bool)}
    defaults |= {parameter: _parameter_of(field) for parameter, (_, field) in options.items()}
    call: Any = partial(run_verb, verb, options)
    call.__signature__ = inspect.Signature(
        [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
            for name, (default, kind) in defaults.items()
        ]
    )
    call.__annotations__ = {name: kind for name, (_, kind) in defaults.items()}
    call.__doc__ = verb.about
    command: Callable[..., None] = call
    return command


def _parameter_of(field: Field) -> tuple[Any, Any]:
    """The default and the type of a parameter; an option takes a list, so that one with a single value can refuse several."""
    reader, flag = field.reader, field.flag
    default, metavar = field.default_text, field.metavar or reader.metavar
    help_ = f"{field.help} [{default}]." if default else f"{field.help}."
    if not flag.startswith("-"):
        words = molecules_and_files if flag == "SOURCE" else None
        first: Any = ... if field.default is REQUIRED else None
        argument = typer.Argument(first, show_default=False, metavar=flag, help=help_, autocompletion=words)
        return argument, (list[str] if reader.many else str) | None
    panel = f"{'' if field.common else '+'}{panel_of(field)}"
    if isinstance(reader, Flag):
        names = f"{flag}/--no-{flag[2:]}" if reader.off else flag
        return typer.Option(None, names, show_default=False, help=help_, rich_help_panel=panel), bool | None
    option = typer.Option(None, flag, show_default=False, help=help_, rich_help_panel=panel, metavar=metavar)
    return option, list[str] | None


def molecules_and_files(incomplete: str) -> list[str]:
    """Names of the library and files that begin like a word, for a shell that completes it."""
    from glob import escape, glob

    from rotor.formats.molecules.library import names

    files = [f"{path}/" if os.path.isdir(path) else path for path in glob(f"{escape(incomplete)}*")]
    stems = {path.stem.casefold(): path.stem for path in names().values()}
    known = {**{name: name for name in names() if " " not in name}, **stems}
    return sorted(text for name, text in known.items() if name.startswith(incomplete.casefold())) + sorted(files)


class _TextsUnconverted:
    """A command or group whose texts are left unconverted: typer's own conversion loads pydantic, which takes as long as numpy."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, --help among them."""
        return [_unconverted(parameter) for parameter in super().get_params(ctx)]  # type: ignore[misc]


class VerbCommand(_TextsUnconverted, typer.core.TyperCommand):
    """A command whose help has panels: the options that most people use first, all of them by --help-all.

    Readers of declared fields make numbers of its texts.
    """

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments and options, panel by panel."""
        show_all = "--help-all" in (ctx.meta.get("rotor.help") or ())
        panels: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            panel = getattr(parameter, "rich_help_panel", None) or (
                "Arguments" if record and not parameter.opts[0].startswith("-") else "Help"
            )
            if record is not None and (show_all or not panel.startswith("+")):
                panels.setdefault(panel.lstrip("+"), []).append(record)
        for panel in ("Arguments", *PANELS, *sorted(panels.keys() - {"Arguments", *PANELS, "Help"}), "Help"):
            if panel in panels:
                with formatter.section(panel):
                    formatter.write_dl(panels[panel])


class PlainGroup(_TextsUnconverted, typer.core.TyperGroup):
    """The group of all commands."""


def _unconverted(parameter: Any) -> Any:
    def process_value(context: Any, value: Any) -> Any:
        """The value after the callback of its parameter; another option in its place, which the parser takes for it, is refused."""
        dashed = (
            [word.partition("=")[0] for word in value if word[:1] == "-"] if isinstance(value, list | tuple) else []
        )
        if dashed and parameter.opts[0][:1] == "-":
            names = {name for other in context.command.get_params(context) for name in other.opts}
            if other := next((word for word in dashed if word in names), ""):
                context.fail(f"{parameter.opts[0]}: expected a value, but {other} follows")
        return parameter.callback(context, parameter, value) if parameter.callback else value

    parameter.process_value = process_value
    return parameter


def _show_all(context: typer.Context, value: bool) -> None:
    """Print the help with all options and end."""
    if value and not context.resilient_parsing:
        context.meta["rotor.help"] = ("--help-all",)
        typer.echo(context.command.get_help(context), color=context.color)
        raise typer.Exit


def run_verb(
    verb: Verb, options: Mapping[str, tuple[str, Field]], context: typer.Context, help_all: bool = False, **typed: Any
) -> None:
    """Read the inputs of a verb and carry it out. options: identity and field by parameter. typed: texts by parameter.

    Empty texts and repeated single values are refused.
    """
    texts: dict[str, Any] = {}
    for parameter, value in typed.items():
        if value is None or value == [] or value == ():
            continue
        name, field = options[parameter]
        several = tuple(value) if isinstance(value, list | tuple) else (value,)
        if any(isinstance(text, str) and not text.strip() for text in several):
            raise ValueError(f"{field.flag}: the text given is empty; expected one that is not, or leave it out")
        if len(several) > 1 and not field.reader.many:
            raise ValueError(f"{field.flag}: given more than once; it has one value")
        texts[name] = several if field.reader.many else several[0]
    verb = verb.verb_for(texts.keys())
    files_alone = {output.name for output in verb.outputs}
    values = {name: value for name, value in texts.items() if name in verb.fields.keys() - files_alone}
    extras = {each.option: texts[each.option] for each in verb.extras if each.files is None and each.option in texts}
    entries = Entries({**fields_of_extras(verb, extras, values.keys()), **values}, "option")
    inputs = values | extras
    places, flags = with_files(verb, {name: value for name, value in texts.items() if name not in inputs})
    shown = verb.read_shown(entries)
    files = files_of_options(verb, places, flags)
    if files.paths:
        refuse_overwriting(files, inputs)
    view = picture_settings(verb, places, "plot" in files.paths)
    outputs = {**files.paths, **dict.fromkeys(files.on_screen, ())}
    work = Work(None, shown, outputs, note, True, {"command": str(context.obj)}, view, HELD.callback)
    _carry_out(Calculation(verb, entries, work), files, places)


def _carry_out(calculation: Calculation, files: Files, places: Mapping[str, Any]) -> None:
    """Answer, then write the files, JSON and report. places: texts of the options of files, pictures and processes."""
    verb = calculation.verb
    if verb.short(calculation.request):
        process.leave_compiler_out()
    process.begin_work()
    with picture_style(places), processes(verb, places.get("workers", 1)) as executor:
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
        with naming(verb.named, "option"):
            deliver(files, writers, outcome.json, partial(show_answer, verb, answer, report))
        if reason := verb.failure(answer):
            raise NoAnswerError(reason)


def show_answer(verb: Verb, answer: Any, report: Report) -> None:
    """Print the report of a verb and its files, with the table of errors if requested."""
    parts = [*verb.show(answer, report)]
    if report.content.get("files") and not verb.lists_files:
        parts.append([("files", ", ".join(report.content["files"]))])
    if getattr(report.shown, "errors", False):
        from rotor.reports.top_facts import error_parts

        parts += error_parts(report.content)
    show_parts(parts)


def with_files(verb: Verb, typed: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """The texts by output, those of options that name several files among them, and these options by output, for errors."""
    files: dict[str, Any] = {}
    flags: dict[str, str] = {}
    for extra in verb.extras:
        if extra.files is not None and extra.option in typed:
            named = extra.files(typed[extra.option])
            files |= named
            flags |= dict.fromkeys(named.keys() - typed.keys(), extra.option)
    return {**files, **typed}, flags


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
        with within(extra.option):
            values |= extra.read(typed[extra.option])
    return values if verb.read_extras is None else {**values, **verb.read_extras(typed)}


def files_of_options(verb: Verb, typed: Mapping[str, Any], flags: Mapping[str, str]) -> Files:
    """The files to write; ValueError for a suffix or folder in which they cannot be written. flags: options for several files."""
    files = Files(growing={output.name for output in verb.outputs if output.grows})
    for output in verb.outputs:
        paths = typed.get(output.name, ())
        if paths == "-" and ".csv" in output.suffixes and not output.grows:
            files.on_screen.append(output.name)
            continue
        for path in paths if isinstance(paths, tuple) else (paths,):
            files.add(output.name, flags.get(output.name, output.flag), path, output.suffixes)
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


def processes(verb: Verb, workers: Any) -> Any:
    """The executor of --workers; None for a verb without this option."""
    if not verb.workers:
        return nullcontext()
    from rotor.cli.workers import working  # loads concurrent.futures

    with within("--workers"):
        return working(Whole(1, MOST_WORKERS).read(workers), verb.workers.split()[0])


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


def note(text: str) -> None:
    """Print a remark on standard error."""
    clear = "\r\x1b[2K" if sys.stderr.isatty() else ""  # erases the line with the elapsed time
    print(f"{clear}note:", text, file=sys.stderr)


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
