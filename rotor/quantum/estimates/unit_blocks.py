"""Blocks of a Hamiltonian that is linear in its parameters, H_b = Σ c_i O_i,b: made once, solved again and again.

The unit matrices O_i,b over the functions of a block are taken as their elements that are not zero, the same places for all
parameters. Parameters that multiply one matrix times a number each (B, D_J and H_J at one J) share its elements, O_i = Σ_u M_ui U_u.
Blocks of one size stand side by side, padded, so that new constants cost some products of arrays, one diagonalisation a block, and

    ∂E_n/∂c_i = ⟨n|O_i|n⟩ = Σ_u M_ui Σ_(r,c) U_u(r, c) v_r v_c

more products for the states that have a label. A state is named by the sub-block (a Wang block of one state v, and one pattern of
coupling) that has most of it, and within a sub-block by the order of energy. As long as these are what they were at the start, state n
stays state n; where they are not, the names are made anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, distinct

Namer = Callable[[Floats, Floats, Floats], Ints]  # matrix, energies, vectors -> names (n, columns) of the states

_AT_ONCE = 1 << 18  # numbers of the largest array of blocks side by side: 2 MB, which stays in the cache of a core

_CLEAR = 0.8  # share of a sub-block in a state, above which it and the rank by energy in it make the name

_ALIKE = 1e-13  # of the width of a block: energies that differ less are one, such as doublets of high K


@dataclass(frozen=True)
class UnitBlock:
    """One block: size, places (row, column, row ≥ column) of elements, their factors (elements, units), which parameters.

    mix (units, parameters) : how much of each unit matrix a parameter has
    members (sub-blocks, functions) : 1 where a function is in a sub-block
    namer : names of all states, where they must be made
    """

    size: int
    rows: Ints
    columns: Ints
    factors: Floats
    mix: Floats
    parameters: Ints
    members: Floats
    namer: Namer


class Elements(NamedTuple):
    """Elements of a matrix that are not zero, of its lower triangle: places row * size + column, rising, and values."""

    places: Ints
    values: Floats


def elements_of(matrix: Floats) -> Elements:
    """Of a dense matrix (size, size).

    >>> elements_of(np.array([[1.0, 9.0], [0.0, 2.0]])).places.tolist()
    [0, 3]
    """
    places = np.flatnonzero(matrix)
    rows, columns = np.divmod(places, matrix.shape[1])
    places = places[rows >= columns]
    return Elements(places, matrix.ravel()[places])


def unit_block(units: dict[int, Elements], sub_blocks: Ints, namer: Namer) -> UnitBlock:
    """From the unit matrix of every parameter, by its number, that acts in the block."""
    parameters, size = sorted(units), len(sub_blocks)
    diagonal = np.arange(size) * (size + 1)
    places = distinct(np.concatenate([diagonal, *(units[i].places for i in parameters)]))
    factors = np.zeros((len(places), len(parameters)))
    for column, i in enumerate(parameters):
        factors[np.searchsorted(places, units[i].places), column] = units[i].values
    rows, columns = np.divmod(places, size)
    numbers = np.array(parameters, dtype=np.int64)
    return UnitBlock(size, rows, columns, factors, np.eye(len(parameters)), numbers, members_of(sub_blocks), namer)


def members_of(sub_blocks: Ints) -> Floats:
    """1 where a function (columns) is in a sub-block (rows), from the number of the sub-block of every function."""
    return np.asarray(sub_blocks[None, :] == np.arange(sub_blocks.max(initial=0) + 1)[:, None], dtype=float)


@dataclass(frozen=True)
class _Solved:
    """Blocks side by side: matrices (lower triangles, less `zero` on the diagonal), energies, vectors."""

    matrices: Floats
    energies: Floats
    vectors: Floats


@dataclass(frozen=True)
class _Stack:
    """Blocks of one size side by side, padded with elements that are 0.

    places (blocks, elements) : in all matrices one behind the other, the place behind them where padded. twice : 2 off the diagonal
    rows, columns, factors, mix, parameters, members : as of the blocks; padded parameters are the one behind all, whose value is 0
    """

    size: int
    places: Ints
    rows: Ints
    columns: Ints
    twice: Floats
    factors: Floats
    mix: Floats
    parameters: Ints
    members: Floats

    @classmethod
    def of(cls, blocks: Sequence[UnitBlock]) -> _Stack:
        count, size = len(blocks), blocks[0].size
        most, units = max(len(b.rows) for b in blocks), max(b.factors.shape[1] for b in blocks)
        acting, parts = max(len(b.parameters) for b in blocks), max(len(b.members) for b in blocks)
        places = np.full((count, most), count * size * size)
        rows, columns = np.zeros((2, count, most), dtype=np.int64)
        factors, mix = np.zeros((count, most, units)), np.zeros((count, units, acting))
        parameters, members = np.full((count, acting), -1), np.zeros((count, parts, size))
        for b, block in enumerate(blocks):
            n = len(block.rows)
            places[b, :n] = (b * size + block.rows) * size + block.columns
            rows[b, :n], columns[b, :n] = block.rows, block.columns
            factors[b, :n, : block.factors.shape[1]] = block.factors
            mix[b, : block.mix.shape[0], : block.mix.shape[1]] = block.mix
            parameters[b, : len(block.parameters)] = block.parameters
            members[b, : len(block.members)] = block.members
        twice = np.where(rows == columns, 1.0, 2.0)
        return cls(size, places, rows, columns, twice, factors, mix, parameters, members)

    def solved(self, values_mhz: Floats) -> _Solved:
        """A number is taken off each diagonal for the sake of digits, and added to the energies."""
        count, size = len(self.rows), self.size
        values = np.append(values_mhz, 0.0)[self.parameters]
        of_units = self.mix @ values[:, :, None]
        whole = np.zeros(count * size * size + 1)
        whole[self.places] = (self.factors @ of_units)[:, :, 0]
        matrices = whole[:-1].reshape(count, size, size)
        zero = matrices[:, 0, 0].copy()
        matrices.reshape(count, -1)[:, :: size + 1] -= zero[:, None]
        if not np.isfinite(whole[:-1].sum()):
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        energies, vectors = np.linalg.eigh(matrices)
        return _Solved(matrices, energies + zero[:, None], vectors)

    def leading(self, solved: _Solved) -> tuple[Ints, Floats]:
        """The sub-block with the largest share of each state, (blocks, size), and that share; of two states that round-off alone tells
        apart the lower number first, whichever way round they come."""
        if self.members.shape[1] == 1 or self.size == 1:
            return np.zeros(solved.energies.shape, dtype=np.int64), np.ones(solved.energies.shape)
        shares = self.members @ solved.vectors**2
        found, largest = np.asarray(shares.argmax(axis=1)), np.asarray(shares.max(axis=1))
        whole = solved.energies[:, -1:] - solved.energies[:, :1]
        turned = (np.diff(solved.energies, axis=1) <= _ALIKE * whole) & (found[:, :-1] > found[:, 1:])
        turned[:, 1:] &= ~turned[:, :-1]
        block, place = np.nonzero(turned)
        found[block, place], found[block, place + 1] = found[block, place + 1], found[block, place]
        return found, largest

    def slopes(self, vectors: Floats, states: Ints) -> Floats:
        """⟨n|O_i|n⟩ (blocks, states, parameters of the blocks) of some states (blocks, states)."""
        chosen = np.take_along_axis(vectors, states[:, None, :], axis=2)
        block = np.arange(len(states))[:, None]
        weights = chosen[block, self.rows]
        weights *= chosen[block, self.columns]
        weights *= self.twice[:, :, None]
        return np.asarray(weights.transpose(0, 2, 1) @ self.factors @ self.mix)


class AtStart(NamedTuple):
    """What labels of a block had when they were looked for: parameters of the block, energies, derivatives by them, sub-blocks of all
    its states and the shares of these."""

    values_mhz: Floats
    energies: Floats
    slopes: Floats
    leading: Ints
    shares: Floats


@dataclass(frozen=True)
class Tracked:
    """Labels in a block: their places among all, the names and the states that they have."""

    block: UnitBlock
    rows: Ints
    names: Ints
    states: Ints
    start: AtStart


def _stacks(blocks: Sequence[UnitBlock]) -> list[Ints]:
    """Positions of the blocks that are worked on together: of one size, of like numbers of elements, of bounded memory."""
    order = sorted(range(len(blocks)), key=lambda i: (blocks[i].size, len(blocks[i].rows), blocks[i].factors.shape[1]))
    out, some = list[Ints](), list[int]()
    for i in order:
        block = blocks[i]
        width = max(block.factors.shape[1], block.size)
        if some and (block.size != blocks[some[0]].size or (len(some) + 1) * len(block.rows) * width > _AT_ONCE):
            out.append(np.array(some))
            some = []
        some.append(i)
    return [*out, np.array(some)] if some else out


def tracked_blocks(
    blocks: Sequence[UnitBlock], count: int, find: Callable[[int, Ints], tuple[Ints, Ints]], values_mhz: Floats
) -> UnitBlocks:
    """Labels looked for in the blocks solved at some values.

    Parameters
    ----------
    blocks : sequence of UnitBlock
    count : int
        Number of labels.
    find : callable
        Number of a block and names (n, columns) of its states to places of labels in it, and which states.
    values_mhz : (parameters,) array

    Returns
    -------
    UnitBlocks
        Blocks in which labels lie.
    """
    tracked = list[Tracked]()
    for numbers in _stacks(blocks):
        stack = _Stack.of([blocks[i] for i in numbers.tolist()])
        solved = stack.solved(values_mhz)
        named = [
            blocks[i].namer(solved.matrices[place], solved.energies[place], solved.vectors[place])
            for place, i in enumerate(numbers.tolist())
        ]
        found = [find(i, names) for i, names in zip(numbers.tolist(), named, strict=True)]
        slopes = stack.slopes(solved.vectors, _padded([states for _, states in found], 0))
        leading, shares = stack.leading(solved)
        for place, (rows, states) in enumerate(found):
            if len(rows):
                block = blocks[numbers[place]]
                own = slopes[place, : len(rows), : len(block.parameters)]
                of_states = leading[place], shares[place]
                start = AtStart(values_mhz[block.parameters], solved.energies[place, states], own, *of_states)
                tracked.append(Tracked(block, rows, named[place][states], states, start))
    return UnitBlocks(count, tuple(tracked))


def _padded(rows: Sequence[Ints], fill: int) -> Ints:
    """Arrays of whole numbers as the rows of one."""
    out = np.full((len(rows), max(map(len, rows))), fill)
    for place, row in enumerate(rows):
        out[place, : len(row)] = row
    return out


@dataclass(frozen=True)
class _Labelled:
    """A stack with the labels in it: rows (blocks, labels), the place behind all where padded; states (blocks, labels)."""

    stack: _Stack
    tracked: tuple[Tracked, ...]
    rows: Ints
    states: Ints
    leading: Ints

    @classmethod
    def of(cls, tracked: Sequence[Tracked]) -> _Labelled:
        rows, states = _padded([one.rows for one in tracked], -1), _padded([one.states for one in tracked], 0)
        leading = np.stack([one.start.leading for one in tracked])
        return cls(_Stack.of([one.block for one in tracked]), tuple(tracked), rows, states, leading)

    @cached_property
    def _at_start(self) -> Ints:
        return self._ranks(self.leading)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (blocks, labels) and derivatives (blocks, labels, parameters of the blocks)."""
        solved = self.stack.solved(values_mhz)
        states = self._states(solved)
        return np.take_along_axis(solved.energies, states, axis=1), self.stack.slopes(solved.vectors, states)

    def _states(self, solved: _Solved) -> Ints:
        """The states that have the labels now; names are made anew only where a state is mostly in another sub-block."""
        leading, shares = self.stack.leading(solved)
        moved = ((self._ranks(leading) != self._at_start) & (self.rows >= 0)).any(axis=1)
        moved |= self._unclear_at_start | self._unclear(leading, shares)
        if not moved.any():
            return self.states
        states = self.states.copy()
        for b in np.flatnonzero(moved).tolist():
            one = self.tracked[b]
            made = one.block.namer(solved.matrices[b], solved.energies[b], solved.vectors[b])
            states[b, : len(one.rows)] = _states_of(made, one.names)
        return states

    @cached_property
    def _unclear_at_start(self) -> NDArray[np.bool_]:
        return self._unclear(self.leading, np.stack([one.start.shares for one in self.tracked]))

    def _unclear(self, leading: Ints, shares: Floats) -> NDArray[np.bool_]:
        """Blocks (blocks,) with a labelled state that no sub-block has most of: its sub-block and rank do not make its name."""
        own = np.take_along_axis(shares, self.states, axis=1)
        return np.asarray(((own < _CLEAR) & (self.rows >= 0)).any(axis=1))

    def _ranks(self, leading: Ints) -> Ints:
        """The sub-blocks of the labelled states and their places by energy in these, as one number each (blocks, labels).

        What becomes of states above, such as doublets that nothing splits, has no bearing.
        """
        if self.stack.members.shape[1] == 1:
            return np.zeros_like(self.states)
        own = np.take_along_axis(leading, self.states, axis=1)
        below = np.arange(self.stack.size) < self.states[:, :, None]
        return np.asarray(own * self.stack.size + ((leading[:, None, :] == own[:, :, None]) & below).sum(axis=2))


