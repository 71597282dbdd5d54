"""Lines between the Wang blocks of neighbouring J that may reach an intensity: few large products, and bounds before them.

A line of the frequency ν and the strength S can only reach a cut where ν S is at least what the larger population of both states
needs (the photon factor, at most 1, left out). The highest frequency there can be in a product of two blocks stands for ν at
first, so that two comparisons of S suffice for most of its elements.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.stacked_blocks import Product, Stack, Vector, stacks_by_j
from rotor.quantum.tensors import BodyTensor

SMALLEST_MHZ = 1e-30  # in place of 0 between states that all have one energy
ROUND_OFF = 1e-9  # of a threshold, by which a line that is compared exactly later may miss it

StrongLines = tuple[Indices, Indices, Floats]  # rows of both states, and S in D²


def strong_lines(
    levels: Levels, blocks: Sequence[SolvedBlock], dipole: BodyTensor, needed: Floats, highest_mhz: float
) -> Iterator[StrongLines]:
    """Rows of both states and strengths of all lines that may reach a cut, and of some that do not, block by block.

    Parameters
    ----------
    levels : Levels
        With eigenvectors in Wang blocks.
    blocks : sequence of SolvedBlock
        Those between which lines count, whole and in the order of J.
    dipole : BodyTensor
        A vector, in debye.
    needed : (levels,) array
        ν S in MHz D² that a line with this lower state needs.
    highest_mhz : float
        Frequency above which lines do not count.

    Returns
    -------
    iterator of tuples of (n,) arrays
        Row of one state, row of the other, S in D².
    """
    vector, most = Vector(dipole), sum(abs(part) ** 2 for part in dipole.components)
    counts = reaching(levels, needed, most)
    memory = _Memory(len(levels))
    below: dict[int, Stack] = {}
    before = -2
    lower = {block.basis.j for block in blocks if counts[block.start]}
    near = lower.union(*({j - 1, j + 1} for j in lower))
    for j, stacks in stacks_by_j([block for block in blocks if block.basis.j in near]):
        of_up: dict[int, tuple[SolvedBlock, list[Product]]] = {}
        for lows in (below, stacks) if before == j - 1 else (stacks,):
            for up, product in vector.products(stacks, lows):
                of_up.setdefault(up.start, (up, []))[1].append(product)
        for up, products in of_up.values():
            for part in _parts(up, products, counts):
                yield _strong_lines(*part, levels.energy_mhz, needed, highest_mhz, memory)
        below, before = stacks, j


def reaching(levels: Levels, needed: Floats, most: float) -> dict[int, int]:
    """How many of the states of each Wang block, from the lowest on, may be the lower state of a line that reaches the cut.

    Over all upper states of one lower state the strengths add up to (2J+1) μ² (the sum rule of direction cosines), so that one is
    not larger; ν is at most the distance to the highest level of J - 1, J and J + 1.
    """
    starts = np.array([block.start for block in levels.blocks])
    j, sizes = levels.quanta["j"], np.diff(np.append(starts, len(levels)))
    highest = np.full(j.max() + 3, -np.inf)  # of J - 1, from J = -1 on
    np.maximum.at(highest, j + 1, levels.energy_mhz)
    highest = np.maximum(np.maximum(highest[:-2], highest[1:-1]), highest[2:])
    reaches = (highest[j] - levels.energy_mhz) * (2 * j + 1) * most >= needed
    last = np.maximum.reduceat(np.where(reaches, np.arange(1, len(levels) + 1), 0), starts)
    counts = np.clip(last - starts, 0, sizes)
    return dict(zip(starts.tolist(), counts.tolist(), strict=True))


Part = tuple[
    int, int, list[tuple[Product, int, int]]
]  # first state and number of the upper block; first and last of each low


def _parts(up: SolvedBlock, products: list[Product], counts: Mapping[int, int]) -> Iterator[Part]:
    """The parts of blocks between which a line may reach the cut: all with the lowest states of one side, or of the other."""
    of_up, all_up = counts[up.start], len(up.energies_mhz)
    if of_up == all_up:
        yield up.start, all_up, [(product, 0, len(product.low.energies_mhz)) for product in products]
        return
    lowest = [(product, 0, split) for product in products if (split := counts[product.low.start])]
    if lowest:
        yield up.start, all_up, lowest
    others = [(product, counts[product.low.start], len(product.low.energies_mhz)) for product in products]
    others = [(product, first, last) for product, first, last in others if first < last]
    if of_up and others:
        yield up.start, of_up, others


class _Memory:
    """Arrays used again and again: products of one block, which of them may suffice, and the numbers of all levels."""

    def __init__(self, levels: int) -> None:
        self.rows = np.arange(levels, dtype=np.int32)
        self._elements, self._keep, self._other = np.empty(0), np.empty(0, np.bool_), np.empty(0, np.bool_)

    def of(self, shape: tuple[int, int]) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """An array for elements, and two for whether they suffice."""
        size = shape[0] * shape[1]
        if len(self._elements) < size:
            self._elements, self._keep, self._other = np.empty(size), np.empty(size, np.bool_), np.empty(size, np.bool_)
        return (
            self._elements[:size].reshape(shape),
            self._keep[:size].reshape(shape),
            self._other[:size].reshape(shape),
        )


def _strong_lines(
    start: int, count: int, products: list[tuple[Product, int, int]], energy: Floats, needed: Floats,
    highest_mhz: float, memory: _Memory,
) -> StrongLines:  # fmt: skip
    """The lines of `count` states from `start` on with those of lower blocks whose strengths may suffice."""
    stop = start + count
    others = np.concatenate([memory.rows[product.low.start + a : product.low.start + b] for product, a, b in products])
    strength, keep, other = memory.of((count, len(others)))

    at = 0
    for product, a, b in products:
        np.matmul(product.moved[:, :count].T, product.low.vectors[:, a:b], out=strength[:, at : at + b - a])
        at += b - a
    np.multiply(strength, strength, out=strength)

    lowest = min(
        [energy[start], *(product.low.energies_mhz[a] for product, a, _ in products)]
    )  # of each block, energies rise
    highest = max([energy[stop - 1], *(product.low.energies_mhz[b - 1] for product, _, b in products)])
    span = max(min(highest - lowest, highest_mhz), SMALLEST_MHZ)
    scale = (1 - ROUND_OFF) / span
    np.greater_equal(strength, scale * needed[start:stop, None], out=keep)
    np.greater_equal(strength, scale * needed[others], out=other)
    np.logical_or(keep, other, out=keep)

    places = np.flatnonzero(keep)
    row = places // len(others)
    column = places - row * len(others)
    return memory.rows[row + start], others[column], strength.reshape(-1)[places]
