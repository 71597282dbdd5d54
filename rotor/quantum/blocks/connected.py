"""The linear block Hamiltonian H_b(c) = Σ_i c_i O_i,b over labelled functions.

Elements of every term are made once, from an operator algebra (`operators`) or by a writer of elements. Blocks are the connected parts of
what the terms connect, so that symmetries need not be named; each is a `linear_stacks.LinearBlock` over the functions at some rows. At any
values c the blocks are summed and solved; a fit is the same blocks at other values, a field strength is one of the c, and

    ∂E/∂c_i = ⟨ψ|O_i|ψ⟩

is one contraction with the eigenvectors. Eigenvectors keep their meaning without a phase convention: nothing here depends on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Ints
from rotor.quantum.basis.labelled import ROUND_OFF, Basis, Elements
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.operators.algebra import Operator


def part_numbers(count: int, rows: ArrayLike, columns: ArrayLike) -> Ints:
    """The number of the connected part of each of so many functions, which elements at (rows, columns) connect.

    Parts are numbered by their lowest members.

    >>> part_numbers(4, [0, 3], [2, 3]).tolist()
    [0, 1, 0, 2]
    """
    first, second = np.asarray(rows, dtype=np.int64), np.asarray(columns, dtype=np.int64)
    lower = np.arange(count)  # of each function another one of its part that is not above it, in the end the lowest
    while len(first):
        lower[np.maximum(first, second)] = np.minimum(first, second)
        while not np.array_equal(lower, below := lower[lower]):
            lower = below
        first, second = lower[first], lower[second]
        apart = first != second
        first, second = first[apart], second[apart]
    return np.asarray(np.unique(lower, return_inverse=True)[1])


def connected_parts(count: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """The connected parts of the nodes 0 to `count` - 1, by their lowest members, each in rising order."""
    parts: dict[int, list[int]] = {}
    for node, part in enumerate(part_numbers(count, *_columns(edges, 2)).tolist()):
        parts.setdefault(part, []).append(node)
    return list(parts.values())


def coloured_components(count: int, edges: Iterable[tuple[int, int, int]]) -> list[tuple[list[int], list[int], bool]]:
    """Connected parts of the nodes 0 to `count` - 1, a colour 0 or 1 of each node, and whether all edges agree with the colours.

    An edge (a, b, 1) asks for different colours, (a, b, 0) for the same one. Each node stands twice in a graph, once for either colour.

    >>> coloured_components(3, [(0, 1, 1)])
    [([0, 1], [0, 1], True), ([2], [0], True)]
    """
    first, second, odd = _columns(edges, 3)
    rows, columns = np.append(first, first + count), np.append(second + count * odd, second + count * (1 - odd))
    part = part_numbers(2 * count, rows, columns)
    out = []
    for members in connected_parts(count, zip(first.tolist(), second.tolist(), strict=True)):
        colours = (part[members] != part[members[0]]).astype(int).tolist()
        out.append((members, colours, bool(part[members[0]] != part[members[0] + count])))
    return out


def _columns(edges: Iterable[Sequence[int]], width: int) -> Ints:
    """Edges as columns of numbers (width, edges)."""
    return np.array([*edges], dtype=np.int64).reshape(-1, width).T


FunctionBlocks = list[tuple[Ints, LinearBlock]]  # the rows of the functions of each block, in order, and its elements


class Entries(NamedTuple):
    """Elements of operators between two blocks: row and column in each block, and values (operators, entries)."""

    rows: Ints
    columns: Ints
    values: NDArray[Any]


ByBlocks = dict[tuple[int, int], Entries]  # elements by the numbers of two blocks


def elements_by_blocks(elements: Elements, members: Sequence[Ints]) -> ByBlocks:
    """Elements of operators between the functions of blocks with these members, by the numbers of the blocks of rows and columns."""
    block, rank = _places(elements.count, members)
    here = np.flatnonzero((block[elements.rows] >= 0) & (block[elements.columns] >= 0))
    up, low = block[elements.rows[here]], block[elements.columns[here]]
    pair = up * len(members) + low
    order = np.argsort(pair, kind="stable")
    bounds = [*np.flatnonzero(np.diff(pair[order], prepend=-1)).tolist(), len(order)]
    entries = {}
    for start, stop in pairwise(bounds):
        chosen = here[order[start:stop]]
        rows, columns = rank[elements.rows[chosen]], rank[elements.columns[chosen]]
        entries[int(up[order[start]]), int(low[order[start]])] = Entries(rows, columns, elements.values[:, chosen])
    return entries


def _places(count: int, members: Sequence[Ints]) -> tuple[Ints, Ints]:
    """The block of each of so many functions and its place in the block, -1 for those of no block."""
    block, rank = np.full((2, count), -1)
    for number, rows in enumerate(members):
        block[rows], rank[rows] = number, np.arange(len(rows))
    return block, rank


def linear_blocks(functions: Basis, terms: Mapping[str, Operator]) -> FunctionBlocks:
    """H_b(c) = Σ_i c_i O_i,b of named operators over a basis: the rows of the functions of each block, and the block.

    >>> from rotor.quantum.basis.labelled import rotation_labels
    >>> from rotor.quantum.operators.rotation import j_x, j_y, j_z
    >>> top = linear_blocks(Basis(rotation_labels(1)), {"A": j_z(2), "B": j_x() @ j_x(), "C": j_y() @ j_y()})
    >>> [block.energies(np.array([10.0, 6.0, 4.0])).round(9).tolist() for _, block in top]
    [[0.0], [14.0, 16.0], [10.0]]
    """
    return connected_blocks(functions.labels, functions.elements(list(terms.values())))


def connected_blocks(
    labels: Mapping[str, Ints], elements: Elements, needed: NDArray[np.bool_] | None = None
) -> FunctionBlocks:
    """The connected parts of elements of terms, both triangles of Hermitian matrices, that have a `needed` function.

    Inside a block functions are in the order of their labels.
    """
    part = part_numbers(elements.count, elements.rows, elements.columns)
    order = np.arange(elements.count) if needed is None else np.flatnonzero(np.isin(part, part[needed]))
    keys = [part, *labels.values()]
    order = order[np.lexsort([key[order] for key in keys[::-1]])]
    members = np.split(order, 1 + np.flatnonzero(np.diff(part[order])))
    block, rank = _places(elements.count, members)
    lower = np.flatnonzero((rank[elements.rows] >= rank[elements.columns]) & (block[elements.rows] >= 0))
    lower = lower[np.argsort(block[elements.rows[lower]], kind="stable")]
    bounds = np.searchsorted(block[elements.rows[lower]], np.arange(len(members) + 1)).tolist()
    rows, columns, values = rank[elements.rows[lower]], rank[elements.columns[lower]], elements.values[:, lower]
    if np.iscomplexobj(values) and np.abs(values.imag).max(initial=0.0) <= ROUND_OFF * np.abs(values).max(initial=0.0):
        values = np.ascontiguousarray(values.real)
    factors, terms, unit = values.T, np.arange(len(values)), np.eye(len(values))
    return [
        (m, LinearBlock(len(m), rows[first:stop], columns[first:stop], factors[first:stop], unit, terms))
        for m, (first, stop) in zip(members, pairwise(bounds), strict=True)
    ]
