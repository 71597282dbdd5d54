"""`rotor cat`: show, filter or draw a catalogue, merge measured lines into it, or compare it with another list."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import NoAnswerError
from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, json_text, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import OUTPUT, REQUIRED, changed_fields, declared
from rotor.requests.readers import INFINITE, Flag, Names, Quantity, Range, Text, Whole
from rotor.table import counted
from rotor.verbs.common.molecule import with_some_dipole
from rotor.verbs.common.outputs import Output, Report, draw_answer, picture, tables
from rotor.verbs.common.subjects import top_of_word
from rotor.verbs.common.verb import ErrorsShown, Note, Tool, Work

if TYPE_CHECKING:
    from rotor.formats.spcat.compare import Comparison
    from rotor.formats.spcat.text.catalogue import Catalogue

EXAMPLES = """\
  rotor cat c018003.cat --range 0:1000GHz --min-lgint -5
  rotor cat predicted.cat --measured c060503.cat.gz --out merged.cat
  rotor cat c060503.cat.gz --compare OCS
  rotor cat c052009.cat.gz --compare CH3Cl --isotope Cl=37Cl --plot difference.png
  rotor cat case.cat --compare case.int --json difference.json"""
FORMAT_K = 300.0  # intensities of the 80-column format are those at 300 K
DIFFERENCES = ("frequency_mhz", "lgint", "energy_lower_cm")
compared_field = partial(declared, panel="Comparison")  # a field under this heading of --help
UNLIKE = 0.05  # relative difference of temperatures above which a note is given


@dataclass(frozen=True)
class CatRequest:
    """The selection of lines, and the list for a comparison."""

    file: str = declared(REQUIRED, Text(metavar="FILE"), "Catalogue (.cat, .cat.gz)", option="FILE")
    range_mhz: tuple[float, float] = declared(
        INFINITE, Range("MHz"), "First and last frequency (MHz)", option="--range"
    )
    min_lgint: float | None = declared(
        None, Quantity(least=-300, most=300), "Least log10 of the intensity in nm² MHz", none="none"
    )
    measured: str | None = declared(None, Text(metavar="FILE"), "Catalogue whose measured lines are merged in")
    compare: str | None = compared_field(
        None, Text(metavar="OTHER"), "List for a comparison: another .cat, an .int, or a molecule to predict"
    )
    temperature: float | None = compared_field(
        None, Quantity("K", above=0, metavar="T"),
        "Temperature of the intensities in FILE, for a molecule (K; by default what FILE says, else 300)",
    )  # fmt: skip
    isotope: tuple[str, ...] = compared_field(
        (), Names("1=2H"), "Another isotope of the molecule to predict, by atom number or element; repeatable"
    )
    as_spcat: bool = compared_field(
        False, Flag(), "Predict the .int as SPCAT does, also where SPCAT errs (see rotor spectrum)"
    )
    full_basis: bool = compared_field(
        False, Flag(), "Predict the .int with every K in the basis, ignoring KNMIN and KNMAX"
    )
    top_lines: int = declared(20, Whole(0), "Number of lines shown", option="--top", panel=OUTPUT)

    def __post_init__(self) -> None:
        """Check that options of a predicted molecule or of an .int file have such a file or molecule."""
        other = (self.compare or "").lower()
        if not other.endswith(".int"):
            for field in changed_fields(self, ("as_spcat", "full_basis")):
                raise ValueError(f"{field.name}: expected with --compare and an .int file to predict")
        if not other or other.endswith((".cat", ".cat.gz", ".int")):
            for field in changed_fields(self, ("temperature", "isotope")):
                raise ValueError(f"{field.name}: expected with --compare and a molecule to predict; a file has its own")

    def chosen(self, lines: Catalogue) -> Catalogue:
        """The lines in the range and above the intensity cut."""
        from rotor.formats.spcat.compare import in_mhz

        frequency, _ = in_mhz(lines)
        least = -np.inf if self.min_lgint is None else self.min_lgint
        return lines.take((frequency >= self.range_mhz[0]) & (frequency <= self.range_mhz[1]) & (lines.lgint >= least))


@dataclass(frozen=True)
class Compared:
    """Two lists side by side; for a predicted molecule, its temperature and the source of that temperature."""

    comparison: Comparison
    temperature_k: float | None = None
    temperature_source: str | None = None

    @cached_property
    def likely_temperature_k(self) -> float:
        """The temperature (K) at which the intensities agree best; nan if they do not determine it."""
        from rotor.formats.spcat.compare import likely_temperature_k

        return likely_temperature_k(self.comparison, self.temperature_k or FORMAT_K)


def beside(lines: Catalogue, request: CatRequest, note: Note) -> Compared:
    """Compare the lines of a file with those of OTHER."""
    from rotor.formats.spcat.compare import compare, within

    other = request.compare or ""
    if not len(lines):
        raise NoAnswerError("--compare: no lines are left to compare")
    if other.lower().endswith((".cat", ".cat.gz")):
        return Compared(compare(lines, request.chosen(read_catalogue(other))))
    if other.lower().endswith(".int"):
        from rotor.formats.spcat.predict import predict_file

        prediction = predict_file(other, as_spcat=request.as_spcat, full_basis=request.full_basis)
        for text in prediction.notes:
            note(text)
        return Compared(compare(lines, request.chosen(prediction.catalogue)))
    kelvin, source = temperature_of(request.file, request.temperature)
    comparison = compare(lines, request.chosen(predicted(lines, request, kelvin, note)))
    reference = comparison.reference
    range_mhz = (float(reference.frequency_mhz.min()), float(reference.frequency_mhz.max()))
    return Compared(within(comparison, range_mhz, float(reference.lgint.min())), kelvin, source)


def read_catalogue(path: str) -> Catalogue:
    """Read a catalogue; ValueError for another kind of file, and for one without lines."""
    from rotor.formats.spcat.text.cat import read_cat

    if not path.lower().endswith((".cat", ".cat.gz")):
        raise ValueError(f"{path}: expected a catalogue, .cat or .cat.gz")
    catalogue = read_cat(path)
    if not len(catalogue):
        raise ValueError(f"{path}: the file is empty; expected lines of a catalogue")
    return catalogue


def temperature_of(file: str, option: float | None) -> tuple[float, str]:
    """Temperature of a catalogue's intensities (K) and its source: the option, the provenance file, or the format."""
    if option is not None:
        return option, "given (--temperature)"
    provenance = Path(f"{file}.provenance.json")
    if provenance.is_file():
        try:
            stated = json.loads(provenance.read_text(encoding="utf-8")).get("temperature_k")
        except (ValueError, AttributeError):
            raise ValueError(f"{provenance}: expected a JSON object with temperature_k; give --temperature") from None
        if isinstance(stated, int | float) and stated > 0:
            return float(stated), provenance.name
    return FORMAT_K, "the format's"


