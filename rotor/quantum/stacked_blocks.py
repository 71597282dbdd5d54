"""A vector fixed in the molecule, acting on the Wang blocks of several J at once.

E+ and E- (O+ and O-, see `wang.basis`) have the same K but for K = 0, and the vector has the same elements between them up to
factors of a whole pair of blocks, so that their eigenvectors stand side by side, in rows of one K; blocks of neighbouring J, which
are nearly as large, stand behind each other, filled up with zeros. With c± the coupling from K of a lower block to K ± 1 of an
upper one, U its states, the components along z, x and y make of U, but for a sign,

    z: T_0 c_0(K) U(K),    x: |Re T_1| (c+(K) U(K+1) - c-(K) U(K-1)),    y: |Im T_1| (c+(K) U(K+1) + c-(K) U(K-1)).

A line list needs squares of elements only. So thousands of small products become a dozen for each group of J.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.tensors import BodyTensor, wang_coupling
from rotor.quantum.wang.basis import WangBlock

MOST_J, MOST_ELEMENTS = (
    12,
    6000,
)  # J in one group, and their K times states: some MB, which stay in fast memory

Slot = tuple[int, int]  # parity of K, and 0 for the sign +, 1 for -


@dataclass(frozen=True)
class Group:
    """The blocks of consecutive J, those of the J before them first.

    js: (g,) the J. columns: by parity of K, (g, size, 2, size): K = parity, parity + 2, ..., sign + and -, states; 0 where there is
    none. starts, counts: by slot, (g,) row of the first state, and how many states there are. turn: which of two places in memory.
    """

    js: list[int]
    columns: dict[int, Floats]
    starts: dict[Slot, Ints]
    counts: dict[Slot, Ints]
    turn: bool


class Memory:
    """Arrays used again and again. Fresh ones of this size come from the system, page by page, which takes longer than their use."""

    def __init__(self) -> None:
        self._arrays: dict[Any, NDArray[Any]] = {}

    def room(self, name: Any, shape: tuple[int, ...], kind: type = float) -> NDArray[Any]:
        """The array of this name in a shape, with whatever stood there."""
        size = math.prod(shape)
        if name not in self._arrays or len(self._arrays[name]) < size:
            self._arrays[name] = np.empty(size + size // 4, kind)
        return self._arrays[name][:size].reshape(shape)


class Product(NamedTuple):
    """Blocks of a slot moved by a vector, (g, size, n_up), those of a lower slot, (g, size, n_low), and that slot and its J by place."""

    moved: Floats
    low: Floats
    low_slot: Slot
    low_places: Ints


def are_whole(blocks: Iterable[SolvedBlock]) -> bool:
    """Whether blocks have all their K and all their states."""
    return all(
        b.basis.first_k == (b.basis.first_k % 2 or 1 - b.basis.sign)  # 0 of E+, 2 of E-, 1 of O+ and O-
        and b.vectors.shape[1] == b.basis.size == (b.basis.j - b.basis.first_k) // 2 + 1
        for b in blocks
    )


def groups_of(blocks: Sequence[SolvedBlock], memory: Memory) -> Iterator[Group]:
    """All J of whole blocks, rising, in groups; each begins with the last J of the one before, and lasts until the next but one."""
    of_j: dict[int, list[SolvedBlock]] = {}
    for block in blocks:
        of_j.setdefault(block.basis.j, []).append(block)
    j, last = min(of_j, default=0), max(of_j, default=-1)
    group = None
    while j <= last:
        stop = min(j + MOST_J, last + 1)
        while stop > j + 1 and (stop - j) * (stop // 2) ** 2 > MOST_ELEMENTS:
            stop -= 1
        group = _group(list(range(j - 1, stop)), of_j, group, memory)
        yield group
        j = stop


def _group(js: list[int], of_j: dict[int, list[SolvedBlock]], before: Group | None, memory: Memory) -> Group:
    turn = before is not None and not before.turn
    sizes = [(js[-1] - parity) // 2 + 1 for parity in (0, 1)]
    columns = {p: memory.room(("columns", turn, p), (len(js), sizes[p], 2, sizes[p])) for p in (0, 1)}
    starts, counts = ({(p, side): np.zeros(len(js), np.int64) for p in (0, 1) for side in (0, 1)} for _ in range(2))
    for g, j in enumerate(js):
        if g == 0 and before is not None:
            _repeat(columns, starts, counts, before)
            continue
        of_slot = {(b.basis.first_k % 2, (1 - b.basis.sign) // 2): b for b in of_j.get(j, [])}
        for slot in starts:
            here, block = columns[slot[0]][g, :, slot[1]], of_slot.get(slot)
            if block is None:
                here[...] = 0.0
                continue
            first, size = block.basis.first_k // 2, block.basis.size
            here[first : first + size, :size] = block.vectors
            here[:first], here[first + size :], here[:, size:] = 0.0, 0.0, 0.0
            starts[slot][g], counts[slot][g] = block.start, size
    return Group(js, columns, starts, counts, turn)


def _repeat(columns: dict[int, Floats], starts: dict[Slot, Ints], counts: dict[Slot, Ints], before: Group) -> None:
    """The last J of the group before as the first of this one, where it stands in the right order in memory already."""
    for parity, known in before.columns.items():
        size, here = known.shape[1], columns[parity][0]
        here[:size, :, :size] = known[-1]
        here[size:], here[:, :, size:] = 0.0, 0.0
    for slot in starts:
        starts[slot][0], counts[slot][0] = before.starts[slot][-1], before.counts[slot][-1]


@dataclass(frozen=True)
class Vector:
    """A vector by what its components along z, x and y make of stacked blocks."""

    tensor: BodyTensor
    memory: Memory

    @cached_property
    def sizes(self) -> tuple[float, float, float]:
        """|T_0|, |Re T_1|, |Im T_1|."""
        _, along, plus = self.tensor.components
        return abs(along.real), abs(plus.real), abs(plus.imag)

    @cached_property
    def changes(self) -> dict[tuple[int, int, bool], int]:
        """By rise of J, parity of the upper K, whether K stays: 0 where Re T leads from sign + to +, 1 where it leads to -.

        Im T does the opposite. That depends on the characters under C2y alone, see `tensors`.
        """
        out = {}
        for rise in (0, 1):
            for parity in (0, 1):
                for stays in (False, True):
                    up, low = WangBlock(2 + rise, "", parity, 1, 1), WangBlock(2, "", parity ^ (not stays), 1, 1)
                    out[rise, parity, stays] = 0 if self.tensor.is_real_between(up, low) else 1
        return out

    def products(self, group: Group, places: Ints) -> Iterator[tuple[Slot, Product]]:
        """Every pair of slots that the vector connects, by its upper slot, each pair of blocks once.

        places: of the upper blocks in the group, from 1 on, as the lower ones are those of the same J and of the J before.
        """
        for rise in (1, 0):
            for parity in (0, 1):
                if self.sizes[0]:
                    yield from self._along(group, places, rise, parity)
                if any(self.sizes[1:]) and (rise or parity):  # within J, E with O is O with E
                    yield from self._across(group, places, rise, parity)

    def _along(self, group: Group, places: Ints, rise: int, parity: int) -> Iterator[tuple[Slot, Product]]:
        moved = self._shifted(group, places, rise, parity, 0)
        moved *= self.sizes[0]
        change = self.changes[rise, parity, True]
        for side in (0, 1) if rise else (0,):  # within J, + with - is - with +
            yield (parity, side), _product(group, places - rise, moved, side, (parity, side ^ change))

    def _across(self, group: Group, places: Ints, rise: int, parity: int) -> Iterator[tuple[Slot, Product]]:
        raised, lowered = (self._shifted(group, places, rise, parity, step) for step in (1, -1))
        _, real, imaginary = self.sizes
        change = self.changes[rise, parity, False]
        if real:
            moved = self.memory.room(("along x", rise, parity), raised.shape)
            np.subtract(raised, lowered, out=moved)
            moved *= real
            for side in (0, 1):
                yield (parity, side), _product(group, places - rise, moved, side, (1 - parity, side ^ change))
        if imaginary:
            raised += lowered
            raised *= imaginary
            for side in (0, 1):
                yield (parity, side), _product(group, places - rise, raised, side, (1 - parity, side ^ change ^ 1))

    def _shifted(self, group: Group, places: Ints, rise: int, parity: int, step: int) -> Floats:
        """c(K) U(K + step) over the K of the lower blocks, (g, size, 2, n_up); 0 where K + step is beyond the upper ones."""
        ups = _at(group.columns[parity], places)
        low_parity = parity ^ (step % 2)
        size, offset = group.columns[low_parity].shape[1], (low_parity + step - parity) // 2
        first, last = max(0, -offset), min(size, ups.shape[1] - offset)
        coupling = np.zeros((len(places), size))
        for row, place in zip(coupling, places.tolist(), strict=True):
            j_up, j_low = group.js[place], group.js[place] - rise
            if j_low >= 0 and j_up > 0:
                own = wang_coupling(j_low, j_up, 1, step)[low_parity::2]
                row[: len(own)] = own
        out = self.memory.room(("moved", rise, parity, step), (len(places), size, *ups.shape[2:]))
        out[:, :first], out[:, last:] = 0.0, 0.0
        np.multiply(ups[:, first + offset : last + offset], coupling[:, first:last, None, None], out=out[:, first:last])
        return out


def _product(group: Group, places: Ints, moved: Floats, side: int, low: Slot) -> Product:
    return Product(moved[:, :, side], _at(group.columns[low[0]], places)[:, :, low[1]], low, places)


def _at(columns: Floats, places: Ints) -> Floats:
    """The blocks at evenly spaced places, without a copy."""
    step = int(places[1] - places[0]) if len(places) > 1 else 1
    return columns[places[0] : places[-1] + 1 : step]
