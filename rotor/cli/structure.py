"""`rotor structure`: bond lengths and angles from the constants, or the measured lines, of isotopologues."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared.inputs import fields_as_options, json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Table,
    Writer,
    deliver,
    json_text,
    note,
    show_facts,
    show_table,
    write_text,
)
from rotor.table import counted

if TYPE_CHECKING:
    from rotor.formats.family_file import FamilyFile
    from rotor.molecules.molecule import Molecule
    from rotor.structures.consistency import PlanarMoment, Without
    from rotor.structures.family import Family
    from rotor.structures.least_squares import FittedStructure
    from rotor.structures.substitution import SubstitutionStructure, Value

EXAMPLES = """\b
Examples:
  rotor structure ocs.toml
  rotor structure h2co.toml --method rs,r0 --leave-out c --plot h2co.png
  rotor structure water.toml --method re --xyz water_re.xyz"""

ROUND_OFF = 1e-9  # of a value: an error below it means that symmetry fixes the value
METHODS = ("rs", "r0", "rm1", "rm2", "re")


@dataclass(frozen=True)
class Answer:
    """What was found by each method."""

    substitution: SubstitutionStructure | None
    fitted: tuple[FittedStructure, ...]
    planar: tuple[PlanarMoment, ...] = ()
    without: Mapping[str, list[Without]] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Options:
    """The family, the methods, and what is written."""

    source: str = argument(..., metavar="FAMILY", help="Family of isotopologues (.toml).")
    method: str = option("rs,r0", metavar="LIST", help="Of rs, r0, rm1, rm2, re.")
    weights: str = option("equal", metavar="NAME", help="Moments weighted equally, or by their errors (errors).")
    leave_out: str = option("", metavar="AXES", help="Axes whose moments are not fitted, such as c.")
    pair: str = option("ab", metavar="AB", help="Which two moments serve for rs of a planar molecule: ab, ac, bc.")
    check: bool = option(False, "--check", help="Fit again without each isotopologue: is one unlike the others?")
    xyz: str | None = file_option(".xyz", help="The geometry of the last method, in principal axes.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="The molecule with its bonds.")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, given: Options) -> None:
    """Structures of a family: by substitution (rs), fitted to all moments (r0, rm1, rm2), of equilibrium (re)."""
    chosen = [name.strip() for name in given.method.split(",")]
    strange = [name for name in chosen if name not in METHODS]
    if strange or len(set(chosen)) < len(chosen):
        raise ValueError(f"--method {given.method}: expected each of {', '.join(METHODS)} once at most")
    if given.check and chosen == ["rs"]:
        raise ValueError(
            "--check goes with r0, rm1, rm2 or re, which are fitted to all isotopologues; add one to --method"
        )
    files, source = Files.of(given), given.source
    if not source.lower().endswith(".toml"):
        raise ValueError(
            f"{source}: a family of isotopologues is a .toml file; docs/structure.md says what stands in it"
        )

    from rotor.formats.family_file import read_family

    file = read_family(source)
    with fields_as_options(weights="--weights", leave_out="--leave-out", pair="--pair"):
        answer = answered(file, chosen, given.weights, given.leave_out, given.pair, check=given.check)
    for text in _notes(answer):
        note(text)
    content = record(file, answer, source, context.obj)
    content["files"] = files.names
    deliver(files, _writers(file, answer, content), lambda: json_text(content), lambda: _show(file, answer))
    bad = [one for one in answer.fitted if not one.minimum.converged]
    if bad:
        raise ComputationError(f"{bad[0].method} has not converged: {bad[0].minimum.reason}")


def answered(
    file: FamilyFile, methods: Sequence[str], weights: str, leave_out: str, pair: str, *, check: bool = False
) -> Answer:
    """The structures of the methods, in their order; with check, fitted again without each isotopologue."""
    from rotor.structures.consistency import doubts, gains, moments_across_planes, without_each
    from rotor.structures.least_squares import fit_structure
    from rotor.structures.substitution import substitution_structure

    substitution = None
    if "rs" in methods:
        substitution = substitution_structure(file.family, pair=pair, coordinates=file.coordinates)

    def fitted_to(family: Family, name: str) -> FittedStructure:
        """The structure of one kind, fitted."""
        return fit_structure(
            family, name, coordinates=file.coordinates, held=file.held, weights=weights, leave_out=tuple(leave_out)
        )

    fitted = tuple(fitted_to(file.family, name) for name in methods if name != "rs")
    without = {
        one.method: without_each(file.family, one, partial(fitted_to, name=one.method)) for one in fitted if check
    }
    said = [text for one in fitted for text in gains(one.method, without.get(one.method, []), one.rms_u_angstrom2)]
    planar = tuple(moments_across_planes(file.family))
    return Answer(substitution, fitted, planar, without, (*doubts(file.family), *said))


def _notes(answer: Answer) -> list[str]:
    found = [*answer.doubts, *(answer.substitution.notes if answer.substitution else ())]
    for one in answer.fitted:
        found += [f"{one.method}: {text}" for text in one.notes]
        found += [f"{one.method}: not determined by these moments: {c.text}" for c in one.undetermined]
    return found


def record(file: FamilyFile, answer: Answer, source: str, command_line: str) -> dict[str, Any]:
    """Everything found, by the keys of docs/command_line.md."""
    import rotor

    family = file.family
    return {
        "rotor_version": rotor.__version__,
        "command": command_line,
        "input": source,
        "name": family.name,
        "kind": family.top.kind,
        "isotopologues": [
            {
                "name": one.name,
                "formula": one.molecule.formula,
                "constants_mhz": dict(one.constants_mhz),
                "errors_mhz": dict(one.errors_mhz),
                "corrections_mhz": dict(one.corrections_mhz),
                "moments_u_angstrom2": one.moments,
                "axes": one.axes,
                "source": one.source or None,
            }
            for one in family.species
        ],
        "planar_moments": [{**vars(one), "doubtful": one.doubtful} for one in answer.planar],
        "without": {method: [vars(one) for one in found] for method, found in answer.without.items()},
        "rs": _substitution_record(answer.substitution),
        **{one.method: _fitted_record(one) for one in answer.fitted},
        "notes": _notes(answer),
    }


def _substitution_record(found: SubstitutionStructure | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "atoms": [
            {
                "atom": one.atom,
                "isotopologue": one.species,
                "coordinates_angstrom": one.coordinates_angstrom,
                "squares_angstrom2": one.squares_angstrom2,
                "costain_angstrom": one.costain_angstrom,
                "measured_angstrom": one.measured_angstrom,
            }
            for one in found.atoms
        ],
        "values": [vars(one) for one in found.values],
    }


def _fitted_record(one: FittedStructure) -> dict[str, Any]:
    return {
        "converged": one.minimum.converged,
        "reason": one.minimum.reason,
        "values": [vars(value) for value in one.values],
        "vibrational": [vars(value) for value in one.vibrational],
        "rms_u_angstrom2": one.rms_u_angstrom2,
        "degrees_of_freedom": one.degrees_of_freedom,
        "condition": one.condition,
        "undetermined": [c.text for c in one.undetermined],
        "positions_angstrom": one.molecule.positions_angstrom,
        "moments": [{**vars(moment), "difference": moment.difference} for moment in one.moments],
    }


def _geometry(file: FamilyFile, answer: Answer) -> tuple[Molecule, Sequence[Value], str]:
    """The last geometry that is complete, its values and the name of the method."""
    import numpy as np

    from rotor.molecules.molecule import Molecule as Made

    if answer.fitted:
        last = answer.fitted[-1]
        return last.molecule, last.values, last.method
    assert answer.substitution is not None  # one method at least
    positions = answer.substitution.positions_angstrom
    if np.isnan(positions).any():
        raise ComputationError("--xyz and --plot: rs has not every atom; add a method that fits the whole geometry")
    return Made(file.family.molecule.symbols, positions), answer.substitution.values, "rs"


def _writers(file: FamilyFile, answer: Answer, content: dict[str, Any]) -> dict[str, Writer]:
    def geometry(path: Path) -> None:
        """The geometry as a file."""
        molecule, _, method = _geometry(file, answer)
        rows = [
            f"{s:2s} {x:14.8f} {y:14.8f} {z:14.8f}"
            for s, (x, y, z) in zip(
                molecule.symbols, (molecule.positions_angstrom.round(8) + 0.0).tolist(), strict=True
            )
        ]
        write_text(
            path, "\n".join([str(len(rows)), f"{file.family.name}, {method}, principal axes a b c", *rows]) + "\n"
        )

    def picture(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.picture import name_text
        from rotor.plots.structure import plot_structure

        molecule, values, method = _geometry(file, answer)
        title = f"{name_text(file.family.name)}, {method}"
        plot_structure(molecule, path, values=values, title=title, provenance={"command": content["command"]})

    return {"--xyz": geometry, "--plot": picture}


def _show(file: FamilyFile, answer: Answer) -> None:
    family = file.family
    print(f"{family.name}: {counted(len(family.species), 'isotopologue')}, {family.top.kind} top")
    if answer.planar:
        show_table(_planar_table(answer.planar))
    if answer.substitution:
        show_table(_coordinates_table(answer.substitution))
        if answer.substitution.values:
            show_table(_values_table("rs", answer.substitution.values))
    for one in answer.fitted:
        show_table(_values_table(one.method, (*one.values, *one.vibrational)))
        worst = max(one.moments, key=lambda moment: abs(moment.difference))
        show_facts(
            [
                (
                    "moments",
                    f"{len(one.moments)}, {counted(one.degrees_of_freedom, 'degree')} of freedom, rms {one.rms_u_angstrom2:.3g} u Å²",
                ),
                ("worst", f"I_{worst.axis} of {worst.species}: obs - calc {worst.difference:+.3g} u Å²"),
                ("search", one.minimum.reason),
            ]
        )
        if answer.without.get(one.method):
            show_table(_without_table(one.method, answer.without[one.method]))


def _planar_table(found: Sequence[PlanarMoment]) -> Table:
    rows = [
        [
            one.species,
            one.axis,
            f"{one.value:.5f}",
            f"{one.change:+.5f}",
            f"{one.error:.5f}",
            "doubtful" if one.doubtful else "",
        ]
        for one in found
    ]
    columns = ["isotopologue", "axis", "P (u Å²)", "from the parent", "error", ""]
    return Table("planar moments of substitutions in a plane", columns, rows, frozenset({"isotopologue", "axis", ""}))


def _without_table(method: str, found: Sequence[Without]) -> Table:
    rows = [[one.species, f"{one.rms_u_angstrom2:.3g}", f"{one.chance:.2g}"] for one in found]
    return Table(f"{method} without", ["isotopologue", "rms (u Å²)", "by chance"], rows, frozenset({"isotopologue"}))


def _coordinates_table(found: SubstitutionStructure) -> Table:
    rows = []
    for one in found.atoms:
        columns = (one.coordinates_angstrom, one.squares_angstrom2, one.errors_angstrom, one.zero_by_symmetry)
        cells = [_coordinate_text(*numbers) for numbers in zip(*(list(column) for column in columns), strict=True)]
        rows.append([str(one.atom), one.species, *cells, one.kraitchman.shape])
    return Table(
        "rs: coordinates (Å)", ["atom", "from", "a", "b", "c", "equations"], rows, frozenset({"from", "equations"})
    )


def _coordinate_text(value: float, square: float, error: float, zero_by_symmetry: bool) -> str:
    """A coordinate with its error in the last digits; imaginary ones as i·|r|, 0 where symmetry makes it so."""
    if zero_by_symmetry:
        return "0"
    return f"i·{math.sqrt(-square):.4f}" if square < 0 else f"{value:.5f}({round(error * 1e5)})"


def _values_table(method: str, values: Sequence[Value]) -> Table:
    rows = [[one.name, _value_text(one.value, one.error), one.unit] for one in values]
    return Table(method, ["coordinate", "value", "unit"], rows, frozenset({"coordinate", "unit"}))


def _value_text(value: float, error: float) -> str:
    from rotor.fitting.publication import value_text

    if not math.isfinite(error):
        return f"{value:.6g} (no error)"
    return value_text(value, error) if error > ROUND_OFF * abs(value) else f"{value:.6g} (by symmetry)"
