"""`rotor catalogue`: a local catalogue of lines in one file: add sources, list species, look into a range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import Files, Table, deliver, json_text, note, show_facts, show_table

ADD, LIST, SHOW = ACTIONS = ("add", "list", "show")
EXAMPLES = """\b
Examples:
  rotor catalogue add cdms/ jpl/ library --catalogue lines.rotorcat
  rotor catalogue add 1H2-16O__POKAZATEL.states --catalogue lines.rotorcat --licence "CC BY-SA 4.0"
  rotor catalogue list --catalogue lines.rotorcat
  rotor catalogue show CO "HC3N, v7=1" --catalogue lines.rotorcat --range 84:116GHz --csv lines.csv"""


@dataclass(frozen=True)
class Options:
    """What is done with which catalogue."""

    action: str = argument(..., metavar="ACTION", help="add, list or show.")
    words: list[str] | None = argument(
        None, metavar="WORD", help="add: files (.cat, .states, .par), folders or 'library'; show: species, all without."
    )
    catalogue: str = option("lines.rotorcat", metavar="FILE", help="The catalogue.")
    catdir: str | None = option(None, metavar="FILE", help="Table of species with Q(T); those beside .cat files.")
    licence: str | None = option(None, metavar="TEXT", help="Licence of what is added.")
    citation: str | None = option(None, metavar="TEXT", help="Citation of what is added.")
    database: str | None = option(None, metavar="NAME", help="Database of what is added.")
    range_: str | None = option(None, "--range", metavar="A:B", help="Frequencies of show (MHz).")
    top_lines: int = option(20, "--top", metavar="N", help="How many lines are shown, the strongest at 300 K.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    csv: str | None = file_option(".csv", help="Write the species (list) or the lines (show) as CSV.")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options, outputs: Outputs) -> None:
    """A local catalogue of spectral lines: add sources, list its species, show lines of a range."""
    require_whole("--top", options.top_lines, 0)
    if options.action not in ACTIONS:
        raise ValueError(f"ACTION {options.action!r}: expected {', '.join(ACTIONS)}")
    files = Files.of(outputs)
    {ADD: _add, LIST: _list, SHOW: _show_range}[options.action](options, files)


def _add(options: Options, files: Files) -> None:
    """Add sources; faults are reported, and the others added."""
    import sys

    from rotor.formats.catalogue.build import SourceFacts, add_sources

    if not options.words:
        raise ValueError("add: expected files, folders or 'library', such as 'rotor catalogue add cdms/ library'")
    if "--csv" in files.paths:
        raise ValueError("--csv: writes what list and show print; expected without add")
    facts = SourceFacts(options.database or "", options.licence or "", options.citation or "")
    progress = (lambda name: print(f"\r{name[-70:]:70s}", end="", file=sys.stderr)) if sys.stderr.isatty() else None
    report = add_sources(options.catalogue, options.words, facts, catdir=options.catdir, progress=progress)
    if progress:
        print(file=sys.stderr)
    faults = [one for one in report if one.fault]
    for one in faults:
        note(f"left out: {one.fault}")
    added = [one for one in report if not one.fault]
    content = {
        "catalogue": options.catalogue,
        "added": [{"source": one.source, "species": one.species, "lines": one.lines} for one in added],
        "faults": [{"source": one.source, "fault": one.fault} for one in faults],
    }
    total = sum(one.lines for one in added)

    def show() -> None:
        show_facts(
            [
                ("catalogue", options.catalogue),
                ("added", f"{total} lines from {len(added)} sources"),
                ("left out", str(len(faults))),
            ]
        )

    deliver(files, {}, lambda: json_text(content), show)


def _list(options: Options, files: Files) -> None:
    """The species of the catalogue."""
    import rotor
    from rotor.formats.catalogue.database import LineCatalogue

    with LineCatalogue(options.catalogue) as catalogue:
        species, count = catalogue.species(), len(catalogue)
    names = ("name", "formula", "tag", "database", "lines", "source", "date")
    columns = species.columns
    rows = [tuple(str(columns[name][i]) for name in names) for i in range(len(species))]
    records = [{name: _plain(column[i]) for name, column in columns.items()} for i in range(len(species))]
    content = {"catalogue": options.catalogue, "lines": count, "species": records}

    def show() -> None:
        show_facts([("catalogue", options.catalogue), ("lines", str(count)), ("species", str(len(rows)))])
        if rows:
            print()
            show_table(
                Table("species, by name", names, rows, frozenset({"name", "formula", "database", "source", "date"}))
            )

    deliver(files, {"--csv": lambda path: rotor.write(species, path)}, lambda: json_text(content), show)


def _show_range(options: Options, files: Files) -> None:
    """Lines of a range, the strongest at 300 K in order of frequency."""
    from rotor.formats.catalogue.database import LineCatalogue
    from rotor.units import parse_range

    first, last = (0.0, math.inf)
    if options.range_ is not None:
        first, last = inputs.parsed("--range", options.range_, lambda text: parse_range(text, "MHz"))
    with LineCatalogue(options.catalogue) as catalogue:
        species = catalogue.species_between(first, last, options.words or [])
    rows = _line_rows(species)
    content = {"catalogue": options.catalogue, "lines": [dict(zip(_COLUMNS, row, strict=True)) for row in rows]}

    def show() -> None:
        show_facts([("catalogue", options.catalogue), ("lines", f"{len(rows)} of {len(species)} species")])
        if rows and options.top_lines:
            print()
            show_table(_table(rows, options.top_lines))

    deliver(files, {"--csv": lambda path: _write_csv(rows, path)}, lambda: json_text(content), show)


_COLUMNS = (
    "species",
    "frequency_mhz",
    "error_mhz",
    "log_intensity_300k",
    "energy_lower_k",
    "g_upper",
    "einstein_a_per_s",
    "upper",
    "lower",
)


def _line_rows(species: Sequence[Any]) -> list[tuple[Any, ...]]:
    """A row for each line, rising in frequency."""
    import numpy as np

    rows: list[tuple[Any, ...]] = []
    for one in species:
        low, high = one.partition.range_k
        intensity = np.log10(one.intensity_nm2_mhz(min(max(300.0, low), high)))
        numbers = (one.frequency_mhz, one.error_mhz, intensity, one.energy_lower_k, one.g_upper, one.einstein_a_per_s)
        texts = (one.upper.tolist(), one.lower.tolist())
        rows += [(one.name, *row) for row in zip(*(column.tolist() for column in numbers), *texts, strict=True)]
    return sorted(rows, key=lambda row: row[1])


def _table(rows: Sequence[tuple[Any, ...]], shown: int) -> Table:
    strongest = sorted(sorted(range(len(rows)), key=lambda i: -rows[i][3])[:shown])
    cells = [
        (r[0], f"{r[1]:.4f}", f"{r[2]:.4f}", f"{r[3]:.4f}", f"{r[4]:.2f}", f"{r[5]:g}", f"{r[6]:.3e}", r[7], r[8])
        for r in (rows[i] for i in strongest)
    ]
    heads = ("species", "frequency (MHz)", "error", "lg I(300 K)", "E_l (K)", "g_u", "A (1/s)", "upper", "lower")
    title = "all lines" if len(cells) == len(rows) else f"the {len(cells)} strongest of {len(rows)} lines"
    return Table(f"{title}, in order of frequency", heads, cells, frozenset({"species"}))


def _write_csv(rows: Sequence[tuple[Any, ...]], path: Path) -> None:
    import csv

    with path.open("w", encoding="utf-8", newline="") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows(rows)


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else value
