"""Reports on the screen: text, facts and tables; JSON for programs."""

from __future__ import annotations

import json
import math
import shutil
import string
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass

if TYPE_CHECKING:
    from rotor.table import Table as Columns


@dataclass(frozen=True)
class Table:
    """A title, column names and rows of text. Columns in `left` are aligned to the left, the others to the right."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: Collection[str] = frozenset()


Facts = Sequence[tuple[str, str]]  # names and their texts; those without a text are left out
Part = str | Facts | Table  # of a report


class _Cells(string.Formatter):
    """Formatter of cells: None is an empty text, NaN or infinity a dash."""

    def format_field(self, value: Any, form: str) -> str:
        """The text of a value."""
        if value is None:
            return ""
        return "-" if isinstance(value, float) and not math.isfinite(value) else format(value, form)


def listed(name: str, texts: Iterable[str]) -> list[tuple[str, str]]:
    """Several texts as facts, of which the first carries the name.

    >>> listed("left out", ["spins", "vibration"])
    [('left out', 'spins'), ('', 'vibration')]
    """
    return [("" if number else name, text) for number, text in enumerate(texts)]


def record_table(title: str, columns: Mapping[str, Any], records: Iterable[Any], left: Collection[str] = ()) -> Table:
    """Table with a row for each record, a mapping or an object.

    columns: by heading, the format of a cell, with names of the mapping or attributes of the object `0`; or a function of the record.

    >>> record_table("", {"J": "{j}", "E (MHz)": "{energy:.1f}"}, [{"j": 1, "energy": 2.0}, {"j": 2, "energy": float("nan")}]).rows
    [['1', '2.0'], ['2', '-']]
    >>> record_table("", {"real": "{0.real:g}", "twice": lambda x: str(2 * x)}, [1.5]).rows
    [['1.5', '3.0']]
    """
    cells = _Cells()

    def text(form: str | Callable[[Any], str], record: Any) -> str:
        names = record if isinstance(record, Mapping) else {}
        return cells.vformat(form, (record,), names) if isinstance(form, str) else form(record)

    return Table(title, list(columns), [[text(form, record) for form in columns.values()] for record in records], left)


def show_parts(parts: Iterable[Part | None]) -> None:
    """Print the parts of a report that are not empty, with a blank line before each text, and before and after each table."""
    previous: Part | None = None
    for part in parts:
        if part and not isinstance(part, str | Table):
            part = [(name, text) for name, text in part if text]
        if not part or (isinstance(part, Table) and not part.rows):
            continue
        if previous is not None and (isinstance(previous, Table) or isinstance(part, str | Table)):
            print()
        if isinstance(part, Table):
            show_table(part)
        elif isinstance(part, str):
            print(part)
        else:
            show_facts(part)
        previous = part


def show_table(table: Table) -> None:
    """Print a table: drawn by rich on a terminal, as aligned text into a pipe or file."""
    if sys.stdout.isatty():
        _draw(table)
    else:
        print(table_text(table))


def evenly(count: int, most: int) -> list[int]:
    """Indices of at most `most` evenly spaced rows of a long table, with the first and the last.

    >>> evenly(3, 5), evenly(9, 5)
    ([0, 1, 2], [0, 2, 4, 6, 8])
    """
    return list(range(count)) if count <= most else [round(i * (count - 1) / (most - 1)) for i in range(most)]


def sampled(table: Columns, most: int, things: str = "rows") -> tuple[list[dict[str, Any]], str]:
    """Evenly spaced rows of a long table as records, and a text on their number for the title."""
    rows = evenly(len(table), most)
    return table_records(table, rows), "" if len(rows) == len(table) else f", {len(rows)} of {len(table)} {things}"


def table_text(table: Table) -> str:
    """The table as aligned text, two spaces between columns."""
    widths = [max(map(len, column)) for column in zip(table.columns, *table.rows, strict=True)]
    rows = []
    for row in (table.columns, *table.rows):
        cells = zip(row, widths, table.columns, strict=True)
        rows.append("  ".join(t.ljust(w) if name in table.left else t.rjust(w) for t, w, name in cells).rstrip())
    return "\n".join([table.title, *rows] if table.title else rows)


def _draw(table: Table) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    drawn = RichTable(
        title=table.title or None,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
    )
    for name in table.columns:
        drawn.add_column(Text(name), justify="left" if name in table.left else "right", no_wrap=True)
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    console = Console()
    if console.measure(drawn, options=console.options.update(width=10_000)).maximum <= console.width:
        console.print(drawn)
    else:  # terminal too narrow: break lines rather than cut numbers
        print(table_text(table))


def show_facts(facts: Iterable[tuple[str, str]]) -> None:
    """Print names and their texts in two columns, folded to the width of the terminal."""
    import textwrap

    facts = list(facts)
    indent = max(len(name) for name, _ in facts) + 2
    width = max(60, min(120, shutil.get_terminal_size((120, 24)).columns))
    for name, text in facts:
        print(textwrap.fill(text, width, initial_indent=name.ljust(indent), subsequent_indent=" " * indent))


def plain(content: Any) -> Any:
    """Convert content to the types of JSON: arrays become lists, non-finite numbers None."""
    if isinstance(content, Mapping):
        return {str(key): plain(value) for key, value in content.items()}
    if hasattr(content, "tolist"):
        return plain(content.tolist())
    if isinstance(content, list | tuple):
        return [plain(item) for item in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def json_text(content: Mapping[str, Any]) -> str:
    """JSON text with one line for each key and for each record of a list."""
    items = (f"{json.dumps(str(key))}: {_json_value(value)}" for key, value in content.items())
    return "{\n" + ",\n".join(items) + "\n}\n"


def json_with_rows(table: Columns, key: str, content: Mapping[str, Any]) -> str:
    """JSON text of the content, with all rows of a table as records under `key`."""
    return json_text({**content, key: table_records(table)})


def table_records(table: Columns, rows: Any = slice(None)) -> list[dict[str, Any]]:
    """Rows of a table, by default all, as records by column name."""
    columns = {name: column[rows].tolist() for name, column in table.columns.items()}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _json_value(value: Any) -> str:
    value = plain(value)
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(json.dumps(item, ensure_ascii=False, allow_nan=False) for item in value) + "\n]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
