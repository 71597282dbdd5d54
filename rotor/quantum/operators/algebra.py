"""Operators as sums of shifts of quantum numbers, closed under sums and products.

An operator acts on functions |a b c ...⟩ that are labelled by whole numbers. One shift changes some of the labels by fixed amounts
and multiplies by a function of the labels that it acts on,

    O |a⟩ = Σ_s f_s(a) |a + d_s⟩,        O' O |a⟩ = Σ f'_s'(a + d_s) f_s(a) |a + d_s + d_s'⟩,

so that sums, products, anticommutators and powers of operators are operators again, and no element is written twice. In a product shifts
by the same steps are one, whose factor is their sum.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

from numpy.typing import NDArray

from rotor.arrays import Ints

Labels = Mapping[str, Ints]
Values = NDArray[Any]  # real or complex, one for each function
Factor = Callable[[Labels], Any]  # of the labels that a shift acts on
Change = tuple[tuple[str, int], ...]  # (label, step) in the order of labels, steps of 0 left out


@dataclass(frozen=True)
class Shift:
    """One shift: the change of labels, and the factor as a function of the labels before it."""

    change: Change
    factor: Factor

    def after(self, first: Shift) -> Shift:
        """The product in which `first` acts first."""
        steps = dict(first.change)
        moved = {name: steps.get(name, 0) + step for name, step in self.change}

        def factor(labels: Labels) -> Any:
            between = {**labels, **{name: labels[name] + step for name, step in first.change}}
            return self.factor(between) * first.factor(labels)

        return Shift(change_of({**steps, **moved}), factor)


@dataclass(frozen=True)
class Operator:
    """A sum of shifts. `a + b`, `c * a` with a number c, `a @ b` (b acts first) and `a ** n` are operators."""

    shifts: tuple[Shift, ...] = ()

    def __add__(self, other: Operator) -> Operator:
        return Operator(self.shifts + other.shifts)

    def __sub__(self, other: Operator) -> Operator:
        return self + (-1.0) * other

    def __rmul__(self, number: complex) -> Operator:
        return Operator(tuple(Shift(s.change, _scaled(number, s.factor)) for s in self.shifts))

    def __matmul__(self, first: Operator) -> Operator:
        return Operator(tuple(s.after(t) for s in self.merged().shifts for t in first.merged().shifts)).merged()

    def __pow__(self, power: int) -> Operator:
        return reduce(lambda left, right: left @ right, [self] * power) if power else UNIT

    def merged(self) -> Operator:
        """The same operator with one shift by any steps."""
        factors: dict[Change, list[Factor]] = {}
        for each in self.shifts:
            factors.setdefault(each.change, []).append(each.factor)
        return Operator(tuple(Shift(change, _sum(alike)) for change, alike in factors.items()))


def _sum(factors: Sequence[Factor]) -> Factor:
    return factors[0] if len(factors) == 1 else lambda labels: sum(factor(labels) for factor in factors)


def _scaled(number: complex, factor: Factor) -> Factor:
    return lambda labels: number * factor(labels)


def change_of(steps: Mapping[str, int]) -> Change:
    """The steps of labels in a fixed order, without those of 0.

    >>> change_of({"m": 0, "K": 2, "J": -1})
    (('J', -1), ('K', 2))
    """
    return tuple(sorted((name, step) for name, step in steps.items() if step))


def diagonal(factor: Factor) -> Operator:
    """The operator that multiplies by a function of the labels."""
    return Operator((Shift((), factor),))


def shift(factor: Factor, **steps: int) -> Operator:
    """The operator that changes labels by `steps` and multiplies by a function of the labels before.

    >>> import numpy as np
    >>> raise_k = shift(lambda labels: np.sqrt(labels["K"] + 1.0), K=1)
    >>> [(s.change, float(s.factor({"K": np.array(3)}))) for s in (raise_k @ raise_k).shifts]  # √4 √5
    [((('K', 2),), 4.47213595499958)]
    """
    return Operator((Shift(change_of(steps), factor),))


UNIT = diagonal(lambda labels: 1.0)


def half_anticommutator(a: Operator, b: Operator) -> Operator:
    """½(ab + ba), Hermitian where a and b are."""
    return 0.5 * (a @ b + b @ a)
