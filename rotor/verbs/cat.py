"""`rotor cat`: show, filter or draw a catalogue, merge measured lines into it, or compare it with another list."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.spcat.catalogue_budget import catalogue_budget
from rotor.formats.spcat.compare import in_mhz, with_measured_lines
from rotor.formats.spcat.text.cat import write_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, json_text, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.budget import ErrorBudget
from rotor.verbs.comparing import (
    CatRequest,
    Compared,
    beside,
    comparison_facts,
    comparison_record,
    line_record,
    read_catalogue,
    temperature_note,
)
from rotor.verbs.outputs import Output, Report, draw_answer, picture, tables
from rotor.verbs.tool import Tool
from rotor.verbs.verb import ErrorsShown, Work

EXAMPLES = """\b
Examples:
  rotor cat c018003.cat --range 0:1000GHz --min-lgint -5
  rotor cat predicted.cat --measured c060503.cat.gz --out merged.cat
  rotor cat c060503.cat.gz --compare OCS
  rotor cat c052009.cat.gz --compare CH3Cl --isotope Cl=37Cl --plot difference.png
  rotor cat case.cat --compare case.int --json difference.json"""


@dataclass(frozen=True)
class CatAnswer:
    """The selected lines, and the comparison with another list."""

    request: CatRequest
    lines: Catalogue
    compared: Compared | None

    def facts(self) -> dict[str, Any]:
        """Number, range and species of the lines, by the keys of docs/verbs."""
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
        return catalogue_budget(self.lines)


def answer(request: CatRequest, work: Work) -> CatAnswer:
    """The selected lines, and the comparison if one is requested."""
    if request.compare is not None and work.view.vertical is not None:
        raise ValueError("--plot-vertical: cannot be combined with --compare, whose picture fixes its vertical axis")
    lines = request.chosen(read_catalogue(request.file))
    if request.measured is not None:
        lines = with_measured_lines(lines, read_catalogue(request.measured))
    return CatAnswer(request, lines, None if request.compare is None else beside(lines, request, work.note))


def write_lines(answer: CatAnswer, path: Path, report: Report) -> None:
    """Write the lines as a catalogue."""
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
