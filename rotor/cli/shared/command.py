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
from rotor.frozen import dataclass
from rotor.requests.field import NUMERICS, OUTPUT, PANELS, REQUIRED, Field
from rotor.requests.readers import Flag
from rotor.verbs.outputs import Output
from rotor.verbs.verb import Extra, Verb

JSON_HELP = "Everything printed, as JSON; - is standard output"
SCENE_HELP = "Write down the scene, which 'rotor run' gives again (.toml)"


@dataclass(frozen=True)
class Parameter:
    """One option of a command. identity: of the input, or the name of the file. kind: of the value of the parser."""

    identity: str
    flag: str
    help: str
    metavar: str = "TEXT"
    panel: str = OUTPUT
    common: bool = False
    kind: Any = str
    off: bool = False
    many: bool = False
    required: bool = False

    @property
    def name(self) -> str:
        """The name of the parameter of the function behind it."""
        return re.sub(r"\W", "_", self.flag.strip("-").lower()) + "_"


def parameters_of(verb: Verb) -> list[Parameter]:
    """Every option of a verb; those of a tool are few, and --help shows all."""
    parameters = [_input(field) for field in verb.parameters.values()]
    parameters += [_extra(extra) for extra in verb.extras]
    parameters += [_file(output) for output in verb.all_outputs]
    if verb.has_json:
        parameters.append(Parameter("json", "--json", JSON_HELP, "FILE", OUTPUT, True))
    if verb.has_scenes:
        parameters.append(Parameter("save_scene", "--save-scene", SCENE_HELP, "FILE", OUTPUT))
    if any(output.name == "plot" for output in verb.outputs):
        parameters += [_input(field) for name, field in picture_fields().items() if name not in _left_out(verb)]
    if verb.spread:
        parameters.append(
            Parameter("workers", "--workers", f"Processes over which {verb.spread} are spread", "N", NUMERICS)
        )
    return parameters if verb.has_scenes else [replace(parameter, common=True) for parameter in parameters]


def _left_out(verb: Verb) -> set[str]:
    if verb.drawn is None:
        return {*PLOT_NAMES} - {"style"}
    return ({"plot_unit"} if not verb.spectral else set()) | (set() if verb.scaled else {"plot_scale"})


def _input(field: Field) -> Parameter:
    flag = isinstance(field.reader, Flag)
    default = _default_text(field)
    help_ = f"{field.help} [{default}]" if default else field.help
    metavar = field.metavar or field.reader.metavar
    off = isinstance(field.reader, Flag) and field.reader.off
    return Parameter(
        field.identity, field.flag, help_, metavar, field.heading, field.common, bool if flag else str, off, field.reader.many,
        field.default is REQUIRED,
    )  # fmt: skip


def _default_text(field: Field) -> str:
    if field.typed is not None:
        return str(field.typed)
    if field.default in (None, REQUIRED) or isinstance(field.default, bool) or field.default in ((), "", {}):
        return ""
    return field.reader.show(field.default)


def _extra(extra: Extra) -> Parameter:
    kind = str if extra.metavar else bool
    return Parameter(
        extra.option,
        extra.option,
        extra.help,
        extra.metavar,
        extra.panel or OUTPUT,
        extra.common,
        kind,
        many=extra.many,
    )


def _file(output: Output) -> Parameter:
    return Parameter(
        output.name, output.flag, output.help, "FILE", OUTPUT, True, many=output.many, required=output.required
    )


def command_of(verb: Verb, run: Callable[[Verb, typer.Context, Mapping[str, Any]], None]) -> Callable[..., None]:
    """A function for typer with one parameter for each option of a verb; run: is given the texts by identity."""
    options = parameters_of(verb)
    by_name = {option.name: option for option in options}

    def call(context: typer.Context, **typed: Any) -> None:
        texts = {}
        for name, value in typed.items():
            if name != "help_all" and value is not None and value != [] and value != ():
                option = by_name[name]
                if any(isinstance(text, str) and not text.strip() for text in (value if option.many else [value])):
                    raise ValueError(
                        f"{option.flag}: the text given is empty; expected one that is not, or leave it out"
                    )
                texts[option.identity] = tuple(value) if option.many else value
        run(verb, context, texts)

    parameters = [inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)]
    parameters += [_signature_of(option) for option in options]
    if any(not option.common for option in options):
        everything = typer.Option(False, "--help-all", is_eager=True, callback=_show_all, help="Show all options.")
        parameters.append(
            inspect.Parameter("help_all", inspect.Parameter.KEYWORD_ONLY, default=everything, annotation=bool)
        )
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    call.__doc__ = verb.about
    return call


def _signature_of(option: Parameter) -> inspect.Parameter:
    kind: Any = bool if option.kind is bool else list[str] if option.many else str
    if not option.flag.startswith("-"):
        words = molecules_and_files if option.flag == "SOURCE" else None
        first: Any = ... if option.required else None
        default = typer.Argument(
            first, show_default=False, metavar=option.flag, help=f"{option.help}.", autocompletion=words
        )
    else:
        names = f"{option.flag}/--no-{option.flag[2:]}" if option.off else option.flag
        settings: dict[str, Any] = {} if option.kind is bool else {"metavar": option.metavar}
        panel = f"{'' if option.common else '+'}{option.panel}"
        default = typer.Option(
            None, names, show_default=False, help=f"{option.help}.", rich_help_panel=panel, **settings
        )
    return inspect.Parameter(option.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind | None)


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

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments; ValueError for an option with a single value that is given twice."""
        single = {
            text
            for parameter in self.params
            if not parameter.multiple
            for text in (*parameter.opts, *parameter.secondary_opts)
        }
        names = [word.partition("=")[0] for word in args if word.startswith("--")]
        twice = next((word for word in names if word in single and names.count(word) > 1), None)
        if twice is not None:
            raise ValueError(f"{twice}: given more than once; it has one value")
        return super().parse_args(ctx, args)

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
