"""Stated numerical errors are bounds of the actual ones, and not wasteful: 100 random cases of each kind (`stated_bounds`).

Data and statistics state standard deviations whose intervals cover the truth (`stated_coverage`). All cases run with the slow proofs;
of these `.ci/run` takes another part each day.
"""

import json
import math
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest
from places import PROJECT
from stated_bounds import CASES
from stated_coverage import CONFIDENCE, COVERED, DRAWS, covered, fitted

EACH = 100  # cases of a kind
SHARE = 20  # cases of a test: enough for a median
FAST = 4


def check(kind: str, seeds) -> None:
    ratios = []
    for seed in seeds:
        case = CASES[kind](seed)
        assert case.actual <= case.stated, (kind, seed, case)
        ratios.append(case.stated / max(case.actual, case.floor))
    assert np.median(ratios) <= 10, ratios
    assert np.sort(ratios)[int(0.95 * (len(ratios) - 1))] <= 100, ratios


def test_a_thousand_cases():
    assert len(CASES) * EACH >= 1000


def test_the_page_is_that_of_the_results_and_every_case_is_within_its_bound():
    path = PROJECT / "benchmarks" / "bounds_and_coverage.py"
    spec = spec_from_file_location("bounds_and_coverage", path)
    program = module_from_spec(spec)
    spec.loader.exec_module(program)
    results = json.loads(program.RESULTS.read_text(encoding="utf-8"))
    assert program.PAGE.read_text(encoding="utf-8") == program.page(results)
    assert results["bounds"].keys() == CASES.keys()
    assert results["coverage"].keys() == COVERED.keys()
    for figures in results["bounds"].values():
        assert (figures["above"], figures["cases"]) == (0, EACH)
        assert figures["median"] <= program.MOST_MEDIAN
        assert figures["of_95"] <= program.MOST_95


@pytest.mark.parametrize("kind", CASES)
def test_stated_errors_are_bounds(kind):
    check(kind, range(10_000, 10_000 + FAST))


@pytest.mark.parametrize(
    ("kind", "seeds"), [("driven", (36, 154, 360, 408, 553, 599)), ("thermo", (39, 132, 136)), ("fluid", (34, 39, 54))]
)
def test_cases_that_were_understated(kind, seeds):
    """Dense times, steps longer than the times are apart, asymmetric tops in the classical limit, few rows of a fluid."""
    for seed in seeds:
        case = CASES[kind](seed)
        assert case.actual <= case.stated, (seed, case)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "first"), [(kind, first) for kind in CASES for first in range(0, EACH, SHARE)])
def test_stated_errors_are_bounds_in_many_cases(kind, first):
    check(kind, range(first, first + SHARE))


@pytest.mark.slow
@pytest.mark.parametrize("name", COVERED)
def test_intervals_cover_the_truth(name):
    """Of 300 draws 95 %, within four standard deviations of that count."""
    inside = covered(name)
    assert np.mean(inside) == pytest.approx(CONFIDENCE, abs=4 * math.sqrt(0.05 * 0.95 / DRAWS))


def test_an_interval_from_half_a_deviation_does_not_cover(monkeypatch):
    """Negative control."""
    name = "fitted constants"
    monkeypatch.setitem(COVERED, name, lambda seed: [2 * deviation for deviation in fitted(seed)[0]])
    assert np.mean(covered(name)) < 0.85


def test_a_bound_without_its_largest_term_is_none(monkeypatch):
    """Negative control: Q without the terms in A(B - C)²/BC, which the classical limit had left out."""
    from rotor.thermodynamics.sums import level_sums

    whole = level_sums.classical_limit
    monkeypatch.setattr(level_sums, "classical_limit", lambda *top: replace(whole(*top), asymmetry_k=0.0))
    with pytest.raises(AssertionError):
        check("thermo", (39, 132, 136))
