"""Operators of the rotation contracted to the eigenstates of many solved blocks at once.

Blocks with the same states v and Wang functions in them, which differ in N alone, stand in one stack, padded with zeros to one shape.
Elements between two stacks whose N differ by one number are one array, by the formulas of `tensors` and `operators` for all these
N, and are contracted by one product of matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.operators import Basis, Rotor
from rotor.quantum.spins.rotor import Piece, RotorBlock, acts
from rotor.quantum.spins.stack_elements import Pairs, Section, power_matrices, rotor_elements, tensor_elements_of_pairs
from rotor.quantum.tensors import Tensors, rank_of, tensor_between
from rotor.quantum.wang.basis import WangBlock

_SMALL = 16  # functions up to which blocks of all sizes share a stack; of larger ones the largest has half as many again at most


class Stack(NamedTuple):
    """Solved blocks of rising N: which states and Wang functions are in them, as a number, their own numbers, N, eigenvectors
    (blocks, rows, states) with zeros beyond a block, how many states each has, the blocks, and which are contracted one by one."""

    kind: int
    numbers: Ints
    n: Ints
    sections: tuple[Section, ...]
    vectors: Floats
    sizes: list[int]
    blocks: list[RotorBlock]
    single: list[bool]


Element = tuple[Section, Section, Floats]
"""Elements (pairs, functions', functions) between two sections."""


class Contracted(NamedTuple):
    """Elements between the states of pairs of blocks of two stacks: (pairs, states', states), zeros beyond a block."""

    up: Stack
    low: Stack
    pairs: Pairs
    matrices: Floats

    def turned(self, sign: float) -> Contracted:
        """The other way round, times a sign."""
        return Contracted(self.low, self.up, self.pairs.turned(), sign * self.matrices.transpose(0, 2, 1))


def stacks_of(blocks: Sequence[RotorBlock]) -> list[Stack]:
    """All blocks in stacks of like shapes: by their states and kinds of Wang blocks, of |N K⟩ by their states."""
    alike: dict[tuple[tuple[int, ...], ...], list[int]] = {}
    for number, block in enumerate(blocks):
        alike.setdefault(tuple((part.v, *_kind(part.basis)) for part in block.parts), []).append(number)
    of_kinds = enumerate(alike.values())
    return [_stack(blocks, kind, some) for kind, members in of_kinds for some in _of_like_size(blocks, members)]


def _kind(basis: Basis) -> tuple[int, ...]:
    return (basis.first_k, basis.sign) if isinstance(basis, WangBlock) else ()


def _of_like_size(blocks: Sequence[RotorBlock], members: list[int]) -> Iterator[list[int]]:
    some: list[int] = []
    for number in sorted(members, key=lambda number: blocks[number].n):
        if some and len(blocks[number].energies_mhz) > max(_SMALL, 1.5 * len(blocks[some[0]].energies_mhz)):
            yield some
            some = []
        some.append(number)
    yield some


def _stack(blocks: Sequence[RotorBlock], kind: int, numbers: list[int]) -> Stack:
    own = [blocks[number] for number in numbers]
    sections, start = [], 0
    for parts in zip(*(block.parts for block in own), strict=True):
        largest = max((part.basis for part in parts), key=lambda basis: basis.size)
        sections.append(Section(parts[0].v, largest, slice(start, start + largest.size), parts))
        start += largest.size
    sizes = [len(block.energies_mhz) for block in own]
    vectors = np.zeros((len(own), start, max(sizes)))
    for place, (block, states) in enumerate(zip(own, sizes, strict=True)):
        for part, section in zip(block.parts, sections, strict=True):
            first = section.rows.start
            vectors[place, first : first + part.basis.size, :states] = block.vectors[part.place]
    return Stack(
        kind,
        np.array(numbers),
        np.array([block.n for block in own]),
        tuple(sections),
        vectors,
        sizes,
        own,
        [len(block.energies_mhz) == 1 or any(part.basis.size == 1 for part in block.parts) for block in own],
    )


def operators_of_stacks(
    stacks: Sequence[Stack], reach: int, operators: Sequence[Sequence[Piece]], representation: str
) -> list[list[Contracted]]:
    """Σ value ⟨r'‖X‖r⟩ of each operator between blocks whose N differ by `reach` at most, each pair once, that of the higher number first.

    Parameters
    ----------
    stacks : sequence of Stack
        All blocks.
    reach : int
        Largest difference of N.
    operators : sequence of sequence of Piece
        Sums of pieces with their values in MHz, conjugates of those between different states not among them.
    representation : str
        Which principal axes are x, y, z.

    Returns
    -------
    list of list of Contracted
        Of each operator, in MHz. Coefficients of coupling have c(p', p) = (-1)^(N'-N) c(p, p').
    """
    between = [[piece for piece in pieces if piece.bra != piece.ket] for pieces in operators]
    out: list[list[Contracted]] = [[] for _ in operators]
    for up, low, pairs in _near(stacks, reach):
        there, back = _Pieces(up, low, pairs, representation), _Pieces(low, up, pairs.turned(), representation)
        for contracted, pieces, others in zip(out, operators, between, strict=True):
            found = there.contracted(pieces)
            turned = back.contracted(others) if others else None
            if turned is not None:
                turned = turned.turned((-1.0) ** pairs.rise)
                found = turned if found is None else found._replace(matrices=found.matrices + turned.matrices)
            if found is not None:
                contracted.append(found)
    return out


def powers_of_stacks(stacks: Sequence[Stack], units: Sequence[tuple[int, int, int]]) -> list[tuple[Stack, Floats]]:
    """½[Nz^2q, N₊^2n + N₋^2n]₊ within the state v of each unit (v, q, n), over eigenstates: (blocks, units, states, states)."""
    out = []
    for stack in stacks:
        found = np.zeros((len(stack.numbers), len(units), stack.vectors.shape[2], stack.vectors.shape[2]))
        for section in stack.sections:
            own = [place for place, (v, _, _) in enumerate(units) if v == section.v]
            vectors = stack.vectors[:, None, section.rows]
            matrices = power_matrices(section, [units[place][1:] for place in own])
            found[:, own] += np.matmul(vectors.transpose(0, 1, 3, 2), np.matmul(matrices, vectors))
        out.append((stack, found))
    return out


def tensors_of_stacks(stacks: Sequence[Stack], tensors: Tensors) -> list[Contracted]:
    """⟨r'‖T‖r⟩ between blocks, both ways round.

    Parameters
    ----------
    stacks : sequence of Stack
        All blocks.
    tensors : mapping of (int, int) to BodyTensor
        By pairs of states, all of one rank.

    Returns
    -------
    list of Contracted
        In the unit of the tensors; of a block with itself the last one counts.
    """
    rank = rank_of(tensors)

    alike = all(tensors.get((v, w), tensor) == tensor for (w, v), tensor in tensors.items())
    there, back = list[Contracted | None](), list[Contracted | None]()
    for up, low, pairs in _near(stacks, rank):
        found = _contracted(up, low, pairs, _of_tensors(tensors, up, low, pairs))
        there.append(found)
        if alike:
            back.append(None if found is None else found.turned((-1.0) ** (pairs.rise + rank)))
        else:
            turned = pairs.turned()
            back.append(_contracted(low, up, turned, _of_tensors(tensors, low, up, turned)))
    return [found for found in (*back, *there) if found is not None]


def acting_numbers(found: Sequence[Contracted]) -> list[tuple[int, int]]:
    """The numbers of every pair of blocks between which there are elements that are not zero."""
    out: list[tuple[int, int]] = []
    for up, low, pairs, matrices in found:
        acting = matrices.any(axis=(1, 2))
        out += zip(up.numbers[pairs.up][acting].tolist(), low.numbers[pairs.low][acting].tolist(), strict=True)
    return out


def by_numbers(found: Sequence[Contracted]) -> dict[tuple[int, int], Floats]:
    """The (n', n) elements of every pair of blocks by their numbers, those that are zero left out."""
    out = {}
    for up, low, pairs, matrices in found:
        acting: list[bool] = matrices.any(axis=(1, 2)).tolist()  # type: ignore[assignment]
        numbers = zip(up.numbers[pairs.up].tolist(), low.numbers[pairs.low].tolist(), strict=True)
        sizes = zip(pairs.up.tolist(), pairs.low.tolist(), strict=True)
        for matrix, acts_here, number, (a, b) in zip(matrices, acting, numbers, sizes, strict=True):
            if acts_here:
                out[number] = matrix[: up.sizes[a], : low.sizes[b]]
    return out


def _of_tensors(tensors: Tensors, up: Stack, low: Stack, pairs: Pairs) -> list[Element]:
    """Elements of the tensors between all sections that they connect."""
    return [
        (left, right, element)
        for left in up.sections
        for right in low.sections
        if (tensor := tensor_between(tensors, left.v, right.v)) is not None
        and (element := tensor_elements_of_pairs(tensor, left.basis, right.basis, pairs)) is not None
    ]


def _near(stacks: Sequence[Stack], reach: int) -> Iterator[tuple[Stack, Stack, Pairs]]:
    for up in stacks:
        for low in stacks:
            for rise in range(reach + 1):
                pairs = _pairs(up, low, rise)
                if len(pairs.up):
                    yield up, low, pairs


def _pairs(up: Stack, low: Stack, rise: int) -> Pairs:
    """The blocks whose N differ by `rise`; of one N, those with the number of the first not below that of the second."""
    a, b = _alike(up.n, low.n + rise)
    if not rise and up is not low:
        ordered = up.numbers[a] > low.numbers[b]
        a, b = a[ordered], b[ordered]
    return Pairs(a, b, up.n[a][:, None], low.n[b][:, None])


def _alike(one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Where two rising arrays have the same numbers."""
    first, last = max(one[0], other[0]), min(one[-1], other[-1])
    if one[-1] - one[0] + 1 == len(one) and other[-1] - other[0] + 1 == len(other):  # without gaps
        return np.arange(first - one[0], last - one[0] + 1), np.arange(first - other[0], last - other[0] + 1)
    _, a, b = np.intersect1d(one, other, assume_unique=True, return_indices=True)
    return a, b


def _contracted(up: Stack, low: Stack, pairs: Pairs, elements: Sequence[Element]) -> Contracted | None:
    """The sum of elements between the states of each pair of blocks, None where there are none."""
    if not elements:
        return None
    bra, ket = up.vectors[pairs.up].transpose(0, 2, 1), low.vectors[pairs.low]
    total = sum(np.matmul(np.matmul(bra[:, :, left.rows], x), ket[:, right.rows]) for left, right, x in elements)
    matrices: Floats = np.asarray(total)
    for place, (a, b) in enumerate(zip(pairs.up.tolist(), pairs.low.tolist(), strict=True)):
        if up.single[a] or low.single[b]:
            own = _one_contracted(up, low, (a, b), [(left, right, x[place]) for left, right, x in elements])
            matrices[place, : up.sizes[a], : low.sizes[b]] = own
    return Contracted(up, low, pairs, matrices)


def _one_contracted(up: Stack, low: Stack, place: tuple[int, int], elements: Sequence[Element]) -> Floats:
    """The same of one pair without padding: where levels nearly coincide their states depend on the last bit."""
    total: Floats | None = None
    for left, right, element in elements:
        bra, ket = left.every[place[0]], right.every[place[1]]
        inside = element[: bra.basis.size, : ket.basis.size]
        own = up.blocks[place[0]].vectors[bra.place].T @ inside @ low.blocks[place[1]].vectors[ket.place]
        total = own if total is None else total + own
    assert total is not None
    return total


class _Pieces:
    """Elements of pieces between two stacks; those of one operator of N are made once for all pieces that have it."""

    def __init__(self, up: Stack, low: Stack, pairs: Pairs, representation: str) -> None:
        self._up, self._low, self._pairs, self._representation = up, low, pairs, representation
        self._known: dict[tuple[Rotor, int, int], Floats | None] = {}

    def contracted(self, pieces: Sequence[Piece]) -> Contracted | None:
        """The sum of some pieces between the states of each pair of blocks, None where there is none."""
        elements = [
            (left, right, element)
            for piece in pieces
            for left in self._up.sections
            for right in self._low.sections
            if acts(piece, left.v, right.v) and (element := self._element(piece, left, right)) is not None
        ]
        return _contracted(self._up, self._low, self._pairs, elements)

    def _element(self, piece: Piece, left: Section, right: Section) -> Floats | None:
        """value ½(bra + ket) of N^2p, times ½(bra + ket) of Nz^2q, times the element of the operator."""
        key = (piece.rotor, left.rows.start, right.rows.start)
        if key not in self._known:
            self._known[key] = rotor_elements(piece.rotor, left, right, self._pairs, self._representation)
        found = self._known[key]
        if found is None:
            return None
        m, n = self._pairs.m[:, :, None].astype(float), self._pairs.n[:, :, None].astype(float)
        factor = piece.value * ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
        if piece.nz2:
            bra, ket = (section.basis.k.astype(float) ** (2 * piece.nz2) for section in (left, right))
            factor = factor * ((bra[:, None] + ket) / 2)
        return np.asarray(factor * found)
