"""Tables of `rotor spectrum` on the screen: the strongest lines, and the strongest patterns at a resolution."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Table, record_table, table_records
from rotor.requests.budget import two_digits

if TYPE_CHECKING:
    from rotor.spectra.lines import Lines


def pattern_records(lines: Lines, resolution_mhz: float, shown: int) -> list[dict[str, Any]]:
    """The strongest patterns of lines that a resolution merges, ordered by frequency."""
    from rotor.quantum.labels.quanta import labels, rotational_quanta
    from rotor.spectra.intensity import largest
    from rotor.spectra.patterns import patterns

    groups, levels = patterns(lines, resolution_mhz), lines.levels
    quanta = rotational_quanta(levels.quanta)
    rows = sorted(largest(groups.intensity_nm2_mhz, shown).tolist()) if shown else []
    sides = {s: labels(quanta, getattr(lines, s)[groups.strongest], levels.halves) for s in ("upper", "lower")}
    names = ("frequency_mhz", "intensity_nm2_mhz", "components", "width_mhz")
    records = []
    for row in rows:
        record: dict[str, Any] = {name: getattr(groups, name)[row].item() for name in names}
        records.append(record | {side: text[row].strip() for side, text in sides.items()})
    return records


def first_rows_title(count: int, total: int, what: str) -> str:
    """Title of a table that shows only the strongest (or lowest, brightest) of all rows.

    >>> first_rows_title(1, 5, "strongest line"), first_rows_title(3, 5, "strongest line"), first_rows_title(5, 5, "strongest line")
    ('the strongest line', 'the 3 strongest lines', 'all lines')
    """
    if count == total:
        return f"all {what.rpartition(' ')[2]}s"
    return f"the {what}" if count == 1 else f"the {count} {what}s"


def patterns_table(records: list[dict[str, Any]], names: str) -> Table:
    """Table of line patterns by frequency; `names` heads the quantum numbers of the rotational levels."""
    columns = {
        "frequency (MHz)": "{frequency_mhz:.4f}",
        "nm² MHz": "{intensity_nm2_mhz:.3e}",
        "components": "{components}",
        "width (MHz)": "{width_mhz:.4f}",
        "upper": "{upper}",
        "lower": "{lower}",
    }
    return record_table(
        f"the strongest lines at this resolution, in order of frequency (states: {names})", columns, records
    )


ROUGH_MHZ = 100.0  # errors of estimated constants have two digits
_COLUMNS: dict[str, tuple[str, str | Callable[[Any], str]]] = {
    "frequency_mhz": ("frequency (MHz)", "{frequency_mhz:.4f}"),
    "error_mhz": (
        "error (MHz)",
        lambda row: f"{row['error_mhz']:.4f}" if row["error_mhz"] < ROUGH_MHZ else two_digits(row["error_mhz"]),
    ),
    "lgint": (
        "lgint",
        lambda row: "<-300" if math.isinf(row["lgint"]) else f"{row['lgint']:.4f}",
    ),  # the intensity underflows
    "energy_lower_cm": ('E" (cm-1)', "{energy_lower_cm:.4f}"),
    "g_upper": ("g'", "{g_upper}"),
    "einstein_a_per_s": ("A (1/s)", "{einstein_a_per_s:.2e}"),
    "strength_debye2": ("Sμ² (D²)", "{strength_debye2:.5g}"),
}  # headings and formats by the names in `Lines.columns`


def lines_table(lines: Lines, rows: Any, depth: Any = None) -> Table:
    """Table of the selected lines in order of frequency, with their optical depths if a layer of gas is given."""
    shown = lines.where(rows)
    records = labelled_rows(shown, {"upper": shown.upper, "lower": shown.lower})
    columns = dict(column for name, column in _COLUMNS.items() if name in shown.columns)
    if depth is not None:
        columns["τ"] = "{depth:.3e}"
        records = [record | {"depth": value} for record, value in zip(records, depth[rows], strict=True)]
    title = first_rows_title(len(shown), len(lines), "strongest line")
    columns |= {"upper": "{upper}", "lower": "{lower}"}
    return record_table(f"{title}, in order of frequency {states_text(lines)}", columns, records)


def states_text(lines: Any) -> str:
    """Headings of the quantum numbers that label the states of lines."""
    from rotor.quantum.labels import quanta

    return f"(states: {quanta.headings(lines.quanta_names)})"


def labelled_rows(lines: Any, states: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of lines as records, with the labels of their states by name."""
    labels = (lines.levels.labels(numbers) for numbers in states.values())
    return [
        row | dict(zip(states, texts, strict=True)) for row, *texts in zip(table_records(lines), *labels, strict=True)
    ]
