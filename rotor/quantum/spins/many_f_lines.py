"""Elements of molecule-fixed tensors between the levels of many F at once (see `many_f`); `lines` computes them pair by pair."""

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

_ELEMENT, _PRODUCT = 1.5e-4, 2e-6  # time of an element, and of one step of its products, relative to that of a call


class Rows(NamedTuple):
    """Amplitudes (F, n_up, n_low) between blocks of rising F, and rows (F, states) of their levels.

    Rows beyond a block are `len(levels)`, which is no level. alike: whether each block is taken with itself.
    """

    up: Indices
    low: Indices
    amplitudes: Floats
    alike: bool


class States(NamedTuple):
    """Blocks of a group, side by side.

    places: index by doubled F. vectors: (F, columns, rotational states, states). rows: of the levels, (F, states). sizes: number of states
    of each block. heights: number of rotational states of each block.
    """

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
    """Real reduced elements between all blocks, (F, n_up, n_low) at a time, each pair of blocks once; `levels` is the row of padding.

    Amplitudes are zero beyond a block. Their array may be changed; the next step overwrites it.
    """
    shared, rank = blocks[0].shared, rank_of(tensors)
    frame: Frame = shared.cache["frame"]
    tables = tables_of(tensors_of_stacks(shared.stacks, tensors), frame)
    groups = [states_of_group(group, members, levels) for group, members in groups_of_blocks(blocks)]
    space = Workspace()
    for step in range(0, 2 * rank + 1, 2):
        coefficients = tensors_by_f(shared.scheme, rank, step, frame.twice_f[0], frame.twice_f[-1])
        for place, low in enumerate(groups):
            for up in groups[place:] if step == 0 else groups:
                yield from _between(up, low, step, rank, tables, coefficients, frame, space)


def groups_of_blocks(blocks: Sequence[SpinBlock]) -> list[tuple[Group, list[SpinBlock]]]:
    """The groups in which blocks were solved, each with its blocks by rising F."""
    members: dict[int, tuple[Group, list[SpinBlock]]] = {}
    for block in blocks:
        assert block.group is not None
        members.setdefault(id(block.group), (block.group, []))[1].append(block)
    return [(group, sorted(group_blocks, key=lambda block: block.twice_f)) for group, group_blocks in members.values()]


def states_of_group(group: Group, blocks: Sequence[SpinBlock], levels: int) -> States:
    """Blocks of a group by rising F, side by side; levels: the row of padding."""
    sizes = [len(block.energies_mhz) for block in blocks]
    vectors = np.zeros((len(blocks), group.columns * group.states, max(sizes)))
    starts, counts = np.array([block.start for block in blocks], dtype=np.int32), np.array(sizes)
    state_numbers = np.arange(max(sizes), dtype=np.int32)
    rows = np.where(state_numbers < counts[:, None], starts[:, None] + state_numbers, np.int32(levels))
    for place, (block, size) in enumerate(zip(blocks, sizes, strict=True)):
        functions = group.functions[group.places[block.twice_f]]
        vectors[place, functions, :size] = block.vectors
    heights = [group.heights[group.places[block.twice_f]] for block in blocks]
    by_column = vectors.reshape(len(blocks), group.columns, group.states, -1)
    return States(group, {block.twice_f: place for place, block in enumerate(blocks)}, by_column, rows, sizes, heights)


def _between(
    up: States, low: States, step: int, rank: int, tables: Tables, coefficients: Floats, frame: Frame, space: Workspace
) -> Iterator[Rows]:
    """Elements between two groups with doubled F' = F + step."""
    twice_f = [f for f in low.places if f + step in up.places and 2 * f + step >= 2 * rank]
    if not twice_f or not are_connected((up.group, low.group), step, tables):
        return
    whole = between(up.group, low.group, twice_f, step, tables, coefficients, frame, space)
    lefts, rights = [up.places[f + step] for f in twice_f], [low.places[f] for f in twice_f]
    for run in _runs_of_similar_size([low.sizes[place] for place in rights]):
        left, right = _places(lefts[run]), _places(rights[run])
        height, width = (
            max(up.heights[place] for place in lefts[run]),
            max(low.heights[place] for place in rights[run]),
        )
        ups, lows = max(up.sizes[place] for place in lefts[run]), max(low.sizes[place] for place in rights[run])
        elements = functions_of(whole[run, :, :height, :, :width])
        bra = up.vectors[left, :, :height, :ups].reshape(len(elements), -1, ups)
        ket = low.vectors[right, :, :width, :lows].reshape(len(elements), -1, lows)
        moved = np.matmul(elements, ket, out=space.array("moved", len(elements), bra.shape[1], lows))
        amplitudes = np.matmul(bra.transpose(0, 2, 1), moved, out=space.array("found", len(elements), ups, lows))
        yield Rows(up.rows[left, :ups], low.rows[right, :lows], amplitudes, up is low and not step)


def _places(places: list[int]) -> slice | list[int]:
    """The places as a slice if they are consecutive."""
    return slice(places[0], places[-1] + 1) if places[-1] - places[0] + 1 == len(places) else places


def _runs_of_similar_size(sizes: Sequence[int]) -> Iterator[slice]:
    """Runs of blocks of rising size for one call each: a run ends where its padding would cost more than another call."""
    first, cost_of_run = 0, 0.0
    for last, size in enumerate(sizes):
        cost = size**2 * (_ELEMENT + size * _PRODUCT)
        if (last - first) * cost - cost_of_run > 1.0:
            yield slice(first, last)
            first, cost_of_run = last, 0.0
        cost_of_run += cost
    yield slice(first, len(sizes))
