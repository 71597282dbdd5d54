"""Options of a verb in groups: a frozen dataclass holds one group, and the command has one parameter for each of its fields.

@dataclass(frozen=True)
class Options:
    temperature: str = option("300", metavar="T", help="Temperature (K).")
    csv: str | None = file_option(".csv", help="Write all lines as CSV.")

@grouped()
def command(context: typer.Context, given: Input, options: Options) -> None: ...
"""

from __future__ import annotations

import inspect
import os
import shlex
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, field, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
import typer.core

Command = Callable[..., None]
MOST_WHOLE = 10**15  # of an option: beyond it a double no longer holds every whole number


def option(default: Any, *names: str, **settings: Any) -> Any:
    """A field of a group: its default, its name on the command line if that is not its own, and what `typer.Option` takes."""
    return field(default=default, metadata={"parameter": typer.Option(default, *names, **settings)})


def argument(default: Any = None, **settings: Any) -> Any:
    """A field that stands on the command line without a name."""
    return field(default=default, metadata={"parameter": typer.Argument(default, show_default=False, **settings)})


def file_option(*suffixes: str, name: str | None = None, **settings: Any) -> Any:
    """A field that names a file to write, with the suffixes that it may have; see `rotor.cli.shared.output.Files`."""
    made = typer.Option(None, *([name] if name else []), metavar="FILE", **settings)
    return field(default=None, metadata={"parameter": made, "suffixes": suffixes})


def name_of(one: Field[Any]) -> str:
    """How a field is called on the command line: `--range` for `range_`.

    >>> from dataclasses import make_dataclass
    >>> name_of(fields(make_dataclass("Group", [("min_lgint", str, option("-12"))]))[0])
    '--min-lgint'
    """
    declared = [text for text in one.metadata["parameter"].param_decls or () if text.startswith("--")]
    return declared[0] if declared else "--" + one.name.rstrip("_").replace("_", "-")


def refuse_overwriting(groups: Sequence[Any]) -> None:
    """ValueError where a file that one option writes is a file that another option, or the source, names as what is read.

    groups: all options of a command. Options of pictures are texts; they name no file.
    """
    written = [asked for group in groups for asked in files_asked(group) if asked[1] is not None]
    outputs = [(name, Path(path)) for name, path, _ in written if path is not None]
    outputs += [("--json", Path(group.json)) for group in groups if getattr(group, "json", None)]
    if not outputs:
        return
    inputs = {os.path.realpath(text) for group in groups for text in _texts_read(group) if _is_file(text)}
    for name, path in outputs:
        if os.path.realpath(path) in inputs:
            raise ValueError(f"{name} {path}: is an input of this command; write the result under another name")


def _texts_read(group: Any) -> list[str]:
    """The values of a group that may name files to read."""
    values = [
        getattr(group, one.name)
        for one in fields(group)
        if "suffixes" not in one.metadata and one.name != "json" and not one.name.startswith("plot_")
    ]
    return [text for value in values for text in (value if isinstance(value, list) else [value]) if _named(text)]


def _named(value: Any) -> bool:
    return isinstance(value, str) and bool(value)


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # a text that no path can be: too long, or with a zero byte
        return False


def files_asked(group: Any) -> list[tuple[str, str | None, Sequence[str]]]:
    """Option, path and suffixes of every field of a group that names a file to write."""
    return [
        (name_of(one), getattr(group, one.name), one.metadata["suffixes"])
        for one in fields(group)
        if "suffixes" in one.metadata
    ]


def grouped(**omitted: Sequence[str]) -> Callable[[Command], Command]:
    """A decorator: the command with a parameter for every field of the dataclasses in its signature.

    omitted: by the name of a group, fields that this command does not have; they keep their defaults.
    """

    def decorate(command: Command) -> Command:
        """The command with one parameter for each field of its groups."""
        hints = get_type_hints(command)
        groups = {name: hints[name] for name in inspect.signature(command).parameters if is_dataclass(hints[name])}
        chosen = {
            name: [one for one in fields(group) if one.name not in omitted.get(name, ())]
            for name, group in groups.items()
        }

        types = {name: get_type_hints(group) for name, group in groups.items()}

        def flat(context: typer.Context, **values: Any) -> None:
            made = {
                name: group(
                    **{one.name: value_of(one, types[name][one.name], values[one.name]) for one in chosen[name]}
                )
                for name, group in groups.items()
            }
            refuse_overwriting(list(made.values()))
            command(context, **made)

        parameters = [inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)]
        for name in groups:
            parameters += [_parameter(one, types[name][one.name]) for one in chosen[name]]
        flat.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        flat.__annotations__ = {one.name: one.annotation for one in parameters}
        flat.__doc__ = command.__doc__
        return flat

    return decorate