def predicted(lines: Catalogue, request: CatRequest, kelvin: float, note: Note) -> Catalogue:
    """Lines of a molecule up to the highest J and down to the weakest line of the catalogue, somewhat beyond its range."""
    from rotor.formats.lines.line_tables import catalogue
    from rotor.formats.spcat.compare import in_mhz
    from rotor.spectra.lines import line_list

    source = request.compare or ""
    highest = int(max(lines.quanta_upper[:, 0].max(), lines.quanta_lower[:, 0].max()))
    frequency, _ = in_mhz(lines)
    reach = 1000.0 + 0.01 * float(frequency.max())  # other constants may shift lines out of the range
    prediction = line_list(
        top_of_word(source, note, request.isotope, with_some_dipole),
        temperature_k=kelvin,
        jmax=highest,
        min_lgint=float(lines.lgint.min()) - 1.0,
        untrusted=True,
        range_mhz=(max(0.0, float(frequency.min()) - reach), float(frequency.max()) + reach),
    )
    note(f"{source}: predicted at {prediction.temperature_k:g} K with Q = {prediction.q:.6g}, J up to {highest}")
    if not len(prediction):
        raise NoAnswerError(f"--compare: {source} has no lines in the range of the catalogue")
    return catalogue(prediction)


def comparison_record(compared: Compared, other: str, shown: int) -> dict[str, Any]:
    """Counts of matched, missing and extra lines, and differences (OTHER minus the catalogue), for JSON."""
    from rotor.formats.spcat.compare import agreement

    comparison = compared.comparison
    measured = agreement(comparison)
    return {
        "other": other,
        "temperature_k": compared.temperature_k,
        "temperature_source": compared.temperature_source,
        "likely_temperature_k": compared.likely_temperature_k,
        "spins_collapsed": comparison.collapsed,
        "matched": len(comparison.our_rows),
        "missing": len(comparison.missing),
        "extra": len(comparison.extra),
        "other_states": comparison.other_states,
        **{name: _spread(comparison.differences(name)) for name in DIFFERENCES},
        "degeneracies_that_differ": None
        if comparison.collapsed
        else int((comparison.differences("g_upper") != 0).sum()),
        "measured": measured._asdict() if measured.lines else None,
        "missing_lines": [line_record(comparison.reference, row) for row in comparison.missing[:shown].tolist()],
        "extra_lines": [line_record(comparison.ours, row) for row in comparison.extra[:shown].tolist()],
    }


