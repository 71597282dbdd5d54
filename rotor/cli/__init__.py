"""The command line: verbs declared in `rotor.verbs` and in this folder, carried out by one runner.

docs/command_line.md and docs/verbs are the contract: options, columns, JSON keys, error texts, exit codes. Heavy modules are imported
only after a verb has checked its input.
"""

from __future__ import annotations

import os
import shlex
import signal
import sys
import traceback
from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, cast

import typer

from rotor.checks import NoAnswerError, RunStopped, require_file
from rotor.cli import process
from rotor.verbs import declared_verbs, first_file_text, has_small_blocks, highest_j_in, kind_in

if TYPE_CHECKING:
    from rotor.verbs.common.verb import Verb

VERBS = {  # with their lines in the list of verbs, short enough for 80 columns
    "spectrum": "Rotational lines: frequencies and intensities.",
    "emission": "Lines as a radio telescope sees them.",
    "info": "A molecule as a top: frame, constants, kind, Q(T).",
    "levels": "Energy levels as a table and a term diagram.",
    "molecules": "The molecules known by name, with their sources.",
    "isotopologues": "Isotopologues: abundance, constants, axes, dipole.",
    "raman": "Rotational Raman lines and their cross sections.",
    "thermo": "Partition function, entropy, heat capacity.",
    "torsion": "Rotation about a bond: levels, tunnelling, heat.",
    "tumble": "The exact free rotation of a molecule or a body.",
    "stark": "Levels in a static electric field.",
    "zeeman": "Levels in a static magnetic field.",
    "align": "Molecules aligned or oriented by pulses of light.",
    "gas": "A classical gas: equipartition, correlations.",
    "fluid": "Rigid molecules in a periodic box, run in time.",
    "fit": "Constants from measured lines, with their errors.",
    "assign": "Constants of unknown molecules from a spectrum.",
    "structure": "Structures from the constants of isotopologues.",
    "convert": "Constants from one file format into another.",
    "view": "A spectrum and its assignment in the browser.",
    "identify": "Which species an observed spectrum needs.",
    "catalogue": "A local catalogue of lines: add, list, show.",
    "cat": "A catalogue as a table, filtered or compared.",
    "new": "A commented scene file to begin with.",
    "plan": "What a scene will do, its cost, what it omits.",
    "run": "Run a scene file; a sweep resumes where it stopped.",
    "accuracy": "What accuracy costs in a scene: errors and times.",
}
VERBS |= {name: "" for name in declared_verbs() if name not in VERBS}  # the list shows a new verb's declaration
FILES = {"run": "run_scene"}  # a verb whose name is that of a function of this module
WITH_SCENE = ("run", "plan", "accuracy")
COMPLETION = "_ROTOR_COMPLETE"  # set by a shell that asks for completions
NO_ANSWER, WRONG_INPUT, INTERRUPTED, TERMINATED = 1, 2, 130, 143
# click's ClickException, whether click is a package of its own or, in a newer typer, a part of it
_UsageError = cast(type[Exception], typer.BadParameter.__mro__[2])

EXAMPLES = """\
  rotor spectrum water
  rotor spectrum "SMILES:C=O" --temperature 100
  rotor spectrum my.xyz --dipole 0,0,1.85 --range 0:2000GHz --cat out.cat --plot out.png
  rotor spectrum --constants "A=835840.288 B=435351.717 C=278138.7 MHz" --dipole-abc 0,1.8546,0
  rotor emission CH3CN HC3N --band ALMA6 --column 1e15,3e14 --width 5 --plot core.png
  rotor info my.sdf
  rotor levels water --jmax 5 --plot terms.png
  rotor isotopologues water
  rotor raman N2 --laser 488
  rotor thermo water --temperature 10:1000K:100 --plot heat.png
  rotor torsion C2H6 --bond 1-2 --plot ethane.png
  rotor tumble water --plot water.png
  rotor stark OCS --field 0:200kV/cm --plot stark.png
  rotor zeeman --constants "B=6081.5 MHz" --g -0.03 --field 0:5T
  rotor align OCS --pulse "1e13 W/cm2, 1 ps" --plot align.png
  rotor gas water --molecules 20000 --seed 7
  rotor fluid water --molecules 216 --csv run.csv
  rotor fit case.par --out fitted
  rotor assign peaks.csv --plot assigned.png
  rotor view spectrum.csv water
  rotor structure family.toml --plot molecule.png
  rotor new spectrum > s.toml && rotor run s.toml"""


