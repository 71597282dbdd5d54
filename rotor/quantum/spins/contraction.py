"""Operators of the rotation contracted to the eigenstates of many solved blocks at once.

Blocks with the same states v and Wang functions in them, which differ in N alone, stand in one stack, padded with zeros to one shape.
Elements between two stacks whose N differ by one number are one array, by the formulas of `tensors` and `operators` for all these
N, and are contracted by one product of matrices. Pair by pair the same is `rotor.in_both_orders`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Rotor, axis_tensor, factors_with_n, tensor_of
from rotor.quantum.spins.rotor import Piece, RotorBlock, RotorPart, acts
from rotor.quantum.symmetric_top_elements import closed_coupling
from rotor.quantum.tensors import BodyTensor, Tensors, overlap, rank_of, tensor_between
from rotor.quantum.wang.basis import WangBlock

_SMALL = 16  # functions up to which blocks of all sizes share a stack; of larger ones the largest has half as many again at most
MOST_RANK = 2  # up to which there are closed forms for many N at once


class Section(NamedTuple):
    """The functions of one state and one kind of Wang block in a stack: the block of the largest N, the rows, the parts of all N."""

    v: int
    basis: WangBlock
    rows: slice
    every: tuple[RotorPart, ...]


class Stack(NamedTuple):
    """Solved blocks of rising N: which states and Wang functions are in them, as a number, their own numbers, N, eigenvectors
    (blocks, rows, states) with zeros beyond a block, how many states each has, its own eigenvectors, and its energies."""

    kind: int
    numbers: Ints
    n: Ints
    sections: tuple[Section, ...]
    vectors: Floats
    sizes: list[int]
    own: list[Floats]
    energies_mhz: list[Floats]
    single: list[bool]


class Pairs(NamedTuple):
    """Blocks of two stacks, the N' and N of each pair: places in the stacks and N as columns."""

    up: Ints
    low: Ints
    m: Ints
    n: Ints

    @property
    def rise(self) -> int:
        """N' - N, the same of all."""
        return int(self.m[0, 0] - self.n[0, 0])

    def turned(self) -> Pairs:
        """The other way round."""
        return Pairs(self.low, self.up, self.n, self.m)


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
    """All blocks, whose functions are those of Wang blocks, in stacks of like shapes."""
    alike: dict[tuple[tuple[int, int, int], ...], list[int]] = {}
    for number, block in enumerate(blocks):
        key = tuple((part.v, part.basis.first_k, part.basis.sign) for part in block.parts)  # type: ignore[union-attr]
        alike.setdefault(key, []).append(number)
    of_kinds = enumerate(alike.values())
    return [_stack(blocks, kind, some) for kind, members in of_kinds for some in _of_like_size(blocks, members)]


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
        assert isinstance(largest, WangBlock)
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
        [block.vectors for block in own],
        [block.energies_mhz for block in own],
        [len(block.energies_mhz) == 1 or any(part.basis.size == 1 for part in block.parts) for block in own],
    )


def operators_of_stacks(
    stacks: Sequence[Stack], reach: int, pieces: Sequence[Piece], representation: str
) -> list[Contracted]:
    """Σ value ⟨r'‖X‖r⟩ between blocks whose N differ by `reach` at most, each pair once, the one of the higher number first.

    Parameters
    ----------
    stacks : sequence of Stack
        All blocks.
    reach : int
        Largest difference of N.
    pieces : sequence of Piece
        Operators with their values in MHz, conjugates of those between different states not among them.
    representation : str
        Which principal axes are x, y, z.

    Returns
    -------
    list of Contracted
        In MHz, as `rotor.in_both_orders` gives them.
    """

    between = [piece for piece in pieces if piece.bra != piece.ket]
    out = []
    for up, low, pairs in _near(stacks, reach):
        found = _contracted(up, low, pairs, _of_pieces(pieces, up, low, pairs, representation))
        if between:
            turned = pairs.turned()
            back = _contracted(low, up, turned, _of_pieces(between, low, up, turned, representation))
            if back is not None:
                back = back.turned((-1.0) ** pairs.rise)
                found = back if found is None else found._replace(matrices=found.matrices + back.matrices)
        if found is not None:
            out.append(found)
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
        and (element := _of_tensor(tensor, left.basis, right.basis, pairs)) is not None
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
    """The same of one pair, to the last bit of `rotor.contracted`: where levels nearly coincide their states depend on it."""
    total: Floats | None = None
    for left, right, element in elements:
        bra, ket = left.every[place[0]], right.every[place[1]]
        inside = element[: bra.basis.size, : ket.basis.size]
        own = up.own[place[0]][bra.place].T @ inside @ low.own[place[1]][ket.place]
        total = own if total is None else total + own
    assert total is not None
    return total


