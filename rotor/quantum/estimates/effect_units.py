"""Linear blocks of labelled levels, with or without spins and several states.

The levels are solved once. Blocks that contain a label are then expanded over basis functions as linear combinations of their parameters
(`linear_stacks`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.basis.state_elements import linear_blocks_of, vertices_of
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.labels.tracking import (
    AssignedLevels,
    Follows,
    NamedBlock,
    NamedFunctions,
    Naming,
    TrackedLevels,
    by_overlaps,
    tracked_blocks,
)
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinFunctions
from rotor.quantum.spins.levels import levels_of_f, unmixed_levels
from rotor.quantum.spins.linear_blocks import linear_blocks_of_spins
from rotor.quantum.spins.parts import assigned, functions_by_sub_block, labels_by_shares, names_of_parts, turned
from rotor.quantum.spins.scheme import scheme_of

if TYPE_CHECKING:
    from rotor.tops.top import Top


Functions = Callable[[SolvedBlock], tuple[Floats, Ints]]
SpinNaming = Callable[[SolvedBlock, str], NamedFunctions]
"""How the states of a block with spins are labelled, from the block and the representation, over its functions as rows of vectors."""


def unit_levels(
    top: Top,
    levels: Levels,
    rows: Ints,
    names: Sequence[str],
    values_mhz: Floats,
    functions: Functions | None = None,
    naming: Naming | None = None,
    spin_naming: SpinNaming | None = None,
) -> TrackedLevels:
    """The blocks of labelled levels as functions of the parameters.

    rows: of the levels, in the order in which `TrackedLevels.levels` returns them; the levels have vectors, at `values_mhz` of `names`.
    functions: for blocks of several states that are labelled by other than basis functions, returns these functions (n, n) in rows over the
    basis, and their labels v, Ka, Kc and, with spins, the doubled pattern (n, 3 + pattern). naming: how states of blocks without spins are
    labelled, by default by overlaps. With either, levels without spins have these labels. spin_naming: how states of blocks with spins are
    labelled, by default by Wang blocks and patterns; rows are those of states in solved blocks. ValueError for levels without blocks.
    """
    if not levels.blocks:
        raise ValueError("levels of a closed form have no blocks; solve them in blocks")
    block_of_row = levels.block_numbers(rows)
    numbers = distinct(block_of_row).tolist()
    blocks = [levels.blocks[number] for number in numbers]
    units = list(_named_blocks(top, levels, names, blocks, functions, naming, spin_naming))
    inside = [np.flatnonzero(block_of_row == number) for number in numbers]

    quanta = np.stack([levels.quantum("v"), levels.quantum("ka"), levels.quantum("kc")], axis=1)

    def find(place: int, names: Ints) -> tuple[Ints, Ints]:
        """Rows of the labels in a block, and their names."""
        block, rows_of_block = blocks[place], inside[place]
        states = rows[rows_of_block] - block.start
        if spin_naming:
            return rows_of_block, names[states]
        if functions and block.spins:
            return rows_of_block, _names_by(block, *functions(block))[states]
        if functions or naming:
            return rows_of_block, quanta[rows[rows_of_block]]
        return rows_of_block, (_ranks(len(block.energies_mhz)) if block.labels is None else block.labels)[states]

    return tracked_blocks(names, units, len(rows), find, values_mhz)


def _ranks(count: int) -> Ints:
    """The names (n, 1) of states that are labelled by their order in energy."""
    return np.arange(count)[:, None]


def _names_by(block: SolvedBlock, functions: Floats, names: Ints) -> Ints:
    """Labels of the states of a block from their overlaps with functions over the basis."""
    parts = block.spins.parts
    over_basis = turned(parts, block.vectors, {part.number: part.rotor.vectors for part in parts})
    return np.asarray(names[assigned((functions @ over_basis) ** 2, np.ones(len(names), dtype=np.int64))])


def _named_blocks(
    top: Top,
    levels: Levels,
    names: Sequence[str],
    blocks: Sequence[SolvedBlock],
    functions: Functions | None,
    naming: Naming | None,
    spin_naming: SpinNaming | None,
) -> Iterator[NamedBlock]:
    """The linear block of each solved block with the rule that labels its states."""
    if blocks[0].spins:
        linear_blocks = linear_blocks_of_spins(top, levels.effects, names, blocks)
    else:
        linear_blocks = linear_blocks_of(top, levels, names, blocks)
    representation = str(levels.representation)
    for linear, block in zip(linear_blocks, blocks, strict=True):
        if functions:
            yield _turned(linear, *functions(block))
        elif block.spins:
            yield linear, (spin_naming(block, representation) if spin_naming else _names_with_spins(block.spins))
        elif naming:
            yield linear, naming(vertices_of(block), representation)
        elif block.alone:
            yield (
                linear,
                NamedFunctions(
                    np.zeros(linear.size, dtype=np.int64), lambda _, energies, __: _ranks(len(energies)), Follows.MOSTLY
                ),
            )
        else:
            yield linear, by_overlaps(vertices_of(block), representation)


def _turned(block: LinearBlock, functions: Floats, names: Ints) -> NamedBlock:
    """The block over other functions, one for each state; sub-blocks have one v, parity of Ka and pattern."""

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return np.asarray(names[assigned(vectors**2, np.ones(len(names), dtype=np.int64))])

    members = np.column_stack([names[:, 0], names[:, 1] % 2, names[:, 3:]])
    sub_blocks = np.unique(members, axis=0, return_inverse=True)[1].reshape(-1)
    return block.turned(functions), NamedFunctions(sub_blocks, namer, Follows.MOSTLY)


def _names_with_spins(block: SpinFunctions) -> NamedFunctions:
    """Labels by Wang blocks and patterns, or by the functions that exchange allows."""
    if block.allowed:
        names, sizes, order = block.allowed.names, block.allowed.sizes, np.arange(len(block.allowed.names))
    else:
        names, sizes, _ = names_of_parts(block.columns.only(block.number), block.patterns)
        order = functions_by_sub_block(block.parts)

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return np.asarray(labels_by_shares(names[None], sizes[None], vectors[None, order])[0][0])

    sub_blocks = np.empty(len(order), dtype=np.int64)
    sub_blocks[order] = np.repeat(np.arange(len(sizes)), sizes)
    return NamedFunctions(sub_blocks, namer, Follows.MOSTLY)


_MOST_ELEMENTS = 1e7  # most elements of vectors of the F that are solved together
_LARGE = 400  # blocks of an F with fewer functions are solved whole, which is then faster


def assigned_with_spins(
    top: Top,
    effects: tuple[QuantumEffect, ...],
    names: Sequence[str],
    values_mhz: Floats,
    twice_f: Ints,
    rows_of: Callable[[Levels, Ints], Ints],
    functions: Callable[[Levels], Functions] | None = None,
    naming: SpinNaming | None = None,
) -> list[AssignedLevels]:
    """Blocks of labels with spins as functions of the parameters; labels without a level are missing.

    values_mhz: at which levels are labelled, in the order of `names`. twice_f: doubled F of each label, 0 or more. rows_of: takes levels
    and places of labels, and returns the row of each label, -1 if it has none. functions: functions other than basis functions that label
    the levels, see `unit_levels`. naming: how the states of solved blocks are labelled; `rows_of` takes levels with these labels.
    """
    scheme, all_f, columns = scheme_of(top, effects), distinct(twice_f), np.arange(len(names))
    size = (1 + sum(len(effect.states(top)) for effect in effects)) * int(np.prod([two + 1 for two in scheme.twice]))
    # functions of three equivalent nuclei are not products
    products = scheme.equivalent < 3 and functions is None and naming is None
    if products and size * int(all_f.max() + 1) > _LARGE:
        from rotor.quantum.estimates.contracted import contracted_levels

        levels = unmixed_levels(top, effects, all_f.tolist())
        rows = rows_of(levels, np.arange(len(twice_f)))
        here = np.flatnonzero(rows >= 0)
        if not len(here):
            return []
        contracted = contracted_levels(top, effects, levels, rows[here], names, values_mhz, _LARGE)
        if contracted is not None:
            return [AssignedLevels(here, columns, contracted)]
    out = list[AssignedLevels]()
    for chunk in np.split(all_f, np.flatnonzero(np.diff(np.cumsum((size * (all_f + 1.0)) ** 2) // _MOST_ELEMENTS)) + 1):
        places, angular = np.flatnonzero(np.isin(twice_f, chunk)), chunk.tolist()
        levels = unmixed_levels(top, effects, angular) if products else levels_of_f(top, effects, angular)
        rows = rows_of(levels, places)
        has_level = rows >= 0
        if has_level.any():
            namer = functions(levels) if functions else None
            blocks = unit_levels(top, levels, rows[has_level], names, values_mhz, namer, spin_naming=naming)
            out.append(AssignedLevels(places[has_level], columns, blocks))
    return out
