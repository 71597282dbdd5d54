"""docs/validation/fitted_catalogues.md is what its script makes: one row in every run, the others among the slow proofs."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest
from places import PROJECT

from rotor.formats.lines.assigned_lines import read_assigned_lines

SCRIPT = PROJECT / "docs" / "make_fitted_catalogues.py"


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make_fitted_catalogues", SCRIPT)
    module = sys.modules["make_fitted_catalogues"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del sys.modules["make_fitted_catalogues"]


ROWS = ("OCS", "HC3N", "H2CO", "SO2", "SO2, J ≤ 40", "CH2CO", "HCONH2", "c-C2H4O", "CH2OHCHO", "HCOOH", "H2CS", "HNCO", "HNCO, Ka ≤ 1",
        "D2O", "D2O, J ≤ 5")  # fmt: skip


def cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip().strip("|").split("|")]


def test_the_page_has_the_rows_and_texts_of_its_script(make):
    page = make.PAGE.read_text(encoding="utf-8")
    assert page.startswith(make.HEAD)
    assert page.endswith(make.TAIL)
    rows = [cells(line) for line in page[len(make.HEAD) : -len(make.TAIL)].splitlines() if line]
    assert [row[0] for row in rows] == list(make.CASES) == list(ROWS)


@pytest.mark.oracle
@pytest.mark.parametrize(
    "label",
    ["OCS", *(pytest.param(label, marks=pytest.mark.slow(seconds=31 if label == "SO2" else 8)) for label in ROWS[1:])],
)
def test_a_row_made_anew_is_that_of_the_page(shared, make, label):
    """Lines, reduction and number of constants as they stand there; the rms to the last digit."""
    page = make.PAGE.read_text(encoding="utf-8")
    written = next(cells(line) for line in page.splitlines() if cells(line)[0] == label)
    computed = cells(make.row(label, shared))
    assert computed[:7] == written[:7]
    assert float(computed[7]) == pytest.approx(float(written[7]), abs=0.011)  # two decimals, one unit of the last


@pytest.mark.oracle
def test_no_smooth_model_meets_the_lines_of_hnco(shared, make):
    """The figures that the page gives: ladders of Ka and parity, each with a polynomial in J(J + 1) of its own."""
    lines, _ = read_assigned_lines(shared / "reference/library_lines/c043002.cat.gz", ("j", "ka", "kc"))
    worst = "34 1 34 - 35 0 35"
    for power, coefficients, rms in ((3, 32, 3.36), (8, 54, 2.97)):
        computed = make.ladders(lines, power)
        assert computed[:2] == (coefficients, pytest.approx(rms, abs=0.005))  # two decimals are written
        assert 19 < computed[2][worst] < 22.5
    text = [lines.text(i) for i in range(len(lines))]
    without = lines.take(np.array([line != worst for line in text]))
    assert make.ladders(without, 4)[1] == pytest.approx(1.17, abs=0.005)  # the same
    more = {worst, "10 1 9 - 9 1 8", "9 1 9 - 8 1 8", "2 1 2 - 1 1 1", "8 1 8 - 7 1 7"}
    assert make.ladders(lines.take(np.array([line not in more for line in text])), 3)[1] == pytest.approx(
        0.85, abs=0.005
    )
