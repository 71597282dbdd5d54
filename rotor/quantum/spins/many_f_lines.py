"""Reduced elements of moments and molecule-fixed tensors between levels with spins, of many F at once (see `many_f`).

The element of an electric moment, which does not act on spins, is that of the rotation times a product of 6j symbols,

    ⟨r' p'‖T^K‖r p⟩ = t(p', p) ⟨r'‖T^K‖r⟩.

The magnetic moment of a spin S contains T^0 or T² of the rotation in place of a vector; with L the rank,

    ⟨p'‖[T^L x S]^1‖p⟩ = m(p', p) ⟨N'‖T^L‖N⟩,     Σ_q T²_pq S_q = -√(5/3) [T² x S]^1_p

(A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.5; the factor, and t and m, as in `coupling.ChainOperator`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Indices, Ints, Workspace, runs_of_similar_size
from rotor.frozen import dataclass
from rotor.quantum.effect import Moment
from rotor.quantum.levels import Connections, Levels, SolvedBlock
from rotor.quantum.operators.tensors import Tensors, rank_of
from rotor.quantum.spins.blocks import Shared
from rotor.quantum.spins.contraction import Contracted, pieces_in_both_orders, tensors_of_stacks
from rotor.quantum.spins.coupling import ChainOperator
from rotor.quantum.spins.many_f import (
    Between,
    Coefficients,
    Frame,
    Group,
    Tables,
    are_connected,
    between,
    coefficients_by_f,
    element_type,
    tables_of,
    write_between,
)
from rotor.quantum.spins.pattern_tables import column_tensors, tensors_by_f
from rotor.quantum.spins.rotor import Piece
from rotor.quantum.spins.scheme import Cosines, Scheme

# ratio of sizes of blocks in one array, sizes that all share one, most numbers in it
_LIKE, _SMALL, _MOST = 1.5, 24, 1 << 20
_LARGE = 20_000  # elements of a block whose columns are multiplied one kind after another
_IN_CACHE = 1 << 18  # most numbers in the vectors of a run of blocks: 2 MB
_IN_MEMORY = 1 << 22  # most numbers in the vectors of a group that lie side by side: 32 MB


Operator = Callable[[slice, NDArray[Any], NDArray[Any]], NDArray[Any]]
"""Elements V' X V (blocks, n', n) of a run of its blocks between vectors (blocks, columns, states, n)."""


Near = Callable[[Indices, Indices], NDArray[np.bool_]]
"""Whether lines between rows (blocks, n') and (blocks, n) are needed, as (blocks, n', n)."""


ActingMoment = tuple[Tables, ChainOperator]
"""Elements of the rotation, and what acts on the spins."""


class Moments(NamedTuple):
    """Moments of one rank; those of an inner sequence interfere, squares of the sums are added."""

    rank: int
    sums: Sequence[Sequence[ActingMoment]]


class Rows(NamedTuple):
    """Amplitudes (blocks, n_up, n_low) between blocks of two groups, and rows (blocks, states) of their levels.

    Rows beyond a block are `len(levels)`, which is no level. alike: whether each block is taken with itself.
    """

    up: Indices
    low: Indices
    amplitudes: NDArray[Any]
    alike: bool


@dataclass(frozen=True, eq=False)
class GroupStates:
    """Solved blocks of a group by rising row. rows: of the levels, (blocks, states)."""

    group: Group
    blocks: list[SolvedBlock]
    rows: Indices

    @cached_property
    def places(self) -> dict[int, int]:
        """Number of each block by doubled row."""
        return {block.spins.twice_row: place for place, block in enumerate(self.blocks)}

    @cached_property
    def sizes(self) -> Ints:
        """Number of states of each block."""
        return np.array([len(block.energies_mhz) for block in self.blocks])

    @cached_property
    def in_group(self) -> Ints:
        """Number of each block in the group."""
        return np.array([self.group.places[row] for row in self.places])

    @cached_property
    def heights(self) -> Ints:
        """The largest number of states of a rotational block, for each block."""
        return self.group.heights[self.in_group]

    def runs(self) -> Iterator[tuple[Ints, NDArray[Any], Indices]]:
        """Numbers in the group, vectors and rows of the levels of blocks of similar size."""
        for run in runs_of_similar_size(self.sizes.tolist(), _LIKE, _SMALL, _IN_CACHE):
            vectors = self.vectors(np.arange(run.start, run.stop))
            yield self.in_group[run], vectors, self.rows[run, : vectors.shape[3]]

    def vectors(self, places: Ints) -> NDArray[Any]:
        """Vectors (blocks, columns, rotational states, states) of some blocks."""
        if self._whole is None:
            return self._scattered(places)
        first, last = int(places[0]), int(places[-1])  # they rise
        chosen = slice(first, last + 1) if last - first == len(places) - 1 else places
        return self._whole[chosen, :, : self.heights[chosen].max(), : self.sizes[chosen].max()]

    @cached_property
    def _whole(self) -> NDArray[Any] | None:
        """Vectors of all blocks; None where they are large."""
        numbers = len(self.blocks) * self.group.columns * self.heights.max() * self.sizes.max()
        return self._scattered(np.arange(len(self.blocks))) if numbers <= _IN_MEMORY else None

    def _scattered(self, places: Ints) -> NDArray[Any]:
        """Vectors of some blocks over the functions of the group."""
        in_group, sizes = self.in_group[places], self.sizes[places]
        shape = len(places), self.group.columns, self.heights[places].max(), sizes.max()
        vectors = np.zeros(shape, dtype=self.blocks[0].vectors.dtype)
        kinds = [self.blocks[place].vectors.shape for place in places.tolist()]
        for at, columns, states in self.group.alike(in_group, kinds):
            of_kind = np.concatenate([self.blocks[place].vectors for place in places[at].tolist()])
            count = of_kind.shape[1]
            vectors[at[:, None], columns, states, :count] = of_kind.reshape(len(at), -1, count)
        return vectors


def tensor_moments(shared: Shared, tensors: Tensors) -> Moments:
    """A tensor of the molecule by pairs of states."""
    rank = rank_of(tensors)
    elements = tensors_of_stacks(shared.stacks, tensors, shared.representation)
    return Moments(rank, [[(tables_of(elements, shared.frame), ChainOperator((), rank, scalar=False))]])


def spin_moments(shared: Shared, moments: Sequence[Moment]) -> Moments:
    """Moments between levels with spins; electric and magnetic, real and imaginary ones do not interfere."""
    kinds: dict[tuple[bool, bool], list[ActingMoment]] = {}
    for moment in moments:
        piece = Piece(moment.value_debye, moment.rotor, *moment.states, 0, 0)
        elements = pieces_in_both_orders(shared.stacks, [piece], moment.conjugate_sign, shared.representation)
        place = (shared.scheme.place(moment.spin),) if moment.spin else ()
        acting = ChainOperator(place, moment.rotor.rank, scalar=False)
        tables = tables_of(elements, shared.frame)
        kinds.setdefault((moment.electric, moment.imaginary), []).append((tables, acting))
    return Moments(1, list(kinds.values()))


def moments_of(
    levels: Levels, dipoles: dict[tuple[int, int], tuple[float, float, float]], moments: Sequence[Moment]
) -> Moments:
    """Dipoles by pairs of states and other moments, for levels with spins; ValueError for levels without."""
    if not levels.blocks or levels.blocks[0].spins is None:
        raise ValueError("moments besides plain dipoles need levels that were solved with spins")
    plain = [Moment(1.0, states, Cosines(along)) for states, along in dipoles.items() if any(along)]
    others = [moment for moment in moments if moment.value_debye]
    return spin_moments(levels.blocks[0].spins.shared, plain + others)


def amplitudes_of_groups(
    blocks: Sequence[SolvedBlock], moments: Moments, levels: int, both_orders: bool = False, near: Near | None = None
) -> Iterator[Rows]:
    """Reduced elements between all blocks, many at a time, each pair of blocks once; `levels` is the row of padding.

    Amplitudes are zero beyond a block, complex where those of the rotation are. both_orders: pairs of blocks of one F occur in both orders.
    near: elements of states without a line that is needed are left out.
    """
    shared = blocks[0].spins.shared
    frame = shared.frame
    groups = groups_of_blocks(blocks, levels)
    spaces = [Workspace() for _ in moments.sums]
    rises_of_k = range(-moments.rank, moments.rank + 1) if shared.axial else range(1)
    for rise, rise_of_k, (place, low) in product(range(0, 2 * moments.rank + 1, 2), rises_of_k, enumerate(groups)):
        if rise or both_orders or rise_of_k >= 0:
            for up in groups if rise or both_orders or rise_of_k else groups[place:]:
                yield from _between(up, low, rise, rise + 2 * frame.count * rise_of_k, moments, shared, spaces, near)


def connections_of(blocks: Sequence[SolvedBlock], moments: Moments) -> Connections:
    """The pairs of blocks that moments connect, the higher F first, and the function that returns their reduced elements (n_up, n_low)."""
    block_at, count = {block.start: block for block in blocks}, blocks[-1].start + len(blocks[-1].energies_mhz)
    elements: dict[tuple[int, int], NDArray[Any]] = {}
    for rows in amplitudes_of_groups(blocks, moments, count, both_orders=True):
        acting = np.flatnonzero(rows.amplitudes.any(axis=(1, 2)))
        starts = zip(rows.up[acting, 0].tolist(), rows.low[acting, 0].tolist(), strict=True)
        for place, (up, low) in zip(acting.tolist(), starts, strict=True):
            first, second = block_at[up], block_at[low]
            if up >= low or first.twice_total > second.twice_total:
                sizes = len(first.energies_mhz), len(second.energies_mhz)
                elements[up, low] = rows.amplitudes[place, : sizes[0], : sizes[1]].copy()
    return _connections(block_at, elements)


def connections_of_stacks(blocks: Sequence[SolvedBlock], contracted: Sequence[Contracted]) -> Connections:
    """The pairs of blocks of the rotation between which an operator has elements, and the function that returns these."""
    elements: dict[tuple[int, int], NDArray[Any]] = {}
    for up, low, pairs, matrices in contracted:
        for matrix, a, b in zip(matrices, pairs.up.tolist(), pairs.low.tolist(), strict=True):
            if matrix.any():
                elements[up.blocks[a].start, low.blocks[b].start] = matrix[: up.sizes[a], : low.sizes[b]]
    return _connections({block.start: block for block in blocks}, elements)


def _connections(block_at: Mapping[int, SolvedBlock], elements: Mapping[tuple[int, int], NDArray[Any]]) -> Connections:
    """The pairs and the function of elements by the rows at which both blocks start."""
    pairs = [(block_at[up], block_at[low]) for up, low in sorted(elements, key=lambda pair: pair[::-1])]
    return pairs, partial(_between_blocks, elements)


def _between_blocks(
    elements: Mapping[tuple[int, int], NDArray[Any]], up: SolvedBlock, low: SolvedBlock
) -> NDArray[Any]:
    """Elements between two blocks."""
    return elements[up.start, low.start]


def groups_of_blocks(blocks: Sequence[SolvedBlock], levels: int) -> list[GroupStates]:
    """The groups in which blocks were solved with these blocks; levels: the row of padding."""
    members: dict[int, list[SolvedBlock]] = {}
    for block in sorted(blocks, key=lambda block: block.spins.twice_row):
        members.setdefault(id(block.spins.group), []).append(block)
    return [_states_of_group(alike, levels) for alike in members.values()]


def _states_of_group(blocks: list[SolvedBlock], levels: int) -> GroupStates:
    """Blocks of one group by rising row."""
    sizes = np.array([len(block.energies_mhz) for block in blocks])
    starts, numbers = np.array([block.start for block in blocks], dtype=np.int32), np.arange(max(sizes), dtype=np.int32)
    rows = np.where(numbers < sizes[:, None], starts[:, None] + numbers, np.int32(levels))
    return GroupStates(blocks[0].spins.group, blocks, rows)


def _between(
    up: GroupStates, low: GroupStates, rise: int, step: int, moments: Moments, shared: Shared,
    spaces: Sequence[Workspace], near: Near | None,
) -> Iterator[Rows]:  # fmt: skip
    """Elements between two groups, whose doubled F differ by `rise` and doubled rows by `step`; spaces: for each sum of moments."""
    frame = shared.frame
    chosen = [row for row in low.places if row + step in up.places]
    chosen = [row for row in chosen if 2 * low.blocks[low.places[row]].spins.twice_f + rise >= 2 * moments.rank]
    sums = [
        [
            (tables, _coefficients(shared.scheme, frame, moment, rise))
            for tables, moment in interfering
            if are_connected(up.group, low.group, step, tables)
        ]
        for interfering in moments.sums
    ]
    if not chosen or not any(sums):
        return
    lefts = np.array([up.places[row + step] for row in chosen])
    rights = np.array([low.places[row] for row in chosen])
    states = int(up.heights[lefts].max()), int(low.heights[rights].max())
    at_once = max(1, _MOST // (up.group.columns * states[0] * low.group.columns * states[1]))
    for first in range(0, len(chosen), at_once):
        left, right = lefts[first : first + at_once], rights[first : first + at_once]
        operators = [
            _operator(up.group, low.group, low.in_group[right], step, terms, frame, states, space)
            for terms, space in zip(sums, spaces, strict=True)
            if terms
        ]
        for run in runs_of_similar_size(low.sizes[right].tolist(), _LIKE, _SMALL, _MOST):
            bra, ket = up.vectors(left[run]), low.vectors(right[run])
            up_rows, low_rows = up.rows[left[run], : bra.shape[3]], low.rows[right[run], : ket.shape[3]]
            if near is not None:
                needed = near(up_rows, low_rows)
                bra, up_rows = _states_with_lines(bra, up_rows, np.asarray(needed.any(axis=2)))
                ket, low_rows = _states_with_lines(ket, low_rows, np.asarray(needed.any(axis=1)))
            each = [operator(run, bra, ket) for operator in operators] if up_rows.size and low_rows.size else []
            if not each:
                continue
            amplitudes = each[0] if len(each) == 1 else np.sqrt(sum(elements**2 for elements in each))
            yield Rows(up_rows, low_rows, amplitudes, up is low and not step)


def _states_with_lines(vectors: NDArray[Any], rows: Indices, needed: NDArray[np.bool_]) -> tuple[NDArray[Any], Indices]:
    """Vectors (blocks, columns, states, n) and rows (blocks, n) of the needed states, and of others up to the largest number of a block."""
    most = int(needed.sum(axis=1).max())
    if 2 * most > needed.shape[1]:  # a copy would not be worth it
        return vectors, rows
    chosen = np.sort(np.argsort(~needed, axis=1, kind="stable")[:, :most], axis=1)
    return np.take_along_axis(vectors, chosen[:, None, None], axis=3), np.take_along_axis(rows, chosen, axis=1)


def _coefficients(scheme: Scheme, frame: Frame, moment: ChainOperator, rise: int) -> Coefficients:
    """Coefficients of a moment from each doubled F to F + rise: of all patterns, or of each pair of groups where these are many."""
    arguments = scheme, moment, rise, frame.twice_f[0], frame.twice_f[-1]
    if scheme.equivalent or len(frame.twice_f) * len(frame.n_patterns) ** 2 <= _IN_MEMORY:
        return coefficients_by_f(tensors_by_f(*arguments), frame)
    return lambda twice_f: partial(column_tensors, *arguments, twice_f)


def _operator(
    up: Group, low: Group, chosen: Ints, step: int, terms: Sequence[tuple[Tables, Coefficients]], frame: Frame,
    states: tuple[int, int], space: Workspace,
) -> Operator:  # fmt: skip
    """Σ c ⟨r'‖X‖r⟩ of the terms between blocks `chosen` of a group and those of another; states: most states' and states."""
    acting = [each for term in terms for each in between(up, low, chosen, step, *term, frame, states)]
    if up.columns * states[0] * low.columns * states[1] >= _LARGE:  # most columns are not connected
        return partial(_by_columns, acting, space)
    shape = len(chosen), up.columns, states[0], low.columns, states[1]
    whole = space.array("whole", *shape, dtype=element_type(tables for tables, _ in terms))
    write_between(acting, whole)
    return partial(_by_matrices, whole)


def _by_matrices(whole: NDArray[Any], run: slice, bra: NDArray[Any], ket: NDArray[Any]) -> NDArray[Any]:
    """V' X V of matrices (blocks, columns', states', columns, states)."""
    matrices = whole[run, :, : bra.shape[2], :, : ket.shape[2]]
    up, low = (vectors.reshape(len(vectors), -1, vectors.shape[3]) for vectors in (bra, ket))
    moved = np.matmul(matrices.reshape(len(up), up.shape[1], low.shape[1]), low)
    return np.asarray(np.matmul(up.conj().transpose(0, 2, 1), moved))


def _by_columns(
    acting: Sequence[Between], space: Workspace, run: slice, bra: NDArray[Any], ket: NDArray[Any]
) -> NDArray[Any]:
    """V' X V, one kind of columns after another: X of the rotation times vectors, then coefficients, then V'."""
    (count, columns, height, _), (_, _, most, n_low) = bra.shape, ket.shape
    kind = np.result_type(ket, *{each.elements.dtype for each in acting})
    moved = space.array("moved", count, columns, height, n_low, dtype=kind)
    moved.fill(0.0)
    for each in acting:
        of_run = each._replace(elements=each.elements[run, :height, :most], coefficients=each.coefficients[run])
        moved[:, each.left.columns, : of_run.elements.shape[1]] += of_run.times(ket)
    in_blocks = bra.any(axis=(0, 3))
    return np.asarray(np.matmul(bra[:, in_blocks].conj().transpose(0, 2, 1), moved[:, in_blocks]))
