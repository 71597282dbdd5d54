"""Names of quantum numbers, the way back from them to a row, and what is printed from them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rotor.quantum.labels import quanta
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.tops.top import Top

TOPS = {
    "linear": "B=5 GHz",
    "spherical": "B=5 GHz Dt=1e-3 MHz",
    "prolate": "A=9 B=5 GHz",
    "oblate": "B=9 C=5 GHz",
    "asymmetric": "A=9 B=5 C=4 GHz",
}


@pytest.mark.parametrize("kind", TOPS)
def test_every_level_is_found_by_its_quantum_numbers(kind):
    if kind == "spherical":
        levels = solve_levels(Top.from_constants("B=5000 MHz"), 20)
    else:
        levels = solve_levels(Top.from_constants(TOPS[kind]), 20)
    assert np.array_equal(levels.rows_of(**levels.quanta), np.arange(len(levels)))
    last = {name: int(column[-1]) for name, column in levels.quanta.items()}
    assert levels.find(**last) == len(levels) - 1
    beyond = last | {"j": 21}
    assert levels.rows_of(**{name: [value] for name, value in beyond.items()}).tolist() == [-1]
    with pytest.raises(ValueError, match="no level with"):
        levels.find(**beyond)


@given(st.lists(st.integers(0, 30), min_size=1, max_size=20))
@settings(max_examples=30)
def test_rows_of_mixed_labels_are_rows_or_minus_one(values):
    levels = solve_levels(Top.from_constants("A=9 B=5 GHz"), 12)
    k = np.array(values) // 2
    rows = levels.rows_of(j=values, k=k)
    for j, item, row in zip(values, k.tolist(), rows.tolist(), strict=True):
        if j <= 12 and item <= j:
            assert (levels.quanta["j"][row], levels.quanta["k"][row]) == (j, item)
        else:
            assert row == -1


def test_a_table_that_begins_above_zero_still_finds_its_rows():
    levels = solve_levels(Top.from_constants("A=9 B=5 C=4 GHz"), 9, jmin=7)
    row = levels.find(j=7, ka=0, kc=7)
    assert levels.energy_mhz[row] == levels.energy_mhz.min()
    assert levels.rows_of(j=[6], ka=[0], kc=[6]).tolist() == [-1]


def test_half_integers_are_printed_as_fractions():
    levels = Levels(
        "linear", None, 1, np.zeros(2), {"n": np.array([1, 1]), "f": np.array([1, 3])}, np.array([2, 4]),
        np.ones(2, np.int64), np.ones(2, np.int64), halves=frozenset({"f"}),
    )  # fmt: skip
    assert levels.labels(np.arange(2)) == [" 1 1/2", " 1 3/2"]
    assert levels.degeneracy.tolist() == [2, 4]
    assert levels.rotational.tolist() == [1, 1]
    assert list(levels.columns)[:2] == ["n", "f"]


def test_headings_are_the_fields():
    assert quanta.headings(("v", "n", "ka", "kc", "f1", "f")) == "v N Ka Kc F1 F"


def test_a_short_repr_says_what_the_table_is():
    text = repr(solve_levels(Top.from_constants("B=5 GHz"), 3))
    assert text == "Levels(linear, 4 by j; 0.0000 to 60000.0000 MHz)"
