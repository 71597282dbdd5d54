"""Operators of the rotation on functions |J K⟩: powers of J, its components, and tensors fixed in the molecule.

The operators R and L that raise and lower K have the real positive elements √(J(J+1) - K(K±1)). Components along the right-handed frame
x, y, z obey the anomalous commutators [Jx, Jy] = -i Jz (CONVENTIONS.md), so that Jx = ½(R + L), Jy = ½i(R - L)
(P. R. Bunker and P. Jensen, Molecular Symmetry and Spectroscopy, 2nd ed., eqs. 10-46 and 10-47, with J_m± = Jx ± iJy, where
J_m∓ raises and lowers k). In a left-handed representation the frame x, -y, z is right-handed, so that Jy changes its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, reduce
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Ints
from rotor.quantum.operators.algebra import UNIT, Factor, Labels, Operator, Shift, Values, diagonal, shift
from rotor.quantum.operators.symmetric_top_elements import coupling_to
from rotor.quantum.operators.tensors import spherical_components
from rotor.tops.constants.operators import Powers, axis_order

Weight = Callable[[Ints, Ints, Ints, Ints], Values]  # of J', J, K' and K


def j_squared(power: int = 1) -> Operator:
    """J^2p."""
    return diagonal(lambda labels: (labels["J"] * (labels["J"] + 1.0)) ** power)


def j_z(power: int = 1) -> Operator:
    """Jz^q."""
    return diagonal(lambda labels: labels["K"].astype(float) ** power)


def ladder(step: int) -> Operator:
    """The operator that changes K by `step`: |step| factors √(J(J+1) - K(K±1))."""
    sign = 1 if step > 0 else -1

    def factor(labels: Labels) -> Values:
        square = labels["J"] * (labels["J"] + 1.0)
        steps = [labels["K"] + sign * i for i in range(abs(step))]
        return reduce(lambda x, y: x * y, [np.sqrt(np.maximum(square - k * (k + sign), 0.0)) for k in steps])

    return shift(factor, K=step)


def j_x() -> Operator:
    """Jx of the molecule."""
    return 0.5 * (ladder(1) + ladder(-1))


def j_y() -> Operator:
    """Jy of the molecule, so that [Jx, Jy] = -i Jz."""
    return 0.5j * (ladder(1) - ladder(-1))


@cache
def components(representation: str) -> Mapping[str, Operator]:
    """Ja, Jb, Jc on |J K⟩ of a representation.

    >>> a, b, c = (components("IIIr")[axis] for axis in "abc")
    >>> commutators = {s.change: s.factor({"J": np.array([2]), "K": np.array([1])}) for s in (a @ b - b @ a + 1j * c).merged().shifts}
    >>> bool(max(abs(factor).item() for factor in commutators.values()) < 1e-15)
    True
    """
    sense = -1.0 if representation.endswith("l") else 1.0
    return MappingProxyType(dict(zip(axis_order(representation), (j_x(), sense * j_y(), j_z()), strict=True)))


def weighted(operator: Operator, weight: Weight) -> Operator:
    """The operator whose elements ⟨J'K'|O|J K⟩ are multiplied by weight(J', J, K', K)."""

    def product(each: Shift) -> Factor:
        steps = dict(each.change)

        def factor(labels: Labels) -> Any:
            j, k = labels["J"], labels["K"]
            return weight(j + steps.get("J", 0), j, k + steps.get("K", 0), k) * each.factor(labels)

        return factor

    return Operator(tuple(Shift(each.change, product(each)) for each in operator.shifts))


def with_powers(operator: Operator, p: int, q: int) -> Operator:
    """J^2p ½{Jz^2q, O} of an operator O within J."""
    if not p and not q:
        return operator

    def weight(m: Ints, j: Ints, above: Ints, below: Ints) -> Values:
        axial = (above ** (2.0 * q) + below ** (2.0 * q)) / 2
        return np.asarray((j * (j + 1.0)) ** p * axial)

    return weighted(operator, weight)


def ladders(n: int) -> Operator:
    """J₊^2n + J₋^2n, 1 where n = 0."""
    return ladder(2 * n) + ladder(-2 * n) if n else UNIT


def powers(p: int, q: int, n: int) -> Operator:
    """J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊, J^2p Jz^2q where n = 0: the operator of a distortion constant."""
    return with_powers(ladders(n), p, q)


def sum_of_powers(operators: Mapping[Powers, float]) -> Operator:
    """Σ c J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ over a table {(p, q, n): c}."""
    return reduce(lambda x, y: x + y, (c * powers(*pqn) for pqn, c in operators.items()), Operator())


def body_tensor(components: ArrayLike) -> Operator:
    """⟨J'K'‖T^k‖JK⟩ of a tensor with components T^k_q, q = -k ... k, in the molecule.

    √((2J'+1)(2J+1)) (-1)^(J'-K') (J' k J; -K' q K) T_q with K' = K + q; the phases and the normalisation of `quantum.operators.tensors`.
    """
    parts = np.asarray(components)
    rank = len(parts) // 2
    terms = [
        parts[rank + q] * _tensor_shift(rank, q, rise)
        for rise in range(-rank, rank + 1)
        for q in range(-rank, rank + 1)
        if parts[rank + q] != 0
    ]
    return reduce(lambda x, y: x + y, terms, Operator())


@cache
def direction_cosine(axis: str, representation: str) -> Operator:
    """⟨J'K'‖φ‖JK⟩ of the direction cosines between space and the axis a, b or c."""
    return body_tensor(spherical_components([float(axis == letter) for letter in "abc"], 1, representation))


def _tensor_shift(rank: int, q: int, rise: int) -> Operator:
    def factor(labels: Labels) -> Values:
        return coupling_to(labels["J"], rise, rank, q, labels["K"])

    return shift(factor, J=rise, K=q)
