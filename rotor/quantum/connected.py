"""Connected parts of a graph: which functions, blocks or states belong together, since elements connect them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Ints


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