def temperature_note(compared: Compared | None) -> list[str]:
    """A note if the intensities of a catalogue fit another temperature better than that of the prediction."""
    if compared is None or compared.temperature_k is None:
        return []
    kelvin, likely = compared.temperature_k, compared.likely_temperature_k
    if not math.isfinite(likely) or abs(likely / kelvin - 1) <= UNLIKE:
        return []
    text = f"the intensities of the catalogue are most like those at {likely:.3g} K, not {kelvin:g} K"
    return [f"{text}; if it was made at that temperature, give --temperature {likely:.3g}"]


def _spread(difference: np.ndarray[Any, Any]) -> dict[str, float] | None:
    if not len(difference):
        return None
    size = np.abs(difference)
    return {"median": float(np.median(size)), "largest": float(size.max()), "mean": float(difference.mean())}


def line_record(lines: Catalogue, row: int) -> dict[str, Any]:
    """A line by the fields of the format, without blank quantum numbers."""
    from rotor.formats.spcat.text.fields import BLANK

    record = lines.record(row)._asdict()
    for side in ("quanta_upper", "quanta_lower"):
        record[side] = [q for q in record[side] if q != BLANK]
    return record


def comparison_facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Rows of the report on a comparison."""
    temperature, unlike, measured = (record[name] for name in ("temperature_k", "degeneracies_that_differ", "measured"))
    others = counted(record["other_states"], "line")
    spread = "median |difference| {median:.6g}, largest {largest:.6g}, mean there - here {mean:.6g}"
    units = {"frequency_mhz": " MHz", "lgint": "", "energy_lower_cm": " cm-1"}
    agreement = "{lines}: median |obs - calc| {median_mhz:.4g} MHz, {within_3_sigma:.1%} within 3 σ"
    return [
        ("compared with", record["other"]),
        ("temperature", "" if temperature is None else f"{temperature:g} K: {record['temperature_source']}"),
        ("matched", str(record["matched"]) + (" (hyperfine components summed)" if record["spins_collapsed"] else "")),
        ("missing there", str(record["missing"])),
        ("only there", str(record["extra"])),
        ("not compared", f"{others} of states that one side has no number for" if record["other_states"] else ""),
        *((name, spread.format(**record[name]) + unit) for name, unit in units.items() if record[name]),
        ("degeneracy", "" if unlike is None else f"differs in {counted(unlike, 'line')}"),
        ("measured lines", agreement.format(**measured) if measured else ""),
    ]


@dataclass(frozen=True)
class CatAnswer:
    """The selected lines, and the comparison with another list."""

    request: CatRequest
    lines: Catalogue
    compared: Compared | None

    def facts(self) -> dict[str, Any]:
        """Number, range and species of the lines, by the keys of docs/verbs."""
        from rotor.formats.spcat.compare import in_mhz

        lines, (frequency, _) = self.lines, in_mhz(self.lines)
        facts = {
            "line_count": len(lines),
            "measured": int(np.count_nonzero(lines.tag < 0)),
            "tags": sorted({abs(tag) for tag in lines.tag.tolist()}),
            "range_mhz": [frequency.min(), frequency.max()] if len(lines) else None,
        }
        if self.compared is not None:
            other = ", ".join([self.request.compare or "", *self.request.isotope])
            facts["compared"] = comparison_record(self.compared, other, self.request.top_lines)
        return facts | {"errors": self.errors.as_json()}

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the frequencies, from the errors in the file."""
        from rotor.formats.spcat.compare import catalogue_budget

        return catalogue_budget(self.lines)