def _states_of(made: Ints, names: Ints) -> Ints:
    """Which states have the names, of the names of all."""
    of_name = {tuple(name): state for state, name in enumerate(made.tolist())}
    found = [of_name.get(tuple(name), -1) for name in names.tolist()]
    if min(found) < 0:
        raise ValueError("a labelled level has no state of its name with these constants")
    return np.array(found)


@dataclass(frozen=True)
class UnitBlocks:
    """Blocks with the labels that lie in them; `levels` gives energies and derivatives, in the order of the labels."""

    count: int
    tracked: tuple[Tracked, ...]

    @property
    def found(self) -> Ints:
        """Places of the labels that were found."""
        return np.concatenate([one.rows for one in self.tracked]) if self.tracked else np.zeros(0, dtype=np.int64)

    @cached_property
    def _labelled(self) -> list[_Labelled]:
        numbers = _stacks([one.block for one in self.tracked])
        return [_Labelled.of([self.tracked[i] for i in some.tolist()]) for some in numbers]

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (count,) and derivatives (count, parameters); nan for labels that are not in these blocks."""
        if all(np.array_equal(one.start.values_mhz, values_mhz[one.block.parameters]) for one in self.tracked):
            return self._levels_at_start(len(values_mhz))
        energies = np.full(self.count + 1, np.nan)  # padded labels and parameters go to the last place
        slopes = np.zeros((self.count + 1, len(values_mhz) + 1))
        for one in self._labelled:
            found, derived = one.levels(values_mhz)
            energies[one.rows] = found
            slopes[one.rows[:, :, None], one.stack.parameters[:, None, :]] = derived
        return energies[:-1], slopes[:-1, :-1]

    def _levels_at_start(self, parameters: int) -> tuple[Floats, Floats]:
        energies, slopes = np.full(self.count, np.nan), np.zeros((self.count, parameters))
        for one in self.tracked:
            energies[one.rows] = one.start.energies
            slopes[one.rows[:, None], one.block.parameters] = one.start.slopes
        return energies, slopes


def joined(parts: Sequence[tuple[UnitBlocks, Ints, Ints]], count: int) -> UnitBlocks:
    """Several sets of blocks as one of so many labels: each with the places of its labels and of its parameters among all."""
    tracked = list[Tracked]()
    for blocks, rows, columns in parts:
        for one in blocks.tracked:
            block = replace(one.block, parameters=columns[one.block.parameters])
            tracked.append(replace(one, block=block, rows=rows[one.rows]))
    return UnitBlocks(count, tuple(tracked))
