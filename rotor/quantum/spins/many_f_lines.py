"""Elements of molecule-fixed tensors between the levels of many F at once, see `many_f`; pair by pair the same is `lines`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Indices, Workspace
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.contraction import tensors_of_stacks
from rotor.quantum.spins.many_f import Frame, Group, Tables, are_connected, between, functions_of, tables_of
from rotor.quantum.spins.pattern_tables import tensors_by_f
from rotor.quantum.spins.stack_elements import MOST_RANK
from rotor.quantum.tensors import Tensors, rank_of

_ELEMENT, _PRODUCT = 1.5e-4, 2e-6  # what an element costs, and one step of its products, over what a call costs


class Rows(NamedTuple):
    """Blocks of rising F: (F, states) rows of levels, those beyond a block counted from `len(levels)`, which is no level."""

    up: Indices
    low: Indices
    amplitudes: Floats
    alike: bool


class States(NamedTuple):
    """The blocks of a group that are there: places of the doubled F, eigenvectors (F, columns, states of the rotation, states), rows of
    levels (F, states), how many states each has, and how many of the rotation."""

    group: Group
    places: dict[int, int]
    vectors: Floats
    rows: Indices
    sizes: list[int]
    heights: list[int]


def can_be_stacked(blocks: Sequence[object], tensors: Tensors) -> bool:
    """Whether all blocks are spin blocks that were solved in groups."""
    if rank_of(tensors) > MOST_RANK or not blocks:
        return False
    return all(isinstance(block, SpinBlock) and block.group is not None for block in blocks)


def amplitudes_of_groups(blocks: Sequence[SpinBlock], tensors: Tensors, levels: int) -> Iterator[Rows]:
    """Real reduced elements between all blocks, (F, n_up, n_low) a time, each pair of blocks once.

    Parameters
    ----------
    blocks : sequence of SpinBlock
        Solved in groups.
    tensors : mapping of (int, int) to BodyTensor
        By pairs of states, all of one rank.
    levels : int
        How many levels there are: the row of what is beyond a block.

    Yields
    ------
    Rows
        Rows of levels and amplitudes, zero beyond a block; alike: whether every block is taken with itself. The amplitudes may
        be changed, and stand until the next ones.
    """
    shared, rank = blocks[0].shared, rank_of(tensors)
    frame: Frame = shared.cache["frame"]
    tables = tables_of(tensors_of_stacks(shared.stacks, tensors), frame)
    every = [states_of_group(group, own, levels) for group, own in groups_of_blocks(blocks)]
    space = Workspace()
    for step in range(0, 2 * rank + 1, 2):
        coefficients = tensors_by_f(shared.scheme, rank, step, frame.twice_f[0], frame.twice_f[-1])
        for place, low in enumerate(every):
            for up in every[place:] if step == 0 else every:
                yield from _between(up, low, step, rank, tables, coefficients, frame, space)


def groups_of_blocks(blocks: Sequence[SpinBlock]) -> list[tuple[Group, list[SpinBlock]]]:
    """The groups in which blocks were solved, F rising."""
    found: dict[int, tuple[Group, list[SpinBlock]]] = {}
    for block in blocks:
        assert block.group is not None
        found.setdefault(id(block.group), (block.group, []))[1].append(block)
    return [(group, sorted(own, key=lambda block: block.twice_f)) for group, own in found.values()]


def states_of_group(group: Group, blocks: Sequence[SpinBlock], levels: int) -> States:
    """Blocks of a group, F rising, side by side; levels: the row of what is beyond a block."""
    sizes = [len(block.energies_mhz) for block in blocks]
    vectors = np.zeros((len(blocks), group.columns * group.states, max(sizes)))
    starts, counts = np.array([block.start for block in blocks], dtype=np.int32), np.array(sizes)
    every = np.arange(max(sizes), dtype=np.int32)
    rows = np.where(every < counts[:, None], starts[:, None] + every, np.int32(levels))
    for place, (block, size) in enumerate(zip(blocks, sizes, strict=True)):
        functions = group.functions[group.places[block.twice_f]]
        vectors[place, functions, :size] = block.vectors
    heights = [group.heights[group.places[block.twice_f]] for block in blocks]
    of_columns = vectors.reshape(len(blocks), group.columns, group.states, -1)
    return States(group, {block.twice_f: place for place, block in enumerate(blocks)}, of_columns, rows, sizes, heights)


def _between(
    up: States, low: States, step: int, rank: int, tables: Tables, coefficients: Floats, frame: Frame, space: Workspace
) -> Iterator[Rows]:
    """Between two groups, F' = F + step, doubled."""
    twice_f = [f for f in low.places if f + step in up.places and 2 * f + step >= 2 * rank]
    if not twice_f or not are_connected((up.group, low.group), step, tables):
        return
    whole = between(up.group, low.group, twice_f, step, tables, coefficients, frame, space)
    lefts, rights = [up.places[f + step] for f in twice_f], [low.places[f] for f in twice_f]
    for some in _of_like_size([low.sizes[place] for place in rights]):
        left, right = _places(lefts[some]), _places(rights[some])
        height, width = (
            max(up.heights[place] for place in lefts[some]),
            max(low.heights[place] for place in rights[some]),
        )
        ups, lows = max(up.sizes[place] for place in lefts[some]), max(low.sizes[place] for place in rights[some])
        elements = functions_of(whole[some, :, :height, :, :width])
        bra = up.vectors[left, :, :height, :ups].reshape(len(elements), -1, ups)
        ket = low.vectors[right, :, :width, :lows].reshape(len(elements), -1, lows)
        moved = np.matmul(elements, ket, out=space.array("moved", len(elements), bra.shape[1], lows))
        found = np.matmul(bra.transpose(0, 2, 1), moved, out=space.array("found", len(elements), ups, lows))
        yield Rows(up.rows[left, :ups], low.rows[right, :lows], found, up is low and not step)


def _places(places: list[int]) -> slice | list[int]:
    """A slice where the places follow each other."""
    return slice(places[0], places[-1] + 1) if places[-1] - places[0] + 1 == len(places) else places


def _of_like_size(sizes: Sequence[int]) -> Iterator[slice]:
    """Runs of blocks of rising size whose products are taken in one call, as long as its zeros cost less than another call."""
    first, own = 0, 0.0
    for last, size in enumerate(sizes):
        cost = size**2 * (_ELEMENT + size * _PRODUCT)
        if (last - first) * cost - own > 1.0:
            yield slice(first, last)
            first, own = last, 0.0
        own += cost
    yield slice(first, len(sizes))
