"""Tables of `rotor spectrum` on the screen: the strongest lines, and the strongest patterns at a resolution."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from rotor.reports.screen import Table

if TYPE_CHECKING:
    from rotor.spectra.lines import Lines


def pattern_records(lines: Lines, resolution_mhz: float, shown: int) -> list[dict[str, Any]]:
    """The strongest patterns of lines that a resolution merges, ordered by frequency."""
    from rotor.quantum.quanta import labels, of_rotation
    from rotor.spectra.intensity import largest
    from rotor.spectra.patterns import patterns

    groups, levels = patterns(lines, resolution_mhz), lines.levels
    quanta = of_rotation(levels.quanta)
    rows = sorted(largest(groups.intensity_nm2_mhz, shown).tolist()) if shown else []
    sides = {s: labels(quanta, getattr(lines, s)[groups.strongest], levels.halves) for s in ("upper", "lower")}
    names = ("frequency_mhz", "intensity_nm2_mhz", "components", "width_mhz")
    records = []
    for row in rows:
        record: dict[str, Any] = {name: getattr(groups, name)[row].item() for name in names}
        records.append(record | {side: text[row].strip() for side, text in sides.items()})
    return records


def first_rows_title(count: int, what: str) -> str:
    """Title of a table that shows only the strongest (or lowest, brightest) rows.

    >>> first_rows_title(1, "strongest line"), first_rows_title(3, "strongest line")
    ('the strongest line', 'the 3 strongest lines')
    """
    return f"the {what}" if count == 1 else f"the {count} {what}s"


def patterns_table(records: list[dict[str, Any]], names: str) -> Table:
    """Table of line patterns by frequency; `names` heads the quantum numbers of the rotational levels."""
    forms = {"frequency_mhz": "{:.4f}", "intensity_nm2_mhz": "{:.3e}", "components": "{}", "width_mhz": "{:.4f}"}
    rows = [
        (*(form.format(record[name]) for name, form in forms.items()), record["upper"], record["lower"])
        for record in records
    ]
    columns = ("frequency (MHz)", "nm² MHz", "components", "width (MHz)", "upper", "lower")
    title = f"the strongest lines at this resolution, in order of frequency (states: {names})"
    return Table(title, columns, rows)


class _Column(NamedTuple):
    """A column of the line table: its name in `Lines.columns`, its heading, its number format."""

    name: str
    heading: str
    form: str


_COLUMNS = (
    _Column("frequency_mhz", "frequency (MHz)", "{:.4f}"),
    _Column("error_mhz", "error (MHz)", "{:.4f}"),
    _Column("lgint", "lgint", "{:.4f}"),
    _Column("energy_lower_cm", 'E" (cm-1)', "{:.4f}"),
    _Column("g_upper", "g'", "{}"),
    _Column("einstein_a_per_s", "A (1/s)", "{:.2e}"),
    _Column("strength_debye2", "Sμ² (D²)", "{:.5g}"),
)


def _printed(value: float, form: str) -> str:
    """A number as text: empty where it is NaN, a bound where the intensity underflows (its logarithm is -inf)."""
    if math.isinf(value):
        return "<-300"
    return "" if math.isnan(value) else form.format(value)


def lines_table(lines: Lines, rows: Any, depth: Any = None) -> Table:
    """Table of the selected lines in order of frequency, with their optical depths if a layer of gas is given."""
    from rotor.quantum import quanta

    shown = lines.where(rows)
    names = quanta.headings(lines.quanta_names)
    values = shown.columns
    present = [column for column in _COLUMNS if column.name in values]
    cells = [[_printed(x, column.form) for x in values[column.name]] for column in present]
    headings = [column.heading for column in present]
    if depth is not None:
        headings.append("τ")
        cells.append([f"{x:.3e}" for x in depth[rows]])
    labels = [shown.levels.labels(states) for states in (shown.upper, shown.lower)]
    columns = (*headings, "upper", "lower")
    title = first_rows_title(len(shown), "strongest line") if len(shown) < len(lines) else "all lines"
    return Table(f"{title}, in order of frequency (states: {names})", columns, list(zip(*cells, *labels, strict=True)))
