"""`rotor convert`: constants from one format into another, SPFIT's files to TOML and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import argument, grouped, option
from rotor.cli.shared.output import Files, Writer, deliver, json_text, note

if TYPE_CHECKING:
    from rotor.tops.spins.spin_constants import SpinConstants
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor convert case.var constants.toml
  rotor convert constants.toml case.par --kmax 60
  rotor convert water water.var"""


@dataclass(frozen=True)
class Options:
    """What is read and what is written."""

    source: str = argument(..., help="File (.par, .var, .int, .toml, ...) or name.")
    target: str = argument(..., help="File to write: .toml, .par or .var.")
    kmax: int = option(99, metavar="N", help="Highest K of a .par or .var (KNMAX).")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """Constants, dipole and spin weights into another format; nothing is converted but the format."""
    require_whole("--kmax", options.kmax, 0, 359)
    files, source, target = Files(), options.source, options.target
    files.ask("TARGET", target, (".toml", ".par", ".var"))
    files.ask_json(options.json)
    _refuse_overwriting(source, target)
    top = top_with_errors(source)

    from rotor.cli.shared.report import describe

    content = {**describe(top, source, context.obj), "files": files.names}
    done = f"{source} → {target}: {top.constants.text()}"
    writers = {"TARGET": writer_of(top, source, target, options.kmax)}
    deliver(files, writers, lambda: json_text(content), lambda: print(done))


def _refuse_overwriting(source: str, target: str) -> None:
    """Neither the source nor the .var, .par and .int beside it, which are read with it, is written over."""
    path = Path(source)
    if not path.is_file():
        return
    beside = [path.with_suffix(suffix) for suffix in (".var", ".par", ".int")]
    read = [path, *(beside if path.suffix.lower() == ".int" else [])]
    if Path(target).resolve() in {one.resolve() for one in read}:
        raise ValueError(f"TARGET {target}: is an input of this command; write the result under another name")


def top_with_errors(source: str) -> Top:
    """The top a source means; of a .var file the errors of its parameters are the constants' uncertainties."""
    top = inputs.read_top(Input(source))
    path = Path(source)
    if path.suffix.lower() == ".int":
        from rotor.formats.spcat.predict import parameters_beside

        path = parameters_beside(path)
    if path.suffix.lower() != ".var" or not path.exists():
        return top

    from rotor.formats.spcat.codes import constants_of
    from rotor.formats.spcat.text.par import read_par

    return replace(top, constants=constants_of(read_par(path), errors=True))


def _without_atoms(top: Top) -> SpinConstants | None:
    """The constants of spins for a file without a geometry."""
    return None if top.spin_constants is None else replace(top.spin_constants, atoms={})


def writer_of(top: Top, source: str, target: str, kmax: int) -> Writer:
    """What writes the top in the format that the target's suffix names; what that cannot say is refused or noted."""
    if target.lower().endswith(".toml"):
        from rotor.formats.molecules.molecule_file import MoleculeFile
        from rotor.formats.molecules.molecule_writer import write_molecule_file

        sources = {"constants": top.source, "dipole": top.dipole_source, "spin_weights": top.weights_source}
        sources = {table: text or f"converted from {Path(source).name}" for table, text in sources.items()}
        if not top.dipole_abc_debye:
            del sources["dipole"]
        file = MoleculeFile(
            name=top.name or Path(target).stem,
            constants=top.constants,
            dipole_abc_debye=top.dipole_abc_debye,
            spin_weights=top.spin_weights,
            sources=sources,
            covariance=top.covariance,
            states=top.states,
            spin_constants=_without_atoms(top),
        )
        return lambda path: write_molecule_file(file, path)

    from rotor.fit.top_constants import TopConstants
    from rotor.formats.spcat.model import parameter_file
    from rotor.formats.spcat.named_codes import named_parameter_file
    from rotor.formats.spcat.text.par import write_par

    if top.dipole_abc_debye and any(top.dipole_abc_debye):
        dipole = ", ".join(f"{mu:g}" for mu in top.dipole_abc_debye)
        note(f"a {Path(target).suffix} file has no place for the dipole ({dipole} D); it belongs into an .int file")
    if top.states is None and top.spin_constants is None:
        parameters = parameter_file(top, kmax)
    else:
        constants = TopConstants(top, top.spin_constants is not None)
        parameters = named_parameter_file(constants, top.name, kmax)[0]
    return lambda path: write_par(parameters, path)
