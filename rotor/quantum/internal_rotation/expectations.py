"""Expectation values of scalar operators, from products of the rotation and the torsion without their elements between functions.

A Hermitian sum of products R_i ⊗ o that share the torsional factor o has in a state ψ(K, t) of one J, with D steps of K,

    ⟨ψ|Σ R_i o|ψ⟩ = Re Σ_D≥0 (2 - δ_D0) Σ_K ⟨K + D|R_i|K⟩ w_D(K),        w_D(K) = Σ_t't ψ(K + D, t')* ⟨K + D, t'|o|K t⟩ ψ(K, t),

so that derivatives by any number of constants share w, a product of small matrices for each K.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.functions import TorsionRotation


class _Step(NamedTuple):
    """A torsional factor between K and K + change: its elements (K, t', t), and those of the rotations (operators, |J K⟩)."""

    change: int
    tables: Floats
    rotations: NDArray[Any]


@dataclass(frozen=True, eq=False)
class Expectations:
    """Expectation values of Hermitian operators, sums of products that are scalars."""

    functions: TorsionRotation
    operators: Sequence[Sequence[Product]]

    @cached_property
    def needs_phases(self) -> bool:
        """Whether an operator is imaginary in |J K⟩|K t⟩ and thus connects s = 1 with s = -1."""
        return any(np.iscomplexobj(step.rotations) for step in self._steps)

    @cached_property
    def _steps(self) -> list[_Step]:
        """Elements by torsional factor and step of K ≥ 0; other steps count twice instead."""
        factors = [(i, factor) for i, products in enumerate(self.operators) for factor in products]
        rotation = self.functions.rotation
        plain = rotation.elements([factor.rotation for _, factor in factors])
        change = rotation.labels["K"][plain.rows] - rotation.labels["K"][plain.columns]
        steps = []
        for torsion in dict.fromkeys(factor.torsion for _, factor in factors):
            values = np.zeros((len(self.operators), len(change)), dtype=plain.values.dtype)
            for number, (i, factor) in enumerate(factors):
                if factor.torsion == torsion:
                    values[i] += plain.values[number]
            for step in np.unique(change[(change >= 0) & values.any(axis=0)]).tolist():
                here = change == step
                rotations = np.zeros((len(self.operators), len(rotation)), dtype=values.dtype)
                rotations[:, plain.columns[here]] = values[:, here] * (2 if step else 1)
                steps.append(_Step(step, self.functions.torsion.tables(torsion, step), rotations))
        return steps

    def of_states(self, states: NDArray[Any]) -> Floats:
        """⟨ψ|O|ψ⟩ (n, operators) of states of one J over |J K⟩|K t⟩ (K, t, n)."""
        size, _, count = states.shape
        j, k_max = size // 2, self.functions.torsion.k_max
        start = j * j - self.functions.jmin**2
        total = np.zeros((len(self.operators), count))
        for change, tables, rotations in self._steps:
            if (stop := size - change) > 0:
                image = tables[k_max - j : k_max - j + stop] @ states[:stop]
                weights = np.einsum("ktn,ktn->kn", states[change:].conj(), image)
                total += (rotations[:, start : start + stop] @ weights).real
        return total.T
