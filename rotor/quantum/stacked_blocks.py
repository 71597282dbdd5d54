"""A vector fixed in the molecule, acting on all Wang blocks of one J whose K have one parity, in one product.

E+ and E- (O+ and O-, see `wang.basis`) have the same K but for K = 0, and the vector has the same elements between them up to
factors of a whole pair of blocks, so that their eigenvectors stand side by side, in rows of one K. With c± the coupling from K of a
lower block to K ± 1 of an upper one, U its states, the components along z, x and y make of U, but for a sign,

    z: T_0 c_0(K) U(K),    x: |Re T_1| (c+(K) U(K+1) - c-(K) U(K-1)),    y: |Im T_1| (c+(K) U(K+1) + c-(K) U(K-1)).

A line list needs squares of elements only. So thousands of small products become a dozen for each J.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.frozen import dataclass
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.tensors import BodyTensor, wang_coupling
from rotor.quantum.wang.basis import WangBlock


@dataclass(frozen=True)
class ParityStates:
    """The states of the blocks of one J with K even (parity 0) or odd (1).

    columns: (size, n) eigenvectors over K = parity, parity + 2, ...; 0 at K = 0 of E-. blocks: by their sign, with the slice of
    their columns.
    """

    j: int
    parity: int
    columns: Floats
    blocks: dict[int, tuple[SolvedBlock, slice]]


class Product(NamedTuple):
    """Two blocks that a vector connects: the states of the upper one, moved, (low.size, n_up), and the lower one."""

    moved: Floats
    low: SolvedBlock


def are_whole(blocks: Iterable[SolvedBlock]) -> bool:
    """Whether blocks have all their K and all their states."""
    return all(
        first_k == (first_k % 2 or 1 - sign)  # 0 of E+, 2 of E-, 1 of O+ and O-
        and states == size == (j - first_k) // 2 + 1
        for (j, _, first_k, sign, size), states in ((block.basis, block.vectors.shape[1]) for block in blocks)
    )


def stacks_by_j(blocks: Iterable[SolvedBlock]) -> Iterator[tuple[int, dict[int, ParityStates]]]:
    """Each J, rising, with its stacks by their parity. The blocks must be whole and in the order of J."""
    for j, blocks_of_j in groupby(blocks, key=lambda block: block.basis.j):
        of_parity: dict[int, list[SolvedBlock]] = {}
        for block in blocks_of_j:
            of_parity.setdefault(block.basis.first_k % 2, []).append(block)
        yield j, {parity: _stack(of_parity[parity], j, parity) for parity in sorted(of_parity)}


def _stack(blocks: list[SolvedBlock], j: int, parity: int) -> ParityStates:
    columns = np.empty(((j - parity) // 2 + 1, sum(len(block.energies_mhz) for block in blocks)))
    by_sign, at = {}, 0
    for block in blocks:
        (_, _, first_k, sign, size) = block.basis
        here = slice(at, at + size)
        columns[first_k // 2 :, here] = block.vectors
        columns[: first_k // 2, here] = 0.0
        by_sign[sign] = block, here
        at = here.stop
    return ParityStates(j, parity, columns, by_sign)


@dataclass(frozen=True)
class Vector:
    """A vector by what its components along z, x and y make of stacked blocks."""

    tensor: BodyTensor

    @cached_property
    def sizes(self) -> tuple[float, float, float]:
        """|T_0|, |Re T_1|, |Im T_1|."""
        _, along, plus = self.tensor.components
        return abs(along.real), abs(plus.real), abs(plus.imag)

    @cached_property
    def partners(self) -> dict[tuple[int, int, bool], tuple[int, int]]:
        """By rise of J, parity of the upper stack and whether K stays: the sign of the lower block that Re T reaches from +, and Im T.

        From - it is the other one. That depends on the characters under C2y alone, see `tensors`.
        """
        out = {}
        for rise in (0, 1):
            for parity in (0, 1):
                for stays in (False, True):
                    up, low = WangBlock(2 + rise, "", parity, 1, 1), WangBlock(2, "", parity ^ (not stays), 1, 1)
                    real = 1 if self.tensor.is_real_between(up, low) else -1
                    out[rise, parity, stays] = real, -real
        return out

    def products(
        self, ups: dict[int, ParityStates], lows: dict[int, ParityStates]
    ) -> Iterator[tuple[SolvedBlock, Product]]:
        """Every pair of blocks that the vector connects, by its upper block, each pair once.

        ups, lows: the stacks of J and of J - 1, or twice those of J.
        """
        for parity, up in ups.items():
            if up.j == 0:  # a vector has no elements within J = 0
                continue
            same, other = lows.get(parity), lows.get(1 - parity)
            if same is not None and self.sizes[0]:
                yield from self._along(up, same)
            if other is not None and any(self.sizes[1:]) and (other.j < up.j or parity):  # E with O is O with E
                yield from self._across(up, other)

    def _along(self, up: ParityStates, low: ParityStates) -> Iterator[tuple[SolvedBlock, Product]]:
        partner, _ = self.partners[up.j - low.j, up.parity, True]
        moved = _shifted(up, low, 0)
        moved *= self.sizes[0]
        signs = (1, -1) if up.j > low.j else (1,)  # + with - is - with +
        yield from _pairs(up, low, moved, partner, signs)

    def _across(self, up: ParityStates, low: ParityStates) -> Iterator[tuple[SolvedBlock, Product]]:
        real_partner, imaginary_partner = self.partners[up.j - low.j, up.parity, False]
        raised, lowered = _shifted(up, low, 1), _shifted(up, low, -1)
        _, real, imaginary = self.sizes
        if real:
            moved = raised - lowered
            moved *= real
            yield from _pairs(up, low, moved, real_partner, (1, -1))
        if imaginary:
            raised += lowered
            raised *= imaginary
            yield from _pairs(up, low, raised, imaginary_partner, (1, -1))


def _pairs(
    up: ParityStates, low: ParityStates, moved: Floats, partner: int, signs: tuple[int, ...]
) -> Iterator[tuple[SolvedBlock, Product]]:
    for sign in signs:
        if sign in up.blocks and partner * sign in low.blocks:
            (block, here), (other, _) = up.blocks[sign], low.blocks[partner * sign]
            yield block, Product(moved[other.basis.first_k // 2 :, here], other)


def _shifted(up: ParityStates, low: ParityStates, step: int) -> Floats:
    """c(K) U(K + step) over the K of the lower stack, (low size, n_up); 0 where K + step is beyond the upper one."""
    offset, size = (low.parity + step - up.parity) // 2, len(low.columns)
    first, last = max(0, -offset), min(size, len(up.columns) - offset)
    coupling = wang_coupling(low.j, up.j, 1, step)[low.parity :: 2]
    out = np.empty((size, up.columns.shape[1]))
    out[:first], out[last:] = 0.0, 0.0
    np.multiply(up.columns[first + offset : last + offset], coupling[first:last, None], out=out[first:last])
    return out