def _application(verbs: Iterable[str] = VERBS, *, listed: bool = False) -> typer.Typer:
    """The command with these verbs. listed: only their names and help lines; their modules are not loaded."""
    group: Any = None
    if not listed:
        from rotor.cli.command import PlainGroup as group
    app = typer.Typer(
        cls=group,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
    )

    @app.callback(help="A molecule goes in, a rotational spectrum comes out.", epilog=headed(EXAMPLES))
    def start(
        version: bool = typer.Option(
            False, "--version", is_eager=True, help="Print the version and stop.", callback=_print_version
        ),
        debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error."),
    ) -> None:
        pass

    for verb in verbs:
        if listed and VERBS[verb]:
            app.command(verb, short_help=VERBS[verb])(_listed)
            continue
        from rotor.cli.command import VerbCommand, command_of

        declared = declaration(verb)
        app.command(verb, cls=VerbCommand, short_help=VERBS[verb] or declared.about, epilog=headed(declared.examples))(
            command_of(declared)
        )
    return app


def folded(examples: str, width: int = 76) -> str:
    """Examples in which long commands continue on the next line, as a shell reads them.

    >>> print(folded("  rotor levels water --jmax 4 --plot terms.png", width=30))
      rotor levels water \\
          --jmax 4 \\
          --plot terms.png
    """
    return "\n".join(_folded_line(line, width) for line in examples.split("\n"))


def headed(examples: str) -> str:
    """Examples of a command, folded, below a heading; typer leaves lines after \\b as they are."""
    return f"\b\nExamples:\n{folded(examples)}" if examples else ""


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


def _listed() -> None:
    """Placeholder of a verb in the list of verbs."""


def declaration(name: str) -> Verb:
    """The declaration of a verb."""
    folder = "cli" if find_spec(f"rotor.verbs.{name}") is None else "verbs"
    verb: Verb = import_module(f"rotor.{folder}.{FILES.get(name, name)}").VERB
    return verb


def _print_version(requested: bool) -> None:
    if requested:
        import rotor

        print(f"rotor {rotor.__version__}")
        raise typer.Exit


class Terminated(BaseException):
    """SIGTERM or SIGHUP arrived: unfinished files are removed, as after Ctrl-C."""


def _terminated(number: int, frame: object) -> None:
    raise Terminated


