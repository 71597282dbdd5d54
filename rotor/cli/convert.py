"""`rotor convert`: constants from one format into another, SPFIT's files to TOML and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, grouped, option
from rotor.cli.shared.output import Files, Writer, deliver, json_text, note
from rotor.verbs.molecule import refuse_weights_of_another_kind

if TYPE_CHECKING:
    from rotor.formats.molecules.molecule_file import MoleculeFile
    from rotor.formats.spcat.text.int_file import IntensityFile
    from rotor.tops.top import Top

EXAMPLES = """\b
Examples:
  rotor convert case.var constants.toml
  rotor convert constants.toml case.par --kmax 60
  rotor convert water water.var
  rotor convert NH3 ammonia.par && rotor convert NH3 ammonia.int"""


@dataclass(frozen=True)
class Options:
    """What is read and what is written."""

    source: str = argument(..., help="File (.par, .var, .int, .toml, ...) or name.")
    target: str = argument(..., help="File to write: .toml, .par, .var or .int.")
    kmax: int = option(99, metavar="N", help="Highest K of a .par or .var (KNMAX), highest F of an .int.")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """Constants, spins, states, dipoles and weights into another format; nothing is converted but the format."""
    require_whole("--kmax", options.kmax, 0, 359)
    files, source, target = Files(), options.source, options.target
    files.ask("TARGET", target, (".toml", ".par", ".var", ".int"))
    files.ask_json(options.json)
    _refuse_overwriting(source, target)
    top = top_with_errors(source)

    from rotor.reports.top_facts import describe

    content = {**describe(top, source, context.obj), "files": files.names}
    done = f"{source} → {target}: {top.constants.text()}{_further(top)}"
    writers = {"TARGET": writer_of(top, source, target, options.kmax)}
    _note_of_options(top, source, target, options.kmax)
    deliver(files, writers, lambda: json_text(content), lambda: print(done))


def _further(top: Top) -> str:
    """What goes with the constants of the first state, in words."""
    states = f"; {top.states.count} states" if top.states else ""
    spins = f"; spins {', '.join(top.spin_constants.twice)}" if top.spin_constants else ""
    return states + spins


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
    path = Path(source)
    if path.suffix.lower() == ".int":
        from rotor.formats.spcat.predict import parameters_beside

        path = parameters_beside(path)
    if path.suffix.lower() != ".var" or not path.exists():
        return inputs.read_top(source)

    from rotor.formats.read_write import read_spcat_top
    from rotor.formats.spcat.hamiltonian.codes import constants_of
    from rotor.formats.spcat.hamiltonian.states import has_one_state
    from rotor.formats.spcat.text.par import read_par

    file, top = read_par(path), read_spcat_top(path, errors=True)
    return replace(top, constants=constants_of(file, errors=True)) if has_one_state(file) else top


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
            covariance=top.covariance,
            dipole_abc_debye=top.dipole_abc_debye,
            spin_weights=top.spin_weights,
            states=top.states,
            internal_rotation=top.internal_rotation,
            spin_constants=top.spin_constants,
            polarizability_abc_angstrom3=top.polarizability_abc_angstrom3,
            magnetic=top.magnetic,
            sources=sources,
        )
        _refuse_unreadable(file, source)
        return lambda path: write_molecule_file(file, path)

    from rotor.tops.top import without_internal_rotation

    without_internal_rotation(top, f"a {Path(target).suffix} file")
    if top.level_table is not None:
        note(
            f"a {Path(target).suffix} file has no place for the table of level energies, which count before the constants"
        )
    if target.lower().endswith(".int"):
        from rotor.formats.spcat.text.int_file import write_int

        intensities = _intensities(top, kmax)
        return lambda path: write_int(intensities, path)

    from rotor.formats.spcat.names.named_parameters import named_parameter_file
    from rotor.formats.spcat.text.par import write_par

    moments = [top.dipole_abc_debye or (0.0, 0.0, 0.0), *(top.states.dipoles.values() if top.states else ())]
    if any(map(any, moments)):
        dipole = ", ".join(f"{mu:g}" for mu in moments[0])
        note(f"a {Path(target).suffix} file has no place for the dipole ({dipole} D); it belongs into an .int file")
    parameters = named_parameter_file(top, kmax)
    return lambda path: write_par(parameters, path)


def _refuse_unreadable(file: MoleculeFile, source: str) -> None:
    """ValueError where a .toml of this top would be refused when read, as for dipoles or couplings that the spin weights forbid."""
    from rotor.formats.molecules.molecule_file import parse_molecule_file
    from rotor.formats.molecules.molecule_writer import molecule_file_text
    from rotor.formats.read_write import top_of_file
    from rotor.quantum.effects.of_top import effects_of

    try:
        top = top_of_file(parse_molecule_file(molecule_file_text(file), "TARGET"))
        refuse_weights_of_another_kind(top)
        if top.spin_constants is not None:
            effects_of(top, True)  # weights that count a total spin of the file a second time
    except ValueError as reason:
        raise ValueError(
            f"{source}: a .toml of it would be refused when it is read: {reason}; leave out of the source what is named here (a dipole "
            "that joins levels of unlike weight makes no line unless they mix), or predict from the files themselves"
        ) from None


def _note_of_options(top: Top, source: str, target: str, kmax: int) -> None:
    """A note on what of the options of SPFIT's files is not taken along and comes back otherwise: DIAG, KNMAX, NLINE."""
    path = Path(source)
    if path.suffix.lower() == ".int":
        from rotor.formats.spcat.predict import parameters_beside

        path = parameters_beside(path)
    if path.suffix.lower() not in (".par", ".var") or not path.is_file() or target.lower().endswith(".int"):
        return
    from rotor.formats.spcat.text.par import read_par

    file, kind = read_par(path), top.constants.kind
    written = {"DIAG": 3 if kind == "asymmetric" else 0, "KNMAX": 0 if kind == "linear" else kmax, "NLINE": 1}
    knmax = min(line.knmax for line in file.options)
    given = {"DIAG": file.options[0].diag, "KNMAX": knmax, "NLINE": file.header.nline}
    lost = [f"{name} = {value}" for name, value in given.items() if value != written[name]]
    if lost:
        others = ", ".join(f"{name} = {value}" for name, value in written.items())
        what = "are not part of a .toml" if target.lower().endswith(".toml") else "are not taken along"
        note(
            f"{', '.join(lost)} of {path.name} {what}: a .par or .var written of these constants has {others}; "
            "K above KNMAX is left out by SPCAT (--kmax)"
        )


def _intensities(top: Top, highest: int) -> IntensityFile:
    """The .int file at 300 K, F to `highest`, with Q summed over the levels and spins of the top."""
    from rotor.formats.spcat.model import intensity_file
    from rotor.formats.spcat.text.int_file import Request
    from rotor.quantum.effects.of_top import effects_of
    from rotor.thermodynamics import partition_function

    count = top.states.count if top.states else 1
    q = partition_function(top, 300.0, effects=effects_of(top, bool(top.spin_constants))).q
    request = Request(tag=0, qrot=q, fend=min(highest, 99), str0=-12.0, str1=-12.0, maxv=count - 1)
    return intensity_file(top, request)
