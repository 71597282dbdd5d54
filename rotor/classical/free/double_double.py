"""Numbers of 32 digits as unevaluated sums of two doubles, and exact sums of many doubles, for phases at long times.

A phase accurate to 1e-15 rad after 1e10 turns requires its rate to 26 digits. `DoubleDouble` has about 31, for whole arrays; it
provides only the operations for the constants of a free motion (+ - * / and square root).
Algorithms: T. J. Dekker, Numer. Math. 18, 224 (1971); M. Joldes, J.-M. Muller, V. Popescu, ACM Trans. Math. Softw. 44,
15 (2017), relative errors of a few 2^-106; T. Ogita, S. M. Rump, S. Oishi, SIAM J. Sci. Comput. 26, 1955 (2005).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.geometry.error_free import two_product, two_sum


@dataclass(frozen=True)
class DoubleDouble:
    """The number hi + lo, |lo| at most half a unit in the last place of hi; arrays of one shape.

    >>> third = DoubleDouble.exact(1.0) / 3.0
    >>> float((third * 3.0 - 1.0).hi)
    0.0
    """

    hi: Floats
    lo: Floats

    @classmethod
    def exact(cls, value: Floats | float) -> DoubleDouble:
        """A double, exactly."""
        hi = np.asarray(value, dtype=np.float64)
        return cls(hi, np.zeros_like(hi))

    @classmethod
    def product(cls, a: Floats | float, b: Floats | float) -> DoubleDouble:
        """a b of two doubles, exactly."""
        return cls(*_arrays(two_product(a, b)))

    @classmethod
    def difference(cls, a: Floats | float, b: Floats | float) -> DoubleDouble:
        """a - b of two doubles, exactly."""
        return cls(*_arrays(two_sum(a, -b)))

    def __add__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        other = _lift(other)
        s, e = two_sum(self.hi, other.hi)
        t, f = two_sum(self.lo, other.lo)
        s, e = _fast_two_sum(s, e + t)
        return DoubleDouble(*_fast_two_sum(s, e + f))

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble(-self.hi, -self.lo)

    def __sub__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        return self + (-_lift(other))

    def __mul__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        other = _lift(other)
        p, e = two_product(self.hi, other.hi)
        return DoubleDouble(*_fast_two_sum(p, e + (self.hi * other.lo + self.lo * other.hi)))

    def __truediv__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        other = _lift(other)
        first = self.hi / other.hi
        rest = self - other * first
        second = rest.hi / other.hi
        third = (rest - other * second).hi / other.hi
        return DoubleDouble(*_fast_two_sum(first, second)) + third

    __array_ufunc__ = None  # numpy then leaves array - number to __rsub__, __radd__, ...

    def __radd__(self, other: Floats | float) -> DoubleDouble:
        return self + other

    def __rmul__(self, other: Floats | float) -> DoubleDouble:
        return self * other

    def __rsub__(self, other: Floats | float) -> DoubleDouble:
        return _lift(other) - self

    def __rtruediv__(self, other: Floats | float) -> DoubleDouble:
        return _lift(other) / self

    def sqrt(self) -> DoubleDouble:
        """Square root by one Newton step from the root of hi; of zero, zero."""
        root = np.sqrt(self.hi)
        rest = (self - DoubleDouble.product(root, root)).hi
        step = np.divide(rest, 2.0 * root, out=np.zeros_like(root), where=root > 0.0)
        return DoubleDouble(*_fast_two_sum(root, step))

    def scaled(self, power_of_two: Floats | float) -> DoubleDouble:
        """Times a power of two, exactly."""
        return DoubleDouble(self.hi * power_of_two, self.lo * power_of_two)


PASSES = 4  # of `exact_sum`, each for about 16 digits
PI = DoubleDouble(np.array(np.pi), np.array(1.2246467991473532e-16))  # the second double is π less the first


def choose(condition: NDArray[np.bool_], yes: DoubleDouble, no: DoubleDouble) -> DoubleDouble:
    """`yes` where the condition holds, `no` elsewhere."""
    return DoubleDouble(np.where(condition, yes.hi, no.hi), np.where(condition, yes.lo, no.lo))


def products(*factors: DoubleDouble) -> list[Floats]:
    """Doubles whose exact sum is the exact product of the factors, 2^(2n-1) of them for n factors."""
    terms = [factors[0].hi, factors[0].lo]
    for factor in factors[1:]:
        terms = [part for term in terms for half in (factor.hi, factor.lo) for part in two_product(term, half)]
    return terms


def exact_sum(terms: list[Floats]) -> DoubleDouble:
    """Σ terms to 31 digits of the *result*, however much cancels (up to about 64 digits).

    Each pass preserves the exact sum and concentrates it in the last term (VecSum of Ogita, Rump and Oishi).
    """
    vector = [np.asarray(term, dtype=np.float64) for term in terms]
    for _ in range(PASSES):
        for i in range(1, len(vector)):
            vector[i], vector[i - 1] = two_sum(vector[i], vector[i - 1])
    total = DoubleDouble.exact(vector[0])
    for term in vector[1:]:
        total = total + term
    return total


def _arrays(pair: tuple[Floats | float, Floats | float]) -> tuple[Floats, Floats]:
    high, low = pair
    return np.asarray(high), np.asarray(low)


def _fast_two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The sum and its rounding error where |a| >= |b| or a = 0."""
    s = a + b
    return s, b - (s - a)


def _lift(value: DoubleDouble | Floats | float) -> DoubleDouble:
    return value if isinstance(value, DoubleDouble) else DoubleDouble.exact(value)
