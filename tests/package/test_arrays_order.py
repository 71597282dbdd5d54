"""Numbers sorted by their bits: the order is that of a stable sort."""

import numpy as np
import pytest

from rotor.arrays import rising_order


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
