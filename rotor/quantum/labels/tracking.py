"""Named states of linear blocks while constants change.

A state is named by its dominant sub-block (a Wang block of one state v, and one pattern of coupling), and within a sub-block by the order
of energy. While these are those of the start, state n keeps its name; else the states of the block are named again (`Follows`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace, distinct, rows_of_keys
from rotor.frozen import dataclass
from rotor.quantum.basis.state_elements import StateElements, StateTerms, Vertex
from rotor.quantum.blocks.linear_stacks import LinearBlock, LinearStack, stack_numbers
from rotor.quantum.effect import QuantumEffect, k_limits_of
from rotor.quantum.labels.labelled import ClosedForm, LevelModel
from rotor.quantum.wang.basis import WangBlock, blocks_within, parts_of
from rotor.quantum.wang.coupled_levels import names_of_functions, names_of_states
from rotor.quantum.wang.rotation import representation_of

if TYPE_CHECKING:
    from typing import TypeAlias

    from rotor.quantum.estimates.contracted import ContractedLevels

    LevelBlocks: TypeAlias = "TrackedLevels | ContractedLevels | ClosedForm"
    from rotor.tops.top import Top


_CLEAR = 0.8  # share of a sub-block in a state, above which it and the rank by energy in it make the name
_FIRST = 0.5  # share above which a state has its sub-block before all others

_ALIKE = 1e-13  # of the width of a block: energies that differ less are one, such as doublets of high K


Namer = Callable[
    [Floats, Floats, Floats], Ints
]  # lower triangle of the matrix, energies, vectors -> names (n, columns) of the states


class Follows(Enum):
    """What shows that a state keeps its name, so that its block is not named again.

    MOSTLY: the sub-block with a share of at least 0.8, and the rank by energy in it. GROUPS: sub-blocks, largest shares first, each for as
    many states as it has functions, and energy in these. NOTHING: states are always named again.
    """

    MOSTLY = 1
    GROUPS = 2
    NOTHING = 3


class NamedFunctions(NamedTuple):
    """The number of the sub-block of each function (functions,), and the rules by which states are named."""

    sub_blocks: Ints
    namer: Namer
    follows: Follows


Naming = Callable[[Sequence[tuple[int, WangBlock]], str], NamedFunctions]  # states and Wang blocks, representation


NamedBlock = tuple[LinearBlock, NamedFunctions]


class Tracked(NamedTuple):
    """Labels in a block: their places among all labels, their names and states.

    At the start: values of the parameters of the block, energies of the labels and their derivatives, and of all states the sub-block with
    the largest share and this share.
    """

    block: LinearBlock
    named: NamedFunctions
    rows: Ints
    names: Ints
    states: Ints
    values_mhz: Floats
    energies: Floats
    slopes: Floats
    leading: Ints
    shares: Floats


def tracked_blocks(
    names: Sequence[str],
    blocks: Sequence[NamedBlock],
    count: int,
    find: Callable[[int, Ints], tuple[Ints, Ints]],
    values_mhz: Floats,
) -> TrackedLevels:
    """The blocks, solved at values of named parameters, in which labels lie, of which there are `count`.

    find: from the number of a block and the names (n, columns) of its states to the places of labels that may be in it, and their names.
    """
    tracked, space = list[Tracked](), Workspace()
    for numbers in stack_numbers([block.shape for block, _ in blocks]):
        stack = LinearStack.from_blocks([blocks[i][0] for i in numbers.tolist()])
        members = _members([blocks[i][1].sub_blocks for i in numbers.tolist()], stack.size)
        energies, vectors, matrices = stack.solved(values_mhz, space)
        state_names = [
            _names(blocks[i][1], stack.matrix(matrices, k), energies[k], vectors[k])
            for k, i in enumerate(numbers.tolist())
        ]
        tracked_rows = list[tuple[Ints, Ints]]()
        for i, names_of_block in zip(numbers.tolist(), state_names, strict=True):
            rows, requested = find(i, names_of_block)
            states = rows_of_keys(names_of_block, requested)
            tracked_rows.append((rows[states >= 0], states[states >= 0]))
        slopes = stack.slopes(vectors, _padded([states for _, states in tracked_rows], 0), space)
        leading, shares = _leading(members, energies, vectors)
        for place, (rows, states) in enumerate(tracked_rows):
            if len(rows):
                block, named = blocks[numbers[place]]
                block_slopes = slopes[place, : len(rows), : len(block.parameters)]
                start = values_mhz[block.parameters], energies[place, states], block_slopes
                sub_blocks = leading[place, : block.size], shares[place, : block.size]
                tracked.append(Tracked(block, named, rows, state_names[place][states], states, *start, *sub_blocks))
    return TrackedLevels(tuple(names), count, tuple(tracked))


def _members(sub_blocks: Sequence[Ints], size: int) -> Floats:
    """1 where a function of a block is in a sub-block, (blocks, sub-blocks, functions)."""
    members = np.zeros((len(sub_blocks), 1 + max(int(numbers.max(initial=0)) for numbers in sub_blocks), size))
    for place, numbers in enumerate(sub_blocks):
        members[place, numbers, np.arange(len(numbers))] = 1.0
    return members


def _names(named: NamedFunctions, matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
    """Names of the states of a block from its row of a stack, where these are padded."""
    size = len(matrix)
    return named.namer(matrix, energies[:size], vectors[:size, :size])


def _leading(members: Floats, energies: Floats, vectors: Floats) -> tuple[Ints, Floats]:
    """For each state (blocks, size) the dominant sub-block and its share; degenerate states (within round-off) are ordered by sub-block."""
    if members.shape[1] == 1 or members.shape[2] == 1:
        return np.zeros(energies.shape, dtype=np.int64), np.ones(energies.shape)
    shares = members @ vectors**2
    largest_state, largest = np.asarray(shares.argmax(axis=1)), np.asarray(shares.max(axis=1))
    whole = np.nanmax(energies, axis=1, keepdims=True) - energies[:, :1]
    turned = (np.diff(energies, axis=1) <= _ALIKE * whole) & (largest_state[:, :-1] > largest_state[:, 1:])
    turned[:, 1:] &= ~turned[:, :-1]
    block, place = np.nonzero(turned)
    largest_state[block, place], largest_state[block, place + 1] = (
        largest_state[block, place + 1],
        largest_state[block, place],
    )
    return largest_state, largest


def _padded(rows: Sequence[Ints], fill: int) -> Ints:
    """Arrays of whole numbers as the rows of one."""
    out = np.full((len(rows), max(map(len, rows))), fill)
    for place, row in enumerate(rows):
        out[place, : len(row)] = row
    return out


@dataclass(frozen=True, eq=False)
class _Labelled:
    """Blocks side by side with their labels.

    members: 1 where a function is in a sub-block, (blocks, sub-blocks, functions). rows, states: of the labels, (blocks, labels), padded
    with -1 and 0.
    """

    stack: LinearStack
    members: Floats
    tracked: tuple[Tracked, ...]
    rows: Ints
    states: Ints
    leading: Ints

    @classmethod
    def from_tracked(cls, tracked: Sequence[Tracked]) -> _Labelled:
        """Blocks of like size side by side."""
        stack = LinearStack.from_blocks([each.block for each in tracked])
        members = _members([each.named.sub_blocks for each in tracked], stack.size)
        rows, states = _padded([each.rows for each in tracked], -1), _padded([each.states for each in tracked], 0)
        return cls(stack, members, tuple(tracked), rows, states, _padded([each.leading for each in tracked], 0))

    @cached_property
    def _at_start(self) -> Ints:
        return self._ranks(self.leading)

    def levels(self, values_mhz: Floats, space: Workspace) -> tuple[Floats, Floats]:
        """Energies (blocks, labels) and derivatives (blocks, labels, parameters of the blocks)."""
        energies, vectors, matrices = self.stack.solved(values_mhz, space)
        states = self._states(energies, vectors, matrices)
        return np.take_along_axis(energies, states, axis=1), self.stack.slopes(vectors, states, space)

    def _states(self, energies: Floats, vectors: Floats, matrices: Floats) -> Ints:
        """The states (blocks, labels) of the labels. Interacting states are named from the current constants."""
        leading, shares = _leading(self.members, energies, vectors)
        moved = self._unclear_at_start | self._unclear(leading, shares)
        if (self._below & (leading != self.leading)).any():
            moved |= ((self._ranks(leading) != self._at_start) & (self.rows >= 0)).any(axis=1)
        if not moved.any():
            return self.states
        states = self.states.copy()
        for b in np.flatnonzero(moved).tolist():
            block = self.tracked[b]
            state_names = _names(block.named, self.stack.matrix(matrices, b), energies[b], vectors[b])
            states[b, : len(block.rows)] = new = rows_of_keys(state_names, block.names)
            if (new < 0).any():
                raise ValueError("a labelled level has no state of its name with these constants")
        return states

    @cached_property
    def _unclear_at_start(self) -> NDArray[np.bool_]:
        shares = [np.pad(block.shares, (0, self.stack.size - block.block.size)) for block in self.tracked]
        return self._unclear(self.leading, np.stack(shares))

    def _unclear(self, leading: Ints, shares: Floats) -> NDArray[np.bool_]:
        """Blocks (blocks,) with a labelled state whose sub-block and rank among those that lead do not make its name."""
        mostly, groups = self._follow[Follows.MOSTLY], self._follow[Follows.GROUPS]
        unclear = self._follow[Follows.NOTHING]
        if mostly.any():
            share = np.take_along_axis(shares, self.states, axis=1)
            unclear = unclear | (mostly & ((share < _CLEAR) & (self.rows >= 0)).any(axis=1))
        return unclear | (groups & self._shared(leading, shares)) if groups.any() else unclear

    @cached_property
    def _follow(self) -> dict[Follows, NDArray[np.bool_]]:
        return {what: np.array([block.named.follows is what for block in self.tracked]) for what in Follows}

    def _shared(self, leading: Ints, shares: Floats) -> NDArray[np.bool_]:
        """Blocks (blocks,) in which a labelled state may be assigned to another sub-block than the dominant one.

        That is where sub-blocks dominate more or fewer states than they have functions.
        """
        sizes = self.members.sum(axis=2)
        shared = (_counts(leading, self._inside, sizes.shape[1]) != sizes).any(axis=1)
        if shared.any():
            first = self._inside & (shares > _FIRST)
            over = (_counts(leading, first, sizes.shape[1]) > sizes).any(axis=1)
            shared &= over | (self._below & ~first).any(axis=1)
        return np.asarray(shared)

    @cached_property
    def _inside(self) -> NDArray[np.bool_]:
        return np.asarray(np.arange(self.stack.size) < self.stack.sizes[:, None])

    @cached_property
    def _below(self) -> NDArray[np.bool_]:
        """The states (blocks, size) up to the highest one with a label."""
        highest = np.where(self.rows >= 0, self.states, -1).max(axis=1)
        return np.asarray(np.arange(self.stack.size) <= highest[:, None])

    def _ranks(self, leading: Ints) -> Ints:
        """Sub-block and rank by energy in it of the labelled states, as one number (blocks, labels); states above them do not count."""
        if self.members.shape[1] == 1:
            return np.zeros_like(self.states)
        leading_function = np.take_along_axis(leading, self.states, axis=1)
        below = np.arange(self.stack.size) < self.states[:, :, None]
        return np.asarray(
            leading_function * self.stack.size
            + ((leading[:, None, :] == leading_function[:, :, None]) & below).sum(axis=2)
        )


def _counts(leading: Ints, chosen: NDArray[np.bool_], parts: int) -> Ints:
    """How many of the chosen states (blocks, size) each sub-block leads, (blocks, parts)."""
    blocks = len(leading)
    numbers = (leading + parts * np.arange(blocks)[:, None])[chosen]
    return np.bincount(numbers, minlength=blocks * parts).reshape(blocks, parts)


class AssignedLevels(NamedTuple):
    """Blocks of some labels and parameters: the places of both among all (rows, columns)."""

    rows: Ints
    columns: Ints
    blocks: LevelBlocks


@dataclass(frozen=True)
class TrackedLevels(LevelModel):
    """Blocks of named parameters and the labels in them. others: parts without blocks, solved label by label."""

    names: tuple[str, ...]
    count: int
    tracked: tuple[Tracked, ...]
    others: tuple[AssignedLevels, ...] = ()

    @classmethod
    def from_parts(cls, names: tuple[str, ...], parts: Sequence[AssignedLevels], count: int) -> TrackedLevels:
        """The model of `count` labels; blocks of all parts are one set, so that those of equal size are solved together."""
        tracked = [
            block
            for part in parts
            if isinstance(part.blocks, TrackedLevels)
            for block in part.blocks.moved(part.rows, part.columns)
        ]
        others = tuple(part for part in parts if not isinstance(part.blocks, TrackedLevels))
        return cls(names, count, tuple(tracked), others)

    @property
    def without_level(self) -> NDArray[np.bool_]:
        """Which labels (count,) have no level in these blocks."""
        missing = np.ones(self.count, dtype=bool)
        for rows in (*(block.rows for block in self.tracked), *(part.rows for part in self.others)):
            missing[rows] = False
        return missing

    def moved(self, rows: Ints, columns: Ints) -> Iterator[Tracked]:
        """The blocks with other places of labels and of parameters."""
        for tracked in self.tracked:
            block = tracked.block._replace(parameters=columns[tracked.block.parameters])
            yield tracked._replace(block=block, rows=rows[tracked.rows])

    @cached_property
    def _space(self) -> Workspace:
        return Workspace()

    @cached_property
    def _labelled(self) -> list[_Labelled]:
        numbers = stack_numbers([block.block.shape for block in self.tracked])
        return [
            _Labelled.from_tracked([self.tracked[i] for i in numbers_of_stack.tolist()]) for numbers_of_stack in numbers
        ]

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`; nan for labels that are not in these blocks."""
        energies = np.full(self.count + 1, np.nan)  # padded labels and parameters go to the last place
        slopes = np.zeros((self.count + 1, len(values_mhz) + 1))
        if all(np.array_equal(block.values_mhz, values_mhz[block.block.parameters]) for block in self.tracked):
            for block in self.tracked:
                energies[block.rows] = block.energies
                slopes[block.rows[:, None], block.block.parameters] = block.slopes
        else:
            for labelled in self._labelled:
                energies[labelled.rows], derived = labelled.levels(values_mhz, self._space)
                slopes[labelled.rows[:, :, None], labelled.stack.parameters[:, None, :]] = derived
        for part in self.others:
            energies[part.rows], derived = part.blocks.levels(values_mhz[part.columns])
            slopes[part.rows[:, None], part.columns] = derived
        return energies[:-1], slopes[:-1, :-1]


