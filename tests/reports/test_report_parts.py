"""Parts of a report on the screen: blank lines about tables, cells by format, and empty parts."""

from __future__ import annotations

import math
from types import SimpleNamespace

from rotor.reports.screen import Table, record_table, sampled, show_parts
from rotor.table import Table as Columns

TABLE = Table("levels", ("J", "E"), [("1", "2.0")])


def test_blank_lines_stand_about_tables_and_before_texts(capsys):
    show_parts(
        ["water", [("A", "1 MHz")], None, TABLE, [("sources", "none")], [("files", "a.csv")], "errors", [("data", "0")]]
    )
    assert capsys.readouterr().out.splitlines() == [
        "water", "A  1 MHz", "", "levels", "J    E", "1  2.0", "", "sources  none", "files  a.csv", "", "errors", "data  0",
    ]  # fmt: skip


def test_empty_parts_leave_no_blank_line(capsys):
    show_parts([[("A", "1")], Table("nothing", ("J",), []), "", (), [("B", "2")]])
    assert capsys.readouterr().out.splitlines() == ["A  1", "B  2"]


def test_cells_of_records():
    records = [{"name": "CO", "x": 1.26, "left": None}, {"name": "OCS", "x": math.inf, "left": 2}]
    table = record_table("", {"species": "{name}", "x": "{x:.1f}", "left": "{left}"}, records, {"species"})
    assert table.rows == [["CO", "1.3", ""], ["OCS", "-", "2"]]
    objects = record_table("", {"double": lambda item: f"{2 * item.x:g}", "x": "{0.x:g}"}, [SimpleNamespace(x=1.5)])
    assert objects.rows == [["3", "1.5"]]


def test_evenly_spaced_rows_say_how_many_there_are():
    import numpy as np

    class Squares(Columns):
        columns = {"n": np.arange(5)}  # noqa: RUF012

    assert sampled(Squares(), 3, "times") == ([{"n": 0}, {"n": 2}, {"n": 4}], ", 3 of 5 times")
    assert sampled(Squares(), 5)[1] == ""
