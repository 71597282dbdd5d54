"""Elements of operators of the rotation between Wang functions, of all J at once.

    |J K s)) = i^J φ (|K⟩ + s |-K⟩)/√2 for K > 0,    i^J φ |0⟩ for K = 0,    φ of `wang.basis.phase`

(`operators.tensors`). A shift of K by q leads from K to K + q and from -K to -K + q, functions of K' = |K + q| and |K - q|. Where both lead
to one function, and where several shifts do, the elements are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.wang.basis import NOTHING, SPECIES, SpeciesFactors, WangBlock, phase

Steps = tuple[tuple[int, int], ...]  # of J and K, of each shift of an operator
_POWERS_OF_I = np.array([1, 1j, -1, -1j])


class WangFunctions:
    """The functions of Wang blocks, one block behind the other, in order of J: block, place in it, J, K, and factors of |K⟩ and |-K⟩."""

    def __init__(self, blocks: Sequence[WangBlock]) -> None:
        sizes = [block.size for block in blocks]
        self.blocks = tuple(blocks)
        self.block = np.repeat(np.arange(len(blocks)), sizes)
        self.place = np.arange(len(self.block)) - np.repeat(np.cumsum([0, *sizes[:-1]]), sizes)
        self.j_of_block = np.array([block.j for block in blocks])
        self.species = np.array([SPECIES.index(block.species) for block in blocks])
        self.j = self.j_of_block[self.block]
        self.k = np.array([block.first_k for block in blocks])[self.block] + 2 * self.place
        self.sign = np.array([block.sign for block in blocks])[self.block]
        phases = _POWERS_OF_I[self.j_of_block % 4] * np.array([phase(block) for block in blocks])
        self.plus = phases[self.block] * np.where(self.k == 0, 1.0, np.sqrt(0.5))
        occurring, number = np.unique(self.j, return_inverse=True)
        self._number_of_j = np.full(int(occurring[-1]) + 1, -1)
        self._number_of_j[occurring] = np.arange(len(occurring))
        self._rows = np.full((len(occurring), int(self.k.max()) + 1, 2), -1)
        self._rows[number, self.k, (self.sign > 0).astype(int)] = np.arange(len(self.j))

    def rows(self, j: Ints, k: Ints, sign: int) -> Ints:
        """Rows of the functions |J K sign), -1 where there is none."""
        inside = (j >= 0) & (j < len(self._number_of_j)) & (k < self._rows.shape[1])
        number = np.where(inside, self._number_of_j[np.where(inside, j, 0)], -1)
        return np.where(number < 0, -1, self._rows[number, np.where(inside, k, 0), int(sign > 0)])


class WangElements(NamedTuple):
    """Elements between blocks: blocks of bra and ket, row and column in them, values."""

    up: Ints
    low: Ints
    rows: Ints
    columns: Ints
    values: Floats


class _Paths(NamedTuple):
    """How shifts lead between functions: from which of the evaluated factors, with which weight, to which place.

    places are sorted by pairs of blocks; pair: of each place; starts: the first place of each pair; up, low: blocks of each pair
    """

    source: Ints
    weight: NDArray[np.complex128]
    place: Ints
    rows: Ints
    columns: Ints
    pair: Ints
    starts: Ints
    up: Ints
    low: Ints


class BetweenStates:
    """Elements of operators between the Wang functions of the bra and those of the ket."""

    def __init__(self, up: WangFunctions, low: WangFunctions) -> None:
        self._up, self._low = up, low
        negative = np.flatnonzero(low.k)
        self._columns = np.concatenate([np.arange(len(low.k)), negative])
        self._labels = {"J": low.j[self._columns], "K": np.concatenate([low.k, -low.k[negative]])}
        self._amplitudes = np.concatenate([low.plus, (low.sign * low.plus)[negative]])
        self._paths: dict[Steps, _Paths] = {}

    def elements(self, operator: Operator, factors: SpeciesFactors | None = None) -> tuple[WangElements, bool]:
        """Real elements without round-off of zero, in order of the blocks of the bra, and whether some have an imaginary part.

        factors: of pairs of species, which multiply the elements.
        """
        shifts = {}
        for each in operator.merged().shifts:
            steps = dict(each.change)
            shifts[steps.get("J", 0), steps.get("K", 0)] = each.factor
        paths = self._paths_of(tuple(shifts))
        if not len(paths.rows):
            none = np.zeros(0, dtype=np.int64)
            return WangElements(none, none, none, none, np.zeros(0)), False
        count = len(self._columns)
        evaluated = np.array([np.broadcast_to(factor(self._labels), count) for factor in shifts.values()])
        contributions = evaluated.ravel()[paths.source] * paths.weight
        parts = [np.bincount(paths.place, part, len(paths.rows)) for part in (contributions.real, contributions.imag)]
        largest = np.zeros(int(self._labels["J"].max()) + 1)
        np.maximum.at(largest, self._labels["J"], np.abs(evaluated).max(axis=0))
        least = NOTHING * np.nan_to_num(largest, posinf=0.0)[self._low.j_of_block[paths.low]]
        if factors is not None:
            scale = np.array(factors)[self._up.species[paths.up], self._low.species[paths.low]]
            parts = [part * scale[paths.pair] for part in parts]
        real, imaginary = (np.maximum.reduceat(np.abs(part), paths.starts) for part in parts)
        acting = ~(real <= least)
        chosen = np.flatnonzero(acting[paths.pair] & (parts[0] != 0))
        pair, rows, columns = paths.pair[chosen], paths.rows[chosen], paths.columns[chosen]
        places = self._up.place[rows], self._low.place[columns]
        values = np.asarray(parts[0][chosen], dtype=float)
        return WangElements(paths.up[pair], paths.low[pair], *places, values), bool((imaginary > least).any())

    def _paths_of(self, steps: Steps) -> _Paths:
        if steps in self._paths:
            return self._paths[steps]
        up, low, none = self._up, self._low, np.zeros(0, dtype=np.int64)
        pieces = [(none, none, none, np.zeros(0, dtype=np.complex128))]
        for number, (rise, step) in enumerate(steps):
            target = self._labels["K"] + step
            for sign in (1, -1):
                rows = up.rows(self._labels["J"] + rise, np.abs(target), sign)
                at = np.flatnonzero(rows >= 0)
                back = up.plus[rows[at]].conj() * np.where(target[at] < 0, sign, 1)
                pieces.append((number * len(target) + at, rows[at], self._columns[at], back * self._amplitudes[at]))
        source, rows, columns, weight = (np.concatenate(column) for column in zip(*pieces, strict=True))
        pairs = up.block[rows] * len(low.blocks) + low.block[columns]
        keys = (pairs * len(up.k) + rows) * len(low.k) + columns
        _, first, place = np.unique(keys, return_index=True, return_inverse=True)
        starts = np.flatnonzero(np.diff(pairs[first], prepend=-1))
        pair = np.cumsum(np.bincount(starts, minlength=len(first))) - 1
        blocks = np.divmod(pairs[first][starts], len(low.blocks))
        self._paths[steps] = _Paths(source, weight, place, rows[first], columns[first], pair, starts, *blocks)
        return self._paths[steps]
