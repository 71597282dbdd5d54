"""Operators of the rotation contracted to the eigenstates of many solved blocks at once.

Blocks that have the same states v and kinds of Wang functions, and differ only in N, form a stack, padded with zeros to one shape.
Elements between two stacks with a fixed N' - N are one array, computed for all N by the formulas of `tensors` and `operators` and
contracted by one matrix product. Functions |N K⟩ of axial tops, K a good quantum number, are blocks of one function; those of a state v
are one stack. States of a species of internal rotation bring their elements along (`TorsionMoments`), which may be complex.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, numbers_in_runs, runs_of_similar_size
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.operators.tensors import Tensors, rank_of
from rotor.quantum.spins.rotor import Piece, acts
from rotor.quantum.spins.scheme import AxialState, Fixed, Rotor
from rotor.quantum.spins.stack_elements import Pairs, Section, both_signs, rotor_elements
from rotor.quantum.wang.basis import WangBlock

_REACH, _RISES_OF_K = 2, range(-2, 3)  # largest differences of N and of K that an operator connects
_LIKE, _SMALL = 1.5, 16  # largest ratio of sizes of blocks that share a stack, and sizes that all do


class Stack(NamedTuple):
    """Solved blocks of rising N with the same states and kinds of Wang functions.

    kind: number of this combination. numbers, n, sizes: number, N and states of each block. k: K of functions |N K⟩, None for other
    functions. vectors: (blocks, rows, states), zero beyond a block; None where functions take the place of eigenstates, and for species,
    which have no sections. single: blocks that are contracted one by one.
    """

    kind: int
    numbers: Ints
    n: Ints
    k: Ints | None
    sections: tuple[Section, ...]
    vectors: Floats | None
    sizes: list[int]
    blocks: list[SolvedBlock]
    single: list[bool]

    @property
    def is_species(self) -> bool:
        """Whether the blocks are states of a species of internal rotation."""
        return self.blocks[0].moments is not None

    @property
    def places(self) -> tuple[Ints, Ints]:
        """Block and place in it of each state."""
        return numbers_in_runs(np.array(self.sizes))


Element = tuple[Section, Section, Floats]
"""Elements (pairs, functions', functions) between two sections."""


class Contracted(NamedTuple):
    """Elements between the states of pairs of blocks of two stacks: (pairs, states', states), zero beyond a block."""

    up: Stack
    low: Stack
    pairs: Pairs
    matrices: NDArray[Any]

    def turned(self, sign: float) -> Contracted:
        """The adjoint elements times a sign, from the second stack to the first."""
        return Contracted(self.low, self.up, self.pairs.turned(), sign * self.matrices.conj().transpose(0, 2, 1))


def stacks_of(blocks: Sequence[SolvedBlock], contract: bool = True) -> list[Stack]:
    """Stacks of blocks with the same states v and kinds of Wang functions (for |N K⟩ the same v) and similar size.

    contract: False for stacks of functions, one for each kind.
    """
    alike: dict[Any, list[int]] = {}
    for number, kind in enumerate(_kinds(blocks)):
        alike.setdefault(kind, []).append(number)
    stacks, all_n = list[Stack](), np.array([block.j for block in blocks])
    for place, members in enumerate(alike.values()):
        rising: Ints = np.array(members)
        rising = rising[np.argsort(all_n[rising], kind="stable")]
        sizes = [len(blocks[number].energies_mhz) for number in rising.tolist()]
        whole = not contract or blocks[members[0]].moments is not None  # tables of species have one size anyway
        runs = [slice(None)] if whole else runs_of_similar_size(sizes, _LIKE, _SMALL)
        stacks += [_stack(blocks, place, rising[run], all_n[rising[run]], sizes[run], contract) for run in runs]
    return stacks


def _kinds(blocks: Sequence[SolvedBlock]) -> Iterator[Any]:
    """The state v of each block of |N K⟩; states v, first K and sign of Wang functions; the place of a block of a species."""
    for block in blocks:
        basis = block.parts[0].basis
        if isinstance(basis, WangBlock):
            yield tuple([(part.v, part.basis.first_k, part.basis.sign) for part in block.parts])
        else:
            yield block.parts[0].v if block.moments is None else (id(block.moments), basis.place)


def _stack(blocks: Sequence[SolvedBlock], kind: int, numbers: Ints, n: Ints, sizes: list[int], contract: bool) -> Stack:
    """The stack of these blocks."""
    members = [blocks[number] for number in numbers.tolist()]
    if members[0].moments is not None:
        return Stack(kind, numbers, n, None, (), None, sizes, members, [False] * len(members))
    sections, start = list[Section](), 0
    for parts in zip(*(block.parts for block in members), strict=True):
        largest = max((part.basis for part in parts), key=lambda basis: basis.size)
        sections.append(Section(parts[0].v, largest, slice(start, start + largest.size), parts))
        start += largest.size
    if isinstance(sections[0].basis, AxialState):
        k, single = np.array([part.basis.axial_k for part in sections[0].parts]), [False] * len(members)
        vectors = np.ones((len(members), 1, 1)) if contract else None
        return Stack(kind, numbers, n, k, tuple(sections), vectors, sizes, members, single)
    single = [
        size == 1 or any(part.basis.size == 1 for part in block.parts)
        for size, block in zip(sizes, members, strict=True)
    ]
    vectors = padded_vectors(members, sections, sizes) if contract else None
    return Stack(kind, numbers, n, None, tuple(sections), vectors, sizes, members, single)


def padded_vectors(members: Sequence[SolvedBlock], sections: Sequence[Section], sizes: Sequence[int]) -> Floats:
    """Vectors of the blocks of a stack (blocks, rows, states), zero beyond a block."""
    rows = sections[-1].rows.stop
    if min(sizes) == rows:
        return np.concatenate([block.vectors for block in members]).reshape(len(members), rows, rows)
    vectors = np.zeros((len(members), rows, max(sizes)))
    for place, (block, states) in enumerate(zip(members, sizes, strict=True)):
        for part, section in zip(block.parts, sections, strict=True):
            first = section.rows.start
            vectors[place, first : first + part.basis.size, :states] = block.vectors[part.place]
    return vectors


def operators_of_stacks(
    stacks: Sequence[Stack], reach: int, operators: Sequence[Sequence[Piece]], representation: str
) -> list[list[Contracted]]:
    """Σ value ⟨r'‖X‖r⟩ (MHz) of operators, sums of pieces without the conjugates of those between different states, by operator.

    Between blocks whose N differ by at most `reach`, each pair once, the higher number first: c(p', p) = (-1)^(N'-N) c(p, p').
    """
    if stacks[0].is_species:
        return [list(_between_species(stacks, reach, pieces)) for pieces in operators]
    out: list[list[Contracted]] = [[] for _ in operators]
    for up, low, pairs in _near(stacks, reach):
        forward, back = _Pieces(up, low, pairs, representation), _Pieces(low, up, pairs.turned(), representation)
        for contracted, pieces in zip(out, operators, strict=True):
            elements = _with_conjugates(forward, back, pieces, (-1.0) ** pairs.rise)
            if elements is not None:
                contracted.append(elements)
    return out


def pieces_in_both_orders(
    stacks: Sequence[Stack], pieces: Sequence[Piece], sign: float | None, representation: str
) -> list[Contracted]:
    """Σ value ⟨r'‖X‖r⟩ of pieces of one rank between blocks for both orders of each pair, which are squared for both signs of K of |N K⟩.

    sign: the conjugates of pieces between different states are added, this times (-1)^(N'-N) times the transpose; None where the pieces
    contain them. Within a state an operator may be anti-Hermitian, as [N², φ]: each order has its own elements. A block with itself occurs
    in both orders; the last entry counts.
    """
    axial, out = stacks[0].k is not None, list[Contracted]()
    hermitian = all(piece.bra != piece.ket or isinstance(piece.rotor, Fixed) for piece in pieces)
    for up, low, pairs in _near(stacks, min(pieces[0].rotor.rank, _REACH), _RISES_OF_K if axial else range(1)):
        orders = _Pieces(up, low, pairs, representation), _Pieces(low, up, pairs.turned(), representation)
        phase = None if sign is None else sign * (-1.0) ** pairs.rise
        forward = _with_conjugates(*orders, pieces, phase)
        if phase is None or axial or not hermitian:
            back = _with_conjugates(*orders[::-1], pieces, phase)
        else:
            back = None if forward is None else forward.turned(phase)
        each = [elements for elements in (back, forward) if elements is not None]
        out += [e._replace(matrices=e.matrices * both_signs(pairs)) for e in each] if axial else each
    return out


def _with_conjugates(forward: _Pieces, back: _Pieces, pieces: Sequence[Piece], sign: float | None) -> Contracted | None:
    """The sum of pieces and of the conjugates of those between different states: `sign` times the transpose of `back`, none for None."""
    elements = forward.contracted(pieces)
    between = [piece for piece in pieces if sign is not None and piece.bra != piece.ket]
    others = back.contracted(between) if between else None
    if others is None or sign is None:
        return elements
    turned = others.turned(sign)
    return turned if elements is None else elements._replace(matrices=elements.matrices + turned.matrices)


def tensors_of_stacks(stacks: Sequence[Stack], tensors: Tensors, representation: str) -> list[Contracted]:
    """⟨r'‖T‖r⟩ between blocks for both orders of each pair, of tensors of one rank by pairs of states.

    Those between two states may change their sign with the order of the states.
    """
    rank = rank_of(tensors)
    if stacks[0].is_species:
        one_component = _between_species(stacks, rank, [Piece(1.0, Fixed(tensors[0, 0]), 0, 0, 0, 0)])
        forth = [e._replace(matrices=np.sqrt(e.up.blocks[0].components) * e.matrices) for e in one_component]
        return [e.turned((-1.0) ** (e.pairs.rise + rank * e.up.blocks[0].combined)) for e in forth] + forth
    both = {(w, v): tensor for (v, w), tensor in tensors.items()} | dict(tensors)
    alike = all(both[w, v] == tensor for (v, w), tensor in both.items())
    pieces = [Piece(1.0, Fixed(tensor), v, w, 0, 0) for (v, w), tensor in both.items() if v >= w or not alike]
    return pieces_in_both_orders(stacks, pieces, (-1.0) ** rank if alike else None, representation)


def _between_species(stacks: Sequence[Stack], reach: int, pieces: Sequence[Piece]) -> Iterator[Contracted]:
    """Elements between states of species whose N differ by at most `reach`, each pair of blocks once, the higher number first."""
    for up, low, pairs in _near(stacks, reach):
        moments = up.blocks[0].moments
        if moments is None or moments is not low.blocks[0].moments:
            continue
        operators = [(piece.value, moments.beside_spins(piece.rotor)) for piece in pieces]
        acting = [
            (place, value * block)
            for place, (a, b) in enumerate(zip(pairs.up.tolist(), pairs.low.tolist(), strict=True))
            for value, elements in operators
            if (block := elements(up.blocks[a], low.blocks[b])) is not None
        ]
        if acting:
            shape = len(pairs.up), max(up.sizes), max(low.sizes)
            matrices = np.zeros(shape, dtype=np.result_type(*{block.dtype for _, block in acting}))
            for place, block in acting:
                matrices[place, : block.shape[0], : block.shape[1]] += block
            yield Contracted(up, low, pairs, matrices)


def within_blocks(stack: Stack, matrices: Sequence[Floats]) -> Contracted:
    """An operator within the blocks of a stack, from its matrices by number."""
    places = np.arange(len(stack.numbers))
    out = np.zeros((len(places), max(stack.sizes), max(stack.sizes)))
    for place, (number, size) in enumerate(zip(stack.numbers.tolist(), stack.sizes, strict=True)):
        out[place, :size, :size] = matrices[number]
    return Contracted(stack, stack, Pairs(places, places, stack.n[:, None], stack.n[:, None]), out)


def _near(
    stacks: Sequence[Stack], reach: int, rises_of_k: Sequence[int] = (0,)
) -> Iterator[tuple[Stack, Stack, Pairs]]:
    """Pairs of stacks with the pairs of their blocks whose N differ by at most `reach`, and K of |N K⟩ by one of `rises_of_k`."""
    for up, low, rise, rise_of_k in product(stacks, stacks, range(reach + 1), rises_of_k):
        pairs = _pairs(up, low, rise, rise_of_k)
        if len(pairs.up):
            yield up, low, pairs


def _pairs(up: Stack, low: Stack, rise: int, rise_of_k: int) -> Pairs:
    """The blocks with N' - N = rise; for equal N, those whose first number is not below the second."""
    if up.k is not None and low.k is not None:
        width = 1 + max(int(up.k.max()), int(low.k.max())) + abs(rise_of_k)
        rows_up, rows = up.n * width + up.k, (low.n + rise) * width + low.k + rise_of_k
        _, a, b = np.intersect1d(rows_up, rows, assume_unique=True, return_indices=True)
    else:
        a, b = _alike(up.n, low.n + rise)
    if not rise and up is not low:
        ordered = up.numbers[a] > low.numbers[b]
        a, b = a[ordered], b[ordered]
    k = None if up.k is None or low.k is None else (up.k[a], low.k[b])
    return Pairs(a, b, up.n[a][:, None], low.n[b][:, None], k)


def _alike(left: Ints, right: Ints) -> tuple[Ints, Ints]:
    """Positions in two rising arrays of their common numbers."""
    first, last = max(left[0], right[0]), min(left[-1], right[-1])
    if left[-1] - left[0] + 1 == len(left) and right[-1] - right[0] + 1 == len(right):  # without gaps
        return np.arange(first - left[0], last - left[0] + 1), np.arange(first - right[0], last - right[0] + 1)
    _, a, b = np.intersect1d(left, right, assume_unique=True, return_indices=True)
    return a, b


def _contracted(up: Stack, low: Stack, pairs: Pairs, elements: Sequence[Element]) -> Contracted | None:
    """The sum of elements between the states of each pair of blocks; None without elements."""
    if not elements:
        return None
    if up.vectors is None or low.vectors is None:
        matrices = np.zeros((len(pairs.up), up.sections[-1].rows.stop, low.sections[-1].rows.stop))
        for left, right, x in elements:
            matrices[:, left.rows, right.rows] += x
        return Contracted(up, low, pairs, matrices)
    bra, ket = up.vectors[pairs.up].transpose(0, 2, 1), low.vectors[pairs.low]
    total = sum(np.matmul(np.matmul(bra[:, :, left.rows], x), ket[:, right.rows]) for left, right, x in elements)
    matrices = np.asarray(total)
    for place, (a, b) in enumerate(zip(pairs.up.tolist(), pairs.low.tolist(), strict=True)):
        if up.single[a] or low.single[b]:
            block = _one_contracted(up, low, (a, b), [(left, right, x[place]) for left, right, x in elements])
            matrices[place, : up.sizes[a], : low.sizes[b]] = block
    return Contracted(up, low, pairs, matrices)


def _one_contracted(up: Stack, low: Stack, place: tuple[int, int], elements: Sequence[Element]) -> Floats:
    """Elements of one pair of blocks without padding: padding changes the last bit, on which near-degenerate states depend."""
    total: Floats | None = None
    for left, right, element in elements:
        bra, ket = left.parts[place[0]], right.parts[place[1]]
        inside = element[: bra.basis.size, : ket.basis.size]
        part = up.blocks[place[0]].vectors[bra.place].T @ inside @ low.blocks[place[1]].vectors[ket.place]
        total = part if total is None else total + part
    assert total is not None
    return total


class _Pieces:
    """Elements of pieces between two stacks; an operator of N that several pieces have is computed once."""

    def __init__(self, up: Stack, low: Stack, pairs: Pairs, representation: str) -> None:
        self._up, self._low, self._pairs, self._representation = up, low, pairs, representation
        self._cache: dict[tuple[Rotor, int, int], Floats | None] = {}

    def contracted(self, pieces: Sequence[Piece]) -> Contracted | None:
        """The sum of pieces between the states of each pair of blocks; None without elements."""
        elements = [
            (left, right, element)
            for piece in pieces
            for left in self._up.sections
            for right in self._low.sections
            if acts(piece, left.v, right.v) and (element := self._element(piece, left, right)) is not None
        ]
        return _contracted(self._up, self._low, self._pairs, elements)

    def _element(self, piece: Piece, left: Section, right: Section) -> Floats | None:
        """value · ½(bra + ket) of N^2p · ½(bra + ket) of Nz^2q · element of the operator."""
        key = (piece.rotor, left.rows.start, right.rows.start)
        if key not in self._cache:
            self._cache[key] = rotor_elements(piece.rotor, left, right, self._pairs, self._representation)
        element = self._cache[key]
        if element is None:
            return None
        m, n = self._pairs.m[:, :, None].astype(float), self._pairs.n[:, :, None].astype(float)
        factor = piece.value * ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
        if piece.nz2 and self._pairs.k is not None:
            bra, ket = (k ** (2.0 * piece.nz2) for k in self._pairs.k)
            factor = factor * ((bra + ket) / 2)[:, None, None]
        elif piece.nz2:
            bra, ket = (section.basis.k.astype(float) ** (2 * piece.nz2) for section in (left, right))
            factor = factor * ((bra[:, None] + ket) / 2)
        return np.asarray(factor * element)
