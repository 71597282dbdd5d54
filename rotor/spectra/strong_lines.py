"""Lines between the Wang blocks of neighbouring J that may reach an intensity: few large products, and bounds before them.

A line of the frequency ν and the strength S can only reach a cut where ν S is at least what the larger population of both states
needs (the photon factor, at most 1, left out). The highest frequency there can be in a product of two blocks stands for ν at
first, so that two comparisons of S suffice for most of its elements.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats, Indices, Ints
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.stacked_blocks import Group, Memory, Product, Slot, Vector, groups_of
from rotor.quantum.tensors import BodyTensor

ROUND_OFF = 1e-9  # of a threshold, by which a line that is compared exactly later may miss it

Found = tuple[Indices, Indices, Floats]  # rows of both states, and S in D²


def strong_lines(
    levels: Levels, blocks: Sequence[SolvedBlock], dipole: BodyTensor, needed: Floats, highest_mhz: float
) -> Iterator[Found]:
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
    memory, most = Memory(), sum(abs(part) ** 2 for part in dipole.components)
    bounds = _Bounds.of(levels, needed, highest_mhz, reaching(levels, needed, most), memory)
    vector = Vector(dipole, memory)
    whole = len(blocks) == len(levels.blocks)
    lower = {block.basis.j for block in blocks if bounds.reaching[block.start]}
    near = lower.union(*({j - 1, j + 1} for j in lower))
    for group in groups_of([block for block in blocks if block.basis.j in near], memory):
        every, scale = np.arange(1, len(group.js)), bounds.scale(group)
        rows = {slot: bounds.rows(group, slot) for slot in group.starts}
        for places in (every,) if whole else (every[::2], every[1::2]):  # missing species have other signs at J + 1
            products: dict[Slot, list[Product]] = {}
            for slot, product in vector.products(group, places) if len(places) else ():
                if (whole and group.js[0] > 1) or _are_there(group, slot, places, product):
                    products.setdefault(slot, []).append(product)
            for slot, lows in products.items():
                yield from _found(rows[slot][places], rows, lows, bounds, scale)


def reaching(levels: Levels, needed: Floats, most: float) -> Ints:
    """Of every level of Wang blocks: 1 + the place in its block of the highest one there that may be the lower state of a line, else 0.

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
    return np.asarray(np.repeat(np.clip(last - starts, 0, sizes), sizes))


@dataclass(frozen=True)
class _Bounds:
    """What a line needs, with one row more, for states that are not there: energies in MHz, ν S in MHz D², states that reach."""

    energy: Floats
    needed: Floats
    reaching: Ints
    highest_mhz: float
    memory: Memory

    @staticmethod
    def of(levels: Levels, needed: Floats, highest_mhz: float, reaching: Ints, memory: Memory) -> _Bounds:
        return _Bounds(levels.energy_mhz, np.append(needed, np.inf), np.append(reaching, 0), highest_mhz, memory)

    def rows(self, group: Group, slot: Slot) -> Ints:
        """Rows (g, n) in the levels of the states of a slot; one beyond the last where there is none."""
        starts, counts = group.starts[slot][:, None], group.counts[slot][:, None]
        states = np.arange(counts.max())
        return np.where(states < counts, starts + states, len(self.energy))

    def scale(self, group: Group) -> float:
        """1/ν of the highest frequency that counts in a group, less round-off."""
        own = [(group.starts[slot][g], group.counts[slot][g]) for slot in group.starts for g in range(len(group.js))]
        energies = [self.energy[place] for start, count in own if count for place in (start, start + count - 1)]
        highest = min(max(energies) - min(energies), self.highest_mhz)
        return (1 - ROUND_OFF) / highest if highest > 0 else math.inf


def _are_there(group: Group, slot: Slot, places: Ints, product: Product) -> bool:
    """Whether both blocks of a product have states at some place."""
    there = group.counts[slot][places] * group.counts[product.low_slot][product.low_places]
    return bool(there.any())


def _found(
    ups: Ints, rows: dict[Slot, Ints], products: list[Product], bounds: _Bounds, scale: float
) -> Iterator[Found]:
    """The lines of the states of one slot with those of lower slots whose strengths may suffice.

    All states of one side with the lowest ones of the other can make lines that reach the cut, and the other way round.
    """
    lows = [rows[one.low_slot][one.low_places] for one in products]
    all_up, of_up = ups.shape[1], int(bounds.reaching[ups].max(initial=0))
    if of_up >= all_up:
        yield from _among(ups, lows, products, all_up, [(0, low.shape[1]) for low in lows], bounds, scale)
        return
    splits = [int(bounds.reaching[low].max(initial=0)) for low in lows]
    yield from _among(ups, lows, products, all_up, [(0, split) for split in splits], bounds, scale)
    others = [(split, low.shape[1]) for low, split in zip(lows, splits, strict=True)]
    yield from _among(ups, lows, products, of_up, others, bounds, scale)


def _among(
    ups: Ints, lows: list[Ints], products: list[Product], count: int, parts: list[tuple[int, int]],
    bounds: _Bounds, scale: float,
) -> Iterator[Found]:  # fmt: skip
    """The same of the lowest `count` upper states and a part of each of the lower ones."""
    ups = ups[:, :count]
    others = np.hstack([low[:, first:last] for low, (first, last) in zip(lows, parts, strict=True)])
    shape = (*ups.shape, others.shape[1])
    if not math.prod(shape):
        return
    strength, keep, other = (
        bounds.memory.room(*one) for one in (("s", shape, float), ("k", shape, bool), ("o", shape, bool))
    )
    at = 0
    for one, (first, last) in zip(products, parts, strict=True):
        here = slice(at, at + last - first)
        np.matmul(one.moved[:, :, :count].transpose(0, 2, 1), one.low[:, :, first:last], out=strength[:, :, here])
        at = here.stop
    np.multiply(strength, strength, out=strength)

    np.greater_equal(strength, scale * bounds.needed[ups][:, :, None], out=keep)
    np.greater_equal(strength, scale * bounds.needed[others][:, None, :], out=other)
    np.logical_or(keep, other, out=keep)

    found = np.flatnonzero(keep)
    row = found // shape[2]
    column = found - row * shape[2] + row // count * shape[2]
    yield (
        ups.reshape(-1)[row].astype(np.int32),
        others.reshape(-1)[column].astype(np.int32),
        strength.reshape(-1)[found],
    )
