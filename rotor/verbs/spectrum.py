"""`spectrum`: rotational lines of a molecule."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotor.frozen import dataclass
from rotor.quantum.estimates.budgets import ESTIMATES
from rotor.quantum.labels.quanta import headings, rotational_quanta
from rotor.reports import top_facts
from rotor.reports.line_tables import lines_table, pattern_records, patterns_table
from rotor.reports.screen import Part
from rotor.requests.field import OUTPUT, changed_fields, declared
from rotor.requests.fill import Entries, NamedError, read_fields, read_instance
from rotor.requests.readers import Custom, Flag, Quantity, Rule, Text, Whole
from rotor.spectra.request import SpectrumAnswer, SpectrumRequest, answer_spectrum
from rotor.verbs.common import int_files
from rotor.verbs.common.long_lists import LongAnswer, answer_long, is_long, refuse_long_output
from rotor.verbs.common.molecule import POLARIZABILITY, range_without_unit, with_some_dipole
from rotor.verbs.common.outputs import PICTURES, Output, Report, draw_answer, picture, table_file, tables
from rotor.verbs.common.subjects import INT_FILE_IN_SCENE, OneMolecule
from rotor.verbs.common.verb import LinesShown, Place, Subject, Verb, Work
from rotor.verbs.measurements.over_spectrum import Comparison, draw_loomis_wood, draw_over, over_facts

MOST_FACTS_OF_STATES = 10  # in the head of a line list; rotor info shows all
HITRAN_K = 296.0
_FILE_ALONE = ("as_spcat", "full_basis")  # options of .int files

EXAMPLES = """\
  rotor spectrum water
  rotor spectrum "SMILES:C=O" --temperature 100
  rotor spectrum my.xyz --dipole 0,0,1.85 --range 0:2000GHz --cat out.cat --csv out.csv --plot out.png
  rotor spectrum --constants "A=835840.288 B=435351.717 C=278138.7 MHz" --dipole-abc 0,1.8546,0 --jmax 20
  rotor spectrum case.int --cat case.cat
  rotor spectrum CO --exomol CO.states && rotor catalogue add CO.states --catalogue lines.rotorcat
  rotor spectrum --constants "A=2237 B=1368.5 C=884.2" --dipole-abc 1,1,1 --temperature 2 --over peaks.csv --plot over.png"""


def _hitran_numbers(raw: Any) -> tuple[int, int]:
    words = str(raw).split(":")
    if len(words) > 2 or not all(word.isdecimal() and 0 < int(word) < 100 for word in words):
        raise ValueError(f"{raw!r}: expected HITRAN's number of the molecule, such as 5 or 5:1")
    return int(words[0]), int(words[1]) if len(words) == 2 else 1


@dataclass(frozen=True)
class SpectrumShown(LinesShown):
    """Display options of `spectrum`, and options of its files."""

    resolution: float | None = declared(
        None, Quantity("MHz", above=0, metavar="D"), "Show components of a rotational line closer than this (MHz) as one line",
    )  # fmt: skip
    as_spcat: bool = declared(
        False, Flag(), "For an .int file: results of SPCAT, also where SPCAT errs (notes say where)"
    )
    full_basis: bool = declared(False, Flag(), "For an .int file: every K in the basis, ignoring KNMIN and KNMAX")
    over: str | None = declared(
        None, Text(metavar="FILE"), "Compare with a measured spectrum or its peaks (columns of text, .npy, FITS): --plot draws both",
        common=True,
    )  # fmt: skip
    tag: int = declared(0, Whole(0, 999_999), "Tag of the species in the catalogue", "outputs.tag")
    hitran_id: tuple[int, int] | None = declared(
        None, Custom(_hitran_numbers, metavar="M:I"), "HITRAN's numbers of molecule and isotopologue, such as 5:1",
        panel=OUTPUT, rule=Rule(("outputs.hitran",)),
    )  # fmt: skip


class MoleculeOrFile(OneMolecule):
    """A molecule with its dipole, or an .int file, which states the request itself."""

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """The top of a molecule, or the prediction of an .int file."""
        shown, source = read_instance(SpectrumShown, entries), entries.values.get("molecule.source")
        basis = {name: getattr(shown, name) for name in _FILE_ALONE}
        if not int_files.is_int_file(source):
            for field in changed_fields(shown, _FILE_ALONE):
                raise ValueError(f"{field.flag}: expected with an .int file, which SPCAT reads with the .var beside it")
            return super().read(entries, place, verb)
        path = str(Path(place.folder) / str(source)) if entries.style == "key" else str(source)
        request = int_files.predicted_request(path, entries, place.note, **basis)
        return Subject({"request": request}, (), str(source), place.note)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The inputs of the molecule; an .int file cannot be saved in a scene."""
        if not subject.molecules:
            raise ValueError(INT_FILE_IN_SCENE)
        return super().saved(request, subject, folder)


