"""The 40 scenes of docs/validation/asked_and_stated.md: stated is above actual, and the next coarser setting misses."""

import importlib.util
import json
import sys

import pytest
from places import PROJECT

_spec = importlib.util.spec_from_file_location("asked_and_stated", PROJECT / "benchmarks" / "asked_and_stated.py")
cases = importlib.util.module_from_spec(_spec)
sys.modules["asked_and_stated"] = cases  # dataclasses look their module up
_spec.loader.exec_module(cases)
SCENES = [*cases.PICKED, *(cases.drawn(seed) for seed in range(20))]
FAST = (1, 6, 10, 17, 30)


def test_the_page_is_that_of_the_results():
    rows = [cases.Measured(**row) for row in json.loads(cases.RESULTS.read_text(encoding="utf-8"))]
    assert [row.number for row in rows] == list(range(1, 41))
    assert not [row.number for row in rows if cases.verdict(row)]
    assert cases.PAGE.read_text(encoding="utf-8") == cases.page(rows)
    assert len({row.kind for row in rows}) >= 12


def test_a_verdict_names_what_does_not_hold():
    row = cases.Measured(1, "stark", "1 kHz", "", "MHz", 1e-3, 1e-4, 2e-4, "", 0.0, "J max 3", 1e-4, 0.0)
    assert cases.verdict(row) == "actual above stated, coarser serves"


@pytest.mark.parametrize(
    "number",
    [
        number if number in FAST else pytest.param(number, marks=pytest.mark.slow)
        for number in range(1, len(SCENES) + 1)
    ],
)
def test_a_scene_is_within_what_it_states(number, tmp_path):
    row = cases.measured(number, *SCENES[number - 1], tmp_path)
    assert cases.verdict(row) == "", row
