"""Numbers sorted by their bits: the order is that of a stable sort; rows found by several columns."""

import numpy as np
import pytest

from rotor.arrays import matching_rows, rising_order


@pytest.mark.parametrize("count", [0, 1, 2, 3, 1000, 70_000])
@pytest.mark.parametrize("digits", [None, 1, -2])
def test_the_order_is_that_of_a_stable_sort(count, digits):
    values = np.abs(np.random.default_rng(5).normal(size=count)) * 1e6
    if digits is not None:
        values = values.round(digits)  # many equal ones
    assert np.array_equal(rising_order(values), np.argsort(values, kind="stable"))


def test_neighbours_in_the_last_bit_zeros_and_infinity():
    item = np.nextafter(1e5, np.inf)
    values = np.array([np.inf, item, 1e5, 0.0, np.nextafter(item, 2e5), -0.0, item, 5e-324, 1e5] * 300)
    assert np.array_equal(rising_order(values), np.argsort(values, kind="stable"))


def test_what_has_no_such_order_is_refused():
    for values in ([1.0, -1e-9], [np.nan, 1.0]):
        with pytest.raises(ValueError, match="none below 0 and no NaN"):
            rising_order(np.array(values))


def test_matching_rows_are_those_of_a_dictionary():
    """Numbers, texts and halves in columns; ranges whose product needs more than 64 bits; repeated and missing rows."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        count, sought, columns = rng.integers(0, 20), rng.integers(0, 20), rng.integers(1, 5)
        both = [rng.integers(-2, 4, size=count + sought) for _ in range(columns)]
        forms = (lambda x: x, lambda x: np.array(list("abcdef"))[x + 2], lambda x: x * 10**17, lambda x: x / 2)
        both = [forms[rng.integers(0, 4)](column) for column in both]
        first: dict[tuple, int] = {}
        for row, key in enumerate(zip(*(column[:count].tolist() for column in both), strict=True)):
            first.setdefault(key, row)
        expected = [first.get(key, -1) for key in zip(*(column[count:].tolist() for column in both), strict=True)]
        rows = matching_rows([column[:count] for column in both], [column[count:] for column in both])
        assert rows.tolist() == expected


def test_a_code_beyond_64_bits_matches_no_other_row():
    """5 · 2^64 is 0 in 64 bits."""
    table = [np.array([0, 2**32 - 1])] * 3
    assert matching_rows(table, [np.array([5, 0]), np.array([0, 0]), np.array([0, 0])]).tolist() == [-1, 0]
