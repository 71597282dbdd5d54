"""A vector fixed in the molecule, acting on all Wang blocks of successive J whose K have one parity, in one product.

E+ and E- (O+ and O-, see `wang.basis`) have the same K but for K = 0, and the vector has the same elements between them up to
factors of a whole pair of blocks, so that their eigenvectors stand side by side, in rows of one K. With c± the coupling from K of a
lower block to K ± 1 of an upper one, U its states, the components along z, x and y make of U, but for a sign,

    z: T_0 c_0(K) U(K),    x: |Re T_1| (c+(K) U(K+1) - c-(K) U(K-1)),    y: |Im T_1| (c+(K) U(K+1) + c-(K) U(K-1)).

A line list needs squares of elements only. So thousands of small products become a dozen for several J together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.levels import SolvedBlock
from rotor.quantum.operators.symmetric_top_elements import wang_coupling
from rotor.quantum.operators.tensors import BodyTensor
from rotor.quantum.wang.basis import WangBlock

Sector = tuple[int, int]  # parity of K and sign of a Wang block


@dataclass(frozen=True)
class ParityStates:
    """The states of the blocks of successive J with K even (parity 0) or odd (1), padded to those of the last J.

    columns: (J, m, 2 m) eigenvectors over K = parity, parity + 2, ..., those of sign + before those of sign -, m the same for both
    parities. rows: (J, 2 m) of the states in the levels; -1, with columns of zeros, where there is no state.
    """

    js: range
    parity: int
    columns: Floats
    rows: Ints

    def selected(self, part: slice) -> ParityStates:
        """Those of some J."""
        return ParityStates(self.js[part], self.parity, self.columns[part], self.rows[part])

    def sign_slice(self, sign: int) -> slice:
        """The states of one sign."""
        count = self.columns.shape[1]
        return slice(0, count) if sign > 0 else slice(count, 2 * count)


class Product(NamedTuple):
    """What a vector makes of upper states, (J, m, n_up), the lower states (J, m, n_low) and their rows (J, n_low)."""

    moved: Floats
    low: Floats
    rows: Ints

    def part(self, up: slice, low: slice) -> Product:
        """That of some of the states."""
        return Product(self.moved[:, :, up], self.low[:, :, low], self.rows[:, low])


def are_whole(blocks: Iterable[SolvedBlock]) -> bool:
    """Whether blocks have all their K and all their states."""
    return all(
        first_k == (first_k % 2 or 1 - sign)  # 0 of E+, 2 of E-, 1 of O+ and O-
        and states == size == (j - first_k) // 2 + 1
        for (j, _, first_k, sign, size), states in ((block.basis, block.vectors.shape[1]) for block in blocks)
    )


def stacked(blocks: Mapping[tuple[int, Sector], SolvedBlock], js: range) -> dict[int, ParityStates]:
    """The states of successive J by their parity; blocks that are not there have no states."""
    stacks, size = {}, js[-1] // 2 + 1
    for parity in (0, 1):
        columns, rows = np.zeros((len(js), size, 2 * size)), np.full((len(js), 2 * size), -1)
        for place, j in enumerate(js):
            for sign, at in ((1, 0), (-1, size)):
                block = blocks.get((j, (parity, sign)))
                if block is not None:
                    count, first = len(block.energies_mhz), block.basis.first_k // 2
                    columns[place, first : first + count, at : at + count] = block.vectors
                    rows[place, at : at + count] = np.arange(block.start, block.start + count)
        stacks[parity] = ParityStates(js, parity, columns, rows)
    return stacks


@dataclass(frozen=True)
class Vector:
    """A vector by what its components along z, x and y make of stacked blocks up to a J."""

    tensor: BodyTensor
    jmax: int

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

    @cached_property
    def couplings(self) -> dict[tuple[int, int], Floats]:
        """c(K) of each lower J from -1 on, (J + 1, K), by rise of J and step of K."""
        j, k = np.arange(-1.0, self.jmax + 1)[:, None], np.arange(self.jmax + 2.0)
        return {(rise, step): wang_coupling(j, rise, 1, step, k) for rise in (0, 1) for step in (-1, 0, 1)}

    def products(self, up: ParityStates, lows: Mapping[int, ParityStates]) -> Iterator[tuple[int, Product]]:
        """Every pair of blocks that the vector connects, by the sign of the upper one; over both parities each pair once.

        lows: the stacks of J - 1, or those of the same J.
        """
        rise = up.js[0] - lows[0].js[0]
        if self.sizes[0]:
            yield from self._along(up, lows[up.parity], rise)
        if any(self.sizes[1:]) and (rise or up.parity):  # E with O is O with E
            yield from self._across(up, lows[1 - up.parity], rise)

    def _along(self, up: ParityStates, low: ParityStates, rise: int) -> Iterator[tuple[int, Product]]:
        partner, _ = self.partners[rise, up.parity, True]
        moved = self._shifted(up, low, 0, self.sizes[0])
        yield from _pairs(up, low, moved, partner, (1, -1) if rise else (1,))  # + with - is - with +

    def _across(self, up: ParityStates, low: ParityStates, rise: int) -> Iterator[tuple[int, Product]]:
        real_partner, imaginary_partner = self.partners[rise, up.parity, False]
        _, real, imaginary = self.sizes
        raised, lowered = (self._shifted(up, low, step, real or imaginary) for step in (1, -1))
        if real:
            yield from _pairs(up, low, raised - lowered, real_partner, (1, -1))
        if imaginary:
            raised += lowered
            if real:
                raised *= imaginary / real
            yield from _pairs(up, low, raised, imaginary_partner, (1, -1))

    def _shifted(self, up: ParityStates, low: ParityStates, step: int, size: float) -> Floats:
        """size c(K) U(K + step) over the K of the lower stack, (J, m, n_up); 0 where K + step is beyond the upper one."""
        offset, count = (low.parity + step - up.parity) // 2, low.columns.shape[1]
        first, last = max(0, -offset), min(count, count - offset)
        out = np.empty(up.columns.shape)
        out[:, :first], out[:, last:] = 0.0, 0.0
        coupling = self.couplings[up.js[0] - low.js[0], step][low.js.start + 1 : low.js.stop + 1, low.parity :: 2]
        states = up.columns[:, first + offset : last + offset]
        np.einsum("jkn,jk->jkn", states, size * coupling[:, first:last], out=out[:, first:last])
        return out


def _pairs(
    up: ParityStates, low: ParityStates, moved: Floats, partner: int, signs: tuple[int, ...]
) -> Iterator[tuple[int, Product]]:
    for sign in signs:
        there = low.sign_slice(partner * sign)
        product = Product(moved[:, :, up.sign_slice(sign)], low.columns[:, :, there], low.rows[:, there])
        yield sign, product