def build(verb: Verb, entries: Entries, subject: Subject) -> SpectrumRequest:
    """The request from the inputs, or from SPCAT's files and a line shape."""
    values = read_fields(SpectrumRequest, entries, subject)
    if subject.molecules:
        return SpectrumRequest(**subject.values, **values)
    shape = {name: values.get(name) for name in ("profile", "fwhm_mhz", "layer")}
    request: SpectrumRequest = replace(subject.values["request"], **shape)
    return request


def adapt(request: SpectrumRequest, outputs: Mapping[str, Any], entries: Entries) -> SpectrumRequest:
    """Use HITRAN's temperature for HITRAN records if none is given; refuse a profile that a command does not show."""
    if (
        entries.style == "option"
        and _is_shaped(request)
        and not (request.layer or {"profile_csv", "plot"} & outputs.keys())
    ):
        raise ValueError(f"a {request.profile or 'gaussian'} profile needs a file; add --plot or --profile-csv")
    if "hitran" in outputs and entries.values.get("conditions.temperature") is None:
        return replace(request, temperature_k=HITRAN_K)
    return request


def _is_shaped(request: SpectrumRequest) -> bool:
    """Whether lines have a given profile or width."""
    return request.profile not in (None, "sticks") or request.fwhm_mhz is not None


def check(request: SpectrumRequest, outputs: Mapping[str, Any], shown: SpectrumShown) -> None:
    """Refuse files whose inputs are missing, and inputs whose files are missing, before anything is computed."""
    if "hitran" in outputs and request.temperature_k != HITRAN_K:
        raise ValueError("--hitran: its intensities are at 296 K; leave --temperature out, or give 296")
    if "egy" in outputs and not isinstance(request, int_files.PredictedRequest):
        raise ValueError("--egy: expected with an .int file; levels of anything else are written by rotor levels --egy")
    if shown.over is not None:
        from rotor.formats.spectra.peak_files import read_peaks

        read_peaks(shown.over)  # raises errors in the file before anything is computed
    if "profile_csv" in outputs and not (_is_shaped(request) or request.layer):
        raise NamedError(
            "{outputs.profile_csv}: sticks have no profile; give {fwhm_mhz} or {profile} gaussian, lorentzian or voigt"
        )
    if not isinstance(request, int_files.PredictedRequest):
        refuse_long_output(request, outputs, shown.resolution)


def content(answer: SpectrumAnswer, shown: SpectrumShown) -> Mapping[str, Any]:
    """Rows of the strongest lines, patterns at a resolution and the comparison with a spectrum, for the JSON."""
    resolution = shown.resolution
    patterns = None if resolution is None else pattern_records(answer.lines, resolution, shown.top_lines)
    record = {"strongest": answer.strongest(shown.top_lines), "patterns": patterns}
    return record if shown.over is None else record | {"over": Comparison(answer.lines, shown.over).facts()}


def write_table(answer: SpectrumAnswer, path: Path, report: Report) -> None:
    """Write the lines in the format of the file's suffix."""
    from rotor.formats import write

    if isinstance(answer, LongAnswer):
        answer.write(path, tag_of(answer, report.shown))
        return
    shown = report.shown
    numbers = dict(zip(("molecule", "isotopologue"), shown.hitran_id or (), strict=False))
    write(answer.lines, path, settings={**report.provenance, "tag": tag_of(answer, shown), **numbers})


