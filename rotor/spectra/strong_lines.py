"""Lines between Wang blocks of neighbouring J that may reach an intensity cut, found by bounds and few large matrix products.

A line of frequency ν and strength S can reach a cut only if ν S is at least the value that the larger population of its two states
requires (the photon factor, at most 1, is left out). At first ν is replaced by the highest frequency in a product of two blocks, so
that two comparisons of S suffice for most elements.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.stacked_blocks import ParityStates, Product, Vector, stacks_by_j
from rotor.quantum.tensors import BodyTensor

SMALLEST_MHZ = 1e-30  # replaces 0 between states of equal energy
ROUND_OFF = 1e-9  # relative margin of a threshold for lines that are compared exactly later

StrongLines = tuple[Indices, Indices, Floats]  # rows of both states, and S in D²


def strong_lines(
    levels: Levels, blocks: Sequence[SolvedBlock], dipole: BodyTensor, needed: Floats, highest_mhz: float
) -> Iterator[StrongLines]:
    """Rows of both states and strengths of all lines that may reach a cut (and of some that do not), block by block.

    Parameters
    ----------
    levels : Levels
        With eigenvectors in Wang blocks.
    blocks : sequence of SolvedBlock
        Complete blocks between which lines count, in order of J.
    dipole : BodyTensor
        A vector, in debye.
    needed : (levels,) array
        ν S in MHz D² that a line with this lower state requires.
    highest_mhz : float
        Frequency above which lines do not count.

    Returns
    -------
    iterator of tuples of (n,) arrays
        Row of the first state, row of the second, S in D².
    """
    vector, most = Vector(dipole), sum(abs(part) ** 2 for part in dipole.components)
    counts = reaching(levels, needed, most)
    memory = _Memory(len(levels))
    below: dict[int, ParityStates] = {}
    before = -2
    all_j = [block.basis.j for block in blocks]
    lower = {j for j, block in zip(all_j, blocks, strict=True) if counts[block.start]}
    near = lower.union(*({j - 1, j + 1} for j in lower))
    for j, stacks in stacks_by_j([block for j, block in zip(all_j, blocks, strict=True) if j in near]):
        by_upper: dict[int, tuple[SolvedBlock, list[Product]]] = {}
        for lows in (below, stacks) if before == j - 1 else (stacks,):
            for up, product in vector.products(stacks, lows):
                by_upper.setdefault(up.start, (up, []))[1].append(product)
        for up, products in by_upper.values():
            for part in _parts(up, products, counts):
                yield _strong_lines(*part, levels.energy_mhz, needed, highest_mhz, memory)
        below, before = stacks, j


def reaching(levels: Levels, needed: Floats, most: float) -> dict[int, int]:
    """Number of states of each Wang block, from the lowest on, that may be the lower state of a line above the cut.

    The strengths of one lower state add up to (2J+1) μ² over all upper states (sum rule of direction cosines), which bounds each of them;
    ν is at most the distance to the highest level of J - 1, J and J + 1.
    """
    starts = np.array([block.start for block in levels.blocks])
    j, sizes = levels.quanta["j"], np.diff(np.append(starts, len(levels)))
    highest = np.full(j.max() + 3, -np.inf)  # of J - 1, from J = -1 on
    np.maximum.at(highest, j + 1, levels.energy_mhz)
    highest = np.maximum(np.maximum(highest[:-2], highest[1:-1]), highest[2:])  # a line leads to J - 1, J or J + 1
    # a bound by the largest frequency: no line of this level can be stronger
    reaches = (highest[j] - levels.energy_mhz) * (2 * j + 1) * most >= needed
    last = np.maximum.reduceat(np.where(reaches, np.arange(1, len(levels) + 1), 0), starts)
    counts = np.clip(last - starts, 0, sizes)
    return dict(zip(starts.tolist(), counts.tolist(), strict=True))


Part = tuple[
    int, int, list[tuple[Product, int, int]]
]  # first state and number of states of the upper block; for each product, first and last state of the lower block


def _parts(up: SolvedBlock, products: list[Product], counts: Mapping[int, int]) -> Iterator[Part]:
    """Parts of blocks between which a line may reach the cut: those with low-lying states of either block."""
    reaching_up, all_up = counts[up.start], len(up.energies_mhz)
    if reaching_up == all_up:
        yield up.start, all_up, [(product, 0, len(product.low.energies_mhz)) for product in products]
        return
    lowest = [(product, 0, split) for product in products if (split := counts[product.low.start])]
    if lowest:
        yield up.start, all_up, lowest
    others = [(product, counts[product.low.start], len(product.low.energies_mhz)) for product in products]
    others = [(product, first, last) for product, first, last in others if first < last]
    if reaching_up and others:
        yield up.start, reaching_up, others


class _Memory:
    """Reused arrays: products of one block, masks of elements above the cut, and the numbers of all levels."""

    def __init__(self, levels: int) -> None:
        self.rows = np.arange(levels, dtype=np.int32)
        self._elements, self._keep, self._other = np.empty(0), np.empty(0, np.bool_), np.empty(0, np.bool_)

    def arrays(self, shape: tuple[int, int]) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """An array for elements, and two for masks."""
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
    """Lines between `count` states from `start` on and states of lower blocks, whose strengths may suffice."""
    stop = start + count
    others = np.concatenate([memory.rows[product.low.start + a : product.low.start + b] for product, a, b in products])
    strength, keep, other = memory.arrays((count, len(others)))

    at = 0
    for product, a, b in products:
        np.matmul(product.moved[:, :count].T, product.low.vectors[:, a:b], out=strength[:, at : at + b - a])
        at += b - a
    np.multiply(strength, strength, out=strength)

    # energies rise within a block
    lowest = min([energy[start], *(product.low.energies_mhz[a] for product, a, _ in products)])
    highest = max([energy[stop - 1], *(product.low.energies_mhz[b - 1] for product, _, b in products)])
    span = max(min(highest - lowest, highest_mhz), SMALLEST_MHZ)
    scale = (1 - ROUND_OFF) / span  # the bound must not cut by round-off
    np.greater_equal(strength, scale * needed[start:stop, None], out=keep)
    np.greater_equal(strength, scale * needed[others], out=other)
    np.logical_or(keep, other, out=keep)

    places = np.flatnonzero(keep)
    row = places // len(others)
    column = places - row * len(others)
    return memory.rows[row + start], others[column], strength.reshape(-1)[places]
