"""Parts of a block of one F, and labels of its levels.

A sub-block is a Wang block of one state v times one coupling pattern. Levels are assigned to sub-blocks, the largest weight first, until
each sub-block has as many levels as functions. Among the levels of one sub-block Ka rises with energy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, numbers_in_runs
from rotor.frozen import dataclass
from rotor.quantum.levels import SolvedBlock

_AT_A_TIME = 1000  # entries of a table of weights that are examined together


class SpinPart(NamedTuple):
    """The states of the rotational block `number` with each pattern of its N and class, pattern by pattern.

    patterns: rows of these patterns among those of the F, which are ordered by N, then class. place: rows of the part in the block.
    """

    number: int
    rotor: SolvedBlock
    patterns: slice
    place: slice

    @property
    def repeats(self) -> int:
        """Number of patterns."""
        return int(self.patterns.stop - self.patterns.start)

    def rows(self, columns: NDArray[Any]) -> NDArray[Any]:
        """The rows of the part in columns (functions of the block, n), by pattern and rotational state: (patterns, states, n)."""
        return columns[self.place].reshape(self.repeats, -1, columns.shape[1])


@dataclass(frozen=True, eq=False)
class PartColumns:
    """Parts of many blocks in columns, block after block.

    rotors: all rotational blocks. counts: number of parts of each block. numbers: rotational block of each part. first, last: rows of its
    patterns among those of the F. stops: last row of the part in the block.
    """

    rotors: Sequence[SolvedBlock]
    counts: Ints
    numbers: Ints
    first: Ints
    last: Ints
    stops: Ints

    @classmethod
    def from_parts(cls, rotors: Sequence[SolvedBlock], blocks: Sequence[Sequence[SpinPart]]) -> PartColumns:
        """The parts of these blocks."""
        rows = [(p.number, p.patterns.start, p.patterns.stop, p.place.stop) for parts in blocks for p in parts]
        counts: Ints = np.array([len(parts) for parts in blocks], dtype=np.int64)
        return cls(rotors, counts, *np.array(rows, dtype=np.int64).reshape(-1, 4).T)

    @cached_property
    def begins(self) -> Ints:
        """The first part of each block."""
        return _starts(self.counts)

    @property
    def lowest(self) -> Ints:
        """The first rotational block of each block."""
        return np.asarray(self.numbers[self.begins])

    @cached_property
    def single_states(self) -> bool:
        """Whether each rotational block is a single Wang block, or one function |N K⟩."""
        return all(len(rotor.parts) == 1 for rotor in self.rotors)

    def chosen(self, blocks: Ints) -> PartColumns:
        """The parts of some blocks."""
        _, parts = numbers_in_runs(self.counts[blocks], self.begins[blocks])
        columns = (column[parts] for column in (self.numbers, self.first, self.last, self.stops))
        return PartColumns(self.rotors, self.counts[blocks], *columns)

    def only(self, block: int) -> PartColumns:
        """The parts of a block, with its rotational blocks alone."""
        chosen = self.chosen(np.array([block]))
        numbers, places = np.unique(chosen.numbers, return_inverse=True)
        return replace(chosen, rotors=[self.rotors[number] for number in numbers.tolist()], numbers=places)

    def block_parts(self, block: int) -> tuple[SpinPart, ...]:
        """The parts of a block."""
        parts, start = list[SpinPart](), 0
        here = slice(int(self.begins[block]), int(self.begins[block] + self.counts[block]))
        columns = (column[here].tolist() for column in (self.numbers, self.first, self.last, self.stops))
        for number, first, last, stop in zip(*columns, strict=True):
            parts.append(SpinPart(number, self.rotors[number], slice(first, last), slice(start, stop)))
            start = stop
        return tuple(parts)


def named_states(rotor: SolvedBlock, vectors: Floats) -> Ints:
    """v, Ka, Kc (n, 3) of rotational states: those of the part with the largest weight, in order of energy."""
    shares = np.stack([(vectors[part.place] ** 2).sum(axis=0) for part in rotor.parts])
    part_of_state = assigned(shares, np.array([len(part.names) for part in rotor.parts]))
    labels = np.empty((len(part_of_state), 3), dtype=np.int64)
    labels[np.argsort(part_of_state, kind="stable")] = np.concatenate([part.names for part in rotor.parts])
    return labels


def labels_by_shares(names: Ints, sizes: Ints, vectors: Floats) -> tuple[Ints, Floats]:
    """Labels (blocks, n, 3 + pattern) of the states by rising energy, and weights (blocks, n) of the sub-blocks that give them.

    names, sizes: labels of the levels sub-block by sub-block, and how many each has (`names_of_parts`). vectors: eigenvectors in columns
    (blocks, n, n) over functions sub-block by sub-block.
    """
    (count, subs), n = sizes.shape, names.shape[1]
    block = np.arange(count)[:, None]
    starts = np.cumsum(sizes, axis=1) - sizes + n * block
    weights = (vectors * vectors.conj()).real
    shares = np.add.reduceat(weights.reshape(count * n, n), starts.ravel(), axis=0).reshape(count, subs, n)
    sub_block_of_state = assigned_alike(shares, sizes)
    labels = np.empty_like(names)
    labels[block, np.argsort(sub_block_of_state, axis=1, kind="stable")] = names
    return labels, np.asarray(shares[block, sub_block_of_state, np.arange(n)])


def over_functions(columns: PartColumns, blocks: Sequence[int], vectors: Floats) -> Floats:
    """Vectors (blocks, n, n) over functions by sub-block; unchanged if each rotational state belongs to one Wang block anyway."""
    if columns.single_states:
        return vectors
    out = np.empty_like(vectors)
    for place, block in enumerate(blocks):
        parts, of_block = columns.block_parts(block), vectors[place]
        if parts[0].rotor.moments is None:  # states of a species are functions by themselves
            of_block = turned(parts, of_block, {part.number: part.rotor.vectors for part in parts})
        out[place] = of_block[functions_by_sub_block(parts)]
    return out


def turned(parts: Sequence[SpinPart], columns: Floats, matrices: Mapping[int, Floats]) -> Floats:
    """Columns (functions of a block, n), each part of which is multiplied by the matrix of its rotational block."""
    return np.concatenate(
        [np.matmul(matrices[part.number], part.rows(columns)).reshape(-1, columns.shape[1]) for part in parts]
    )


def functions_by_sub_block(parts: Sequence[SpinPart]) -> Ints:
    """Places of the functions of a block sub-block by sub-block."""
    pieces = list[Ints]()
    for part in parts:
        functions = np.arange(part.place.start, part.place.stop).reshape(part.repeats, -1)
        pieces += [functions[:, wang_part.place].ravel() for wang_part in part.rotor.parts]
    return np.concatenate(pieces)


class Names(NamedTuple):
    """Labels v, Ka, Kc, pattern of levels (functions, 3 + pattern), sub-block by sub-block.

    sizes: number of levels of each sub-block. sub_blocks: number of sub-blocks of each part.
    """

    labels: Ints
    sizes: Ints
    sub_blocks: Ints


def names_of_parts(columns: PartColumns, patterns: Ints, first_rows: Ints | int = 0) -> Names:
    """Labels of the levels of parts, whose patterns count from the first row of their F in a table of patterns."""
    wang_names = [[wang_part.names for wang_part in rotor.parts] for rotor in columns.rotors]
    rotor, repeats, rows = columns.numbers, columns.last - columns.first, columns.first + first_rows

    counts: Ints = np.array([len(names) for names in wang_names])  # Wang blocks of each rotational block
    part, wang_part = numbers_in_runs(counts[rotor], _starts(counts)[rotor])
    of_part, row = numbers_in_runs(repeats[part], rows[part])
    wang_part = wang_part[of_part]
    names = [of_wang_part for of_rotor in wang_names for of_wang_part in of_rotor]
    lengths = np.array([len(of_wang_part) for of_wang_part in names])
    sub_block, name = numbers_in_runs(lengths[wang_part], _starts(lengths)[wang_part])
    labels = np.empty((len(name), 3 + patterns.shape[1]), dtype=np.int64)
    labels[:, :3] = np.concatenate(names)[name]
    labels[:, 3:] = patterns[row[sub_block]]
    return Names(labels, lengths[wang_part], counts[rotor] * repeats)


def _starts(counts: Ints) -> Ints:
    """The first place of each run of these counts."""
    return np.asarray(np.cumsum(counts) - counts)


def assigned(shares: Floats, capacity: Ints) -> Ints:
    """The sub-block of each state: largest shares (sub-blocks, states) first, none beyond its capacity.

    >>> assigned(np.array([[0.9, 0.6, 0.0], [0.1, 0.4, 1.0]]), np.array([1, 2])).tolist()
    [0, 1, 1]
    """
    return np.asarray(assigned_alike(shares[None], capacity[None])[0])


def assigned_alike(shares: Floats, capacity: Ints) -> Ints:
    """The sub-block of each state (blocks, states) in blocks of equal size, from shares (blocks, sub-blocks, states)."""
    count, subs, n = shares.shape
    first = subs * np.arange(count)[:, None]
    dominant = shares.argmax(axis=1)
    done = np.all(_number_of(dominant + first, capacity) == capacity, axis=1, keepdims=True)
    if done.all():
        return np.asarray(dominant)
    # a share above ½ precedes all others of its state: where all of these fit the capacities, they are final
    clear = np.take_along_axis(shares, dominant[:, None], 1)[:, 0] > 0.5
    clear |= done
    clear &= np.all(_number_of((dominant + first)[clear], capacity) <= capacity, axis=1, keepdims=True)
    left = capacity - _number_of((dominant + first)[clear], capacity)
    block, sub, state = np.nonzero((left > 0)[:, :, None] & ~clear[:, None])
    dominant[~clear] = -1
    decided = _largest_first(
        shares[block, sub, state], subs * block + sub, n * block + state, left.ravel(), dominant.ravel()
    )
    return np.asarray(np.where(clear, dominant, decided.reshape(count, n) - first))


def _number_of(named: Ints, like: Ints) -> Ints:
    """Number of occurrences of each sub-block, in the shape of `like`."""
    return np.bincount(named.ravel(), minlength=like.size).reshape(like.shape)


def _largest_first(shares: Floats, subs: Ints, states: Ints, left: Ints, assignment: Ints) -> Ints:
    """Assign a sub-block to each state without one (negative), the largest share first while capacities last."""
    order = np.argsort(-shares, kind="stable")
    sub_block_of_state, places, missing = assignment.tolist(), left.tolist(), int((assignment < 0).sum())
    for start in range(0, len(order), _AT_A_TIME):
        batch = order[start : start + _AT_A_TIME]
        if start:  # most states are assigned by then
            batch = batch[(np.array(sub_block_of_state)[states[batch]] < 0) & (np.array(places)[subs[batch]] > 0)]
        for sub, state in zip(subs[batch].tolist(), states[batch].tolist(), strict=True):
            if sub_block_of_state[state] < 0 and places[sub]:
                sub_block_of_state[state], places[sub], missing = sub, places[sub] - 1, missing - 1
        if not missing:
            break
    return np.array(sub_block_of_state)
