"""Commands of typer that leave texts unconverted, and examples folded for a terminal."""

from __future__ import annotations

import shlex
from typing import Any

import typer.core


def folded(examples: str, width: int = 76) -> str:
    """Examples in which long commands continue on the next line, as a shell reads them.

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


class PlainCommand(typer.core.TyperCommand):
    """A command that leaves texts unconverted; readers of declared fields make numbers of them.

    Typer's own conversion loads pydantic, which takes as long as numpy.
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
