"""Levels whose Wang blocks are connected: several states, and operators outside orthorhombic symmetry.

Of each J the Wang blocks of all states are the vertices of a graph, whose edges are the operators that connect two of them;
every connected part is one matrix, real in functions with the factors of `j_operators.phase`, and is solved whole. A
level is named after the function of one state and one Wang block, solved by itself, that it overlaps with; names are given one to
one, so that the sum of all these overlaps is largest.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.one_to_one import one_to_one
from rotor.quantum.wang.basis import Part, WangBlock, names_of

NOTHING = 1e-13  # of an operator's largest element: what is smaller between two blocks is round-off of zero


def parts_of(members: Sequence[tuple[int, WangBlock]]) -> tuple[Part, ...]:
    starts = accumulate((basis.size for _, basis in members), initial=0)
    return tuple(Part(v, basis, start) for (v, basis), start in zip(members, starts, strict=False))


def names_of_states(
    parts: tuple[Part, ...], matrix: Floats, vectors: Floats, representation: str
) -> tuple[Ints, Floats]:
    """v, Ka, Kc (n, 3) of the states of a coupled block, and their squared overlaps (n,) with the functions that name them.

    A function is a state of one part, solved by itself; names are given one to one so that the sum of the overlaps is largest.
    """
    functions = [np.linalg.eigh(matrix[part.place, part.place]).eigenvectors.T @ vectors[part.place] for part in parts]
    overlaps = np.concatenate(functions) ** 2
    of_state = one_to_one(overlaps) if len(parts) > 1 else np.arange(vectors.shape[1])
    return names_of_functions(parts, representation)[of_state], overlaps[of_state, np.arange(vectors.shape[1])]


def names_of_functions(parts: tuple[Part, ...], representation: str) -> Ints:
    """v, Ka, Kc (n, 3) of the states of the parts, each solved by itself, one part behind the other."""
    names = np.empty((parts[-1].place.stop, 3), dtype=np.int64)
    for part in parts:
        names[part.place, 0] = part.v
        names[part.place, 1], names[part.place, 2] = names_of(part.basis, representation)
    return names
