"""`assign`: rotational constants from a spectrum of unknown molecules."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.assignment.request import AssignRequest
from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.field import all_fields, declared
from rotor.requests.fill import Entries, read_instance
from rotor.requests.readers import Custom, Range, Text
from rotor.table import counted
from rotor.verbs.common.outputs import Output, Report, picture, table_file
from rotor.verbs.common.subjects import saved_inputs
from rotor.verbs.common.verb import Place, Subject, SubjectKind, Verb, Work

if TYPE_CHECKING:
    from rotor.assignment.answer import AssignAnswer, AssignedSpecies
    from rotor.assignment.peaks.progressions import Progression

EXAMPLES = """\
  rotor assign peaks.csv
  rotor assign spectrum.csv --species 3 --plot assigned.png --csv peaks_assigned.csv --lin assigned.lin
  rotor assign peaks.csv --guess 2458,490,409 --temperature 2
  rotor assign peaks.csv --isotopologues --molecule parent.xyz --json assigned.json"""


def spectrum_source(raw: Any) -> Any:
    """The file name as text, or numbers as an array (peaks, 2 or 3): frequency, intensity[, error]."""
    if isinstance(raw, str | os.PathLike):
        return os.fspath(raw)
    values = np.asarray(raw, dtype=np.float64)
    if values.ndim != 2 or not {2, 3} & set(values.shape):
        raise ValueError(f"an array of shape {values.shape}: expected columns of frequency, intensity[, error]")
    return values if values.shape[1] in (2, 3) else values.T


@dataclass(frozen=True)
class SpectrumInput:
    """The spectrum, and the geometry of its first species."""

    source: Any = declared(
        None,
        Custom(spectrum_source, metavar="FILE"),
        "List of peaks, or a spectrum on a grid: .csv, .npy, FITS",
        "spectrum.file",
        option="SPECTRUM",
        example="peaks.csv",
    )
    range_mhz: tuple[float, float] | None = declared(
        None, Range("MHz"), "Band that was recorded (MHz); by default from the first to the last peak", "spectrum.range", common=True,
        example="6000:18000 MHz",
    )  # fmt: skip
    molecule: str | None = declared(
        None, Text(metavar="FILE"), "Geometry of the first species for --isotopologues: a file, a name, SMILES:...",
        "spectrum.molecule", common=True, example="parent.xyz",
    )  # fmt: skip


@dataclass(frozen=True)
class SpectrumFile(SubjectKind):
    """Peaks from a file or array, and a geometry."""

    fields = {field.identity: field for field in all_fields(SpectrumInput).values()}  # noqa: RUF012

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read the peaks and the geometry."""
        from rotor.formats import read
        from rotor.formats.spectra.peak_files import peaks_from_columns, read_peaks

        inputs = read_instance(SpectrumInput, entries)
        if inputs.source is None:
            raise ValueError("no spectrum: expected a file with a list of peaks or a spectrum, such as peaks.csv")
        is_file = isinstance(inputs.source, str)
        spectrum = Path(place.folder) / inputs.source if is_file else inputs.source
        peaks = (read_peaks if is_file else peaks_from_columns)(spectrum, inputs.range_mhz)
        for text in peaks.notes:
            place.note(text)
        values: dict[str, Any] = {"peaks": peaks}
        if inputs.molecule is not None:
            path = Path(place.folder) / inputs.molecule
            top = read(path if path.is_file() else inputs.molecule)
            if getattr(top, "molecule", None) is None:
                raise ValueError(f"{inputs.molecule}: holds no geometry; expected a file with the positions of nuclei")
            values["molecule"] = top.molecule
        return Subject(values, (inputs,), inputs.source if is_file else "numbers", place.note)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The inputs, with files relative to the folder of the scene."""
        return saved_inputs(subject.molecules[0], folder, "the numbers of a spectrum")


def answer(request: AssignRequest, work: Work) -> AssignAnswer:
    """The species that the search finds."""
    from rotor.assignment.assign import answer_assign

    return answer_assign(request)


def write_lines(answer: AssignAnswer, path: Path, report: Report) -> None:
    """Write the assigned lines of the first species, or of the first linear top, as input of `rotor fit`."""
    from rotor.formats.lines.assigned_lines import write_assigned_lines

    lines = [species.lines for species in (answer.species or answer.progressions)]
    if not lines:
        raise ValueError(f"{path}: no species was found: no lines to write")
    write_assigned_lines(lines[0], path)


def show(answer: AssignAnswer, report: Report) -> Iterable[Part | None]:
    """The species with their constants and errors."""
    record = report.content
    yield [
        ("spectrum", f"{record['peaks']} peaks, {record['band_mhz'][0]:g} to {record['band_mhz'][1]:g} MHz"),
        ("spurs", f"{record['spurs']} harmonics of a clock are left out"),
        ("answer", _verdict(answer)),
        ("left", f"{counted(record['unexplained'], 'peak belongs', 'peaks belong')} to no species{_hint(answer)}"),
    ]
    for number, species in enumerate(answer.species, 1):
        yield _table(number, species)
        yield _facts(species)
    if answer.species:
        yield error_facts(record.get("errors"))
    yield [("linear top", _progression_text(progression)) for progression in answer.progressions]


def _progression_text(progression: Progression) -> str:
    """Lines and constants of a linear top among the peaks that are left."""
    from rotor.fitting.reports.publication import value_text

    values = zip("BD", progression.constants_mhz.tolist(), progression.errors_mhz.tolist(), strict=True)
    constants = ", ".join(f"{name} {value_text(value, error)}" for name, value, error in values)
    j = progression.lines.lower[:, 0]
    return (
        f"{len(j)} peaks left are its lines, J = {j.min() + 1} - {j.min()} to {j.max() + 1} - {j.max()}: {constants} MHz, "
        f"rms {1000 * progression.rms_mhz:.1f} kHz; or K = 0 of a symmetric top"
    )


def _hint(answer: AssignAnswer) -> str:
    """How to look for isotopologues, where peaks are left that may be theirs and no search was made."""
    if answer.request.isotopologues or not answer.species or not answer.unexplained.any():
        return ""
    return "; isotopologues are looked for with --isotopologues --molecule FILE"


def _verdict(answer: AssignAnswer) -> str:
    if not answer.species:
        return f"not found: no asymmetric top stands above chance{'; lines of a linear top: below' if answer.progressions else ''}"
    words = ", ".join(f"{number}: {species.word}" for number, species in enumerate(answer.species, 1))
    return words + ("; the search was ended by its seconds" if answer.ended else "")


def _table(number: int, species: AssignedSpecies) -> Table:
    from rotor.fitting.reports.publication import value_text

    constants, undetermined = species.constants, species.refined.open_constants
    columns = {
        "constant": "{}",
        "MHz": lambda name: value_text(constants[name], constants.uncertainties[name]),
        "": lambda name: "open" if name in undetermined else "",
    }
    isotopologue = f", {species.isotopologue}" if species.isotopologue else ""
    title = f"species {number}, {species.word} (p = {species.probability:.4f}){isotopologue}"
    return record_table(title, columns, constants.values)


def _facts(species: AssignedSpecies) -> list[tuple[str, str]]:
    a, b, c = species.dipole_ratio
    peaks, rms = len({*species.peak.ravel().tolist()}), 1000 * species.refined.fit.rms_mhz()
    twins = (", ".join(f"{n} {x:.3f}" for n, x in zip("ABC", constants, strict=True)) for constants, _ in species.twins)
    return [
        ("lines", f"{len(species.lines)} on {peaks} peaks, rms {rms:.1f} kHz"),
        ("types", f"{species.kind}; |μa| : |μb| : |μc| = {a:.2f} : {b:.2f} : {c:.2f}"),
        ("temperature", f"about {species.grown.temperature_k:g} K"),
        ("evidence", f"e^{species.grown.evidence:.0f} against chance"),
        ("split", "its lines are doublets; their centres are fitted" if species.split else ""),
        *(("twin", f"as good: {twin} MHz") for twin in twins),
    ]


def results(answer: Any) -> dict[str, Any]:
    """Number of species and peaks, and the probability of the first species, for a sweep."""
    facts = answer.facts()
    numbers = {name: facts[name] for name in ("peaks", "unexplained")} | {"species": len(facts["species"])}
    return numbers | ({"probability": facts["species"][0]["probability"]} if facts["species"] else {})


VERB = Verb(
    name="assign",
    about="Rotational constants of unknown molecules from a spectrum, with the probability that they are right.",
    examples=EXAMPLES,
    request=AssignRequest,
    answer=answer,
    results=results,
    rows="assignments",
    numerics="rotor.assignment.numerics:ASSIGN",
    show=show,
    outputs=(
        table_file("csv", "every peak with its assignment", "assigned.csv"),
        Output(
            "lin",
            (".lin", ".csv"),
            "Write the lines of the first species, ready for rotor fit",
            write_lines,
            "assigned.lin",
        ),
        picture("Draw peaks, predictions and what is left", "assigned.png"),
    ),
    subject=SpectrumFile(),
    drawn="MHz",
    scaled=False,
    accuracy="of the frequencies of the first species",
    start={"spectrum.file": "peaks.csv", "observables.species": 1, "outputs.csv": "assigned.csv"},
)
