"""Two equivalent tops: functions of one sign under their exchange, and spin weights by counting.

Tops that a twofold axis g of the molecule exchanges have equal constants and ρ2 = C2(g) ρ1. The permutation of their nuclei acts as

    P |J K⟩|t1 t2⟩ = φ |J, ∓K⟩|t2 t1⟩,      φ = (-1)^K of g = a (K to K),  (-1)^J of b,  (-1)^(J-K) of c (K to -K),

where the functions of the second top at K are those of the first at ±K. With σ1 = σ2 the functions here have P = ±1; with σ1 ≠ σ2 a
level of (σ1, σ2) coincides with that of (σ2, σ1). Feasible permutations of the six nuclei are the two cyclic ones, P and their products:
C3 ≀ C2 of 18 elements, G36 with the inversion, which takes no part in weights.

Weights by counting: with n = 2I + 1 states of a nucleus, a top has d_0 = (n³ + 2n)/3 spin functions of σ = 0 and d_1 = (n³ - n)/3 each of
σ = 1 and -1. A function of the molecule changes by (-1)^(n-1) for each exchanged pair. Further pairs with m = 2I + 1 states each give
N = Π m² and M = Π m. The trace of the exchange over the d_σ² N spin functions of (σ, σ) is d_σ M, so that (d_σ² N ± d_σ M)/2 of them have
P = ±1.

| (σ1, σ2) | components | spin functions, of two CH3 |
|---|---|---|
| (0, 0) | 1 | (d_0² N ± d_0 M)/2: 10, 6 |
| (1, 1), (-1, -1) | 2 | d_1² N ± d_1 M: 6, 2 |
| (1, -1), (-1, 1) | 2 | d_1² N: 4 |
| (0, ±1), (±1, 0) | 4 | 2 d_0 d_1 N: 16 |
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.labelled import ROUND_OFF, Elements, merged
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.tops.internal_rotation import spin_functions

TURNS = {"a": (1.0, -1.0, -1.0), "b": (-1.0, 1.0, -1.0), "c": (-1.0, -1.0, 1.0)}  # C2 about an axis on (a, b, c)


@dataclass(frozen=True, eq=False)
class ExchangedTops(TorsionRotation):
    """Functions of two tops with σ1 = σ2 that have a sign x under the exchange by C2 about `axis`.

    partner (n_v,): number of the product (t2, t1) for each product (t1, t2). lower (K, n_v): 1 where the sum of a pair has the lower energy
    and thus the lower number, -1 where the difference has; the phases of functions of different K are unrelated.
    """

    axis: str
    partner: Ints
    lower: Ints

    @property
    def has_parity(self) -> bool:
        """Whether Kc follows from the sign s of |K⟩ and |-K⟩."""
        return self.folded or self.axis != "a"

    @cached_property
    def labels(self) -> Mapping[str, Ints]:
        """J, K (not below 0 where K and -K are combined), t, the sign s of |-K⟩ beside |K⟩, and the sign x under the exchange."""
        return self._combined[1]

    @cached_property
    def _combined(self) -> tuple[Any, dict[str, Ints]]:
        """The matrix (plain functions, functions with a sign), and their labels."""
        from scipy.sparse import csr_array

        plain: dict[str, Any] = dict(self.plain_labels)
        count, t = len(plain["t"]), plain["t"]
        other = self._row(plain["J"], plain["K"], self.partner[t], plain["s"])
        lower = self.lower[plain["K"] + self.torsion.k_max, t]
        # sign of each function in its combination with the partner
        first = np.where(t == self.partner[t], 1.0, np.where(t < self.partner[t], lower, -lower))
        matrix = _pairs(np.arange(count), other, first)
        sign = first.astype(np.int64)
        if self.has_parity and not self.folded:
            k = plain["K"]
            opposite = self._row(plain["J"], -k, t, plain["s"])
            matrix = matrix @ _pairs(
                np.arange(count), opposite, np.where(k >= 0, 1.0, -1.0), np.where(k % 2, -1.0, 1.0)
            )
            plain["s"], plain["K"] = np.where(k >= 0, 1, -1), np.abs(k)
        s, j, k = np.where(plain["K"] > 0, plain["s"], 1), plain["J"], plain["K"]
        phase = {"a": k, "b": j + k, "c": j}[self.axis] % 2
        rotation_sign = np.where(phase, -1, 1) * (1 if self.axis == "a" else s)
        plain["x"] = sign * rotation_sign
        order = np.lexsort((plain["t"], plain["K"], plain["J"], -plain["s"]))
        return csr_array(matrix[:, order]), {name: column[order] for name, column in plain.items()}

    def _row(self, j: Ints, k: Ints, t: Ints, s: Ints) -> Ints:
        """Rows of plain functions with these labels."""
        return np.asarray(self._rows[(s < 0).astype(int), self.rotation.rows({"J": j, "K": k}), t])

    def elements(
        self, terms: Sequence[Sequence[Product]], rank: int = 0, time_odd: bool = False, half: bool = False
    ) -> Elements:
        """Elements between functions with a sign x, transformed from those between plain functions; `half` applies to ranks above 0."""
        from scipy.sparse import csr_array

        plain = super().elements(terms, rank, time_odd, half and rank > 0)
        matrix = self._combined[0]
        pieces = []
        for i, values in enumerate(plain.values):
            reduced = matrix.T @ csr_array((values, (plain.rows, plain.columns)), shape=(plain.count,) * 2) @ matrix
            reduced = reduced.tocoo()
            here = np.zeros((len(plain.values), reduced.nnz), dtype=plain.values.dtype)
            here[i] = reduced.data
            pieces.append((reduced.row.astype(np.int64), reduced.col.astype(np.int64), here))
        if len(pieces) == 1:  # no pattern to merge
            rows, columns, values = pieces[0]
            retained = np.abs(values[0]) > ROUND_OFF * np.abs(values).max(initial=0.0)
            return Elements(plain.count, rows[retained], columns[retained], values[:, retained])
        rows, columns, values = (np.concatenate(part, axis=-1) for part in zip(*pieces, strict=True))
        return merged(plain.count, rows, columns, values)

    def over_products(self, rows: Ints, vectors: NDArray[Any], phases: bool = False) -> NDArray[Any]:
        """States over |J K⟩|K t⟩ (K, t, n), by way of the plain functions that occur in them."""
        combined = self._combined[0][:, rows]
        plain = np.unique(combined.nonzero()[0])
        return super().over_products(plain, combined[plain] @ vectors, phases)

    def symmetry_allowed(self, elements: Elements) -> Elements:
        """Elements of the full Hamiltonian without the round-off between functions of different x."""
        x = self.labels["x"]
        return elements.where(x[elements.rows] == x[elements.columns])


def _pairs(rows: Ints, others: Ints, first: Floats, factor: Floats | None = None) -> Any:
    """Columns (|row⟩ + |other⟩ f)/√2 for first = 1, (|other⟩ - |row⟩ f)/√2 for first = -1, and |row⟩ where both are the same."""
    from scipy.sparse import csr_array

    weights = np.ones(len(rows)) if factor is None else factor
    alone = rows == others
    entry = np.where(alone, 1.0, np.where(first > 0, 1.0, -weights) * math.sqrt(0.5))
    beside = np.where(alone, 0.0, np.where(first > 0, weights, 1.0) * math.sqrt(0.5))
    entries = np.concatenate([entry, beside]), (np.concatenate([rows, others]), np.concatenate([rows, rows]))
    return csr_array(entries, shape=(len(rows),) * 2)


def exchanged_functions(states: int, pairs: Sequence[int], sigma: Sequence[int]) -> Ints:
    """Spin functions (2,) of levels with the signs 1 and -1 under the exchange of two tops, summed over their components.

    states: 2I + 1 of a nucleus of a top. pairs: 2I + 1 of further exchanged pairs.

    >>> [exchanged_functions(2, (), sigma).tolist() for sigma in ((0, 0), (1, 1), (1, -1), (0, 1))]
    [[6, 10], [2, 6], [4, 4], [16, 16]]
    >>> exchanged_functions(2, (2,), (0, 0)).tolist()  # propane: the hydrogens of CH2 are exchanged too
    [36, 28]
    """
    all_pairs, d = math.prod(m * m for m in pairs), spin_functions(states)
    first, second = (d[abs(number)] for number in sigma)
    if sigma[0] != sigma[1]:
        return np.full(2, first * second * all_pairs * (1 if all(sigma) else 2))
    fermions = 3 * (states % 2 == 0) + sum(m % 2 == 0 for m in pairs)
    # sign of the spin function, so that the product is symmetric or antisymmetric as the nuclei demand
    y = np.array([1, -1]) * (-1 if fermions % 2 else 1)
    return np.asarray((first**2 * all_pairs + y * first * math.prod(pairs)) // (2 if not any(sigma) else 1))


def exchange_axis(first: Floats, second: Floats, tolerance: float) -> str:
    """The axis a, b or c about which C2 takes the direction of one top to that of the other, "" for none.

    A top along a principal axis is excluded, since the choice of the axis is then not unique.

    >>> exchange_axis(np.array([0.8, 0.6, 0.0]), np.array([-0.8, 0.6, 0.0]), 1e-9)
    'b'
    """
    if np.count_nonzero(np.abs(first) > tolerance) < 2:
        return ""
    for axis, turn in TURNS.items():
        if np.abs(np.array(turn) * first - second).max() < tolerance:
            return axis
    return ""
