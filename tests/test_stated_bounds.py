"""Stated numerical errors are bounds of the actual ones, and not wasteful: random cases of every kind (`stated_bounds`).

All 1,000 run with the slow proofs; of these `.ci/run` takes another part each day.
"""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from stated_bounds import CASES

COUNTS = {
    "driven": 100, "spins": 150, "thermo": 200, "field_map": 120, "magnetic_map": 60, "aligned": 120, "emission": 100, "torsion": 60,
    "fluid": 40, "fitted": 50,
}  # fmt: skip
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
    assert sum(COUNTS.values()) == 1000
    assert COUNTS.keys() == CASES.keys()


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
@pytest.mark.parametrize(
    ("kind", "first"), [(kind, first) for kind, count in COUNTS.items() for first in range(0, count, SHARE)]
)
def test_stated_errors_are_bounds_in_many_cases(kind, first):
    check(kind, range(first, min(first + SHARE, COUNTS[kind])))


def test_a_bound_without_its_largest_term_is_none(monkeypatch):
    """Negative control: Q without the terms in A(B - C)²/BC, which the classical limit had left out."""
    level_sums = import_module("rotor.thermodynamics.level_sums")  # the package has a function of that name
    whole = level_sums.classical_limit
    monkeypatch.setattr(level_sums, "classical_limit", lambda *top: replace(whole(*top), asymmetry_k=0.0))
    with pytest.raises(AssertionError):
        check("thermo", (39, 132, 136))
