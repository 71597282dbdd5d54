"""`rotor cat`: a catalogue shown, filtered, drawn, with measured lines merged in, or compared with another list."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input, json_option
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
)

if TYPE_CHECKING:
    import numpy as np

    from rotor.formats.spcat.catalogue import Catalogue
    from rotor.formats.spcat.compare import Comparison

EXAMPLES = """\b
Examples:
  rotor cat c018003.cat --range 0:1000GHz --min-lgint -5
  rotor cat predicted.cat --measured c060503.cat.gz --out merged.cat
  rotor cat c060503.cat.gz --compare OCS
  rotor cat case.cat --compare case.int --json difference.json"""


@dataclass(frozen=True)
class Options:
    """Which lines are shown, and what they are compared with."""

    file: str = argument(..., metavar="FILE", help="Catalogue (.cat, .cat.gz).")
    range_: str | None = option(None, "--range", metavar="A:B", help="First and last frequency (MHz).")
    min_lgint: str | None = option(None, metavar="X", help="Leave out lines with log10(nm² MHz) below.")
    measured: str | None = option(None, metavar="FILE", help="Catalogue whose measured lines are merged in.")
    compare: str | None = option(
        None, metavar="OTHER", help="Another .cat, an .int, or a molecule to predict: what differs in OTHER."
    )
    as_spcat: bool = option(
        False, "--as-spcat", help="OTHER, an .int, is predicted with its KNMAX as SPCAT takes it, see rotor spectrum."
    )
    top_lines: int = option(20, "--top", metavar="N", help="How many lines are shown.")


@dataclass(frozen=True)
class Outputs:
    """Files to write."""

    out: str | None = file_option(".cat", ".cat.gz", help="Write the lines that are left (.cat, .cat.gz).")
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Draw the lines (.png, .pdf, .svg).")
    json: str | None = json_option()


@grouped()
def command(context: typer.Context, options: Options, outputs: Outputs) -> None:
    """A catalogue as a table; or how another list differs from it."""
    require_whole("--top", options.top_lines, 0)
    files, file, measured, compare = Files.of(outputs), options.file, options.measured, options.compare
    range_, min_lgint, top_lines = options.range_, options.min_lgint, options.top_lines
    lines = filtered(read_catalogue(file), range_, min_lgint)
    if measured is not None:
        from rotor.formats.spcat.compare import with_measured_lines

        lines = with_measured_lines(lines, read_catalogue(measured))
    if outputs.plot and not len(lines):
        raise ComputationError("--plot: no lines are left to draw")
    content = summary(lines, file, context.obj)
    found = None
    if compare is not None:
        found = compared(lines, compare, range_, min_lgint, options.as_spcat)
        content["compared"] = comparison_record(found, compare, top_lines)
    content["files"] = files.names
    content["lines"] = [_record(lines, row) for row in range(len(lines))]

    show = lambda: _show(lines, content, found, top_lines)  # noqa: E731
    deliver(files, _writers(lines, content), lambda: json_text(content), show)


def read_catalogue(path: str) -> Catalogue:
    """The catalogue in a file; ValueError for a file of something else."""
    if not path.lower().endswith((".cat", ".cat.gz")):
        raise ValueError(f"{path}: expected a catalogue, .cat or .cat.gz")
    from rotor.formats.spcat.cat import read_cat

    return read_cat(path)


def filtered(lines: Catalogue, range_: str | None, min_lgint: str | None) -> Catalogue:
    """The lines in the range and above the cut."""
    import numpy as np

    from rotor.formats.spcat.compare import in_mhz
    from rotor.units import parse_range

    first, last = (0.0, math.inf)
    if range_ is not None:
        first, last = inputs.parsed("--range", range_, lambda text: parse_range(text, "MHz"))
    least = inputs.cut("--min-lgint", min_lgint) if min_lgint is not None else None
    frequency, _ = in_mhz(lines)
    chosen = (frequency >= first) & (frequency <= last) & (lines.lgint >= (-np.inf if least is None else least))
    return lines.take(chosen)


def summary(lines: Catalogue, file: str, command: str) -> dict[str, Any]:
    """What the lines are, by the keys of docs/command_line.md."""
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


def compared(
    lines: Catalogue, other: str, range_: str | None, min_lgint: str | None, as_spcat: bool = False
) -> Comparison:
    """The lines beside those of another catalogue, of an .int file, or predicted for a molecule to the same J."""
    from rotor.formats.spcat.compare import compare

    if other.lower().endswith((".cat", ".cat.gz")):
        theirs = read_catalogue(other)
    elif other.lower().endswith(".int"):
        from rotor.formats.spcat.predict import predict_file

        prediction = predict_file(other, as_spcat=as_spcat)
        for text in prediction.notes:
            note(text)
        theirs = prediction.catalogue
    else:
        theirs = predicted(lines, other)
    return compare(lines, filtered(theirs, range_, min_lgint))


def predicted(lines: Catalogue, source: str) -> Catalogue:
    """Lines of a molecule to the highest J of the catalogue, down to its weakest line."""
    import rotor
    from rotor.formats.line_tables import catalogue

    top = inputs.with_some_dipole(inputs.read_top(Input(source)))
    if not len(lines):
        raise ComputationError("--compare: no lines are left to compare")
    highest = int(max(lines.quanta_upper[:, 0].max(), lines.quanta_lower[:, 0].max()))
    made = rotor.line_list(top, jmax=highest, min_lgint=float(lines.lgint.min()) - 1.0, untrusted=True)
    note(f"{source}: predicted at {made.temperature_k:g} K with Q = {made.q:.6g}, J up to {highest}")
    return catalogue(made)


def comparison_record(found: Comparison, other: str, shown: int) -> dict[str, Any]:
    """Matched, missing and extra lines and the differences, ours (OTHER) minus the catalogue."""
    from rotor.formats.spcat.compare import agreement

    differences = {name: _spread(found.differences(name)) for name in _DIFFERENCES}
    met = agreement(found)
    return {
        "other": other,
        "matched": len(found.of_ours),
        "missing": len(found.missing),
        "extra": len(found.extra),
        "other_states": found.other_states,
        **differences,
        "degeneracies_that_differ": int((found.differences("g_upper") != 0).sum()),
        "measured": met._asdict() if met.lines else None,
        "missing_lines": [_record(found.reference, row) for row in found.missing[:shown].tolist()],
        "extra_lines": [_record(found.ours, row) for row in found.extra[:shown].tolist()],
    }


_DIFFERENCES = ("frequency_mhz", "lgint", "energy_lower_cm")


def _spread(difference: np.ndarray[Any, Any]) -> dict[str, float] | None:
    import numpy as np

    if not len(difference):
        return None
    size = np.abs(difference)
    return {"median": float(np.median(size)), "largest": float(size.max()), "mean": float(difference.mean())}


def _record(lines: Catalogue, row: int) -> dict[str, Any]:
    from rotor.formats.spcat.fields import BLANK

    record = lines.record(row)._asdict()
    for side in ("quanta_upper", "quanta_lower"):
        record[side] = [q for q in record[side] if q != BLANK]
    return record


def _writers(lines: Catalogue, content: dict[str, Any]) -> dict[str, Writer]:
    from rotor.formats.spcat.cat import write_cat

    return {"--out": lambda path: write_cat(lines, path), "--plot": lambda path: draw(lines, path, content)}


def draw(lines: Catalogue, path: Path, content: dict[str, Any]) -> None:
    """Sticks of the lines, measured ones in another colour."""
    from rotor.plots.catalogue import plot_catalogue

    plot_catalogue(lines, path, title=Path(str(content["input"])).name, command=str(content["command"]))


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
    show_facts(_comparison_facts(content["compared"]))
    for title, rows, side in (
        ("missing there", found.missing, found.reference),
        ("only there", found.extra, found.ours),
    ):
        if len(rows) and shown:
            print()
            table = _table(side.take(rows), shown)
            show_table(replace(table, title=f"{title}: {table.title}"))


def _comparison_facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    facts = [
        ("compared with", record["other"]),
        ("matched", str(record["matched"])),
        ("missing there", str(record["missing"])),
        ("only there", str(record["extra"])),
    ]
    if record["other_states"]:
        facts.append(("not compared", f"{record['other_states']} lines of states that one side has no number for"))
    units = {"frequency_mhz": "MHz", "lgint": "", "energy_lower_cm": "cm-1"}
    for name in _DIFFERENCES:
        if record[name]:
            text = "median |difference| {median:.6g}, largest {largest:.6g}, mean difference {mean:.6g}"
            facts.append((name, f"{text.format(**record[name])} {units[name]}".rstrip()))
    facts.append(("degeneracy", f"differs in {record['degeneracies_that_differ']} lines"))
    if record["measured"]:
        met = record["measured"]
        facts.append(
            (
                "measured lines",
                f"{met['lines']}: median |obs - calc| {met['median_mhz']:.4g} MHz, {met['within_3_sigma']:.1%} within 3 σ",
            )
        )
    return facts


def _table(lines: Catalogue, shown: int) -> Table:
    """The strongest lines in order of frequency."""
    import numpy as np

    from rotor.formats.spcat.compare import in_mhz

    strongest = np.sort(np.argsort(-lines.lgint, kind="stable")[:shown])
    frequency, error = in_mhz(lines)
    rows = []
    for row in strongest.tolist():
        record = _record(lines, row)
        numbers = [f"{frequency[row]:.4f}", f"{error[row]:.4f}", f"{record['lgint']:.4f}"]
        labels = [" ".join(f"{q:2d}" for q in record[side]) for side in ("quanta_upper", "quanta_lower")]
        seen = "yes" if record["tag"] < 0 else ""
        rows.append((*numbers, f"{record['energy_lower_cm']:.4f}", str(record["g_upper"]), seen, *labels))
    columns = ("frequency (MHz)", "error", "lgint", 'E" (cm-1)', "g'", "measured", "upper", "lower")
    title = "all lines" if len(rows) == len(lines) else f"the {len(rows)} strongest of {len(lines)} lines"
    return Table(f"{title}, in order of frequency", columns, rows)