def _of_pieces(pieces: Sequence[Piece], up: Stack, low: Stack, pairs: Pairs, representation: str) -> list[Element]:
    """Elements of every piece between all sections that it connects."""
    return [
        (left, right, element)
        for piece in pieces
        for left in up.sections
        for right in low.sections
        if acts(piece, left.v, right.v)
        and (element := _of_piece(piece, left, right, pairs, representation)) is not None
    ]


def _of_piece(piece: Piece, left: Section, right: Section, pairs: Pairs, representation: str) -> Floats | None:
    """value ½(bra + ket) of N^2p, times ½(bra + ket) of Nz^2q, times the element of the operator."""
    found = _of_rotor(piece.rotor, left, right, pairs, representation)
    if found is None:
        return None
    m, n = pairs.m[:, :, None].astype(float), pairs.n[:, :, None].astype(float)
    factor = piece.value * ((m * (m + 1.0)) ** piece.n2 + (n * (n + 1.0)) ** piece.n2) / 2
    if piece.nz2:
        bra, ket = (section.basis.k.astype(float) ** (2 * piece.nz2) for section in (left, right))
        factor = factor * ((bra[:, None] + ket) / 2)
    return np.asarray(factor * found)


def _of_rotor(rotor: Rotor, left: Section, right: Section, pairs: Pairs, representation: str) -> Floats | None:
    if isinstance(rotor, Cosines):
        tensor = tensor_of(rotor.components, rotor.rank, representation)
        found = None if tensor is None else _of_tensor(tensor, left.basis, right.basis, pairs)
        return -found if found is not None and rotor.rank == 1 else found
    if isinstance(rotor, CosinesWithN):
        return _of_cosines_with_n(rotor, left, right, pairs, representation)
    return _one_by_one(rotor, left, right, pairs, representation)


def _of_cosines_with_n(
    rotor: CosinesWithN, left: Section, right: Section, pairs: Pairs, representation: str
) -> Floats | None:
    """See `CosinesWithN.elements`."""
    m, n = pairs.m[:, :, None].astype(float), pairs.n[:, :, None].astype(float)
    rise = pairs.rise
    if abs(rise) > 1:
        return None
    up, low = left.basis, right.basis
    stretch, change, length = factors_with_n(m, n)
    parts = [
        (stretch, tensor_of(rotor.components, 2, representation)),
        (change, axis_tensor(rotor.components, representation)),
    ]
    found = [(factor, _of_tensor(tensor, up, low, pairs)) for factor, tensor in parts if tensor is not None]
    acting = [factor * matrix for factor, matrix in found if matrix is not None]
    scalar = float(np.trace(np.array(rotor.components))) / 3
    if scalar and not rise and (up.first_k, up.sign) == (low.first_k, low.sign):
        acting.append(scalar * length * np.eye(up.size, low.size))
    return np.asarray(sum(acting)) if acting else None


