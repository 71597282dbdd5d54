"""Spaces in a field along z: linear blocks of one M, with a term for each component of a tensor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.quantum.basis.phases import with_real_phases
from rotor.quantum.blocks import LinearBlocks, blocks_of_elements
from rotor.quantum.contraction import NEGLIGIBLE, Space, flat_elements
from rotor.quantum.wigner import three_j


def in_field(space: Space, twice_m: int, components: Mapping[str, str]) -> LinearBlocks:
    """A space in static fields along z: linear blocks of one M, a field strength being a coefficient.

    Parameters
    ----------
    space : Space
        Solved without fields.
    twice_m : int
        Twice the projection M.
    components : mapping of str to str
        Name of each term, and the tensor whose component along the field it is.

    Returns
    -------
    LinearBlocks
        Of the terms "energy" and `components`; H = energy + Σ field · T_0, signs as the tensors have them.
    """
    start, count = space.starts(), len(space)
    projects = np.repeat([s.twice_j >= abs(twice_m) for s in space.sectors], np.diff(start))
    diagonal = np.arange(count)
    pieces: list[tuple[Ints, Ints, int, NDArray[Any]]] = [
        (diagonal, diagonal, 0, np.concatenate([sector.energies for sector in space.sectors]))
    ]
    for number, name in enumerate(components.values(), 1):
        tensor = space.tensors[name]
        pairs = [pair for pair in tensor.blocks if min(space.sectors[p].twice_j for p in pair) >= abs(twice_m)]
        if not pairs:
            continue
        up, low = (np.array([space.sectors[pair[side]].twice_j for pair in pairs]) for side in (0, 1))
        m = twice_m / 2
        factors = np.where((up - twice_m) // 2 % 2, -1.0, 1.0) * three_j(up / 2, tensor.rank, low / 2, -m, 0, m)
        for (a, b), factor in zip(pairs, factors.tolist(), strict=True):
            matrix = factor * tensor.blocks[a, b]
            r, c = np.nonzero(np.abs(matrix) > NEGLIGIBLE * np.abs(tensor.blocks[a, b]).max(initial=0.0))
            pieces.append((start[a] + r, start[b] + c, number, matrix[r, c]))
    elements = with_real_phases(flat_elements(count, 1 + len(components), pieces)).elements
    return blocks_of_elements(["energy", *components], space.labels(), elements, projects)