def run(arguments: Sequence[str] | None = None) -> int:
    """Carry out a command and return its exit code. An error is one line on standard error, or a traceback with --debug."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    if "--debug" in arguments:  # typer expects it first; users add it at the end
        arguments = ["--debug", *(word for word in arguments if word != "--debug")]
    words = [word for word in arguments[:2] if word != "--debug"]
    is_verb = bool(words) and words[0] in VERBS
    if is_verb:
        _limit_threads(words[0], arguments)
    # undecodable bytes of file names are read as UTF-8, or shown as �
    provenance = shlex.join(["rotor", *arguments]).encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    try:
        # modules of other verbs are not loaded
        command = typer.main.get_command(_application(words[:1] if is_verb else VERBS, listed=not is_verb))
        with command.make_context("rotor", [*arguments] or ["--help"], obj=provenance) as context:
            command.invoke(context)
        sys.stdout.flush()
        return 0
    except typer.Exit as end:
        return end.exit_code
    except BrokenPipeError:  # the reader closed the pipe: write nothing more, also at exit
        _close_output()
        return 0
    except Terminated:
        return TERMINATED
    except KeyboardInterrupt as stop:  # its text says which files are there
        with suppress(OSError):
            print(str(stop) or "interrupted; nothing was written", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        return _fail(*_failure(error, arguments), arguments)
    finally:
        process.HELD.close()


def _limit_threads(verb: str, arguments: Sequence[str]) -> None:
    """One thread of BLAS where the verb, or the kind of its scene, has small blocks. The limit must be set before numpy is loaded."""
    text = " ".join(arguments)
    if verb in WITH_SCENE:
        text = first_file_text(arguments[1:])
        verb = kind_in(text)
    if has_small_blocks(verb):
        process.one_thread_of_blas(highest_j_in(text))


def _failure(error: Exception, arguments: list[str]) -> tuple[int, str]:
    """Exit code and message of an error."""
    if isinstance(error, _UsageError):
        return WRONG_INPUT, _usage_text(error, arguments)
    if isinstance(error, NoAnswerError | RunStopped):
        return NO_ANSWER, str(error)
    if isinstance(error, ValueError | OSError):
        return _exit_code(error), _message(error)
    if isinstance(error, MemoryError):
        return NO_ANSWER, "not enough memory for this; fewer atoms, levels, lines or times need less"
    if isinstance(error, ImportError) and " is not installed" in str(error):  # an extra, named with its command
        return NO_ANSWER, str(error)
    # a defect of the program, not of the input
    text = f"{type(error).__name__}: {error}"
    return NO_ANSWER, f"{text}; this is a defect, please report it with the output of --debug"


def _usage_text(error: Exception, arguments: list[str]) -> str:
    """Message of the command-line parser, with a remedy for superfluous words."""
    text = str(error.format_message())  # type: ignore[attr-defined]
    if text.startswith("No such command") and text.endswith("."):  # with a guess, the text ends with a question mark
        return f"{text.rstrip('.')}; --help lists the commands"
    without_guesses = text.partition(" (")[0]
    if without_guesses == "No such option: --constants":
        return f"{without_guesses}; this verb needs the atoms: a name, a file, or 'SMILES:...'"
    if without_guesses == "No such option: --temperature" and "emission" in arguments[:2]:
        return f"{without_guesses}; the temperature of the molecules is --excitation"
    extra = text.removeprefix("Got unexpected extra argument(s) ").removeprefix("Got unexpected extra argument ")
    if extra == text:
        return text
    for option, number, unit in zip(arguments, arguments[1:], arguments[2:], strict=False):
        if option.startswith("--") and number[-1:].isdigit() and extra.strip("()").split()[:1] == [unit]:
            return f"{option} {number} {unit}: a number and its unit are one word or stand in quotes: {option} '{number} {unit}'"
    return f"{extra.strip('()')}: more than the command takes; an option begins with --, --help shows what there is"


def _exit_code(error: ValueError | OSError) -> int:
    """Exit code of an error: a full disk is not wrong input."""
    from rotor.formats.atomic_write import FULL

    return NO_ANSWER if isinstance(error, OSError) and error.errno in FULL else WRONG_INPUT


def _message(error: ValueError | OSError) -> str:
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    # errors of files carry their names: this is the output
    if error.filename is None and _exit_code(error) == NO_ANSWER:
        _close_output()
        return f"standard output: {error.strerror}"
    if isinstance(error, FileNotFoundError | IsADirectoryError) and error.filename:  # the texts of files checked before
        try:
            require_file(error.filename)
        except ValueError as plain:
            return str(plain)
    return f"{error.filename}: {error.strerror}" if error.filename else error.strerror


def _close_output() -> None:
    """Discard standard output from now on, including its buffer."""
    with suppress(OSError):  # standard output without a file descriptor
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(code: int, message: str, arguments: Sequence[str]) -> int:
    if "--debug" in arguments[:1]:
        traceback.print_exc()
    with suppress(OSError):  # standard error is full or closed
        print("error:", " ".join(message.split()), file=sys.stderr)
    return code


def main() -> None:
    """The console script `rotor`."""
    process.begin()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without Greek letters shows question marks
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP; under nohup it stays ignored
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _terminated)
    if COMPLETION in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()
        _application()(prog_name="rotor")
    process.end(run())
