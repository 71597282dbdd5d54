"""Numbers of 32 digits and elliptic integrals made of them, against mpmath at 60 digits."""

import mpmath as mp
import numpy as np
import pytest

from rotor.classical.free.double_double import PI, DoubleDouble, choose, exact_sum, products
from rotor.classical.free.elliptic import carlson_rf, complete

UNIT = 2.0**-106  # one half unit in the last place of a number held as two doubles


def exactly(x, i=...):
    return mp.mpf(float(x.hi[i])) + mp.mpf(float(x.lo[i]))


def pairs(rng, n):
    hi = rng.normal(size=n) * 10.0 ** rng.uniform(-3, 3, n)
    return DoubleDouble(hi, hi * rng.uniform(-1, 1, n) * 2.0**-54)


@pytest.mark.parametrize("name", ["__add__", "__sub__", "__mul__", "__truediv__"])
def test_arithmetic_has_31_digits(name):
    rng = np.random.default_rng(1)
    x, y = pairs(rng, 300), pairs(rng, 300)
    z = getattr(x, name)(y)
    with mp.workdps(60):
        for i in range(300):
            truth = getattr(exactly(x, i), name)(exactly(y, i))
            assert abs(exactly(z, i) - truth) <= 10 * UNIT * abs(truth)  # Joldes et al.: below 10 units for each


def test_square_root_and_mixed_operands():
    rng = np.random.default_rng(2)
    x = pairs(rng, 200) * pairs(rng, 200)
    x = choose(x.hi < 0.0, -x, x)
    root = x.sqrt()
    with mp.workdps(60):
        assert max(abs(exactly(root, i) / mp.sqrt(exactly(x, i)) - 1) for i in range(200)) < 8 * UNIT
        third = 1.0 / DoubleDouble.exact(np.array([3.0]))
        assert abs(exactly(third, 0) - mp.mpf(1) / 3) < UNIT
        assert abs(exactly(np.array([2.0]) - third, 0) - mp.mpf(5) / 3) < 2 * UNIT
        assert abs(exactly(PI, ()) - mp.pi) < 4 * UNIT
    assert DoubleDouble.exact(0.0).sqrt().hi == 0.0


def test_exact_sum_survives_any_cancellation():
    rng = np.random.default_rng(3)
    a = rng.normal(size=40) * 10.0 ** rng.uniform(-30, 30, 40)
    terms = [np.array(v) for v in [*a, 3e-45, *-a[::-1]]]
    assert exact_sum(terms).hi == 3e-45
    assert exact_sum([*terms, np.array(-3e-45)]).hi == 0.0


def test_products_are_exact():
    rng = np.random.default_rng(4)
    x, y, z = (pairs(rng, 1) for _ in range(3))
    with mp.workdps(120):
        total = sum(mp.mpf(float(term[0])) for term in products(x, y, z))
        truth = exactly(x, 0) * exactly(y, 0) * exactly(z, 0)
        assert total == truth


def test_complete_integrals_to_31_digits():
    rng = np.random.default_rng(5)
    mc = np.concatenate([rng.uniform(0, 1, 10), 10.0 ** -rng.uniform(1, 200, 10), [1.0, 1.0]])
    p = 10.0 ** rng.uniform(-3, 12, 22)
    result = complete(DoubleDouble.exact(mc), DoubleDouble.exact(p))
    with mp.workdps(60):
        for i in range(22):
            quarter = mp.pi / 2 / mp.agm(1, mp.sqrt(mp.mpf(float(mc[i]))))
            third = mp.elliprj(0, mp.mpf(float(mc[i])), 1, mp.mpf(float(p[i]))) / (3 * quarter)
            assert abs(exactly(result.mean, i) * 2 * quarter / mp.pi - 1) < 1e-31  # some ten roundings of 1e-32
            assert abs(exactly(result.third, i) / third - 1) < 1e-30  # and up to 40 terms of a series


def test_first_kind_to_31_digits():
    rng = np.random.default_rng(6)
    x = np.concatenate([10.0 ** -rng.uniform(0, 120, 15), [0.0, 1.0]])
    y = np.concatenate([x[:15] * rng.uniform(1, 2, 15), [0.3, 1.0]])
    result = carlson_rf(DoubleDouble.exact(x), DoubleDouble.exact(y), DoubleDouble.exact(np.ones(17)))
    with mp.workdps(60):
        for i in range(17):
            truth = mp.elliprf(mp.mpf(float(x[i])), mp.mpf(float(y[i])), 1)
            assert abs(exactly(result, i) / truth - 1) < 1e-30  # one rounding of 1e-32 per duplication, 20 of them


def test_what_does_not_converge_says_so():
    with pytest.raises(ValueError, match="did not settle"):
        complete(DoubleDouble.exact(np.array([np.nan])), DoubleDouble.exact(np.array([1.0])))
    with pytest.raises(ValueError, match="did not settle"):
        carlson_rf(*(DoubleDouble.exact(np.array([np.nan])) for _ in range(3)))
