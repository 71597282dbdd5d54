"""The command of a verb, made from its declaration: one option for each input and file, and help in panels."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import typer
import typer.core

from rotor.cli.shared.plot_options import PLOT_NAMES, picture_fields
from rotor.requests.field import NUMERICS, OUTPUT, PANELS, REQUIRED, Field
from rotor.requests.readers import Flag, Text
from rotor.verbs.verb import Verb

JSON_HELP = "Everything printed, as JSON; - is standard output"
FILE, COUNT = Text(metavar="FILE"), Text(metavar="N")
SCENE_HELP = "Write down the scene, which 'rotor run' gives again (.toml)"


def options_of(verb: Verb) -> dict[str, Field]:
    """Every option of a verb, by identity of the input or name of the file; those of a tool are few, and --help shows all."""
    fields = verb.parameters | {extra.option: extra.field for extra in verb.extras}
    fields |= {output.name: output.field for output in verb.all_outputs}
    if verb.has_json:
        fields["json"] = Field(FILE, JSON_HELP, name="json", panel=OUTPUT, common=True)
    if verb.has_scenes:
        fields["save_scene"] = Field(FILE, SCENE_HELP, name="save_scene", panel=OUTPUT)
    if any(output.name == "plot" for output in verb.outputs):
        fields |= {name: field for name, field in picture_fields().items() if name not in _left_out(verb)}
    if verb.spread:
        fields["workers"] = Field(
            COUNT, f"Processes over which {verb.spread} are spread", name="workers", panel=NUMERICS
        )
    return fields if verb.has_scenes else {name: replace(field, common=True) for name, field in fields.items()}


def _left_out(verb: Verb) -> set[str]:
    if verb.drawn is None:
        return {*PLOT_NAMES} - {"style"}
    return ({"plot_unit"} if not verb.spectral else set()) | (set() if verb.scaled else {"plot_scale"})


def command_of(verb: Verb, run: Callable[[Verb, typer.Context, Mapping[str, Any]], None]) -> Callable[..., None]:
    """A function for typer with one parameter for each option of a verb; run: is given the texts by identity."""
    options = options_of(verb)
    identities = {re.sub(r"\W", "_", field.flag.strip("-").lower()) + "_": name for name, field in options.items()}

    def call(context: typer.Context, help_all: bool = False, **typed: Any) -> None:
        """Refuse empty texts and repeated single values, and run the verb with the others by identity."""
        texts = {}
        for name, value in typed.items():
            if value is not None and value != [] and value != ():
                field = options[identities[name]]
                several = tuple(value) if isinstance(value, list | tuple) else (value,)
                if any(isinstance(text, str) and not text.strip() for text in several):
                    raise ValueError(
                        f"{field.flag}: the text given is empty; expected one that is not, or leave it out"
                    )
                if len(several) > 1 and not field.reader.many:
                    raise ValueError(f"{field.flag}: given more than once; it has one value")
                texts[identities[name]] = several if field.reader.many else several[0]
        run(verb, context, texts)

    defaults: dict[str, tuple[Any, Any]] = {"context": (inspect.Parameter.empty, typer.Context)}
    defaults |= {name: _parameter_of(options[identity]) for name, identity in identities.items()}
    few = all(field.common for field in options.values())  # --help shows them all, and --help-all the same
    show = typer.Option(False, "--help-all", is_eager=True, callback=_show_all, help="Show all options.", hidden=few)
    defaults["help_all"] = show, bool
    parameters = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, (default, kind) in defaults.items()
    ]
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {name: kind for name, (_, kind) in defaults.items()}
    call.__doc__ = verb.about
    return call


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
    panel = f"{'' if field.common else '+'}{field.heading}"
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


class VerbCommand(typer.core.TyperCommand):
    """A command whose help has panels: the options that most people use first, all of them by --help-all.

    Texts are left unconverted; readers of declared fields make numbers of them. Typer's own conversion loads pydantic, which takes as
    long as numpy.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, --help among them."""
        return [_unconverted(parameter) for parameter in super().get_params(ctx)]

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


class PlainGroup(typer.core.TyperGroup):
    """A group of commands that leaves texts unconverted."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, --help among them."""
        return [_unconverted(parameter) for parameter in super().get_params(ctx)]


def _unconverted(parameter: Any) -> Any:
    def process_value(context: Any, value: Any) -> Any:
        """The value after the callback of its parameter."""
        return parameter.callback(context, parameter, value) if parameter.callback else value

    parameter.process_value = process_value
    return parameter


def _show_all(context: typer.Context, value: bool) -> None:
    """Print the help with all options and end."""
    if value and not context.resilient_parsing:
        context.meta["rotor.help"] = ("--help-all",)
        typer.echo(context.command.get_help(context), color=context.color)
        raise typer.Exit
