"""Line by line and level by level against the reference program: its whole files beside the project, samples everywhere."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from oracle_cases import (
    BIG,
    CASES,
    SAMPLES,
    WORDED,
    compare_with_tool,
    disagreements,
    level_disagreements,
    lines_of_case,
    prediction,
    read_case,
)

from rotor.formats.spcat.text.cat import read_cat, write_cat
from rotor.formats.spcat.text.egy import read_egy


@pytest.mark.parametrize("case", CASES)
def test_samples(case):
    reference = read_cat(SAMPLES / case / "sample.cat")
    assert len(reference) >= 60
    assert disagreements(reference, prediction(SAMPLES / case).catalogue) == []


@pytest.mark.parametrize("case", CASES)
def test_samples_see_a_change(case):
    """Negative control: a line removed, a line shifted by 4e-4 MHz, an intensity by 5e-4."""
    reference, ours = read_cat(SAMPLES / case / "sample.cat"), prediction(SAMPLES / case).catalogue
    label = np.abs(reference.quanta_upper[40]), np.abs(reference.quanta_lower[40])
    same = (np.abs(ours.quanta_upper) == label[0]).all(axis=1) & (np.abs(ours.quanta_lower) == label[1]).all(axis=1)
    assert disagreements(reference, ours.take(~same))
    for column, change in (("frequency_mhz", 4e-4), ("lgint", 5e-4)):
        moved = {column: getattr(ours, column) + change * same}
        assert disagreements(reference, replace(ours, **moved))


@pytest.mark.parametrize("case", CASES)
def test_samples_of_levels(case):
    reference, ours = read_egy(SAMPLES / case / "sample.egy"), prediction(SAMPLES / case)
    assert len(reference) >= 60
    assert level_disagreements(reference, ours) == []
    reference.energy_cm[30] += 2.1e-6  # negative control
    assert len(level_disagreements(reference, ours)) == 1


@pytest.mark.parametrize("case", WORDED)
def test_the_words_of_a_case_say_what_its_files_say(case):
    """Two ways to the same lines: published names of constants, and parameter codes."""
    routes = (lines_of_case(read_case(SAMPLES / case)), prediction(SAMPLES / case).lines)
    seen = [lines.where(lines.frequency_mhz > 1e-3) for lines in routes]  # the program drops what would print as zero
    worded, ours = (lines.where(np.lexsort((lines.lower, lines.upper))) for lines in seen)
    np.testing.assert_array_equal([ours.upper, ours.lower], [worded.upper, worded.lower])
    np.testing.assert_allclose(ours.frequency_mhz, worded.frequency_mhz, rtol=0, atol=1e-5)  # sums in another order


@pytest.mark.oracle
@pytest.mark.parametrize("case", CASES)
def test_whole_catalogues(case: str, shared: Path, tmp_path: Path):
    """Missing, extra, differing lines: none, by the comparison script of the reference folder."""
    path = tmp_path / "ours.cat"
    write_cat(prediction(shared / "reference" / "spcat" / case).catalogue, path)
    equal, words = compare_with_tool(shared, case, path)
    assert equal, words


@pytest.mark.oracle
@pytest.mark.parametrize("case", [pytest.param(c, marks=pytest.mark.slow) if c in BIG else c for c in CASES])
def test_whole_catalogues_see_a_change(case: str, shared: Path, tmp_path: Path):
    """Negative control: one line missing, a stranger among them, one line shifted by 3e-4 MHz."""
    ours, path = prediction(shared / "reference" / "spcat" / case).catalogue, tmp_path / "ours.cat"
    write_cat(ours, path)
    text, strong = path.read_text().splitlines(keepends=True), int(np.argmax(ours.lgint))
    shifted = f"{float(text[strong][:13]) + 3e-4:13.4f}" + text[strong][13:]
    stranger = text[strong][:55] + " 1 9 9      " + text[strong][67:]
    for changed in (
        text[:strong] + text[strong + 1 :],
        [*text, stranger],
        [*text[:strong], shifted, *text[strong + 1 :]],
    ):
        path.write_text("".join(changed))
        assert not compare_with_tool(shared, case, path)[0], "a changed list was called equal"


@pytest.mark.oracle
@pytest.mark.parametrize("case", CASES)
def test_whole_lists_of_levels(case: str, shared: Path):
    folder = shared / "reference" / "spcat" / case
    reference = read_egy(gzip.decompress((folder / f"{case}.egy.gz").read_bytes()))
    assert len(reference) > 100
    assert level_disagreements(reference, prediction(folder)) == []