def tag_of(answer: SpectrumAnswer, shown: SpectrumShown) -> int:
    """The tag of the species: from the .int file, or as given."""
    request = answer.request
    return int(request.prediction.request.tag) if isinstance(request, int_files.PredictedRequest) else shown.tag


def write_catalogue(answer: SpectrumAnswer, path: Path, report: Report) -> None:
    """Write the catalogue; a prediction of SPCAT's files is written as SPCAT lists it."""
    predicted = isinstance(answer.request, int_files.PredictedRequest)
    (int_files.write_catalogue if predicted else write_table)(answer, path, report)


def draw(answer: SpectrumAnswer, path: Path, report: Report) -> None:
    """Draw the lines or their profile."""
    (draw_answer if report.shown.over is None else draw_over)(answer, path, report)


def _lines_part(answer: SpectrumAnswer, report: Report) -> Part:
    """The strongest lines or patterns, or why there are none."""
    lines, record = answer.lines, report.content
    if not len(lines):
        reason = answer.why_no_lines.replace("the range or lower the cut", "--range or lower --min-lgint")
        return f"no lines: {reason}{range_without_unit(report.entries)}\n"
    if record["patterns"] is not None:
        return patterns_table(record["patterns"], headings(rotational_quanta(lines.levels.quanta)))
    return lines_table(lines, record["strongest"], record["optical_depth"])


def _title(answer: SpectrumAnswer) -> str:
    top = answer.lines.top
    return (
        top_facts.heading(top)
        if answer.lines.levels.has_named_constants
        else f"{top.name}: levels of the file's own parameters"
    )


def _facts(answer: SpectrumAnswer, record: Mapping[str, Any]) -> list[tuple[str, str]]:
    lines, top = answer.lines, answer.lines.top
    cut = "none: every allowed line" if record["min_lgint"] is None else f"lgint above {record['min_lgint']:g}"
    spin_weights = record["spin_weights"]
    named = lines.levels.has_named_constants
    return [
        ("constants", top_facts.constants_text(top) if named else "those of the file, which have no names here"),
        ("dipole", top_facts.dipole_text(top) if named else "the moments of the file"),
        *(
            [("spin weights", "those of the file")]
            if spin_weights is None
            else top_facts.weights_facts(top, spin_weights)[:MOST_FACTS_OF_STATES]
        ),
        *top_facts.states_facts(top)[:MOST_FACTS_OF_STATES],
        ("temperature", f"{lines.temperature_k:g} K"),
        ("Q", top_facts.q_text(lines.partition, record["q"]["classical"] if named else None)),
        ("J max", f"{record['jmax']}: {record['jmax_source']}"),
        ("cut", cut + _range_text(lines.range_mhz)),
        *top_facts.hyperfine_lines(record["hyperfine"]),
        ("lines", _count_text(answer, record["line_count"])),
        *_error_column(answer),
        *([] if record["column_per_cm2"] is None else [_layer_fact(record)]),
        *(over_facts(record["over"]) if "over" in record else []),
    ]


def _error_column(answer: SpectrumAnswer) -> list[tuple[str, str]]:
    """What the column of errors holds; nothing without the column."""
    lines = answer.lines
    if lines.error_mhz is None:
        return []
    if lines.top.level_table is not None:
        return [("column error", "from the table of energies; effects left out are not in it")]
    exact = ", ".join(lines.exact_constants if lines.levels.has_named_constants else ())
    without = f", with {exact} as exact" if exact else ""
    errors = ESTIMATES if (lines.errors_from or "").startswith(ESTIMATES) else "errors"
    return [("column error", f"from {errors} of the constants alone{without}; effects left out are not in it")]


def _layer_fact(record: Mapping[str, Any]) -> tuple[str, str]:
    width = "Doppler's width" if record["fwhm_mhz"] is None else f"FWHM {record['fwhm_mhz']:g} MHz"
    layer = f"{record['pressure_bar']:g} bar, {record['path_cm']:g} cm: {record['column_per_cm2']:.6g} molecules/cm²"
    return "layer", f"{layer}; optical depths τ at line centres, {record['profile']} profile, {width}"


