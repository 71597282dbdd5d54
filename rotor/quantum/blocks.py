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
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import ROUND_OFF, Elements
from rotor.quantum.basis.labelled import Basis
from rotor.quantum.connected import part_numbers
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.solvers.dominated import dominated_states, is_dominated
from rotor.quantum.solvers.hermitian import eigenstates, eigenvalues


@dataclass(frozen=True, eq=False)
class Stack:
    """Blocks of one size: rows of their functions (blocks, size), and where their matrices stand in the flat array of all."""

    functions: Ints
    place: slice

    @property
    def size(self) -> int:
        """Functions in one block."""
        return int(self.functions.shape[1])


@dataclass(frozen=True, eq=False)
class LinearBlocks:
    """H_b(c) = Σ_i c_i O_i,b.

    names: of the terms. labels: quantum numbers of the functions. rows, columns, values: elements (terms, entries) of the lower triangles
    in the order of functions in a block. block, rank: (functions,) number of each function's block, and its place in it; -1 for functions
    of blocks that are left out. stacks: the blocks by size.
    """

    names: tuple[str, ...]
    labels: dict[str, Ints]
    rows: Ints
    columns: Ints
    values: NDArray[Any]
    block: Ints
    rank: Ints
    stacks: tuple[Stack, ...]
    _position: Ints

    def solve(self, coefficients: ArrayLike) -> SolvedBlocks:
        """All blocks solved at coefficients (terms,)."""
        return SolvedBlocks(self, tuple(eigenstates(matrices) for matrices in self.matrices(coefficients)))

    def solve_dominated(self, coefficients: ArrayLike, by: NDArray[np.bool_]) -> SolvedBlocks:
        """Of each block the states with the largest shares in some of the functions (functions,), as many as these; or all."""
        values = np.asarray(coefficients, dtype=float) @ self.values
        return SolvedBlocks(
            self, tuple(self._dominated_or_all(stack, values, by[stack.functions]) for stack in self.stacks)
        )

    def _dominated_or_all(
        self, stack: Stack, values: NDArray[Any], chosen: NDArray[np.bool_]
    ) -> tuple[Floats, NDArray[Any]]:
        """Energies and vectors of the states of each block of a stack that lie in chosen functions (blocks, size), or of all."""
        from scipy.sparse import csr_array

        counts = chosen.sum(axis=1)
        few: list[tuple[Floats, NDArray[Any]]] = []
        if (counts == counts[0]).all() and is_dominated(stack.size, int(counts[0])):
            for block, functions in zip(self.block[stack.functions[:, 0]].tolist(), chosen, strict=True):
                here = self._by_block.get(block, slice(0, 0))
                places = self.rank[self.rows[here]], self.rank[self.columns[here]]
                lower = csr_array((values[here], places), shape=(stack.size, stack.size))
                states = dominated_states(lower, np.flatnonzero(functions))
                if states is None:
                    break
                few.append(states)
        if len(few) == len(chosen):
            return np.stack([energies for energies, _ in few]), np.stack([vectors for _, vectors in few])
        return eigenstates(self._dense(stack, values))

    @cached_property
    def _by_block(self) -> dict[int, slice]:
        """Where the elements of each block stand: they are sorted by block."""
        numbers, starts = np.unique(self.block[self.rows], return_index=True)
        stops = np.append(starts[1:], len(self.rows))
        return {int(n): slice(int(a), int(b)) for n, a, b in zip(numbers, starts, stops, strict=True)}

    def _dense(self, stack: Stack, values: NDArray[Any]) -> NDArray[Any]:
        """The matrices (blocks, size, size) of one stack from the values of all elements."""
        flat = np.zeros(stack.place.stop - stack.place.start, dtype=values.dtype)
        for block in self.block[stack.functions[:, 0]].tolist():
            here = self._by_block.get(block, slice(0, 0))
            flat[self._position[here] - stack.place.start] = values[here]
        return flat.reshape(-1, stack.size, stack.size)

    def energies(self, coefficients: ArrayLike) -> Floats:
        """Energies (functions,) at coefficients (terms,), without vectors; nan for blocks that are left out."""
        energies = np.full(len(self.block), np.nan)
        for stack, matrices in zip(self.stacks, self.matrices(coefficients), strict=True):
            energies[stack.functions] = eigenvalues(matrices)
        return energies

    def matrices(self, coefficients: ArrayLike) -> list[NDArray[Any]]:
        """The matrices (blocks, size, size) of each stack at coefficients (terms,), their lower triangles."""
        flat = np.zeros(self.stacks[-1].place.stop if self.stacks else 0, dtype=self.values.dtype)
        flat[self._position] = np.asarray(coefficients, dtype=float) @ self.values
        return [flat[stack.place].reshape(-1, stack.size, stack.size) for stack in self.stacks]


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
            energies[stack.functions[:, : values.shape[1]]] = values
        return energies

    def vectors(self, block: int) -> tuple[Ints, NDArray[Any]]:
        """The rows of a block's functions, and its eigenvectors in columns."""
        stack, place = self._places[block]
        return self.linear.stacks[stack].functions[place], self.states[stack][1][place]

    def slopes_of(self, elements: Elements, levels: Ints) -> Floats:
        """⟨ψ|O|ψ⟩ (levels, operators) of the levels at these rows, of Hermitian operators between the functions of these blocks."""
        linear = self.linear
        slopes = np.zeros((len(levels), len(elements.values)))
        blocks, entry_blocks = linear.block[levels], linear.block[elements.rows]
        entry_blocks = np.where(
            linear.block[elements.columns] == entry_blocks, entry_blocks, -1
        )  # blocks of H may be finer
        order = np.argsort(entry_blocks, kind="stable")
        for block in np.unique(blocks).tolist():
            chosen = np.flatnonzero(blocks == block)
            _, vectors = self.vectors(block)
            vectors = vectors[:, linear.rank[levels[chosen]]]
            first, last = np.searchsorted(entry_blocks[order], [block, block + 1])
            entries = order[first:last]
            rows, columns = linear.rank[elements.rows[entries]], linear.rank[elements.columns[entries]]
            density = vectors[rows].conj() * vectors[columns]
            slopes[chosen] = (elements.values[:, entries] @ density).real.T
        return slopes

    @cached_property
    def _places(self) -> dict[int, tuple[int, int]]:
        block = self.linear.block
        return {
            int(number): (i, place)
            for i, stack in enumerate(self.linear.stacks)
            for place, number in enumerate(block[stack.functions[:, 0]].tolist())
        }


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
    """The connected parts of elements that are written already.

    Parameters
    ----------
    names : sequence of str
        The terms.
    labels : mapping of str to (n,) array
        Quantum numbers of the functions; inside a block functions are in the order of these.
    elements : Elements
        Both triangles of Hermitian matrices.
    needed : (n,) array of bool, optional
        Blocks without a needed function are left out.

    Returns
    -------
    LinearBlocks
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
    stacks, offsets, start = [], np.zeros(int(part.max(initial=0)) + 1, dtype=np.int64), 0
    for width in np.unique(counts).tolist():
        members = np.flatnonzero(counts == width)
        stop = start + width * width * len(members)
        offsets[numbers[members]] = np.arange(start, stop, width * width)
        stacks.append(Stack(order[starts[members][:, None] + np.arange(width)], slice(start, stop)))
        start = stop
    lower = np.flatnonzero((rank[elements.rows] >= rank[elements.columns]) & present[elements.rows])
    lower = lower[np.argsort(block[elements.rows[lower]], kind="stable")]
    rows, columns, values = elements.rows[lower], elements.columns[lower], elements.values[:, lower]
    if np.iscomplexobj(values) and np.abs(values.imag).max(initial=0.0) <= ROUND_OFF * np.abs(values).max(initial=0.0):
        values = np.ascontiguousarray(values.real)
    position = offsets[block[rows]] + size[rows] * rank[rows] + rank[columns]
    return LinearBlocks(
        tuple(names), {name: np.asarray(column) for name, column in labels.items()}, rows, columns, values, block, rank,
        tuple(stacks), position,
    )  # fmt: skip
