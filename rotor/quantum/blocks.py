"""The linear block Hamiltonian H_b(c) = Σ_i c_i O_i,b over labelled functions.

Elements of every term are made once, from an operator algebra (`operators`) or by a writer of elements. Blocks are the connected parts of
what the terms connect, so that symmetries need not be named. At any values c the blocks are summed and solved; a fit is the same blocks at
other values, a field strength is one of the c, and

    ∂E/∂c_i = ⟨ψ|O_i|ψ⟩

is one contraction with the eigenvectors. Eigenvectors keep their meaning without a phase convention: nothing here depends on it.

A level is named by its block and its rank in it, and stands in all arrays at the row of that function of the block which has this rank.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import ROUND_OFF, Elements
from rotor.quantum.basis.labelled import Basis
from rotor.quantum.connected import part_numbers
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
    """H_b(c) = Σ_i c_i O_i,b.

    names: of the terms. labels: quantum numbers of the functions. rows, columns, values: elements (terms, entries) of the lower triangles
    in the order of functions in a block. block, rank: (functions,) number of each function's block, and its place in it; -1 for functions
    of blocks that are left out. stacks: by size, rising, the rows of the functions of each block (blocks, size). Elements stand in the
    order of these blocks; _position: the place of each in the flat matrices of its stack.
    """

    names: tuple[str, ...]
    labels: dict[str, Ints]
    rows: Ints
    columns: Ints
    values: NDArray[Any]
    block: Ints
    rank: Ints
    stacks: tuple[Ints, ...]
    _position: Ints

    def solve(self, coefficients: ArrayLike) -> SolvedBlocks:
        """All blocks solved at coefficients (terms,)."""
        return SolvedBlocks(self, tuple(eigenstates(matrices) for matrices in self.matrices(coefficients)))

    def solve_dominated(self, coefficients: ArrayLike, by: NDArray[np.bool_]) -> SolvedBlocks:
        """Of each block the states with the largest shares in some of the functions (functions,), as many as these; or all."""
        values = np.asarray(coefficients, dtype=float) @ self.values
        return SolvedBlocks(
            self,
            tuple(
                self._dominated(stack, bounds, values, by[stack]) or eigenstates(self._dense(stack, bounds, values))
                for stack, bounds in zip(self.stacks, self._bounds, strict=True)
            ),
        )

    def _dominated(
        self, stack: Ints, bounds: Ints, values: NDArray[Any], chosen: NDArray[np.bool_]
    ) -> tuple[Floats, NDArray[Any]] | None:
        """Energies and vectors of the states of each block of a stack that lie in chosen functions (blocks, size), where this is faster."""
        from scipy.sparse import csr_array

        counts, size = chosen.sum(axis=1), stack.shape[1]
        if (counts != counts[0]).any() or not is_dominated(size, int(counts[0])):
            return None
        few: list[tuple[Floats, NDArray[Any]]] = []
        for (start, stop), functions in zip(pairwise(bounds.tolist()), chosen, strict=True):
            places = self.rank[self.rows[start:stop]], self.rank[self.columns[start:stop]]
            lower = csr_array((values[start:stop], places), shape=(size, size))
            states = dominated_states(lower, np.flatnonzero(functions))
            if states is None:
                return None
            few.append(states)
        return np.stack([energies for energies, _ in few]), np.stack([vectors for _, vectors in few])

    @cached_property
    def _bounds(self) -> list[Ints]:
        """Of each stack where the elements of its blocks begin, and where the last ones end."""
        counts, bounds, first = np.bincount(self.block[self.rows], minlength=len(self.block)), [], 0
        for stack in self.stacks:
            ends = first + np.cumsum(counts[self.block[stack[:, 0]]])
            bounds.append(np.append(first, ends))
            first = int(ends[-1])
        return bounds

    def _dense(self, stack: Ints, bounds: Ints, values: NDArray[Any]) -> NDArray[Any]:
        """The matrices (blocks, size, size) of one stack from the values of all elements."""
        (count, size), here = stack.shape, slice(bounds[0], bounds[-1])
        flat = np.zeros(count * size * size, dtype=values.dtype)
        flat[self._position[here]] = values[here]
        return flat.reshape(count, size, size)

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
        energies = np.full(len(self.block), np.nan)
        for stack, matrices in zip(self.stacks, self.matrices(coefficients), strict=True):
            energies[stack] = eigenvalues(matrices)
        return energies

    def matrices(self, coefficients: ArrayLike) -> list[NDArray[Any]]:
        """The matrices (blocks, size, size) of each stack at coefficients (terms,), their lower triangles."""
        values = np.asarray(coefficients, dtype=float) @ self.values
        return [self._dense(stack, bounds, values) for stack, bounds in zip(self.stacks, self._bounds, strict=True)]


@dataclass(frozen=True, eq=False)
class SolvedBlocks:
    """Linear blocks solved at some values: energies (blocks, n) and vectors (blocks, size, n) of each stack."""

    linear: LinearBlocks
    states: tuple[tuple[Floats, NDArray[Any]], ...]

    @cached_property
    def energies(self) -> Floats:
        """Energies (functions,) at the row of the function of the same rank; nan for states that were not solved."""
        energies = np.full(len(self.linear.block), np.nan)
        for stack, (values, _) in zip(self.linear.stacks, self.states, strict=True):
            energies[stack[:, : values.shape[1]]] = values
        return energies

    def vectors(self, block: int) -> tuple[Ints, NDArray[Any]]:
        """The rows of a block's functions, and its eigenvectors in columns."""
        stack, place = self._places[block]
        return self.linear.stacks[stack][place], self.states[stack][1][place]

    def slopes_of(self, elements: Elements, levels: Ints) -> Floats:
        """⟨ψ|O|ψ⟩ (levels, operators) of the levels at these rows, of Hermitian operators between the functions of these blocks."""
        linear = self.linear
        slopes, blocks = np.zeros((len(levels), len(elements.values))), linear.block[levels]
        entries = linear.between_blocks(elements, np.unique(blocks))
        for block in {up for up, low in entries if up == low}:  # blocks of H may be finer than those of O
            chosen = np.flatnonzero(blocks == block)
            vectors = self.vectors(block)[1][:, None, linear.rank[levels[chosen]]]
            slopes[chosen] = expectations(entries, {block: vectors}, len(elements.values))
        return slopes

    @cached_property
    def _places(self) -> dict[int, tuple[int, int]]:
        block = self.linear.block
        return {
            int(number): (i, place)
            for i, stack in enumerate(self.linear.stacks)
            for place, number in enumerate(block[stack[:, 0]].tolist())
        }


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
    return blocks_of_elements(tuple(terms), functions.labels, functions.elements(list(terms.values())))