def _range_text(range_mhz: tuple[float, float]) -> str:
    first, last = range_mhz
    return "" if first <= 0 and math.isinf(last) else f", from {first:g} to {last:g} MHz"


def _count_text(answer: SpectrumAnswer, count: int) -> str:
    if not count:
        return "none"
    frequency = answer.lines.frequency_mhz
    first, last = answer.span_mhz if isinstance(answer, LongAnswer) else (frequency[0], frequency[-1])
    return f"{count}, from {first:.4f} to {last:.4f} MHz"


def answer_of(request: SpectrumRequest, work: Work) -> SpectrumAnswer:
    """The lines of a request or of SPCAT's files; long lists are sorted on disk."""
    if isinstance(request, int_files.PredictedRequest):
        return SpectrumAnswer(request, request.prediction.lines)
    if is_long(request, work.files, getattr(work.shown, "resolution", None)):
        return answer_long(request, work.files, getattr(work.shown, "top_lines", 0), work.progress)
    return answer_spectrum(request, work.executor)


def results(answer: Any) -> dict[str, Any]:
    """The strongest line, Q and J max, for a sweep."""
    lines = answer.lines
    strongest = lines.intensity_nm2_mhz.argmax()
    return {
        "lines": len(lines),
        "strongest_mhz": lines.frequency_mhz[strongest],
        "strongest_lgint": lines.lgint[strongest],
        "q": lines.partition.q,
        "jmax": lines.jmax,
    }


VERB = Verb(
    name="spectrum",
    about="Rotational lines of a molecule: frequencies, intensities, and the data behind them.",
    examples=EXAMPLES,
    small_blocks=True,
    request=SpectrumRequest,
    answer=answer_of,
    table=lambda answer: answer.lines,
    results=results,
    rows="lines",
    show=top_facts.report_on_top(_facts, _lines_part, sources=("constants", "dipole", "spin weights"), title=_title),
    outputs=(
        Output(
            "cat", (".cat", ".cat.gz"), "Write a catalogue of 80 columns (.cat, .cat.gz)", write_catalogue, "lines.cat"
        ),
        Output(
            "hitran",
            (".hitran",),
            "Write HITRAN records of 160 characters; with --hitran-id",
            write_table,
            scene=False,
            rule=Rule(("hitran_id",), why="HITRAN's number of the molecule, such as 5 or 5:1 of CO, is not known"),
        ),
        Output(
            "exomol",
            (".states",),
            "Write levels in ExoMol's form (.states), transitions and Q(T) beside (.trans, .pf)",
            write_table,
            scene=False,
        ),
        Output(
            "egy",
            (".egy",),
            "For an .int file: write its levels as SPCAT's list (.egy)",
            int_files.write_levels,
            scene=False,
        ),
        *tables("all lines", "lines", write=write_table),
        table_file("profile_csv", "the profile on its grid", "profile.csv", lambda answer, _: answer.spectrum),
        picture("Draw the spectrum", "lines.png", draw),
        Output(
            "loomis_wood",
            PICTURES,
            "With --over: draw the peaks about each line, series by series (.png, .pdf, .svg)",
            draw_loomis_wood,
            scene=False,
            rule=Rule(("over",), why="its rows are pieces of a spectrum"),
        ),
    ),
    subject=MoleculeOrFile(POLARIZABILITY, lambda top, reading, entries: with_some_dipole(top, reading)),
    shown=SpectrumShown,
    content=content,
    nothing=lambda answer: f"no lines: {answer.why_no_lines}" if answer.why_no_lines else "",
    drawn="MHz",
    spectral=True,
    start={"molecule": "water", "conditions.temperature": "300 K", "outputs.csv": "spectrum.csv"},
    build=build,
    adapt=adapt,
    check=check,
    numerics="rotor.spectra.numerics:SPECTRUM",
    accuracy="of the frequencies, or of the intensities of each line and of all together (%)",
)
