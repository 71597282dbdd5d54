"""The generated pages of docs/ say what the programs beside them find now."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from doc_scripts import DOCS, script


@pytest.mark.oracle
def test_the_page_of_measured_lines(shared: Path):
    make = script("make_measured_lines")
    assert make.page(shared) == make.PAGE.read_text(encoding="utf-8")


@pytest.mark.oracle
def test_the_page_of_published_structures(shared: Path):
    make = script("make_published_structures")
    assert make.page(shared) == make.PAGE.read_text(encoding="utf-8")


def test_the_page_of_codes():
    make = script("make_spcat_codes")
    assert make.page() == make.TARGET.read_text(encoding="utf-8")


@pytest.mark.oracle
@pytest.mark.slow
def test_the_page_of_reference_cases(shared: Path):
    make = script("make_reference_cases")
    now, then = (_same_text_apart(text) for text in (make.page(shared), make.PAGE.read_text(encoding="utf-8")))
    assert now[0] == then[0]
    assert np.max(np.abs(now[1] - then[1])) <= 5  # a last digit on the edge falls otherwise with another LAPACK


def _same_text_apart(page: str) -> tuple[list[list[str]], np.ndarray]:
    """The page as cells without its counts of lines with the same text, and these counts."""
    rows = [row.split("|") for row in page.splitlines()]
    place = {10: 3, 11: 4}  # the column with the count, by the number of cells
    counted = {
        i: place[len(row)] for i, row in enumerate(rows) if len(row) in place and row[place[len(row)]].strip().isdigit()
    }
    assert len(counted) == 13 + 8
    counts = np.array([int(rows[i][column]) for i, column in counted.items()])
    return [row[: counted[i]] + row[counted[i] + 1 :] if i in counted else row for i, row in enumerate(rows)], counts


def test_the_pages_claim_what_they_should():
    """Every molecule and case has its row; shares and differences are what the words around the tables say."""
    measured = (DOCS / "validation" / "measured_lines.md").read_text(encoding="utf-8")
    held = {
        row.split("|")[1].strip(): float(row.split("|")[7]) for row in measured.splitlines() if "held against:" in row
    }
    assert {name for name, share in held.items() if share > 0.99} == {
        "CO", "OCS", "N2O", "HCN", "HC3N", "HC5N", "CH3CN", "CH3CCH", "HDO", "D2O", "SO2",
    }  # fmt: skip
    assert {name for name, share in held.items() if share < 0.9} == {"H2CO", "H2S", "HNCO"}
    assert all(f"- **{name}**" in measured for name in ("H2O", "H2CO", "SO2", "H2S", "HNCO"))

    cases = (DOCS / "validation" / "reference_cases.md").read_text(encoding="utf-8").splitlines()
    rows = [
        [word.strip() for word in row.split("|")[1:-1]] for row in cases if row.startswith("| ") and "case" not in row
    ]
    coupled = [row[:1] + row[2:] for row in rows if len(row) == 9]  # with a column for what it is
    equal = [row for row in rows if len(row) == 8] + coupled
    assert len(equal) == 13 + 8
    assert len(rows) == 13 + 8 + 13
    assert all(float(row[3]) <= 1.1e-4 and float(row[4]) <= 2e-4 and float(row[5]) <= 2e-4 for row in equal)
    assert all(float(row[7]) <= 1e-6 for row in equal)


def results(name: str) -> dict[str, Any]:
    return json.loads((DOCS.parent / "benchmarks" / "results" / f"{name}.json").read_text(encoding="utf-8"))


def test_figures_in_the_text_are_those_that_the_benchmarks_wrote():
    fluid = (DOCS / "fluid.md").read_text(encoding="utf-8").replace("\n", " ")
    computed = results("thermometers")
    drifts = [
        computed["drifts"][name]["energy_rms_kj_per_mol"] for name in ("symmetric top and remainder", "three rotations")
    ]
    long = next(row["energy_rms_kj_per_mol"] for row in computed["runs"] if row["step_fs"] == 2.0)
    stated = f"rms of the energy is {drifts[0]:.2f} kJ/mol with this drift. Three rotations give {drifts[1]:.2f} kJ/mol"
    assert stated in fluid
    assert f"Over 80 ps it is {long:.2f}" in fluid

    cost = results("free_motion")
    single, many, most = (cost[f"setting up {n} bodies, each"] for n in (1, 1000, 100_000))
    for page, form in (
        ("validation/speed.md", "{0:.0f} ms for one body, {1:.0f} to {2:.0f} µs each for many"),
        (
            "classical.md",
            "{0:.0f} ms for a single body (up to 15 ms on a busy machine) and {1:.0f} to {2:.0f} µs a body for many",
        ),
    ):
        text = (DOCS / page).read_text(encoding="utf-8").replace("\n", " ")
        assert form.format(single / 1000, most, many) in text


WITH_OTHERS = ("rich", "pydantic", "polars")  # whose sizes include the packages that they need


@pytest.mark.slow
def test_the_sizes_of_dependencies_are_those_of_the_installed_files():
    """Of the releases in constraints.txt that are installed here; others may weigh something else."""
    root = DOCS.parent
    pinned = dict(row.split("==") for row in (root / "constraints.txt").read_text("utf-8").split() if "==" in row)
    rows = [
        row.split("|")[1:3]
        for row in (root / "docs" / "dependencies.md").read_text("utf-8").splitlines()
        if row.startswith("| ")
    ]
    compared = 0
    for names, sizes in rows:
        packages = [name for name in names.partition("(")[0].strip().split(", ") if name in pinned]
        numbers = re.findall(r"(?:^|, )(?:(\w+) )?(\d+)(?=,|$)", sizes.strip())
        alone = [float(size) for name, size in numbers if not name]
        groups = [([name], float(size)) for name, size in numbers if name in pinned]
        groups += (
            [(packages, alone[0])] if len(alone) == 1 else list(zip(([name] for name in packages), alone, strict=False))
        )
        for group, size in groups:
            parts = [installed(name, pinned[name]) for name in group if name not in WITH_OTHERS]
            if parts and None not in parts:
                assert sum(parts) == pytest.approx(size, abs=0.6 + 0.02 * size), group  # whole MB
                compared += 1
    assert compared >= 8 or importlib.metadata.version("numpy") != pinned["numpy"]


def installed(name: str, version: str) -> float | None:
    """MB of the files of a distribution with the bytecode beside them; None where it is not there or is another release."""
    try:
        computed = importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        return None
    if computed.version != version:
        return None
    files = {str(computed.locate_file(file)) for file in computed.files or []}
    files |= {importlib.util.cache_from_source(file) for file in files if file.endswith(".py")}
    return sum(os.path.getsize(file) for file in files if os.path.isfile(file)) / 1e6
