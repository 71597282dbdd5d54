"""`rotor cat`: a catalogue shown, filtered, drawn, with measured lines merged in, or compared with another list."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.comparing import (
    CompareOptions,
    beside,
    comparison_facts,
    comparison_record,
    line_record,
    read_catalogue,
    refuse_without_molecule,
)
from rotor.cli.shared.inputs import json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Table,
    Writer,
    deliver,
    json_text,
    show_facts,
    show_table,
)
from rotor.cli.shared.plot_options import ViewOptions, view_of
from rotor.requests.readers import Quantity

if TYPE_CHECKING:
    from rotor.formats.spcat.compare import Comparison
    from rotor.formats.spcat.text.catalogue import Catalogue
    from rotor.plots.view import View

EXAMPLES = """\b
Examples:
  rotor cat c018003.cat --range 0:1000GHz --min-lgint -5
  rotor cat predicted.cat --measured c060503.cat.gz --out merged.cat
  rotor cat c060503.cat.gz --compare OCS
  rotor cat c052009.cat.gz --compare CH3Cl --isotope Cl=37Cl --plot difference.png
  rotor cat case.cat --compare case.int --json difference.json"""


@dataclass(frozen=True)
class Options:
    """Which lines are shown, and what they are compared with."""

    file: str = argument(..., metavar="FILE", help="Catalogue (.cat, .cat.gz).")
    range_: str | None = option(None, "--range", metavar="A:B", help="First and last frequency (MHz).")
    min_lgint: str | None = option(None, metavar="X", help="Leave out lines with log10(nm² MHz) below.")
    measured: str | None = option(None, metavar="FILE", help="Catalogue whose measured lines are merged in.")
    top_lines: int = option(20, "--top", metavar="N", help="How many lines are shown.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    out: str | None = file_option(".cat", ".cat.gz", help="Write the lines that are left (.cat, .cat.gz).")
    csv: str | None = file_option(".csv", help="Write the lines that are left as CSV.")
    parquet: str | None = file_option(".parquet", help="Write the lines that are left as Parquet.")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the lines (.png, .pdf, .svg).")
    json: str | None = json_option()


@grouped(picture=("plot_scale",))
def command(
    context: typer.Context, options: Options, comparing: CompareOptions, outputs: Outputs, picture: ViewOptions
) -> None:
    """A catalogue as a table; or how another list differs from it."""
    require_whole("--top", options.top_lines, 0)
    refuse_without_molecule(comparing)
    files, file, measured, top_lines = Files.of(outputs), options.file, options.measured, options.top_lines
    view = view_of(picture, files, "MHz")
    if view.vertical is not None and comparing.compare is not None:
        raise ValueError("--plot-vertical: a comparison shows both lists whole; expected without --compare")
    lines = _chosen(read_catalogue(file), options)
    if measured is not None:
        from rotor.formats.spcat.compare import with_measured_lines

        lines = with_measured_lines(lines, read_catalogue(measured))
    if outputs.plot and not len(lines):
        raise ComputationError("--plot: no lines are left to draw")
    content = summary(lines, file, context.obj)
    found = None
    if comparing.compare is not None:
        compared = beside(lines, file, comparing, lambda other: _chosen(other, options))
        found = compared.comparison
        content["compared"] = comparison_record(compared, comparing.other, top_lines)
    content["files"] = files.names
    content["lines"] = [line_record(lines, row) for row in range(len(lines))]

    show = lambda: _show(lines, content, found, top_lines)  # noqa: E731
    deliver(files, _writers(lines, content, found, view), lambda: json_text(content), show)


def _chosen(lines: Catalogue, options: Options) -> Catalogue:
    return filtered(lines, options.range_, options.min_lgint)


def filtered(lines: Catalogue, range_: str | None, min_lgint: str | None) -> Catalogue:
    """The lines in the range and above the cut."""
    import numpy as np

    from rotor.formats.spcat.compare import in_mhz
    from rotor.units import parse_range

    first, last = (0.0, math.inf)
    if range_ is not None:
        first, last = inputs.parsed("--range", range_, lambda text: parse_range(text, "MHz"))
    least = (
        None
        if min_lgint is None
        else inputs.read_as("--min-lgint", min_lgint, Quantity(least=-300, most=300), none="none")
    )
    frequency, _ = in_mhz(lines)
    chosen = (frequency >= first) & (frequency <= last) & (lines.lgint >= (-np.inf if least is None else least))
    return lines.take(chosen)


def summary(lines: Catalogue, file: str, command: str) -> dict[str, Any]:
    """What the lines are, by the keys of docs/verbs."""
    import numpy as np

    import rotor
    from rotor.formats.spcat.compare import in_mhz

    frequency, _ = in_mhz(lines)
    return {
        "rotor_version": rotor.__version__,
        "command": command,
        "input": file,
        "line_count": len(lines),
        "measured": int(np.count_nonzero(lines.tag < 0)),
        "tags": sorted({abs(tag) for tag in lines.tag.tolist()}),
        "range_mhz": [frequency.min(), frequency.max()] if len(lines) else None,
    }


def _writers(lines: Catalogue, content: dict[str, Any], found: Comparison | None, view: View) -> dict[str, Writer]:
    from rotor.formats import write
    from rotor.formats.spcat.text.cat import write_cat

    settings = {key: content[key] for key in ("command", "input")}
    return {
        "--csv": lambda path: write(lines, path, settings=settings),
        "--parquet": lambda path: write(lines, path, settings=settings),
        "--out": lambda path: write_cat(lines, path),
        "--plot": lambda path: draw(lines, path, content, found, view),
    }


def draw(lines: Catalogue, path: Path, content: dict[str, Any], found: Comparison | None, view: View) -> None:
    """Sticks of the lines, measured ones in another colour; or both lists of a comparison, with the differences."""
    if found is not None:
        from rotor.plots.comparison import plot_comparison

        names = Path(str(content["input"])).name, Path(str(content["compared"]["other"])).name
        plot_comparison(found, path, names=names, view=view, command=str(content["command"]))
        return
    from rotor.plots.catalogue import plot_catalogue

    plot_catalogue(lines, path, title=Path(str(content["input"])).name, view=view, command=str(content["command"]))


def _show(lines: Catalogue, content: dict[str, Any], found: Comparison | None, shown: int) -> None:
    print(content["input"])
    first, last = content["range_mhz"] or (math.nan, math.nan)
    count = f"{len(lines)}, {content['measured']} of them measured"
    show_facts(
        [
            ("lines", count + (f", from {first:.4f} to {last:.4f} MHz" if len(lines) else "")),
            ("species", ", ".join(map(str, content["tags"])) or "none"),
        ]
    )
    if found is None:
        if len(lines) and shown:
            print()
            show_table(_table(lines, shown))
        return
    print()
    show_facts(comparison_facts(content["compared"]))
    for title, rows, side in (
        ("missing there", found.missing, found.reference),
        ("only there", found.extra, found.ours),
    ):
        if len(rows) and shown:
            print()
            table = _table(side.take(rows), shown)
            show_table(replace(table, title=f"{title}: {table.title}"))


def _table(lines: Catalogue, shown: int) -> Table:
    """The strongest lines in order of frequency."""
    import numpy as np

    from rotor.formats.spcat.compare import in_mhz

    strongest = np.sort(np.argsort(-lines.lgint, kind="stable")[:shown])
    frequency, error = in_mhz(lines)
    rows = []
    for row in strongest.tolist():
        record = line_record(lines, row)
        numbers = [f"{frequency[row]:.4f}", f"{error[row]:.4f}", f"{record['lgint']:.4f}"]
        labels = [" ".join(f"{q:2d}" for q in record[side]) for side in ("quanta_upper", "quanta_lower")]
        seen = "yes" if record["tag"] < 0 else ""
        rows.append((*numbers, f"{record['energy_lower_cm']:.4f}", str(record["g_upper"]), seen, *labels))
    columns = ("frequency (MHz)", "error", "lgint", 'E" (cm-1)', "g'", "measured", "upper", "lower")
    title = "all lines" if len(rows) == len(lines) else f"the {len(rows)} strongest of {len(lines)} lines"
    return Table(f"{title}, in order of frequency", columns, rows)
