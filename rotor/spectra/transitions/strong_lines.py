"""Lines between Wang blocks of neighbouring J that may reach an intensity cut, found by bounds and few large matrix products.

A line of frequency ν and strength S can reach a cut only if ν S is at least the value that the larger population of its two states
requires (the photon factor, at most 1, is left out). At first the states in one place of the four blocks of a J are taken together, with
the highest frequency and the largest population among them, so that one comparison of S suffices for most elements.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, runs_of_similar_size
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.operators.tensors import BodyTensor
from rotor.quantum.wang.stacked_blocks import ParityStates, Product, Vector, stacked

SMALLEST_MHZ = 1e-30  # replaces 0 between states of equal energy
ALIKE, SMALL = 1.3, 16  # ratio of the sizes of blocks of several J in one array; smaller ones are alike
AT_ONCE = 30_000  # elements between such blocks of one kind
ROUND_OFF = 1e-9  # relative margin of a threshold for lines that are compared exactly later

StrongLines = tuple[Ints, Ints, Floats]  # rows of both states, and S in D²


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
    counts = reaching(levels, needed, sum(abs(part) ** 2 for part in dipole.components))
    lower = np.flatnonzero(counts)
    if not len(lower):
        return
    first, last = max(int(lower[0]) - 1, 0), min(int(lower[-1]) + 1, len(counts) - 1)
    vector, limits, memory = Vector(dipole, last), _Limits(levels, needed, highest_mhz), _Memory()
    sectors = {(block.basis.j, (block.basis.first_k % 2, block.basis.sign)): block for block in blocks}
    for run in runs_of_similar_size([j // 2 + 1 for j in range(first, last + 1)], ALIKE, SMALL, AT_ONCE):
        js = range(first + run.start - 1, first + run.stop)  # and the J below
        stacks = stacked(sectors, js)
        ups, below = ({p: stack.selected(part) for p, stack in stacks.items()} for part in (slice(1, None), slice(-1)))
        least = [limits.strengths(stacks.values(), rise) for rise in (0, 1)]
        parts = _parts(int(counts[max(js.start, 0) : js.stop].max()), least[0].shape[1])
        thresholds = [[np.ascontiguousarray(strengths[:, up, low]) for strengths in least] for up, low in parts]
        for stack in ups.values():
            products = [(1, *product) for product in vector.products(stack, below)]
            products += [(0, *product) for product in vector.products(stack, ups)]
            for sign in (1, -1):
                rows = stack.rows[:, stack.sign_slice(sign)]
                for (up, low), strengths in zip(parts, thresholds, strict=True):
                    pairs = [(p.part(up, low), strengths[rise]) for rise, of, p in products if of == sign]
                    if pairs:
                        yield _strong_lines(rows[:, up], pairs, memory)


def reaching(levels: Levels, needed: Floats, most: float) -> Ints:
    """By J, how many of the lowest states of its blocks may be lower states of lines above the cut.

    The strengths of one lower state add up to (2J+1) μ² over all upper states (sum rule of direction cosines), which bounds each of them;
    ν is at most the distance to the highest level of J - 1, J and J + 1.
    """
    j, starts = levels.quanta["j"], np.array([block.start for block in levels.blocks])
    highest = np.full(j.max() + 3, -np.inf)  # of J - 1, from J = -1 on
    np.maximum.at(highest, j + 1, levels.energy_mhz)
    highest = np.maximum(np.maximum(highest[:-2], highest[1:-1]), highest[2:])  # a line leads to J - 1, J or J + 1
    # a bound by the largest frequency: no line of this level can be stronger
    reaches = (highest[j] - levels.energy_mhz) * (2 * j + 1) * most >= needed
    place = np.arange(len(levels)) - np.repeat(starts, np.diff(np.append(starts, len(levels))))
    counts = np.zeros(j.max() + 1, dtype=np.int64)
    np.maximum.at(counts, j, np.where(reaches, place + 1, 0))
    return counts


class _Limits:
    """What a line of each level needs, and the energies; the last place is that of states that are not there."""

    def __init__(self, levels: Levels, needed: Floats, highest_mhz: float) -> None:
        self.needed, self.highest_mhz = np.append(needed, np.inf), highest_mhz
        self.from_mhz, self.to_mhz = (np.append(levels.energy_mhz, beyond) for beyond in (np.inf, -np.inf))

    def strengths(self, stacks: Iterable[ParityStates], rise: int) -> Floats:
        """S (J, m, m) below which a line between states in these places of any of the blocks of J and of J - `rise` is too weak."""
        rows = np.concatenate([stack.rows.reshape(len(stack.rows), 2, -1) for stack in stacks], axis=1)
        needed, lowest = self.needed[rows].min(axis=1), self.from_mhz[rows].min(axis=1)
        highest = self.to_mhz[rows].max(axis=1)
        up, low = slice(1, None), slice(1 - rise, len(rows) - rise)
        span = np.maximum(highest[up, :, None] - lowest[low, None], highest[low, None] - lowest[up, :, None])
        span = np.clip(span, SMALLEST_MHZ, self.highest_mhz, out=span)
        least = np.minimum(needed[up, :, None], needed[low, None])
        least *= 1 - ROUND_OFF  # the bound must not cut by round-off
        with np.errstate(over="ignore"):  # infinite: no line reaches the cut
            return np.asarray(np.divide(least, span, out=span))


def _parts(count: int, size: int) -> list[tuple[slice, slice]]:
    """Upper and lower states between which a line may reach the cut: those with low-lying states of either block."""
    everything, lowest = slice(0, size), slice(0, count)
    if count >= size:
        return [(everything, everything)]
    return [(everything, lowest), (lowest, slice(count, size))] if count else []


class _Memory:
    """Reused arrays: products of blocks, and a mask of elements above the cut."""

    def __init__(self) -> None:
        self._elements, self._keep = np.empty(0), np.empty(0, np.bool_)

    def arrays(self, *shape: int) -> tuple[Floats, NDArray[np.bool_]]:
        """An array for elements, and one for the mask."""
        size = math.prod(shape)
        if len(self._elements) < size:
            self._elements, self._keep = np.empty(size), np.empty(size, np.bool_)
        return self._elements[:size].reshape(shape), self._keep[:size].reshape(shape)


def _strong_lines(rows: Ints, products: list[tuple[Product, Floats]], memory: _Memory) -> StrongLines:
    """Lines between upper states (J, n_up) and lower ones with at least the strengths (J, n_up, n_low) beside each product."""
    others = np.stack([product.rows for product, _ in products])
    strength, keep = memory.arrays(len(products), *rows.shape, others.shape[-1])
    for (product, least), part, mask in zip(products, strength, keep, strict=True):
        np.matmul(product.moved.transpose(0, 2, 1), product.low, out=part)
        np.multiply(part, part, out=part)
        np.greater_equal(part, least, out=mask)

    places, width = np.flatnonzero(keep), others.shape[-1]
    row = places // width
    block = row // rows.shape[1]
    column = places + (block - row) * width
    row -= row // rows.size * rows.size  # the remainder in a third of the time
    return rows.ravel()[row], others.ravel()[column], strength.reshape(-1)[places]
