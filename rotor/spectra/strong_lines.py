"""Lines between Wang blocks of neighbouring J that may reach an intensity cut, found by bounds and few large matrix products.

A line of frequency ν and strength S can reach a cut only if ν S is at least the value that the larger population of its two states
requires (the photon factor, at most 1, is left out). At first ν is replaced by the highest frequency in a product of two blocks, so
that two comparisons of S suffice for most elements.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Indices, runs_of_similar_size
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.stacked_blocks import Product, Sector, Vector, stacked
from rotor.quantum.tensors import BodyTensor

SMALLEST_MHZ = 1e-30  # replaces 0 between states of equal energy
ALIKE, SMALL = 1.3, 16  # ratio of the sizes of blocks of several J in one array; smaller ones are alike
AT_ONCE = 30_000  # elements between such blocks of one kind
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
    lower = [block.basis.j for block in blocks if counts[block.start]]
    if not lower:
        return
    bounds, memory = _Bounds(levels, needed, highest_mhz), _Memory()
    sectors = {(block.basis.j, (block.basis.first_k % 2, block.basis.sign)): block for block in blocks}
    first, last = max(min(lower) - 1, 0), max(lower) + 1
    for run in runs_of_similar_size([j // 2 + 1 for j in range(first, last + 1)], ALIKE, SMALL, AT_ONCE):
        stacks = stacked(sectors, range(first + run.start - 1, first + run.stop))  # and those of the J below
        ups, below = ({p: stack.selected(part) for p, stack in stacks.items()} for part in (slice(1, None), slice(-1)))
        by_upper: dict[Sector, list[Product]] = {}
        for lows in (below, ups):
            for sector, product in vector.products(ups, lows):
                by_upper.setdefault(sector, []).append(product)
        for (parity, sign), products in by_upper.items():
            rows = ups[parity].rows[:, ups[parity].sign_slice(sign)]
            for part in _parts(rows, products, counts):
                yield _strong_lines(*part, bounds, memory)


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


Part = tuple[Indices, list[tuple[Product, slice]]]  # rows of upper states; with each product, some of its lower states


def _parts(rows: Indices, products: list[Product], counts: dict[int, int]) -> Iterator[Part]:
    """Parts of blocks between which a line may reach the cut: those with low-lying states of either block."""
    reaching_up, all_up = _most_reaching(rows, counts), rows.shape[1]
    if reaching_up == all_up:
        yield rows, [(product, slice(None)) for product in products]
        return
    splits = [_most_reaching(product.rows, counts) for product in products]
    lowest = [(product, slice(split)) for product, split in zip(products, splits, strict=True) if split]
    if lowest:
        yield rows, lowest
    others = [
        (product, slice(split, None))
        for product, split in zip(products, splits, strict=True)
        if split < product.rows.shape[1]
    ]
    if reaching_up and others:
        yield rows[:, :reaching_up], others


def _most_reaching(rows: Indices, counts: dict[int, int]) -> int:
    """How many of the lowest states of blocks (J, n) may reach the cut, in that J where they are most."""
    return max((counts.get(start, 0) for start in rows[:, :1].ravel().tolist()), default=0)


class _Bounds:
    """What a line of each level needs, and the energies; the last place is that of states that are not there."""

    def __init__(self, levels: Levels, needed: Floats, highest_mhz: float) -> None:
        self.needed, self.highest_mhz = np.append(needed, np.inf), highest_mhz
        self.from_mhz, self.to_mhz = (np.append(levels.energy_mhz, beyond) for beyond in (np.inf, -np.inf))

    def strengths(self, rows: Indices) -> Floats:
        """S (J, n) below which a line of each level with another one of these is too weak."""
        span = self.to_mhz[rows].max(axis=1) - self.from_mhz[rows].min(axis=1)
        span = np.maximum(np.minimum(span, self.highest_mhz), SMALLEST_MHZ)
        return np.asarray((1 - ROUND_OFF) / span[:, None] * self.needed[rows])  # the bound must not cut by round-off


class _Memory:
    """Reused arrays: products of blocks, and masks of elements above the cut."""

    def __init__(self) -> None:
        self._elements, self._keep, self._other = np.empty(0), np.empty(0, np.bool_), np.empty(0, np.bool_)

    def arrays(self, *shape: int) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """An array for elements, and two for masks."""
        size = math.prod(shape)
        if len(self._elements) < size:
            self._elements, self._keep, self._other = np.empty(size), np.empty(size, np.bool_), np.empty(size, np.bool_)
        return (
            self._elements[:size].reshape(shape),
            self._keep[:size].reshape(shape),
            self._other[:size].reshape(shape),
        )


def _strong_lines(
    rows: Indices, products: list[tuple[Product, slice]], bounds: _Bounds, memory: _Memory
) -> StrongLines:
    """Lines between upper states (J, n) and states of lower blocks, whose strengths may suffice."""
    count = rows.shape[1]
    others = np.concatenate([product.rows[:, part] for product, part in products], axis=1)
    width = others.shape[1]
    strength, keep, other = memory.arrays(len(rows), count, width)

    at = 0
    for product, part in products:
        low = product.low[:, :, part]
        to = at + low.shape[2]
        np.matmul(product.moved[:, :, :count].transpose(0, 2, 1), low, out=strength[:, :, at:to])
        at = to
    np.multiply(strength, strength, out=strength)

    least = bounds.strengths(np.concatenate([rows, others], axis=1))
    np.greater_equal(strength, least[:, :count, None], out=keep)
    np.greater_equal(strength, least[:, None, count:], out=other)
    np.logical_or(keep, other, out=keep)

    places = np.flatnonzero(keep)
    row = places // width
    column = row // count * width + places - row * width
    return rows.ravel()[row], others.ravel()[column], strength.reshape(-1)[places]
