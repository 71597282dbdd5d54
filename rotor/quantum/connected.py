"""Connected parts of a graph: which functions, blocks or states belong together, since elements connect them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rotor.arrays import Ints


def coloured_components(
    nodes: Sequence[int], edges: Iterable[tuple[int, int, int]]
) -> list[tuple[list[int], list[int], bool]]:
    """Connected components of a graph with a colour 0 or 1 for each node, and whether all edges agree with the colours.

    An edge (a, b, 1) asks for different colours, (a, b, 0) for the same one.

    >>> coloured_components([0, 1, 2], [(0, 1, 1)])
    [([0, 1], [0, 1], True), ([2], [0], True)]
    """
    beside: dict[int, list[tuple[int, int]]] = {node: [] for node in nodes}
    for a, b, odd in edges:
        beside[a].append((b, odd))
        beside[b].append((a, odd))
    colour: dict[int, int] = {}
    out = []
    for start in nodes:
        if start in colour:
            continue
        colour[start], component, agree = 0, [start], True
        for node in component:  # grows while it is walked
            for other, odd in beside[node]:
                if other not in colour:
                    colour[other] = (colour[node] + odd) % 2
                    component.append(other)
                agree = agree and colour[other] == (colour[node] + odd) % 2
        members = sorted(component)
        out.append((members, [colour[node] for node in members], agree))
    return out


def connected_parts(count: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """The connected parts of the nodes 0 to `count` - 1, by their lowest members, each in rising order."""
    return [part for part, _, _ in coloured_components(range(count), ((a, b, 0) for a, b in edges))]


def part_numbers(count: int, rows: Ints, columns: Ints) -> Ints:
    """The number of the connected part of each of so many functions, which elements at (rows, columns) connect: for many elements.

    >>> part_numbers(4, np.array([0, 3]), np.array([2, 3])).tolist()
    [0, 1, 0, 2]
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