def _one_by_one(rotor: Rotor, left: Section, right: Section, pairs: Pairs, representation: str) -> Floats | None:
    """Any operator, pair by pair."""
    total: Floats | None = None
    for place, (a, b) in enumerate(zip(pairs.up.tolist(), pairs.low.tolist(), strict=True)):
        found = rotor.elements(left.every[a].basis, right.every[b].basis, representation)
        if found is not None:
            if total is None:
                total = np.zeros((len(pairs.up), left.basis.size, right.basis.size))
            total[place, : found.shape[0], : found.shape[1]] = found
    return total


def _of_tensor(tensor: BodyTensor, up: WangBlock, low: WangBlock, pairs: Pairs) -> Floats | None:
    """`tensors.block_elements` of all pairs: (pairs, up.size, low.size)."""
    rank, rise = tensor.rank, pairs.rise
    if rank > MOST_RANK:
        raise ValueError(f"a tensor of rank {rank}: expected at most {MOST_RANK} with spins")
    if abs(rise) > rank or not (steps := tensor.signed_parts(up._replace(j=rise), low._replace(j=0))[0]):
        return None
    closes = (pairs.m + pairs.n >= rank)[:, 0]
    if not closes.any():
        return None
    m, n = (pairs.m, pairs.n) if closes.all() else (pairs.m[closes], pairs.n[closes])
    by_n = [tensor.signed_parts(up._replace(j=j + rise), low._replace(j=j)) for j in range(4)]  # N modulo 4 counts
    parts = np.array([own for _, own in by_n])[n[:, 0] % 4]
    found, every_n = np.zeros((len(m), up.size, low.size)), tuple(n[:, 0].tolist())
    for step in steps:
        source, target = overlap(up, low, step)
        if source.start < source.stop:
            rows, columns = np.arange(target.start, target.stop), np.arange(source.start, source.stop)
            first, count = low.first_k + 2 * source.start, source.stop - source.start
            found[:, rows, columns] = _couplings(every_n, rise, rank, step, first, count) * parts[:, rank + step, None]
    if rank > 1:
        _add_folded(found, parts, up, low, (every_n, rise))
    if closes.all():
        return found
    out = np.zeros((len(closes), up.size, low.size))
    out[closes] = found
    return out


@lru_cache(maxsize=512)  # of N up to 100 some 20 MB
def _couplings(every_n: tuple[int, ...], rise: int, rank: int, step: int, first_k: int, count: int) -> Floats:
    """`tensors.coupling` from each N to N + rise, over K = first_k, first_k + 2, ..., times √2 where one of K and K + step is 0.

    Parameters
    ----------
    every_n : tuple of int
        N of the lower blocks.
    rise, rank, step : int
        By how much N changes, rank of the tensor, by how much K changes.
    first_k, count : int
        The lowest K and their number.

    Returns
    -------
    (N, K) array
        0 where there is no such K; shared and read-only.
    """
    n, k = np.array(every_n)[:, None], first_k + 2 * np.arange(count)
    m = n + rise
    exists = (np.abs(k) <= n) & (np.abs(k + step) <= m)
    inside = np.where(exists, k, np.maximum(-n, -m - step)).astype(float)
    values = closed_coupling(n.astype(float), rise, rank, step, inside)
    if step:
        values = values * np.where(k == max(0, -step), np.sqrt(2.0), 1.0)
    out = np.where(exists, values, 0.0)
    out.flags.writeable = False
    return out


def _add_folded(
    found: Floats, parts: Floats, up: WangBlock, low: WangBlock, of_pairs: tuple[tuple[int, ...], int]
) -> None:
    """Adds what joins K to -K', as `tensors.bands_between` does: s X(K', -K) of 1 ≤ K, K' and K + K' ≤ rank."""
    rank, (every_n, rise) = parts.shape[1] // 2, of_pairs
    for column, k in enumerate(low.k[:rank].tolist()):
        for row, k_up in enumerate(up.k[:rank].tolist()):
            if k and k_up and k + k_up <= rank:
                turned = _couplings(every_n, rise, rank, k + k_up, -k, 1)[:, 0]
                found[:, row, column] += low.sign * turned * parts[:, rank + k + k_up]
