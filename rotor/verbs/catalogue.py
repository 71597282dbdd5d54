"""`rotor catalogue`: a local catalogue of lines in one file: add sources, list species, show a range."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from rotor.formats.spcat.compare import stored_budget
from rotor.frozen import dataclass
from rotor.reports.progress import rewritten_line
from rotor.reports.screen import Part, Table, record_table, table_records
from rotor.reports.top_facts import error_facts
from rotor.requests.field import OUTPUT, REQUIRED, declared
from rotor.requests.readers import INFINITE, Names, Range, Text, Whole
from rotor.table import ColumnTable
from rotor.table import Table as Columns
from rotor.verbs.common.outputs import table_file
from rotor.verbs.common.verb import ErrorsShown, Tool, Work

ADD, LIST, SHOW = ACTIONS = ("add", "list", "show")
EXAMPLES = """\
  rotor catalogue add cdms/ jpl/ library --catalogue lines.rotorcat
  rotor catalogue add 1H2-16O__POKAZATEL.states --catalogue lines.rotorcat --licence "CC BY-SA 4.0"
  rotor catalogue list --catalogue lines.rotorcat
  rotor catalogue show CO "HC3N, v7=1" --catalogue lines.rotorcat --range 84:116GHz --csv lines.csv"""
added_field = partial(declared, panel="Added sources")  # a field under this heading of --help


@dataclass(frozen=True)
class CatalogueRequest:
    """The action, the catalogue, and the inputs of the action."""

    action: str = declared(REQUIRED, Text(ACTIONS), "add, list or show", option="ACTION")
    words: tuple[str, ...] = declared(
        (), Names(), "add: files (.cat, .states, .par), folders or 'library'; show: species, all without", option="WORD"
    )
    catalogue: str = declared("lines.rotorcat", Text(metavar="FILE"), "The catalogue")
    catdir: str | None = added_field(
        None, Text(metavar="FILE"), "Table of species with Q(T); by default the one beside .cat files"
    )
    licence: str = added_field("", Text(), "Licence of the added sources")
    citation: str = added_field("", Text(), "Citation of the added sources")
    database: str = added_field("", Text(metavar="NAME"), "Database of the added sources")
    range_mhz: tuple[float, float] = declared(INFINITE, Range("MHz"), "Frequencies of show (MHz)", option="--range")
    top_lines: int = declared(
        20, Whole(0), "Number of lines shown, the strongest at 300 K", option="--top", panel=OUTPUT
    )

    def __post_init__(self) -> None:
        if self.action == ADD and not self.words:
            raise ValueError("add: expected files, folders or 'library', such as 'rotor catalogue add cdms/ library'")


@dataclass(frozen=True)
class CatalogueAnswer:
    """The content of the JSON, the parts of the report, and the table of an action."""

    content: dict[str, Any]
    parts: Sequence[Part]
    table: Columns | None = None

    def facts(self) -> dict[str, Any]:
        """The content, by the keys of docs/verbs."""
        return self.content


def add(request: CatalogueRequest, work: Work) -> CatalogueAnswer:
    """Add sources; those with faults are reported and left out."""
    from rotor.formats.catalogue.build import SourceFacts, add_sources

    facts = SourceFacts(request.database, request.licence, request.citation)
    with rewritten_line(70) as progress:
        report = add_sources(request.catalogue, request.words, facts, catdir=request.catdir, progress=progress)
    added, faults = ([entry for entry in report if bool(entry.fault) == faulty] for faulty in (False, True))
    for entry in faults:
        work.note(f"left out: {entry.fault}")
    content = {
        "catalogue": request.catalogue,
        "added": [{"source": entry.source, "species": entry.species, "lines": entry.lines} for entry in added],
        "faults": [{"source": entry.source, "fault": entry.fault} for entry in faults],
    }
    total = f"{sum(entry.lines for entry in added)} lines from {len(added)} sources"
    shown = [("catalogue", request.catalogue), ("added", total), ("left out", str(len(faults)))]
    return CatalogueAnswer(content, [shown])


def list_species(request: CatalogueRequest, work: Work) -> CatalogueAnswer:
    """The species of the catalogue, by name."""
    from rotor.formats.catalogue.database import LineCatalogue

    with LineCatalogue(request.catalogue) as catalogue:
        table, count = catalogue.species(), len(catalogue)
    records = table_records(table)
    columns = {name: f"{{{name}}}" for name in ("name", "formula", "tag", "database", "lines", "source", "date")}
    shown = [("catalogue", request.catalogue), ("lines", str(count)), ("species", str(len(table)))]
    by_name = record_table("species, by name", columns, records, columns.keys() - {"tag", "lines"})
    return CatalogueAnswer(
        {"catalogue": request.catalogue, "lines": count, "species": records}, [shown, by_name], table
    )


def find_lines(request: CatalogueRequest, work: Work) -> CatalogueAnswer:
    """Lines of a range, in order of frequency; the report has the strongest at 300 K."""
    from rotor.formats.catalogue.database import LineCatalogue

    with LineCatalogue(request.catalogue) as catalogue:
        species = catalogue.species_between(*request.range_mhz, list(request.words))
    lines = _stored_lines(species)
    # errors of the frequencies, from the errors in their sources
    errors = stored_budget(*(lines.columns[name] for name in ("frequency_mhz", "error_mhz", "log_intensity_300k")))
    budget, count = errors.as_json(), f"{len(lines)} of {len(species)} species"
    content = {"catalogue": request.catalogue, "lines": table_records(lines), "errors": budget}
    shown = [("catalogue", request.catalogue), ("lines", count), *error_facts(budget)]
    return CatalogueAnswer(content, [shown, _table(lines, request.top_lines)], lines)


def _stored_lines(species: Sequence[Any]) -> ColumnTable:
    """The lines of all species, in order of frequency."""

    def intensity(lines: Any) -> Any:
        low, high = lines.partition.range_k
        return np.log10(lines.intensity_nm2_mhz(min(max(300.0, low), high)))

    columns = {
        "species": [np.full(len(lines), lines.name) for lines in species],
        "frequency_mhz": [lines.frequency_mhz for lines in species],
        "error_mhz": [lines.error_mhz for lines in species],
        "log_intensity_300k": [intensity(lines) for lines in species],
        **{
            name: [getattr(lines, name) for lines in species]
            for name in ("energy_lower_k", "g_upper", "einstein_a_per_s", "upper", "lower")
        },
    }
    joined = {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in columns.items()}
    order = np.argsort(joined["frequency_mhz"], kind="stable")
    return ColumnTable({name: column[order] for name, column in joined.items()})


def _table(lines: Columns, shown: int) -> Table:
    columns = {
        "species": "{species}",
        "frequency (MHz)": "{frequency_mhz:.4f}",
        "error (MHz)": "{error_mhz:.4f}",
        "lg I(300 K)": "{log_intensity_300k:.4f}",
        "E_l (K)": "{energy_lower_k:.2f}",
        "g_u": "{g_upper:g}",
        "A (1/s)": "{einstein_a_per_s:.3e}",
        "upper": "{upper}",
        "lower": "{lower}",
    }
    strongest = np.sort(np.argsort(-lines.columns["log_intensity_300k"], kind="stable")[:shown])
    title = "all lines" if len(strongest) == len(lines) else f"the {len(strongest)} strongest of {len(lines)} lines"
    return record_table(f"{title}, in order of frequency", columns, table_records(lines, strongest), {"species"})


def check(request: CatalogueRequest, outputs: Any, _: Any) -> None:
    """Refuse a table for the action add."""
    if request.action == ADD and "csv" in outputs:
        raise ValueError("--csv: is for list and show, not for add")


VERB = Tool(
    name="catalogue",
    about="A local catalogue of spectral lines: add sources, list its species, show lines of a range.",
    examples=EXAMPLES,
    request=CatalogueRequest,
    of="catalogue",
    answer=lambda request, work: {ADD: add, LIST: list_species, SHOW: find_lines}[request.action](request, work),
    table=lambda answer: answer.table,
    show=lambda answer, report: answer.parts,
    outputs=(table_file("csv", "the species (list) or the lines (show)"),),
    check=check,
    shown=ErrorsShown,
    stepwise=True,
)
