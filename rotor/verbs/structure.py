"""`structure`: bond lengths and angles from constants or measured lines of isotopologues."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import NoAnswerError
from rotor.formats.fits.structure_request import StructureAnswer, StructureRequest, answer_structure
from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.field import all_fields, declared
from rotor.requests.fill import Entries, read_instance
from rotor.requests.readers import Custom
from rotor.table import counted
from rotor.verbs.common.outputs import Output, Report, draw_answer, picture, tables, write_text
from rotor.verbs.common.subjects import file_name, saved_inputs
from rotor.verbs.common.verb import ErrorsShown, Place, Subject, SubjectKind, Verb

if TYPE_CHECKING:
    from rotor.structures.substitution import SubstitutedAtom, SubstitutionStructure, Value

EXAMPLES = """\
  rotor structure ocs.toml
  rotor structure h2co.toml --method rs,r0 --leave-out c --plot h2co.png
  rotor structure water.toml --method re --xyz water_re.xyz"""

ROUND_OFF = 1e-9  # relative error below which symmetry fixes a value


@dataclass(frozen=True)
class FamilyInput:
    """The family of isotopologues."""

    source: Any = declared(
        None,
        Custom(file_name),
        "Family of isotopologues (.toml)",
        "family.file",
        option="FAMILY",
        example="family.toml",
    )


class Isotopologues(SubjectKind):
    """A family of isotopologues from a file."""

    fields = all_fields(FamilyInput)

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read the family."""
        from rotor.formats.fits.family_file import FamilyFile, read_family
        from rotor.structures.family import Family

        inputs: FamilyInput = read_instance(FamilyInput, entries)
        if inputs.source is None:
            raise ValueError("FAMILY is missing; expected a family of isotopologues (.toml)")
        if isinstance(inputs.source, Family):
            return Subject({"file": FamilyFile(inputs.source, (), (), {})}, (inputs,), inputs.source.name, place.note)
        if not str(inputs.source).lower().endswith(".toml"):
            raise ValueError(
                f"{inputs.source}: a family of isotopologues is a .toml file; docs/structure.md describes it"
            )
        return Subject(
            {"file": read_family(str(Path(place.folder) / inputs.source))}, (inputs,), str(inputs.source), place.note
        )

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The file, relative to the folder of the scene."""
        return saved_inputs(subject.molecules[0], folder, "a family")


def _geometry(answer: StructureAnswer, option: str) -> Any:
    try:
        return answer.geometry
    except ValueError as error:
        raise NoAnswerError(f"{option}: {error}") from None


def write_geometry(answer: StructureAnswer, path: Path, report: Report) -> None:
    """Write the geometry as .xyz."""
    molecule, _, method = _geometry(answer, "--xyz")
    positions = (molecule.positions_angstrom.round(8) + 0.0).tolist()
    rows = [f"{s:2s} {x:14.8f} {y:14.8f} {z:14.8f}" for s, (x, y, z) in zip(molecule.symbols, positions, strict=True)]
    head = f"{answer.request.file.family.name}, {method}, principal axes a b c"
    write_text(path, "\n".join([str(len(rows)), head, *rows, ""]))


def draw(answer: StructureAnswer, path: Path, report: Report) -> None:
    """Draw the molecule with its bonds."""
    _geometry(answer, "--plot")
    draw_answer(answer, path, report)


def failure(answer: StructureAnswer) -> str:
    """Reason why a method has no result; empty if all converged."""
    unconverged = [fit for fit in answer.fitted if not fit.minimum.converged]
    if unconverged:
        return f"{unconverged[0].method} has not converged: {unconverged[0].minimum.reason}"
    return "; ".join(f"{method}: {reason}" for method, reason in answer.refused.items())


def show(answer: StructureAnswer, report: Report) -> Iterable[Part | None]:
    """Planar moments, coordinates and the values of each method."""
    family = answer.request.file.family
    yield f"{family.name}: {counted(len(family.species), 'isotopologue')}, {family.top.kind} top"
    yield record_table(
        "planar moments of substitutions in a plane", _PLANAR, answer.planar, {"isotopologue", "axis", ""}
    )
    if answer.substitution:
        yield _coordinates_table(answer.substitution)
        yield _values_table("rs", answer.substitution.values)
    for fit in answer.fitted:
        yield _values_table(fit.method, (*fit.values, *fit.vibrational))
        worst = max(fit.moments, key=lambda moment: abs(moment.difference))
        freedom = f"{len(fit.moments)}, {counted(fit.degrees_of_freedom, 'degree')} of freedom"
        yield [
            ("moments", f"{freedom}, rms {fit.rms_u_angstrom2:.3g} u Å²"),
            ("worst", f"I_{worst.axis} of {worst.species}: obs - calc {worst.difference:+.3g} u Å²"),
            ("search", fit.minimum.reason),
        ]
        yield record_table(
            f"{fit.method} fitted without each in turn", _WITHOUT, answer.without.get(fit.method, ()), {"isotopologue"}
        )
    yield error_facts(report.content.get("errors"))


_PLANAR = {
    "isotopologue": "{0.species}",
    "axis": "{0.axis}",
    "P (u Å²)": "{0.value:.5f}",
    "from the parent": "{0.change:+.5f}",
    "error": "{0.error:.5f}",
    "": lambda moment: "doubtful" if moment.doubtful else "",
}
_WITHOUT = {"isotopologue": "{0.species}", "rms (u Å²)": "{0.rms_u_angstrom2:.3g}", "by chance": "{0.chance:.2g}"}


def _coordinates_table(structure: SubstitutionStructure) -> Table:
    axes: dict[str, Any] = {axis: partial(_coordinate_text, number) for number, axis in enumerate("abc")}
    columns = {"atom": "{0.atom}", "from": "{0.species}", **axes, "equations": "{0.kraitchman.shape}"}
    return record_table("rs: coordinates (Å)", columns, structure.atoms, {"from", "equations"})


def _coordinate_text(axis: int, atom: SubstitutedAtom) -> str:
    """A coordinate with its error in the last digits; i·|r| if it is imaginary, 0 if symmetry requires it."""
    if atom.zero_by_symmetry[axis]:
        return "0"
    square, value, error = atom.squares_angstrom2[axis], atom.coordinates_angstrom[axis], atom.errors_angstrom[axis]
    return f"i·{math.sqrt(-square):.4f}" if square < 0 else f"{value:.5f}({round(error * 1e5)})"


def _values_table(method: str, values: Sequence[Value]) -> Table:
    columns = {
        "coordinate": "{0.name}",
        "value": lambda value: _value_text(value.value, value.error),
        "unit": "{0.unit}",
    }
    return record_table(method, columns, values, {"coordinate", "unit"})


def _value_text(value: float, error: float) -> str:
    from rotor.fitting.reports.publication import value_text

    if not math.isfinite(error):
        return f"{value:.6g} (no error)"
    return value_text(value, error) if error > ROUND_OFF * abs(value) else f"{value:.6g} (by symmetry)"


def results(answer: Any) -> dict[str, Any]:
    """Number of coordinates, and the residuals of the fit of r0 if there is one, for a sweep."""
    fitted = answer.facts()["r0"]
    return {"coordinates": len(answer.table)} | ({"rms_u_angstrom2": fitted["rms_u_angstrom2"]} if fitted else {})


VERB = Verb(
    name="structure",
    about="Structures of a family: by substitution (rs), fitted to all moments (r0, rm1, rm2), at equilibrium (re).",
    examples=EXAMPLES,
    request=StructureRequest,
    answer=lambda request, work: answer_structure(request),
    results=results,
    rows="rs",
    records=lambda answer: None,
    show=show,
    outputs=(
        *tables("the values of all methods", "structure"),
        Output(
            "xyz",
            (".xyz",),
            "Write the geometry of the last method, in principal axes",
            write_geometry,
            "structure.xyz",
        ),
        picture("Draw the molecule with its bonds", "structure.png", draw),
    ),
    subject=Isotopologues(),
    shown=ErrorsShown,
    numerics="rotor.formats.fits.structure_request:STRUCTURE",
    accuracy="of the bond lengths",
    accuracy_example="0.001 Å",
    drawn=None,
    sound=False,
    failure=failure,
    start={"family.file": "family.toml", "observables.method": ["rs", "r0"], "outputs.csv": "structure.csv"},
)
