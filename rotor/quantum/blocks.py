"""The linear block Hamiltonian H_b(c) = Σ_i c_i O_i,b over labelled functions.

Elements of every term are made once, from an operator algebra (`operators`) or by a writer of elements. Blocks are the connected parts of
what the terms connect, so that symmetries need not be named; each is a `linear_stacks.LinearBlock`. At any values c the blocks are summed
and solved; a fit is the same blocks at other values, a field strength is one of the c, and

    ∂E/∂c_i = ⟨ψ|O_i|ψ⟩

is one contraction with the eigenvectors. Eigenvectors keep their meaning without a phase convention: nothing here depends on it.

A level is named by its block and its rank in it, and stands in all arrays at the row of that function of the block which has this rank.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import ROUND_OFF, Elements
from rotor.quantum.basis.labelled import Basis
from rotor.quantum.connected import part_numbers
from rotor.quantum.linear_stacks import LinearBlock
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.solvers.dominated import dominated_states, is_dominated
from rotor.quantum.solvers.hermitian import eigenstates, eigenvalues

_AT_ONCE = 1 << 16  # numbers computed at a time, so that they stay in the cache of a core


class Entries(NamedTuple):
    """Elements of operators between two blocks: row and column in each block, and values (operators, entries)."""

    rows: Ints
    columns: Ints
    values: NDArray[Any]


@dataclass(frozen=True, eq=False)
class LinearBlocks:
    """H_b(c) = Σ_i c_i O_i,b of connected functions.

    labels: quantum numbers of the functions. block, rank: (functions,) number of each function's block, and its place in it; -1 for
    functions of blocks that are left out. members, blocks: by number, the rows of the functions of a block, in order, and its elements.
    states: energies (n,) and vectors (size, n) by number, of blocks that `solve` has solved at some values.
    """

    labels: dict[str, Ints]
    block: Ints
    rank: Ints
    members: dict[int, Ints]
    blocks: dict[int, LinearBlock]
    states: dict[int, tuple[Floats, NDArray[Any]]] = field(default_factory=dict, repr=False)

    def solve(self, coefficients: ArrayLike, mostly_in: NDArray[np.bool_] | None = None) -> LinearBlocks:
        """These blocks with their states at coefficients (terms,).

        mostly_in: some of the functions (functions,), of which each block has as many states with the largest shares in them solved, where
        this is faster than all.
        """
        values, states = np.asarray(coefficients, dtype=float), {}
        for number, block in self.blocks.items():
            chosen = None if mostly_in is None else np.flatnonzero(mostly_in[self.members[number]])
            few = None
            if chosen is not None and is_dominated(block.size, len(chosen)):
                few = dominated_states(block.sparse(values), chosen)
            states[number] = few or eigenstates(block.lower(values))
        return replace(self, states=states)

    def between_blocks(self, elements: Elements, blocks: Ints | None = None) -> dict[tuple[int, int], Entries]:
        """Elements of operators between the functions of blocks, by default of all, by the numbers of the blocks of rows and columns."""
        taken = self.block >= 0 if blocks is None else np.isin(self.block, blocks)
        here = np.flatnonzero(taken[elements.rows] & taken[elements.columns])
        up, low = self.block[elements.rows[here]], self.block[elements.columns[here]]
        pair = up * len(self.block) + low
        order = np.argsort(pair, kind="stable")
        bounds = [*np.flatnonzero(np.diff(pair[order], prepend=-1)).tolist(), len(order)]
        entries = {}
        for start, stop in pairwise(bounds):
            chosen = here[order[start:stop]]
            rows, columns = self.rank[elements.rows[chosen]], self.rank[elements.columns[chosen]]
            key = int(up[order[start]]), int(low[order[start]])
            entries[key] = Entries(rows, columns, elements.values[:, chosen])
        return entries

    def energies(self, coefficients: ArrayLike) -> Floats:
        """Energies (functions,) at coefficients (terms,), without vectors; nan for blocks that are left out."""
        energies, values = np.full(len(self.block), np.nan), np.asarray(coefficients, dtype=float)
        for number, rows in self.members.items():
            energies[rows] = eigenvalues(self.blocks[number].lower(values))
        return energies

    @cached_property
    def energies_mhz(self) -> Floats:
        """Energies (functions,) of the states at the row of the function of the same rank; nan for states that were not solved."""
        energies = np.full(len(self.block), np.nan)
        for number, (values, _) in self.states.items():
            energies[self.members[number][: len(values)]] = values
        return energies

    def slopes_of(self, elements: Elements, levels: Ints) -> Floats:
        """⟨ψ|O|ψ⟩ (levels, operators) of the levels at these rows, of Hermitian operators between the functions of these blocks."""
        slopes, blocks = np.zeros((len(levels), len(elements.values))), self.block[levels]
        entries = self.between_blocks(elements, np.unique(blocks))
        for block in {up for up, low in entries if up == low}:  # blocks of H may be finer than those of O
            chosen = np.flatnonzero(blocks == block)
            vectors = self.states[block][1][:, None, self.rank[levels[chosen]]]
            slopes[chosen] = expectations(entries, {block: vectors}, len(elements.values))
        return slopes


def expectations(
    entries: Mapping[tuple[int, int], Entries], vectors: Mapping[int, NDArray[Any]], operators: int
) -> Floats:
    """Σ_p ⟨ψ_p|O|ψ_p⟩ (n, operators) of Hermitian operators; vectors: (functions, p, n) of ψ in each of its blocks."""
    _, patterns, n = next(iter(vectors.values())).shape
    total, at_once = np.zeros((operators, n)), max(1, _AT_ONCE // (patterns * n))
    for up, low in product(vectors, repeat=2):
        if (up, low) in entries:
            rows, columns, values = entries[up, low]
            for start in range(0, len(rows), at_once):
                here = slice(start, start + at_once)
                weights = vectors[up][rows[here]].conj()
                weights *= vectors[low][columns[here]]
                total += (values[:, here] @ weights.sum(axis=1)).real
    return total.T


def linear_blocks(functions: Basis, terms: Mapping[str, Operator]) -> LinearBlocks:
    """H_b(c) = Σ_i c_i O_i,b of named operators over a basis.

    >>> from rotor.quantum.basis.labelled import rotation_labels
    >>> from rotor.quantum.operators.rotation import j_x, j_y, j_z
    >>> top = linear_blocks(Basis(rotation_labels(1)), {"A": j_z(2), "B": j_x() @ j_x(), "C": j_y() @ j_y()})
    >>> top.energies([10.0, 6.0, 4.0]).round(9).tolist()  # 0, and B + C, A + C, A + B
    [0.0, 14.0, 10.0, 16.0]
    """
    return blocks_of_elements(functions.labels, functions.elements(list(terms.values())))


def blocks_of_elements(
    labels: Mapping[str, Ints], elements: Elements, needed: NDArray[np.bool_] | None = None
) -> LinearBlocks:
    """The connected parts of elements of terms, both triangles of Hermitian matrices, that have a `needed` function.

    Inside a block functions are in the order of their labels.
    """
    count = elements.count
    part = part_numbers(count, elements.rows, elements.columns)
    present = np.ones(count, dtype=bool) if needed is None else np.isin(part, part[needed])
    order = np.flatnonzero(present)
    keys = [np.asarray(column)[order] for column in labels.values()]
    order = order[np.lexsort([*keys[::-1], part[order]])]
    numbers, starts, sizes = np.unique(part[order], return_index=True, return_counts=True)
    rank, block = np.full(count, -1), np.where(present, part, -1)
    rank[order] = np.arange(len(order)) - np.repeat(starts, sizes)
    members = dict(zip(numbers.tolist(), np.split(order, starts[1:]), strict=True))
    lower = np.flatnonzero((rank[elements.rows] >= rank[elements.columns]) & present[elements.rows])
    lower = lower[np.argsort(block[elements.rows[lower]], kind="stable")]
    bounds = np.searchsorted(block[elements.rows[lower]], [*numbers.tolist(), count]).tolist()
    rows, columns, values = rank[elements.rows[lower]], rank[elements.columns[lower]], elements.values[:, lower]
    if np.iscomplexobj(values) and np.abs(values.imag).max(initial=0.0) <= ROUND_OFF * np.abs(values).max(initial=0.0):
        values = np.ascontiguousarray(values.real)
    factors, terms, unit = values.T, np.arange(len(values)), np.eye(len(values))
    blocks = {
        number: LinearBlock(size, rows[first:stop], columns[first:stop], factors[first:stop], unit, terms)
        for number, size, (first, stop) in zip(numbers.tolist(), sizes.tolist(), pairwise(bounds), strict=True)
    }
    return LinearBlocks({name: np.asarray(column) for name, column in labels.items()}, block, rank, members, blocks)
