"""Operators of the rotation on functions |J K⟩: powers of J, its components, and tensors fixed in the molecule.

The operators R and L that raise and lower K have the real positive elements √(J(J+1) - K(K±1)). Components along the molecule obey
[Jx, Jy] = -i Jz (CONVENTIONS.md), so that Jx = ½(R + L), Jy = ½i(R - L).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from rotor.quantum.operators.algebra import Labels, Operator, Values, diagonal, half_anticommutator, shift
from rotor.quantum.symmetric_top_elements import closed_coupling
from rotor.quantum.wigner import three_j
from rotor.tops.operators import Powers


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


def powers(p: int, q: int, n: int) -> Operator:
    """J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊, J^2p Jz^2q where n = 0: the operator of a distortion constant."""
    if n == 0:
        return j_squared(p) @ j_z(2 * q)
    return j_squared(p) @ half_anticommutator(j_z(2 * q), ladder(2 * n) + ladder(-2 * n))


def sum_of_powers(operators: Mapping[Powers, float]) -> Operator:
    """Σ c J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ over a table {(p, q, n): c}."""
    return reduce(lambda x, y: x + y, (c * powers(*pqn) for pqn, c in operators.items()), Operator())


def body_tensor(components: ArrayLike) -> Operator:
    """⟨J'K'‖T^k‖JK⟩ of a tensor with components T^k_q, q = -k ... k, in the molecule.

    √((2J'+1)(2J+1)) (-1)^(J'-K') (J' k J; -K' q K) T_q with K' = K + q; the phases and the normalisation of `quantum.tensors`.
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


def _tensor_shift(rank: int, q: int, rise: int) -> Operator:
    def factor(labels: Labels) -> Values:
        j, k = labels["J"], labels["K"]
        exists = (np.abs(k + q) <= j + rise) & (np.abs(rise) <= rank) & (2 * j + rise >= rank)
        values = np.zeros(len(j))
        lower, projection = j[exists], k[exists]
        if rank <= 2:
            values[exists] = closed_coupling(lower, rise, rank, q, projection.astype(float))
            return values
        root = np.sqrt((2.0 * (lower + rise) + 1) * (2 * lower + 1))
        sign = np.where((lower + rise - projection - q) % 2, -1.0, 1.0)
        values[exists] = sign * root * three_j(lower + rise, rank, lower, -projection - q, q, projection)
        return values

    return shift(factor, J=rise, K=q)
