"""Blocks of a Hamiltonian that is linear in its parameters, H_b = Σ c_i O_i,b: made once, solved again and again.

The unit matrices O_i,b over the functions of a block are taken as their elements that are not zero, the same places for all
parameters. Parameters that multiply one matrix times a number each (B, D_J and H_J at one J) share its elements, O_i = Σ_u M_ui U_u.
Blocks of one size stand side by side, padded, so that new constants cost some products of arrays, one diagonalisation a block, and

    ∂E_n/∂c_i = ⟨n|O_i|n⟩ = Σ_u M_ui Σ_(r,c) U_u(r, c) v_r v_c

more products for the states that have a label. A state is named by the sub-block (a Wang block of one state v, and one pattern of
coupling) that has most of it, and within a sub-block by the order of energy. As long as these are what they were at the start, state n
stays state n; where they are not, the names are made anew; see `Follows` for what is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.estimates.unit_matrices import Follows, Namer, UnitBlock

_AT_ONCE = 1 << 18  # numbers of the largest array of blocks side by side: 2 MB, which stays in the cache of a core

_CLEAR = 0.8  # share of a sub-block in a state, above which it and the rank by energy in it make the name
_LIKE = 1.5  # sizes of blocks that stand side by side

_FIRST = 0.5  # share above which a state has its sub-block before all others

_ALIKE = 1e-13  # of the width of a block: energies that differ less are one, such as doublets of high K


class _Solved(NamedTuple):
    """Blocks side by side: all matrices (lower triangles, less `zero` on the diagonal) one behind the other, energies (blocks, size), NaN
    beyond a block, vectors (blocks, size, size), 0 beyond a block."""

    matrices: Floats
    energies: Floats
    vectors: Floats


class _Stack(NamedTuple):
    """Blocks of like size, in order of size, side by side, padded with elements that are 0.

    size, sizes : of the largest block, of each
    runs : of blocks of one size the first, the one behind the last, and the size
    offsets (blocks + 1,) : where each matrix begins, all of them one behind the other
    places (blocks, elements) : in all matrices, the place behind them where padded
    diagonal : the places of all diagonals
    rows, columns (blocks, elements) : as of the blocks, counted through all of them, `size` for each
    half, factors, mix, parameters, members : half is 1 on the diagonal, else 1/2, and factors are those of the blocks over it; padded
    parameters are the one behind all, whose value is 0
    """

    size: int
    sizes: Ints
    runs: tuple[tuple[int, int, int], ...]
    offsets: Ints
    places: Ints
    diagonal: Ints
    rows: Ints
    columns: Ints
    half: Floats
    factors: Floats
    mix: Floats
    parameters: Ints
    members: Floats

    @classmethod
    def of(cls, blocks: Sequence[UnitBlock]) -> _Stack:
        sizes = np.array([block.size for block in blocks])
        count, size, offsets = len(blocks), int(sizes[-1]), np.cumsum([0, *(sizes**2).tolist()])
        most, units = max(len(b.rows) for b in blocks), max(b.factors.shape[1] for b in blocks)
        acting, parts = max(len(b.parameters) for b in blocks), max(len(b.members) for b in blocks)
        places, half = np.full((count, most), offsets[-1]), np.ones((count, most))
        rows, columns = np.zeros((2, count, most), dtype=np.int64)
        factors, mix = np.zeros((count, most, units)), np.zeros((count, units, acting))
        parameters, members = np.full((count, acting), -1), np.zeros((count, parts, size))
        for b, block in enumerate(blocks):
            n = len(block.rows)
            places[b, :n] = offsets[b] + block.rows * block.size + block.columns
            rows[b, :n], columns[b, :n] = block.rows, block.columns
            half[b, :n][block.rows != block.columns] = 0.5
            factors[b, :n, : block.factors.shape[1]] = block.factors / half[b, :n, None]
            mix[b, : block.mix.shape[0], : block.mix.shape[1]] = block.mix
            parameters[b, : len(block.parameters)] = block.parameters
            members[b, : len(block.members), : block.size] = block.members
        diagonal = np.concatenate([start + np.arange(n) * (n + 1) for start, n in zip(offsets, sizes, strict=False)])
        first = size * np.arange(count)[:, None]
        bounds = [0, *(1 + np.flatnonzero(np.diff(sizes))).tolist(), count]
        runs = tuple((i, k, int(sizes[i])) for i, k in pairwise(bounds))
        return cls(
            size, sizes, runs, offsets, places, diagonal, rows + first, columns + first, half, factors, mix, parameters,
            members,
        )  # fmt: skip

    def solved(self, values_mhz: Floats, space: Workspace) -> _Solved:
        """A number is taken off each diagonal for the sake of digits, and added to the energies."""
        count, size = self.rows.shape[0], self.size
        values = np.append(values_mhz, 0.0)[self.parameters]
        elements = (self.factors @ (self.mix @ values[:, :, None]))[:, :, 0]
        elements *= self.half
        whole = space.array("matrices", int(self.offsets[-1]) + 1)
        whole.fill(0.0)
        whole[self.places] = elements
        if not np.isfinite(whole.sum()):
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        zero = whole[self.offsets[:-1]]
        whole[self.diagonal] -= np.repeat(zero, self.sizes)
        energies = np.full((count, size), np.nan)
        vectors = space.array("vectors", count, size, size)
        vectors[:, self.runs[0][2] :, :] = vectors[:, :, self.runs[0][2] :] = 0.0
        for first, stop, n in self.runs:
            some = whole[self.offsets[first] : self.offsets[stop]].reshape(stop - first, n, n)
            energies[first:stop, :n], vectors[first:stop, :n, :n] = np.linalg.eigh(some)
        energies += zero[:, None]
        return _Solved(whole, energies, vectors)

    def names(self, solved: _Solved, place: int, namer: Namer) -> Ints:
        """The names of the states of one block."""
        n = int(self.sizes[place])
        matrix = solved.matrices[self.offsets[place] : self.offsets[place + 1]].reshape(n, n)
        return namer(matrix, solved.energies[place, :n], solved.vectors[place, :n, :n])

    def leading(self, solved: _Solved) -> tuple[Ints, Floats]:
        """The sub-block with the largest share of each state, (blocks, size), and that share; of two states that round-off alone tells
        apart the lower number first, whichever way round they come."""
        if self.members.shape[1] == 1 or self.size == 1:
            return np.zeros(solved.energies.shape, dtype=np.int64), np.ones(solved.energies.shape)
        shares = self.members @ solved.vectors**2
        found, largest = np.asarray(shares.argmax(axis=1)), np.asarray(shares.max(axis=1))
        whole = np.nanmax(solved.energies, axis=1, keepdims=True) - solved.energies[:, :1]
        turned = (np.diff(solved.energies, axis=1) <= _ALIKE * whole) & (found[:, :-1] > found[:, 1:])
        turned[:, 1:] &= ~turned[:, :-1]
        block, place = np.nonzero(turned)
        found[block, place], found[block, place + 1] = found[block, place + 1], found[block, place]
        return found, largest

    def slopes(self, vectors: Floats, states: Ints, space: Workspace) -> Floats:
        """⟨n|O_i|n⟩ (blocks, states, parameters of the blocks) of some states (blocks, states)."""
        (count, most), size, elements = states.shape, self.size, self.rows.shape[1]
        places = (size * size * np.arange(count)[:, None, None] + size * np.arange(size)[:, None]) + states[:, None, :]
        chosen = vectors.ravel().take(places, out=space.array("chosen", count, size, most), mode="clip")
        by_function = chosen.reshape(count * size, most)
        weights = by_function.take(self.rows, axis=0, out=space.array("weights", count, elements, most), mode="clip")
        weights *= by_function.take(self.columns, axis=0, out=space.array("others", count, elements, most), mode="clip")
        return np.asarray(weights.transpose(0, 2, 1) @ self.factors @ self.mix)


class AtStart(NamedTuple):
    """What labels of a block had when they were looked for: parameters of the block, energies, derivatives by them, sub-blocks of all
    its states and the shares of these."""

    values_mhz: Floats
    energies: Floats
    slopes: Floats
    leading: Ints
    shares: Floats


class Tracked(NamedTuple):
    """Labels in a block: their places among all, the names and the states that they have."""

    block: UnitBlock
    rows: Ints
    names: Ints
    states: Ints
    start: AtStart


def _stacks(blocks: Sequence[UnitBlock]) -> list[Ints]:
    """Positions of the blocks that are worked on together: of like size, of like numbers of elements, of bounded memory."""
    order = sorted(range(len(blocks)), key=lambda i: (blocks[i].size, len(blocks[i].rows), blocks[i].factors.shape[1]))
    out, some, least, most = list[Ints](), list[int](), 0, 0
    for i in order:
        block = blocks[i]
        most = max(most, len(block.rows) * max(block.factors.shape[1], block.size))
        if some and (block.size > _LIKE * least or (len(some) + 1) * most > _AT_ONCE):
            out.append(np.array(some))
            some, most = [], len(block.rows) * max(block.factors.shape[1], block.size)
        least = block.size if not some else least
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
    tracked, space = list[Tracked](), Workspace()
    for numbers in _stacks(blocks):
        stack = _Stack.of([blocks[i] for i in numbers.tolist()])
        solved = stack.solved(values_mhz, space)
        named = [stack.names(solved, place, blocks[i].namer) for place, i in enumerate(numbers.tolist())]
        found = [find(i, names) for i, names in zip(numbers.tolist(), named, strict=True)]
        slopes = stack.slopes(solved.vectors, _padded([states for _, states in found], 0), space)
        leading, shares = stack.leading(solved)
        for place, (rows, states) in enumerate(found):
            if len(rows):
                block = blocks[numbers[place]]
                own = slopes[place, : len(rows), : len(block.parameters)]
                of_states = leading[place, : block.size], shares[place, : block.size]
                start = AtStart(values_mhz[block.parameters], solved.energies[place, states], own, *of_states)
                tracked.append(Tracked(block, rows, named[place][states], states, start))
    return UnitBlocks(count, tuple(tracked))


def _padded(rows: Sequence[Ints], fill: int) -> Ints:
    """Arrays of whole numbers as the rows of one."""
    out = np.full((len(rows), max(map(len, rows))), fill)
    for place, row in enumerate(rows):
        out[place, : len(row)] = row
    return out


def _filled(values: Floats, count: int) -> Floats:
    """Values (n,) with zeros behind them."""
    return np.concatenate([values, np.zeros(count - len(values))])


@dataclass(frozen=True, eq=False)
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
        leading = _padded([one.start.leading for one in tracked], 0)
        return cls(_Stack.of([one.block for one in tracked]), tuple(tracked), rows, states, leading)

    @cached_property
    def _at_start(self) -> Ints:
        return self._ranks(self.leading)

    def levels(self, values_mhz: Floats, space: Workspace) -> tuple[Floats, Floats]:
        """Energies (blocks, labels) and derivatives (blocks, labels, parameters of the blocks)."""
        solved = self.stack.solved(values_mhz, space)
        states = self._states(solved)
        return np.take_along_axis(solved.energies, states, axis=1), self.stack.slopes(solved.vectors, states, space)

    def _states(self, solved: _Solved) -> Ints:
        """The states that have the labels now; names are made anew where a state is mostly in another sub-block, and where sub-blocks
        share one now or did so at the start: names are those of these constants, whatever the way to them was."""
        leading, shares = self.stack.leading(solved)
        moved = self._unclear_at_start | self._unclear(leading, shares)
        if (self._below & (leading != self.leading)).any():
            moved |= ((self._ranks(leading) != self._at_start) & (self.rows >= 0)).any(axis=1)
        if not moved.any():
            return self.states
        states = self.states.copy()
        for b in np.flatnonzero(moved).tolist():
            one = self.tracked[b]
            made = self.stack.names(solved, b, one.block.namer)
            states[b, : len(one.rows)] = _states_of(made, one.names)
        return states

    @cached_property
    def _unclear_at_start(self) -> NDArray[np.bool_]:
        return self._unclear(
            self.leading, np.stack([_filled(one.start.shares, self.stack.size) for one in self.tracked])
        )

    def _unclear(self, leading: Ints, shares: Floats) -> NDArray[np.bool_]:
        """Blocks (blocks,) with a labelled state whose sub-block and rank among those that lead do not make its name."""
        mostly, groups = self._follow(Follows.MOSTLY), self._follow(Follows.GROUPS)
        found = self._follow(Follows.NOTHING)
        if mostly.any():
            own = np.take_along_axis(shares, self.states, axis=1)
            found = found | (mostly & ((own < _CLEAR) & (self.rows >= 0)).any(axis=1))
        return found | (groups & self._shared(leading, shares)) if groups.any() else found

    def _follow(self, what: Follows) -> NDArray[np.bool_]:
        return np.asarray(self._follows == what.value)

    @cached_property
    def _follows(self) -> Ints:
        return np.array([one.block.follows.value for one in self.tracked])

    def _shared(self, leading: Ints, shares: Floats) -> NDArray[np.bool_]:
        """Blocks (blocks,) in which sub-blocks lead other numbers of states than they have functions, so that some states up to the
        highest with a label may be given to another one than leads."""
        sizes = self.stack.members.sum(axis=2)
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
        """The sub-blocks of the labelled states and their places by energy in these, as one number each (blocks, labels).

        What becomes of states above, such as doublets that nothing splits, has no bearing.
        """
        if self.stack.members.shape[1] == 1:
            return np.zeros_like(self.states)
        own = np.take_along_axis(leading, self.states, axis=1)
        below = np.arange(self.stack.size) < self.states[:, :, None]
        return np.asarray(own * self.stack.size + ((leading[:, None, :] == own[:, :, None]) & below).sum(axis=2))


def _counts(leading: Ints, chosen: NDArray[np.bool_], parts: int) -> Ints:
    """How many of the chosen states (blocks, size) each sub-block leads, (blocks, parts)."""
    blocks = len(leading)
    numbers = (leading + parts * np.arange(blocks)[:, None])[chosen]
    return np.bincount(numbers, minlength=blocks * parts).reshape(blocks, parts)


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
    def _space(self) -> Workspace:
        return Workspace()

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
            found, derived = one.levels(values_mhz, self._space)
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
            block = one.block._replace(parameters=columns[one.block.parameters])
            tracked.append(one._replace(block=block, rows=rows[one.rows]))
    return UnitBlocks(count, tuple(tracked))
