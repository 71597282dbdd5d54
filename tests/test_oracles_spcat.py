"""Line by line against catalogues of the reference program: whole ones beside the project, samples everywhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracle_cases import CASES, catalogue_of_case, compare_with_tool, disagreements, read_case, sample

from rotor.formats.spcat.cat import write_cat


@pytest.mark.parametrize("case", CASES)
def test_samples(case):
    facts, reference = sample(case)
    assert len(reference) >= 60
    assert disagreements(reference, catalogue_of_case(facts)) == []


@pytest.mark.parametrize("case", CASES)
def test_samples_see_a_change(case):
    """Negative control: a line removed, a line shifted by 2e-4 MHz, an intensity by 3e-4."""
    facts, reference = sample(case)
    ours = catalogue_of_case(facts)
    label = np.abs(reference.quanta_upper[40]), np.abs(reference.quanta_lower[40])
    same = (ours.quanta_upper == label[0]).all(axis=1) & (ours.quanta_lower == label[1]).all(axis=1)
    assert disagreements(reference, ours.take(~same))
    for column, change in (("frequency_mhz", 4e-4), ("lgint", 5e-4)):
        moved = ours.take(slice(None))
        getattr(moved, column)[:] = getattr(ours, column) + change * same
        assert disagreements(reference, moved)


@pytest.mark.oracle
@pytest.mark.parametrize("case", CASES)
def test_whole_catalogues(case: str, shared: Path, tmp_path: Path):
    """Missing, extra, differing lines: none, by the comparison script of the reference folder."""
    ours = catalogue_of_case(read_case(shared / "reference" / "spcat" / case))
    path = tmp_path / "ours.cat"
    write_cat(ours, path)
    equal, words = compare_with_tool(shared, case, path)
    assert equal, words

    strong = int(np.argmax(ours.lgint))
    text = path.read_text().splitlines(keepends=True)
    shifted = f"{float(text[strong][:13]) + 3e-4:13.4f}" + text[strong][13:]
    stranger = text[strong][:55] + " 1 9 9      " + text[strong][67:]
    for changed in (
        text[:strong] + text[strong + 1 :],
        [*text, stranger],
        [*text[:strong], shifted, *text[strong + 1 :]],
    ):
        path.write_text("".join(changed))
        assert not compare_with_tool(shared, case, path)[0], "a changed list was called equal"
