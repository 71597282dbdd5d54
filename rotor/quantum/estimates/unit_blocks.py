"""Blocks of a Hamiltonian that is linear in its parameters, H_b = Σ c_i O_i,b: made once, solved again and again.

The unit matrices O_i,b over the functions of a block are taken as their elements that are not zero, the same places for all
parameters, so that new constants cost one product of a matrix and a vector a block, one diagonalisation, and

    ∂E_n/∂c_i = ⟨n|O_i|n⟩ = Σ_(r,c) O_i(r, c) v_r v_c

another product for the states that have a label. A state is named by the sub-block (a Wang block of one state v, and one pattern of
coupling) that has most of it, and within a sub-block by the order of energy. As long as those shares point to the same sub-blocks as
at the start, state n stays state n; where they do not, the names are made anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints

Namer = Callable[[Floats, Floats, Floats], Ints]  # matrix, energies, vectors -> names (n, columns) of the states


@dataclass(frozen=True)
class UnitBlock:
    """One block: size, places (row, column, row ≥ column) of elements, their factors (elements, columns), which parameters.

    members (sub-blocks, functions) : 1 where a function is in a sub-block. twice (elements,) : 2 off the diagonal
    namer : names of all states, where they must be made
    """

    size: int
    rows: Ints
    columns: Ints
    factors: Floats
    parameters: Ints
    members: Floats
    twice: Floats
    namer: Namer

    def matrix(self, values_mhz: Floats) -> Floats:
        """H (size, size), lower triangle."""
        out = np.zeros((self.size, self.size))
        out[self.rows, self.columns] = self.factors @ values_mhz[self.parameters]
        return out

    def slopes(self, vectors: Floats) -> Floats:
        """⟨n|O_i|n⟩ (states, parameters of the block) of states in columns."""
        weights = vectors[self.rows] * vectors[self.columns] * self.twice[:, None]
        return np.asarray(weights.T @ self.factors)


class Elements(NamedTuple):
    """Elements of a matrix that are not zero, of its lower triangle: places row * size + column, rising, and values."""

    places: Ints
    values: Floats


def elements_of(matrix: Floats) -> Elements:
    """Of a dense matrix (size, size).

    >>> elements_of(np.array([[1.0, 9.0], [0.0, 2.0]])).places.tolist()
    [0, 3]
    """
    places = np.flatnonzero(np.tril(matrix))
    return Elements(places, matrix.ravel()[places])


def unit_block(units: dict[int, Elements], sub_blocks: Ints, namer: Namer) -> UnitBlock:
    """From the unit matrix of every parameter, by its number, that acts in the block."""
    parameters, size = sorted(units), len(sub_blocks)
    diagonal = np.arange(size) * (size + 1)
    places = np.unique(np.concatenate([diagonal, *(units[i].places for i in parameters)]))
    factors = np.zeros((len(places), len(parameters)))
    for column, i in enumerate(parameters):
        factors[np.searchsorted(places, units[i].places), column] = units[i].values
    rows, columns = np.divmod(places, size)
    members = (sub_blocks[None, :] == np.arange(sub_blocks.max(initial=0) + 1)[:, None]).astype(float)
    twice = np.where(rows == columns, 1.0, 2.0)
    return UnitBlock(size, rows, columns, factors, np.array(parameters, dtype=np.int64), members, twice, namer)


@dataclass
class _Tracked:
    """Labels in a block: their places among all, the states that have them, and the sub-blocks of all states at that time."""

    block: UnitBlock
    rows: Ints
    names: Ints
    states: Ints
    leading: Ints


class UnitBlocks:
    """Blocks with the labels that lie in them; `levels` gives energies and derivatives, in the order of the labels."""

    def __init__(
        self,
        blocks: Sequence[UnitBlock],
        count: int,
        find: Callable[[int, Ints], tuple[Ints, Ints]],
        values_mhz: Floats,
    ) -> None:
        """Labels are looked for in the blocks solved at `values_mhz`.

        count : labels. find : number of a block and names (n, columns) of its states to places of labels in it, and which states
        """
        self.count = count
        self._tracked: list[_Tracked] = []
        for number, block in enumerate(blocks):
            matrix, energies, vectors = _solved(block, values_mhz)
            names = block.namer(matrix, energies, vectors)
            rows, states = find(number, names)
            if len(rows):
                leading = _leading(block, vectors)
                self._tracked.append(_Tracked(block, rows, names[states], states, leading))

    @property
    def found(self) -> Ints:
        """Places of the labels that were found."""
        return np.concatenate([one.rows for one in self._tracked]) if self._tracked else np.zeros(0, dtype=np.int64)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (count,) and derivatives (count, parameters); nan for labels that are not in these blocks."""
        energies = np.full(self.count, np.nan)
        slopes = np.zeros((self.count, len(values_mhz)))
        for one in self._tracked:
            matrix, solved, vectors = _solved(one.block, values_mhz)
            states = self._states(one, matrix, solved, vectors)
            energies[one.rows] = solved[states]
            slopes[one.rows[:, None], one.block.parameters] = one.block.slopes(vectors[:, states])
        return energies, slopes

    def _states(self, one: _Tracked, matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        """The states that have the labels now; names are made anew only where a state is mostly in another sub-block."""
        leading = _leading(one.block, vectors)
        if (leading == one.leading).all():
            return one.states
        names = {tuple(name): state for state, name in enumerate(one.block.namer(matrix, energies, vectors).tolist())}
        found = [names.get(tuple(name), -1) for name in one.names.tolist()]
        if min(found) < 0:
            raise ValueError("a labelled level has no state of its name with these constants")
        return np.array(found)


def _solved(block: UnitBlock, values_mhz: Floats) -> tuple[Floats, Floats, Floats]:
    """Matrix, energies and vectors; a number is taken off the diagonal for the sake of digits, and added to the energies."""
    matrix = block.matrix(values_mhz)
    zero = float(matrix[0, 0])
    matrix.ravel()[:: block.size + 1] -= zero
    if not math.isfinite(float(matrix.sum())):
        raise ValueError("a block of the Hamiltonian is not finite with these constants")
    energies, vectors = np.linalg.eigh(matrix)
    return matrix, energies + zero, vectors


def _leading(block: UnitBlock, vectors: Floats) -> Ints:
    """The sub-block with the largest share of each state, (n,)."""
    if len(block.members) == 1:
        return np.zeros(block.size, dtype=np.int64)
    return np.asarray((block.members @ vectors**2).argmax(axis=0))
