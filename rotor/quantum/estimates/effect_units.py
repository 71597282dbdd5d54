"""The unit matrices of an effect's parameters over the blocks in which labelled levels lie, with spins and states or without.

The levels are solved once as the core solves them; the blocks that have a label are then made anew over the functions of the
basis, linear in their parameters (`linear_stacks`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats, Ints, distinct
from rotor.quantum.basis.state_elements import linear_blocks_of, vertices_of
from rotor.quantum.coupled import CoupledBlock
from rotor.quantum.label_tracking import (
    Follows,
    LabelledBlocks,
    NamedBlock,
    NamedFunctions,
    Namer,
    Naming,
    tracked_blocks,
)
from rotor.quantum.labelled_states import by_overlaps
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.linear_stacks import LinearBlock
from rotor.quantum.spins.blocks import SpinBlock
from rotor.quantum.spins.linear_blocks import linear_blocks_of_spins
from rotor.quantum.spins.parts import SpinPart, assigned, labels_by_shares, labels_of, names_of_parts
from rotor.quantum.spins.three_spins import Allowed

if TYPE_CHECKING:
    from rotor.tops.top import Top

Functions = Callable[[CoupledBlock | SpinBlock], tuple[Floats, Ints]]


def unit_levels(
    top: Top,
    levels: Levels,
    rows: Ints,
    names: Sequence[str],
    values_mhz: Floats,
    functions: Functions | None = None,
    naming: Naming | None = None,
) -> LabelledBlocks:
    """The blocks in which the rows of levels lie, for other values of the parameters.

    Parameters
    ----------
    top : Top
    levels : Levels
        Solved with vectors, at values near those of the parameters.
    rows : (n,) array
        Rows of levels, in the order in which `LabelledBlocks.levels` gives them.
    names : sequence of str
        Parameters of the effects of the levels, in the order of the values.
    values_mhz : (parameters,) array
        At which the levels were solved.
    functions : callable, optional
        Of blocks of several states: the functions (n, n) in rows by which the states are called, over those of the basis, and their
        names v, Ka, Kc and with spins the doubled pattern (n, 3 + pattern), where these are not the functions of the basis; levels
        without spins have these names.
    naming : callable, optional
        Of blocks without spins: how the states get their names, which the levels have; by overlaps where it is None.

    Returns
    -------
    LabelledBlocks

    Raises
    ------
    ValueError
        For levels without blocks.
    """
    if not levels.blocks:
        raise ValueError("levels of a closed form have no blocks; solve them in blocks")
    starts = np.array([block.start for block in levels.blocks])
    of_row = np.searchsorted(starts, rows, side="right") - 1
    numbers = distinct(of_row).tolist()
    blocks = [levels.blocks[number] for number in numbers]
    makers = _Makers(top, levels, names, blocks, functions, naming)
    units = [makers.unit(number, block) for number, block in enumerate(blocks)]
    inside = [np.flatnonzero(of_row == number) for number in numbers]

    def find(place: int, names: Ints) -> tuple[Ints, Ints]:
        """Labels of the block by their names, which are those that the levels have."""
        block, rows_of_block = blocks[place], inside[place]
        state_of = {tuple(name): state for state, name in enumerate(names.tolist())}
        if functions and isinstance(block, SpinBlock):
            asked = _names_by(block, *functions(block))[rows[rows_of_block] - block.start]
        else:
            asked = (
                _quanta(levels)[rows[rows_of_block]]
                if functions or naming
                else _names(block)[rows[rows_of_block] - block.start]
            )
        return rows_of_block, np.array([state_of[tuple(name)] for name in asked.tolist()])

    return tracked_blocks(units, len(rows), find, values_mhz)


def _quanta(levels: Levels) -> Ints:
    v = levels.quanta.get("v", np.zeros(len(levels), dtype=np.int64))
    return np.stack([v, levels.quanta["ka"], levels.quanta["kc"]], axis=1)


def _names(block: Any) -> Ints:
    """What the states of a solved block are called; the rank alone where one Wang block is solved by itself."""
    return np.arange(len(block.energies_mhz))[:, None] if isinstance(block, SolvedBlock) else block.labels


def _names_by(block: SpinBlock, functions: Floats, names: Ints) -> Ints:
    """What the states of a block are called by functions over those of the basis."""
    rows = [block.vectors[part.place].reshape(part.repeats, len(part.rotor.energies_mhz), -1) for part in block.parts]
    over_basis = np.concatenate(
        [
            np.matmul(part.rotor.vectors, part_rows).reshape(-1, block.vectors.shape[1])
            for part, part_rows in zip(block.parts, rows, strict=True)
        ]
    )
    return np.asarray(names[assigned((functions @ over_basis) ** 2, np.ones(len(names), dtype=np.int64))])


class _Makers:
    """Linear blocks of solved blocks of any kind, with how their states get their names."""

    def __init__(
        self,
        top: Top,
        levels: Levels,
        names: Sequence[str],
        blocks: Sequence[Any],
        functions: Functions | None,
        naming: Naming | None,
    ) -> None:
        self._functions, self._naming, self._representation = functions, naming, str(levels.representation)
        if isinstance(blocks[0], SpinBlock):
            self._linear = linear_blocks_of_spins(top, levels.effects, names, blocks)
        else:
            self._linear = linear_blocks_of(top, levels, names, blocks)

    def unit(self, number: int, block: Any) -> NamedBlock:
        """One block, and how its states get their names."""
        linear = self._linear[number]
        if self._functions:
            return _turned(linear, *self._functions(block))
        if isinstance(block, SpinBlock):
            return NamedBlock(linear, _names_with_spins(block))
        if self._naming:
            return NamedBlock(linear, self._naming(vertices_of(block), self._representation))
        if isinstance(block, SolvedBlock):
            return NamedBlock(linear, NamedFunctions(np.zeros(linear.size, dtype=np.int64), _by_rank, Follows.MOSTLY))
        return NamedBlock(linear, by_overlaps(vertices_of(block), self._representation))


def _turned(block: LinearBlock, functions: Floats, names: Ints) -> NamedBlock:
    """The block over other functions, each of a state by itself: the sub-blocks are their v, the parity of Ka and the pattern."""

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return np.asarray(names[assigned(vectors**2, np.ones(len(names), dtype=np.int64))])

    members = np.column_stack([names[:, 0], names[:, 1] % 2, names[:, 3:]])
    sub_blocks = np.unique(members, axis=0, return_inverse=True)[1].reshape(-1)
    return NamedBlock(block.turned(functions), NamedFunctions(sub_blocks, namer, Follows.MOSTLY))


def _names_with_spins(block: SpinBlock) -> NamedFunctions:
    """Names by Wang blocks of one state and patterns, or by what exchange makes of these."""
    if block.allowed:
        return NamedFunctions(block.allowed.sub_block, _namer_of_allowed(block.allowed), Follows.MOSTLY)
    sub_blocks = _sub_blocks(block.parts, block.parts[-1].place.stop)
    return NamedFunctions(sub_blocks, _namer(block.parts, block.patterns), Follows.MOSTLY)


def _by_rank(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
    return np.arange(len(energies))[:, None]


def _namer_of_allowed(allowed: Allowed) -> Namer:
    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return np.asarray(labels_by_shares(allowed.names[None], allowed.sizes[None], vectors[None])[0][0])

    return namer


def _sub_blocks(parts: tuple[SpinPart, ...], size: int) -> Ints:
    """The number of the Wang block and pattern of every function, as `labels_of` counts them."""
    out, number = np.empty(size, dtype=np.int64), 0
    for part in parts:
        states = len(part.rotor.energies_mhz)
        for sub_part in part.rotor.parts:
            for pattern in range(part.repeats):
                start = part.place.start + pattern * states
                out[start + sub_part.place.start : start + sub_part.place.stop] = number
                number += 1
    return out


def _namer(solved: tuple[SpinPart, ...], all_names: Ints) -> Namer:
    parts = tuple(
        part._replace(rotor=replace(part.rotor, vectors=np.eye(len(part.rotor.energies_mhz)))) for part in solved
    )
    names = names_of_parts(parts, all_names)

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        return labels_of(parts, names, vectors)[0]

    return namer
