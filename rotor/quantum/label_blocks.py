"""The Wang blocks in which chosen labels lie, side by side in arrays: unit matrices, places of labels, pieces of like size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, runs_of_similar_size
from rotor.quantum.wang.basis import WangBlock, first_name, wang_blocks
from rotor.quantum.wang.unit_diagonals import unit_diagonals

_MOST_PADDED = 1 << 22  # matrix elements of blocks that are worked on together: 32 MB
_LIKE, _SMALL = 2.0, 8  # largest ratio of sizes of blocks that are worked on together, and sizes that all are
_MOST_STATES = 0.6  # of all states of a block: where labels are fewer, they alone are looked at


class Chunk(NamedTuple):
    """Blocks of like size, in order of size, side by side: unit diagonals units[d] (blocks, size, terms), and what fills their places.

    sizes (blocks,); runs: of blocks of one size the first, the one behind the last, and the size
    bands: for every d which of the elements (blocks, size) are in a block, and their places in all matrices, one behind the other
    offsets (blocks + 1,): where each matrix begins
    x: (blocks, terms of the Hamiltonian) X^p
    rows, block, slot (labels,): labels that lie in these blocks, their blocks and places among the labels of each
    states (blocks, most labels): which states they are; None where the states that have labels are most of all
    powers: (labels, terms of the Hamiltonian) X^p
    """

    units: tuple[Floats, ...]
    sizes: list[int]
    runs: tuple[tuple[int, int, int], ...]
    bands: tuple[tuple[Ints, Ints], ...]
    offsets: Ints
    x: Floats
    rows: Ints
    block: Ints
    rank: Ints
    slot: Ints
    states: Ints | None
    powers: Floats


class Occurring(NamedTuple):
    """A block in which labels lie, cut at the highest K, with the places of the labels and their ranks."""

    basis: WangBlock
    size: int
    rows: list[int]
    ranks: list[int]


def occurring_blocks(labels: Ints, representation: str, kmax: int | None) -> list[Occurring]:
    """The blocks in order of size; ValueError for a label that the cut at `kmax` leaves without a state."""
    occurring: dict[tuple[int, str], Occurring] = {}
    by_j: dict[int, dict[str, WangBlock]] = {}
    for row, (j, ka, kc) in enumerate(labels.tolist()):
        species = "eo"[ka % 2] + "eo"[kc % 2]
        if j not in by_j:
            by_j[j] = {block.species: block for block in wang_blocks(j, representation)}
        basis = by_j[j][species]
        rank = (ka - first_name(j, species)[0]) // 2
        if (j, species) not in occurring:
            occurring[j, species] = Occurring(basis, _cut(basis, kmax), [], [])
        current = occurring[j, species]
        if rank >= current.size:
            raise ValueError(f"level {j} {ka} {kc} is not among the states with K up to {kmax}; raise KNMAX")
        current.rows.append(row)
        current.ranks.append(rank)
    return sorted(occurring.values(), key=lambda block: block.size)


def _cut(basis: WangBlock, kmax: int | None) -> int:
    return basis.size if kmax is None else min(basis.size, max(0, (kmax - basis.first_k) // 2 + 1))


def chunks_of(blocks: Sequence[Occurring], units: Sequence[tuple[int, int]], powers: Sequence[int]) -> list[Chunk]:
    """Blocks in order of size, cut into pieces of bounded memory and of sizes within a factor of two."""
    sizes = [block.size for block in blocks]
    return [_chunk(blocks[run], units, powers) for run in runs_of_similar_size(sizes, _LIKE, _SMALL, _MOST_PADDED)]


def _chunk(blocks: Sequence[Occurring], units: Sequence[tuple[int, int]], powers: Sequence[int]) -> Chunk:
    diagonals = unit_diagonals(
        [occurring.basis for occurring in blocks], [occurring.size for occurring in blocks], units
    )
    sizes, size = np.array([occurring.size for occurring in blocks]), blocks[-1].size
    block = np.array([b for b, occurring in enumerate(blocks) for _ in occurring.rows])
    x = np.stack(
        [np.array([occurring.basis.j * (occurring.basis.j + 1.0) for occurring in blocks]) ** p for p in powers], axis=1
    )
    states = np.zeros((len(blocks), max(len(occurring.rows) for occurring in blocks)), dtype=np.int64)
    for b, occurring in enumerate(blocks):
        states[b, : len(occurring.rows)] = occurring.ranks
    bounds = [0, *(1 + np.flatnonzero(np.diff(sizes))).tolist(), len(blocks)]
    offsets = np.cumsum([0, *(sizes**2).tolist()])
    return Chunk(
        units=diagonals,
        sizes=sizes.tolist(),
        runs=tuple((first, stop, int(sizes[first])) for first, stop in pairwise(bounds)),
        bands=tuple(_places_of_band(d, sizes, offsets) for d in range(min(len(diagonals), size))),
        offsets=offsets,
        x=x,
        rows=np.array([row for occurring in blocks for row in occurring.rows]),
        block=block,
        rank=np.array([rank for occurring in blocks for rank in occurring.ranks]),
        slot=np.array([slot for occurring in blocks for slot in range(len(occurring.rows))]),
        states=states if states.shape[1] < _MOST_STATES * size else None,
        powers=x[block],
    )


def _places_of_band(d: int, sizes: Ints, offsets: Ints) -> tuple[Ints, Ints]:
    """Which elements (blocks, size) of diagonal d are in a block, and their places in the lower triangles of all matrices."""
    index, size = np.arange(sizes[-1]), int(sizes[-1])
    block, place = np.nonzero(index + d < sizes[:, None])
    return block * size + place, offsets[block] + (place + d) * sizes[block] + place
