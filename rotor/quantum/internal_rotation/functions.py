"""Torsion-rotation functions |J K⟩|K t⟩ and matrix elements between them.

The species σ = 0 goes to itself under time reversal; its functions are

    |J K t s) = i^J (|J K⟩|K t⟩ + s (-1)^K |J -K⟩|-K t⟩)/√2  (and i more for s = -1),   K > 0,       i^J |J 0⟩|0 t⟩,  s = parity of t,

Operators of rank k that are real in |J K⟩|K t⟩ connect s with s' = s (-1)^(J+J'+k), imaginary ones connect s with -s'. Elements of odd
rank are stored without their factor i, as in `rotor.quantum.operators.tensors`; all are then real. Other species use |J K⟩|K t⟩.

H is real if ρ and its tensors lie in a plane of two principal axes, y across it; s (-1)^J is then good. The molecule may have this plane
as a mirror or not: a mirror excludes components of dipoles and spin tensors with an odd number of y, which are the imaginary ones, and
without it they are allowed beside the same levels. Terms of H across the plane (Dac, Dbc of ρ along a) mix s; with them |J K⟩|K t⟩
serve all species.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.basis.labelled import ROUND_OFF, Basis, Elements, rotation_labels
from rotor.quantum.internal_rotation.contracted import ContractedTorsion, Product


@dataclass(frozen=True, eq=False)
class TorsionRotation:
    """The functions of one species with J from `jmin` to `jmax`.

    folded: whether functions of K and -K are combined, which needs σ = 0; s is a symmetry of a real Hamiltonian.
    """

    torsion: ContractedTorsion
    jmin: int
    jmax: int
    folded: bool

    @cached_property
    def rotation(self) -> Basis:
        """The functions |J K⟩."""
        return Basis(rotation_labels(self.jmax, self.jmin))

    @property
    def has_parity(self) -> bool:
        """Whether Kc follows from the sign s of |K⟩ and |-K⟩."""
        return self.folded

    @property
    def labels(self) -> Mapping[str, Ints]:
        """J, K, t, and the sign s (0 where functions are not combined)."""
        return self.plain_labels

    @cached_property
    def plain_labels(self) -> Mapping[str, Ints]:
        """The labels of |J K t s), those with s = 1 before those with s = -1, or of |J K⟩|K t⟩."""
        signs, count = (1, -1) if self.folded else (0,), self.torsion.count
        s, row, t = (
            each.ravel() for each in np.meshgrid(signs, np.arange(len(self.rotation)), range(count), indexing="ij")
        )
        j, k = self.rotation.labels["J"][row], self.rotation.labels["K"][row]
        exists = (s == 0) | (k > 0) | ((k == 0) & (self.torsion.parity[t] == s))
        return {"J": j[exists], "K": k[exists], "t": t[exists], "s": s[exists]}

    @cached_property
    def _rows(self) -> Ints:
        """Row of the function (sign, |J K⟩, t); -1 where it does not exist."""
        labels = self.plain_labels
        rows = np.full((2, len(self.rotation), self.torsion.count), -1)
        place = self.rotation.rows({"J": labels["J"], "K": labels["K"]})
        rows[(labels["s"] < 0).astype(int), place, labels["t"]] = np.arange(len(place))
        return rows

    def elements(
        self, terms: Sequence[Sequence[Product]], rank: int = 0, time_odd: bool = False, half: bool = False
    ) -> Elements:
        """Reduced elements of sums of products, all tensors of one rank, on their common pattern.

        time_odd: whether time reversal changes the sign of the tensor, as for Σ ½{Φ_i, N_j} of rank 1; its phases are then those of the
        next rank. half: without elements that Hermiticity implies: J' < J, and for scalars K' < K where K and -K are not combined.
        """
        plain = self.rotation.elements([factor.rotation for term in terms for factor in term])
        if half:
            plain = self._lower(plain, rank)
        if self.folded:
            return self._gathered(len(terms), *self._folded(terms, plain, (rank + time_odd) % 2))
        change = self._k(plain.rows) - self._k(plain.columns)
        values = self._values(terms, plain, np.arange(len(change)), change)
        rows, columns = self._rows[0][plain.rows], self._rows[0][plain.columns]
        return self._gathered(len(terms), rows, columns, values)

    def over_products(self, rows: Ints, vectors: NDArray[Any], phases: bool = False) -> NDArray[Any]:
        """States (functions, n) of one J over the functions at some rows as states over |J K⟩|K t⟩ (K, t, n), but for a common phase.

        phases: with the factor i of s = -1, which matters to operators that connect s = 1 with s = -1.
        """
        j, k, t, s = (self.plain_labels[name][rows] for name in ("J", "K", "t", "s"))
        size = 2 * int(j[0]) + 1
        if phases and self.folded:
            vectors = vectors * np.where(s < 0, 1j, 1.0)[:, None]
        states = np.zeros((size, self.torsion.count, vectors.shape[1]), dtype=vectors.dtype)
        states[j + k, t] = vectors
        if self.folded:
            pair = k > 0
            halved = vectors[pair] * np.sqrt(0.5)
            states[(j + k)[pair], t[pair]] = halved
            states[(j - k)[pair], t[pair]] = halved * np.where(k % 2, -s, s)[pair, None]
        return states

    def _lower(self, plain: Elements, rank: int) -> Elements:
        """Elements of the rotation with J' ≥ J, and of scalars with K' ≥ K where K and -K are not combined."""
        lower = plain.rows >= plain.columns  # |J K⟩ stand by J, then K
        if rank or self.folded:
            j = self.rotation.labels["J"]
            lower = j[plain.rows] >= j[plain.columns]
        return plain.where(lower)

    def symmetry_allowed(self, elements: Elements) -> Elements:
        """Elements of the full Hamiltonian without those that symmetry excludes."""
        return elements

    def _k(self, rows: Ints) -> Ints:
        return self.rotation.labels["K"][rows]

    def _values(self, terms: Sequence[Sequence[Product]], plain: Elements, chosen: Ints, change: Ints) -> NDArray[Any]:
        """Values (terms, entries, t', t) of chosen entries of the rotation, whose K changes by `change`."""
        size, tables = self.torsion.count, cache(self.torsion.tables)
        values = np.zeros((len(terms), len(chosen), size, size), dtype=plain.values.dtype)
        source = self._k(plain.columns[chosen]) + self.torsion.k_max
        for step in np.unique(change).tolist():
            here = np.flatnonzero(change == step)
            number = 0
            for i, term in enumerate(terms):
                for factor in term:
                    elements = plain.values[number, chosen[here]]
                    number += 1
                    if elements.any():
                        values[i, here] += elements[:, None, None] * tables(factor.torsion, step)[source[here]]
        return values

    def _folded(
        self, terms: Sequence[Sequence[Product]], plain: Elements, parity: int
    ) -> tuple[Ints, Ints, NDArray[Any]]:
        """Rows and columns (entries, t), and values, between combined functions.

        ⟨J'|K'| t' s'|O|J K t s) = w' w Σ_±K' (s' (-1)^K')^[K' < 0] ⟨K' t'|O|K t⟩ over both signs of K', with K ≥ 0, w = √2 for K > 0 and
        w' = 1/√2 for K' > 0 (1 otherwise), times i^(J - J') and the factors i of s and s'. Imaginary parts of ⟨K' t'|O|K t⟩ have one more
        factor i and the opposite s'.
        """
        chosen = np.flatnonzero(self._k(plain.columns) >= 0)
        rows, columns = plain.rows[chosen], plain.columns[chosen]
        k_row, k_column = self._k(rows), self._k(columns)
        j_row, j_column = self.rotation.labels["J"][rows], self.rotation.labels["J"][columns]
        values = self._values(terms, plain, chosen, k_row - k_column)
        weight = np.where(k_column > 0, np.sqrt(2), 1.0) * np.where(k_row != 0, np.sqrt(0.5), 1.0)
        target = self.rotation.rows({"J": j_row, "K": np.abs(k_row)})
        phase = (j_column - j_row - parity) % 4  # powers of i; odd ranks are stored without one factor i
        pairs, slots = np.unique(target * len(self.rotation) + columns, return_inverse=True)
        first, second = pairs // len(self.rotation), pairs % len(self.rotation)
        parts = [(0, values.real), (1, values.imag)] if np.iscomplexobj(values) else [(0, values)]
        pieces = []
        for (imaginary, part), column_sign in product(parts, (1, -1)):
            odd = (j_row + j_column + parity + imaginary) % 2  # whether the sign s changes
            row_sign = np.where(odd, -column_sign, column_sign)
            reflected = np.where(k_row < 0, row_sign * np.where(k_row % 2, -1, 1), 1)
            turns = (phase + imaginary + (column_sign < 0) - (row_sign < 0)) % 4
            factor = weight * reflected * np.where(turns == 0, 1.0, -1.0)
            if (turns % 2).any():
                raise AssertionError("an element between combined functions is not of one phase")
            summed = np.zeros((len(terms), len(pairs), *part.shape[2:]))
            for sign in (True, False):  # each pair has at most one entry of either sign of K'
                here = np.flatnonzero((k_row >= 0) == sign)
                summed[:, slots[here]] += factor[here, None, None] * part[:, here]
            sign_of_pair = np.empty(len(pairs), dtype=np.int64)
            sign_of_pair[slots] = row_sign
            row_index = self._rows[(sign_of_pair < 0).astype(int), first]
            column_index = self._rows[int(column_sign < 0), second]
            pieces.append((row_index, column_index, summed))
        all_rows, all_columns, all_values = zip(*pieces, strict=True)
        return np.concatenate(all_rows), np.concatenate(all_columns), np.concatenate(all_values, axis=1)

    def _gathered(self, count: int, rows: Ints, columns: Ints, values: NDArray[Any]) -> Elements:
        """Elements between functions by entry and t from values (terms, entries, t', t), without zeros and absent functions."""
        flat = values.reshape(count, -1)
        r = np.broadcast_to(rows[:, :, None], values.shape[1:]).ravel()
        c = np.broadcast_to(columns[:, None, :], values.shape[1:]).ravel()
        scale = ROUND_OFF * np.abs(flat).max(axis=1, keepdims=True, initial=0.0)
        retained = np.flatnonzero((np.abs(flat) > scale).any(axis=0) & (r >= 0) & (c >= 0))
        return Elements(len(self.plain_labels["J"]), r[retained], c[retained], flat[:, retained])