def labelled_states(
    top: Top,
    effects: Sequence[QuantumEffect],
    names: Sequence[str],
    labels: Ints,
    values_mhz: Floats,
    naming: Naming | None = None,
) -> TrackedLevels:
    """The blocks in which labels J, v, Ka, Kc (n, 4) lie, for any values of the named parameters; states are named at `values_mhz`.

    naming: how the states of connected Wang blocks get their names; by overlaps by default, see `names_of_states`. Raises ValueError for a
    Hamiltonian that is not finite, or not invariant under time reversal.
    """
    representation, limits, named = representation_of(top), k_limits_of(top, effects), naming or by_overlaps
    rows_of_j = {j: np.flatnonzero(labels[:, 0] == j) for j in distinct(labels[:, 0][labels[:, 0] >= 0]).tolist()}
    states = sorted({0, *(state.v for effect in effects for state in effect.states(top))})
    vertices = {
        j: [(v, block) for v in states for block in blocks_within(j, representation, limits.get(v))] for j in rows_of_j
    }
    terms = StateTerms.from_effects(top, effects, names, representation)
    elements = StateElements(terms, len(names), vertices)
    blocks, inside = list[NamedBlock](), list[Ints]()
    for j, rows in sorted(rows_of_j.items(), reverse=True):
        here = elements.at(j)
        classes = {(int(v), "eo"[ka % 2] + "eo"[kc % 2]) for _, v, ka, kc in labels[rows].tolist()}
        for members in here.connected:
            members_here = [vertices[j][i] for i in members]
            if {(v, block.species) for v, block in members_here} & classes:
                blocks.append((here.block(members), named(members_here, representation)))
                inside.append(rows)

    return tracked_blocks(
        names, blocks, len(labels), lambda number, _: (inside[number], labels[inside[number], 1:]), values_mhz
    )


def by_overlaps(blocks: Sequence[Vertex], representation: str) -> NamedFunctions:
    """Names of states by their overlaps with those of each Wang block by itself."""
    parts = parts_of(blocks)
    sub_blocks = np.repeat(np.arange(len(parts)), [part.basis.size for part in parts])

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        if len(parts) == 1:
            return names_of_functions(parts, representation)
        return names_of_states(parts, matrix, vectors, representation)[0]  # of the matrix the lower triangle is read

    return NamedFunctions(sub_blocks, namer, Follows.MOSTLY)