def _shown_name(one: Field[Any]) -> str:
    """`--range` of an option, `SOURCE` of what stands without a name."""
    parameter = one.metadata["parameter"]
    if isinstance(parameter, typer.models.ArgumentInfo):
        return parameter.metavar or one.name.upper()
    return name_of(one)


def _parameter(one: Field[Any], kind: Any) -> inspect.Parameter:
    assert one.default is not MISSING, f"{one.name}: an option has a default"
    return inspect.Parameter(
        one.name, inspect.Parameter.KEYWORD_ONLY, default=one.metadata["parameter"], annotation=kind
    )


def folded(examples: str, width: int = 76) -> str:
    """Examples with commands that are longer than a line continued on the next one, as a shell takes them.

    >>> print(folded("  rotor levels water --jmax 4 --plot terms.png", width=30))
      rotor levels water \\
          --jmax 4 \\
          --plot terms.png
    """
    return "\n".join(_folded_line(line, width) for line in examples.split("\n"))


def _folded_line(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    words = shlex.split(line, posix=False)
    indent = line[: len(line) - len(line.lstrip())]
    rows, row = [], indent + words[0]
    for number, word in enumerate(words[1:], 1):
        with_value = word.startswith("-") and number + 1 < len(words)  # an option stays beside its value
        needed = len(word) + (1 + len(words[number + 1]) if with_value and not words[number + 1].startswith("-") else 0)
        if len(row) + 1 + needed > width - 2:
            rows.append(row + " \\")
            row = indent + "    " + word
        else:
            row += " " + word
    return "\n".join([*rows, row])


def value_of(one: Field[Any], kind: Any, given: Any) -> Any:
    """The value of a field from what stands on the command line: text, whole or decimal number, truth, or texts."""
    kinds = get_args(kind) or (kind,)
    if given is None and kinds == (str,):
        raise ValueError(f"{_shown_name(one)} is missing; --help shows what the command takes")
    if given is None or isinstance(given, bool):
        return given
    texts = given if isinstance(given, (list, tuple)) else [given]
    if given != one.default and any(isinstance(text, str) and not text.strip() for text in texts):
        raise ValueError(f"{_shown_name(one)}: the text given is empty; expected one that is not, or leave it out")
    if list[str] in kinds:
        return list(given) or None
    for number, name in ((int, "a whole number"), (float, "a number")):
        if number in kinds:
            try:
                found = number(given)
            except ValueError:
                raise ValueError(f"{name_of(one)}: {given!r:.60}: expected {name}") from None
            if number is int and abs(found) > MOST_WHOLE:
                raise ValueError(
                    f"{name_of(one)}: a number of {len(str(abs(found)))} digits; expected at most {MOST_WHOLE}"
                )
            return found
    return given


class PlainCommand(typer.core.TyperCommand):
    """A command that passes texts on as they are; `grouped` makes numbers of them.

    Typer's own conversion loads pydantic, which takes as long as numpy.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, --help among them."""
        return [_unconverted(one) for one in super().get_params(ctx)]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The arguments, refused where an option that has one value is given twice: none is dropped silently."""
        single = {text for one in self.params if not one.multiple for text in (*one.opts, *one.secondary_opts)}
        given = [word.partition("=")[0] for word in args if word.startswith("--")]
        twice = next((word for word in given if word in single and given.count(word) > 1), None)
        if twice is not None:
            raise ValueError(f"{twice}: given more than once; it has one value")
        return super().parse_args(ctx, args)


class PlainGroup(typer.core.TyperGroup):
    """The same for what stands before a verb."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, --help among them."""
        return [_unconverted(one) for one in super().get_params(ctx)]


def _unconverted(parameter: Any) -> Any:
    def process_value(context: Any, value: Any) -> Any:
        """The value after the callback of its parameter."""
        return parameter.callback(context, parameter, value) if parameter.callback else value

    parameter.process_value = process_value
    return parameter