def blocks_of_elements(
    names: Sequence[str], labels: Mapping[str, Ints], elements: Elements, needed: NDArray[np.bool_] | None = None
) -> LinearBlocks:
    """The connected parts of elements of named terms, both triangles of Hermitian matrices, that have a `needed` function.

    Inside a block functions are in the order of their labels.
    """
    count = elements.count
    part = part_numbers(count, elements.rows, elements.columns)
    present = np.ones(count, dtype=bool) if needed is None else np.isin(part, part[needed])
    order = np.flatnonzero(present)
    keys = [np.asarray(column)[order] for column in labels.values()]
    order = order[np.lexsort([*keys[::-1], part[order]])]
    numbers, starts, counts = np.unique(part[order], return_index=True, return_counts=True)
    rank, size = np.full(count, -1), np.zeros(count, dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, counts)
    size[order] = np.repeat(counts, counts)
    block = np.where(present, part, -1)
    stacks = list[Ints]()
    in_stack = np.zeros((2, int(part.max(initial=0)) + 1), dtype=np.int64)  # blocks before, of all and of the stack
    for width in np.unique(counts).tolist():
        members = np.flatnonzero(counts == width)
        places = np.arange(len(members))
        in_stack[:, numbers[members]] = sum(map(len, stacks)) + places, places
        stacks.append(order[starts[members][:, None] + np.arange(width)])
    lower = np.flatnonzero((rank[elements.rows] >= rank[elements.columns]) & present[elements.rows])
    before, place = in_stack[:, block[elements.rows[lower]]]
    lower, place = (array[np.argsort(before, kind="stable")] for array in (lower, place))
    rows, columns, values = elements.rows[lower], elements.columns[lower], elements.values[:, lower]
    if np.iscomplexobj(values) and np.abs(values.imag).max(initial=0.0) <= ROUND_OFF * np.abs(values).max(initial=0.0):
        values = np.ascontiguousarray(values.real)
    position = size[rows] * (size[rows] * place + rank[rows]) + rank[columns]
    return LinearBlocks(
        tuple(names), {name: np.asarray(column) for name, column in labels.items()}, rows, columns, values, block, rank,
        tuple(stacks), position,
    )  # fmt: skip