def answer(request: CatRequest, work: Work) -> CatAnswer:
    """The selected lines, and the comparison if one is requested."""
    from rotor.formats.spcat.compare import with_measured_lines

    if request.compare is not None and work.view.vertical is not None:
        raise ValueError("--plot-vertical: cannot be combined with --compare, whose picture fixes its vertical axis")
    lines = request.chosen(read_catalogue(request.file))
    if request.measured is not None:
        lines = with_measured_lines(lines, read_catalogue(request.measured))
    return CatAnswer(request, lines, None if request.compare is None else beside(lines, request, work.note))


def write_lines(answer: CatAnswer, path: Path, report: Report) -> None:
    """Write the lines as a catalogue."""
    from rotor.formats.spcat.text.cat import write_cat

    write_cat(answer.lines, path)


def draw(answer: CatAnswer, path: Path, report: Report) -> None:
    """Draw the lines with measured ones in another colour; for a comparison, both lists and the differences."""
    name = Path(answer.request.file).name
    if answer.compared is None:
        draw_answer(answer.lines, path, report, title=name)
    else:
        names = name, Path(report.content["compared"]["other"]).name
        draw_answer(answer.compared.comparison, path, report, names=names)


def json_of(answer: CatAnswer, content: Mapping[str, Any]) -> str:
    """The facts and all lines as JSON."""
    return json_text({**content, "lines": [line_record(answer.lines, row) for row in range(len(answer.lines))]})


def show(answer: CatAnswer, report: Report) -> Iterable[Part | None]:
    """A summary and the strongest lines, or the result of a comparison."""
    lines, content, shown = answer.lines, report.content, answer.request.top_lines
    first, last = content["range_mhz"] or (math.nan, math.nan)
    count = f"{len(lines)}, {content['measured']} of them measured"
    yield str(content["input"])
    yield [
        ("lines", count + (f", from {first:.4f} to {last:.4f} MHz" if len(lines) else "")),
        ("species", ", ".join(map(str, content["tags"])) or "none"),
        *error_facts(content["errors"]),
    ]
    if answer.compared is None:
        yield _table("", lines, shown)
        return
    comparison = answer.compared.comparison
    yield "the comparison"
    yield comparison_facts(content["compared"])
    yield _table("missing there: ", comparison.reference.take(comparison.missing), shown)
    yield _table("only there: ", comparison.ours.take(comparison.extra), shown)


def _table(prefix: str, lines: Catalogue, shown: int) -> Table:
    """The strongest lines in order of frequency."""
    from rotor.formats.spcat.compare import in_mhz

    strongest = np.sort(np.argsort(-lines.lgint, kind="stable")[:shown]).tolist()
    frequency, error = in_mhz(lines)
    records = [line_record(lines, row) | {"frequency": frequency[row], "error": error[row]} for row in strongest]
    columns = {
        "frequency (MHz)": "{frequency:.4f}",
        "error (MHz)": "{error:.4f}",
        "lgint": "{lgint:.4f}",
        'E" (cm-1)': "{energy_lower_cm:.4f}",
        "g'": "{g_upper}",
        "measured": lambda line: "yes" if line["tag"] < 0 else "",
        "upper": lambda line: _quanta(line["quanta_upper"]),
        "lower": lambda line: _quanta(line["quanta_lower"]),
    }
    title = "all lines" if len(records) == len(lines) else f"the {len(records)} strongest of {len(lines)} lines"
    return record_table(f"{prefix}{title}, in order of frequency", columns, records)


def _quanta(numbers: Iterable[int]) -> str:
    return " ".join(f"{number:2d}" for number in numbers)


VERB = Tool(
    name="cat",
    about="A catalogue as a table; or how another list differs from it.",
    examples=EXAMPLES,
    request=CatRequest,
    of="file",
    answer=answer,
    table=lambda answer: answer.lines,
    text=json_of,
    shown=ErrorsShown,
    show=show,
    outputs=(
        Output("out", (".cat", ".cat.gz"), "Write the lines that are left (.cat, .cat.gz)", write_lines),
        *tables("the lines that are left", "lines"),
        picture("Draw the lines", draw=draw),
    ),
    notes=lambda answer: temperature_note(answer.compared),
    nothing=lambda answer: "" if len(answer.lines) else "no lines are left to draw",
    drawn="MHz",
)
