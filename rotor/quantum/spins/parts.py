"""The parts of a block of one F, and what its levels are called: after a sub-block, a Wang block of one state and one pattern.

Names are given one to one, the largest share first; among the levels of one sub-block Ka rises with energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.rotor import RotorBlock

_AT_A_TIME = 1000  # entries of a table of shares that are looked at together


class SpinPart(NamedTuple):
    """The states of the solved block `number` with every pattern of its N and class, pattern by pattern.

    patterns: the rows of these patterns among those of the F, which are in the order of N, then of the class.
    """

    number: int
    rotor: RotorBlock
    patterns: slice
    place: slice

    @property
    def sub_blocks(self) -> int:
        """Number of sub-blocks, Wang blocks times patterns."""
        return len(self.rotor.parts) * self.repeats

    @property
    def repeats(self) -> int:
        """Number of patterns."""
        return int(self.patterns.stop - self.patterns.start)


def named_states(rotor: RotorBlock, vectors: Floats) -> Ints:
    """v, Ka, Kc (n, 3) of states (n, n) of the rotation: of the part that has most of each, in order of energy."""
    shares = np.stack([(vectors[part.place] ** 2).sum(axis=0) for part in rotor.parts])
    of_state = assigned(shares, np.array([len(part.names) for part in rotor.parts]))
    labels = np.empty((len(of_state), 3), dtype=np.int64)
    labels[np.argsort(of_state, kind="stable")] = np.concatenate([part.names for part in rotor.parts])
    return labels


def labels_of(parts: tuple[SpinPart, ...], named: tuple[Ints, Ints], vectors: Floats) -> tuple[Ints, Floats]:
    """Names (n, 3 + pattern) of the states of a block, energies rising, and the shares of the sub-blocks that give them."""
    names, sizes = named
    labels, mixing = labels_by_shares(names[None], sizes[None], over_functions([parts], vectors[None]))
    return labels[0], mixing[0]


def labels_by_shares(names: Ints, sizes: Ints, vectors: Floats) -> tuple[Ints, Floats]:
    """Names of the states of blocks of n states each with as many sub-blocks.

    Parameters
    ----------
    names : (blocks, n, 3 + pattern) array
        Of the levels that the sub-blocks name, see `names_of_tables`.
    sizes : (blocks, sub-blocks) array
        How many each names.
    vectors : (blocks, n, n) array
        Eigenvectors in columns, over functions sub-block by sub-block.

    Returns
    -------
    labels : (blocks, n, 3 + pattern) array
        Of the states, energies rising.
    mixing : (blocks, n) array
        Shares of the sub-blocks that name them.
    """
    (count, subs), n = sizes.shape, names.shape[1]
    block = np.arange(count)[:, None]
    starts = np.cumsum(sizes, axis=1) - sizes + n * block
    shares = np.add.reduceat((vectors * vectors).reshape(count * n, n), starts.ravel(), axis=0).reshape(count, subs, n)
    of_state = assigned_alike(shares, sizes)
    labels = np.empty_like(names)
    labels[block, np.argsort(of_state, axis=1, kind="stable")] = names
    return labels, np.asarray(shares[block, of_state, np.arange(n)])


def over_functions(every: Sequence[tuple[SpinPart, ...]], vectors: Floats) -> Floats:
    """Vectors (blocks, n, n) of blocks with these parts over functions of the rotation instead of its states, where these are many."""
    if all(len(part.rotor.parts) == 1 for parts in every for part in parts):
        return vectors
    pairs = zip(every, vectors, strict=True)
    return np.stack([np.concatenate([_over_functions(part, own) for part in parts]) for parts, own in pairs])


def _over_functions(part: SpinPart, vectors: Floats) -> Floats:
    """The same of one part: by Wang blocks, then patterns; of one Wang block the states serve as well."""
    rows = vectors[part.place]
    if len(part.rotor.parts) == 1:
        return rows
    each = np.matmul(part.rotor.vectors, rows.reshape(part.repeats, len(part.rotor.energies_mhz), -1))
    return np.concatenate([each[:, own.place].reshape(-1, rows.shape[1]) for own in part.rotor.parts])


def names_of_parts(parts: Sequence[SpinPart], every: Ints) -> tuple[Ints, Ints]:
    """v, Ka, Kc and the pattern of the levels that the sub-blocks name, (functions, 3 + pattern), and how many each names."""
    return names_of_tables([(every, parts)])


def names_of_tables(tables: Sequence[tuple[Ints, Sequence[SpinPart]]]) -> tuple[Ints, Ints]:
    """The same of several tables of patterns, each with its parts."""
    found, sizes, rows, first = list[Ints](), list[int](), list[int](), 0
    for every, parts in tables:
        for part in parts:
            own, count = range(first + part.patterns.start, first + part.patterns.stop), part.repeats
            for one in part.rotor.parts:
                found += [one.names] * count
                rows += own
                sizes += [len(one.names)] * count
        first += len(every)
    out = np.empty((sum(sizes), 3 + tables[0][0].shape[1]), dtype=np.int64)
    np.concatenate(found, out=out[:, :3])
    out[:, 3:] = np.concatenate([every for every, _ in tables])[rows].repeat(sizes, axis=0)
    return out, np.array(sizes)


def assigned(shares: Floats, capacity: Ints) -> Ints:
    """Which sub-block names each state: shares (sub-blocks, states), the largest first, none beyond its capacity.

    >>> assigned(np.array([[0.9, 0.6, 0.0], [0.1, 0.4, 1.0]]), np.array([1, 2])).tolist()
    [0, 1, 1]
    """
    found = shares.argmax(axis=0)
    if (np.bincount(found, minlength=len(capacity)) == capacity).all():
        return np.asarray(found)
    return np.asarray(assigned_alike(shares[None], capacity[None])[0])


def assigned_alike(shares: Floats, capacity: Ints) -> Ints:
    """The same of blocks with as many states and sub-blocks, (blocks, states): shares (blocks, sub-blocks, states)."""
    count, subs, n = shares.shape
    first = subs * np.arange(count)[:, None]
    found = shares.argmax(axis=1)
    done = np.all(_number_of(found + first, capacity) == capacity, axis=1, keepdims=True)
    if done.all():
        return np.asarray(found)
    clear = (
        np.take_along_axis(shares, found[:, None], 1)[:, 0] > 0.5
    )  # before all others; where they fit in, they are decided
    clear |= done
    clear &= np.all(_number_of((found + first)[clear], capacity) <= capacity, axis=1, keepdims=True)
    left = capacity - _number_of((found + first)[clear], capacity)
    block, sub, state = np.nonzero((left > 0)[:, :, None] & ~clear[:, None])
    found[~clear] = -1
    decided = _largest_first(
        shares[block, sub, state], subs * block + sub, n * block + state, left.ravel(), found.ravel()
    )
    return np.asarray(np.where(clear, found, decided.reshape(count, n) - first))


def _number_of(named: Ints, like: Ints) -> Ints:
    """How often each sub-block occurs, in the shape of `like`."""
    return np.bincount(named.ravel(), minlength=like.size).reshape(like.shape)


def _largest_first(shares: Floats, subs: Ints, states: Ints, left: Ints, found: Ints) -> Ints:
    """The sub-block of each state that has none, found < 0, the largest share first while there are places left."""
    order = np.argsort(-shares, kind="stable")
    of_state, places, missing = found.tolist(), left.tolist(), int((found < 0).sum())
    for start in range(0, len(order), _AT_A_TIME):
        some = order[start : start + _AT_A_TIME]
        if start:  # many are decided before
            some = some[(np.array(of_state)[states[some]] < 0) & (np.array(places)[subs[some]] > 0)]
        for sub, state in zip(subs[some].tolist(), states[some].tolist(), strict=True):
            if of_state[state] < 0 and places[sub]:
                of_state[state], places[sub], missing = sub, places[sub] - 1, missing - 1
        if not missing:
            break
    return np.array(of_state)
