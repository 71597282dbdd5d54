"""Blocks of a Hamiltonian that is linear in its parameters, H_b = Σ c_i O_i,b, of like size side by side.

The O_i,b over the functions of a block are taken as their elements that are not zero, the same places for all parameters. Parameters
that multiply one matrix times a number each (B, D_J and H_J at one J) share its elements, O_i = Σ_u M_ui U_u. Blocks of like size stand in
one array, padded, so that new constants cost some products of arrays, one diagonalisation a block, and

    ∂E_n/∂c_i = ⟨n|O_i|n⟩ = Σ_u M_ui Σ_(r,c) U_u(r, c) v_r* v_c

more products for the states that are asked for. `connected` finds the blocks of an operator algebra, `basis.state_elements` and
`spins.linear_blocks` write those of states and spins, `labels.tracking` follows named states while constants change.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace, runs_of_similar_size, symmetric_from_lower
from rotor.frozen import dataclass
from rotor.quantum.wang.twisted import twisted

_AT_ONCE = 1 << 18  # numbers of the largest array of blocks side by side: 2 MB, which stays in the cache of a core
_LARGE, _NARROW = 600, 15  # size, and bandwidths in it, from which the banded solver is faster
_FEW = 8  # single vectors take less time than all of them where they are at most one in so many
_LEAST = 20  # smallest size for single vectors
_CLOSE = 1e-6  # of the largest energy: closer ones would have single vectors with less than nine digits
_ASIDE = 1e-15  # shift of energies, relative to the largest, so that no pivot is 0
_RESIDUAL = 1e-12  # largest residual of a single vector, relative to the largest energy and the size
_LIKE, _SMALL = 1.5, 8  # largest ratio of sizes of blocks that stand side by side, and sizes that all do


class LinearBlock(NamedTuple):
    """One block: size, places (row, column, row ≥ column) of elements, their factors (elements, units), and what the parameters
    `parameters` have of each unit, mix (units, parameters)."""

    size: int
    rows: Ints
    columns: Ints
    factors: NDArray[Any]
    mix: Floats
    parameters: Ints

    @property
    def shape(self) -> tuple[int, int, int]:
        """Its size, and how many elements and units it has."""
        return self.size, *self.factors.shape

    def matrices(self) -> Floats:
        """The O_i of its parameters, whole: (parameters, size, size)."""
        lower = np.zeros((len(self.parameters), self.size, self.size))
        lower[:, self.rows, self.columns] = (self.factors @ self.mix).T
        return symmetric_from_lower(lower)

    def elements(self, values_mhz: Floats) -> NDArray[Any]:
        """The elements of H, lower triangle, at values (parameters,)."""
        return np.asarray(self.factors @ (self.mix @ values_mhz[self.parameters]))

    def lower(self, values_mhz: Floats) -> NDArray[Any]:
        """The lower triangle of H at values (parameters,)."""
        lower = np.zeros((self.size, self.size), dtype=self.factors.dtype)
        lower[self.rows, self.columns] = self.elements(values_mhz)
        return lower

    def energies(self, values_mhz: Floats) -> Floats:
        """Energies (size,), rising, at values (parameters,); of a large block with elements near the diagonal as a banded matrix."""
        distance = self.rows - self.columns
        width = int(distance.max(initial=0))
        if self.size < _LARGE or _NARROW * width > self.size:
            return np.asarray(np.linalg.eigvalsh(self.lower(values_mhz)))
        from scipy.linalg import eigvals_banded

        bands = np.zeros((width + 1, self.size), dtype=self.factors.dtype)
        bands[distance, self.columns] = self.elements(values_mhz)
        return np.asarray(eigvals_banded(bands, lower=True, check_finite=False))

    def diagonal(self, values_mhz: Floats) -> Floats:
        """The diagonal of H at values (parameters,)."""
        diagonal, alone = np.zeros(self.size), self.rows == self.columns
        diagonal[self.rows[alone]] = self.elements(values_mhz)[alone].real
        return diagonal

    def sparse(self, values_mhz: Floats) -> Any:
        """The lower triangle of H at values (parameters,) as a sparse matrix."""
        from scipy.sparse import csr_array

        return csr_array((self.elements(values_mhz), (self.rows, self.columns)), shape=(self.size, self.size))

    def slopes(self, vectors: Floats) -> Floats:
        """⟨n|O_i|n⟩ (n, parameters of the block) of vectors (size, n)."""
        weights = (vectors[self.rows].conj() * vectors[self.columns]).real
        weights *= np.where(self.rows == self.columns, 1.0, 2.0)[:, None]
        return np.asarray(weights.T @ self.factors @ self.mix)

    def turned(self, functions: Floats) -> LinearBlock:
        """The block over other functions, given in rows over those of this one."""
        matrices = functions @ self.matrices() @ functions.T
        places = np.flatnonzero(np.tril(matrices.any(axis=0)))
        return linear_block(
            len(functions),
            [WeightedElements(places, matrices.reshape(-1, len(functions) ** 2)[:, places].T, self.parameters)],
        )


@dataclass(frozen=True, eq=False)
class LinearStack:
    """Blocks of like size, in order of size, side by side, padded with elements that are 0.

    sizes : of each block
    places (blocks, elements) : in all matrices, one behind the other, the place behind them where padded
    rows, columns (blocks, elements) : as of the blocks, counted through all of them, `size` for each
    half, factors, mix, parameters : half is 1 on the diagonal, else 1/2, and factors are those of the blocks over it; padded parameters
    are the one behind all, whose value is 0
    """

    sizes: Ints
    places: Ints
    rows: Ints
    columns: Ints
    half: Floats
    factors: Floats
    mix: Floats
    parameters: Ints

    @classmethod
    def from_blocks(cls, blocks: Sequence[LinearBlock]) -> LinearStack:
        """Blocks side by side, in order of size."""
        sizes = np.array([block.size for block in blocks])
        count, offsets = len(blocks), np.cumsum([0, *(sizes**2).tolist()])
        most, units = max(len(b.rows) for b in blocks), max(b.factors.shape[1] for b in blocks)
        acting = max(len(b.parameters) for b in blocks)
        places, half = np.full((count, most), offsets[-1]), np.ones((count, most))
        rows, columns = np.zeros((2, count, most), dtype=np.int64)
        factors, mix = np.zeros((count, most, units)), np.zeros((count, units, acting))
        parameters = np.full((count, acting), -1)
        for b, block in enumerate(blocks):
            n = len(block.rows)
            places[b, :n] = offsets[b] + block.rows * block.size + block.columns
            rows[b, :n], columns[b, :n] = block.rows, block.columns
            half[b, :n][block.rows != block.columns] = 0.5
            factors[b, :n, : block.factors.shape[1]] = block.factors / half[b, :n, None]
            mix[b, : block.mix.shape[0], : block.mix.shape[1]] = block.mix
            parameters[b, : len(block.parameters)] = block.parameters
        first = int(sizes[-1]) * np.arange(count)[:, None]
        return cls(sizes, places, rows + first, columns + first, half, factors, mix, parameters)

    @property
    def size(self) -> int:
        """Size of the largest block."""
        return int(self.sizes[-1])

    @cached_property
    def offsets(self) -> Ints:
        """Where each matrix begins, all of them one behind the other, and where the last one ends: (blocks + 1,)."""
        return np.cumsum([0, *(self.sizes**2).tolist()])

    @cached_property
    def runs(self) -> tuple[tuple[int, int, int], ...]:
        """Of the blocks of each size the first, the one behind the last, and the size."""
        bounds = [0, *(1 + np.flatnonzero(np.diff(self.sizes))).tolist(), len(self.sizes)]
        return tuple((i, k, int(self.sizes[i])) for i, k in pairwise(bounds))

    @cached_property
    def _diagonal(self) -> Ints:
        """The places of all diagonals."""
        starts = zip(self.offsets, self.sizes, strict=False)
        return np.concatenate([start + np.arange(n) * (n + 1) for start, n in starts])

    @cached_property
    def _below_diagonal(self) -> Ints:
        """The places of all elements below the diagonals."""
        starts = zip(self.offsets, self.sizes, strict=False)
        return np.concatenate([start + n + np.arange(n - 1) * (n + 1) for start, n in starts])

    @cached_property
    def _is_tridiagonal(self) -> bool:
        """Whether all elements are on the diagonal or beside it."""
        return bool((self.rows - self.columns <= 1).all())

    def assembled(self, values_mhz: Floats, space: Workspace) -> tuple[Floats, Floats]:
        """Lower triangles one behind the other, and the number (blocks,) that is taken off each diagonal for the sake of digits."""
        values = np.append(values_mhz, 0.0)[self.parameters]
        elements = (self.factors @ (self.mix @ values[:, :, None]))[:, :, 0]
        elements *= self.half
        whole = space.array("matrices", int(self.offsets[-1]) + 1)
        whole.fill(0.0)
        whole[self.places] = elements
        if not np.isfinite(whole.sum()):
            raise ValueError("a block of the Hamiltonian is not finite with these constants")
        zero = whole[self.offsets[:-1]]
        whole[self._diagonal] -= np.repeat(zero, self.sizes)
        return whole, zero

    def solved(self, values_mhz: Floats, space: Workspace) -> tuple[Floats, Floats, Floats]:
        """Energies (blocks, size), NaN beyond a block, vectors (blocks, size, size), 0 beyond a block, and matrices (`assembled`)."""
        matrices, zero = self.assembled(values_mhz, space)
        return *self.all_states(matrices, zero, space), matrices

    def all_states(self, matrices: Floats, zero: Floats, space: Workspace) -> tuple[Floats, Floats]:
        """Energies (blocks, size), NaN beyond a block, and vectors (blocks, size, size), 0 beyond a block, of `assembled` matrices."""
        count, size = len(self.sizes), self.size
        energies, vectors = np.full((count, size), np.nan), space.array("vectors", count, size, size)
        vectors[:, self.runs[0][2] :, :] = vectors[:, :, self.runs[0][2] :] = 0.0
        for first, stop, n in self.runs:
            whole = matrices[self.offsets[first] : self.offsets[stop]].reshape(-1, n, n)
            energies[first:stop, :n], vectors[first:stop, :n, :n] = np.linalg.eigh(whole)
        return energies + zero[:, None], vectors

    def few_states(
        self, states: Ints, matrices: Floats, zero: Floats, space: Workspace
    ) -> tuple[Floats, Floats] | None:
        """Energies (blocks, size) and vectors (blocks, size, states) of few states (blocks, states) of tridiagonal blocks.

        None for other blocks, for many states, and where neighbouring energies are too close for single vectors.
        """
        (count, most), size = states.shape, self.size
        if not self._is_tridiagonal or max(_FEW * most, _LEAST) > size:
            return None
        energies = np.full((count, size), np.nan)
        for first, stop, n in self.runs:
            whole = matrices[self.offsets[first] : self.offsets[stop]].reshape(-1, n, n)
            energies[first:stop, :n] = np.linalg.eigvalsh(whole)
        largest = np.nanmax(np.abs(energies), axis=1, keepdims=True)
        if (np.diff(energies, axis=1) <= _CLOSE * largest).any():
            return None
        below, inside = np.zeros((count, size)), np.arange(size) < self.sizes[:, None]
        below[:, 1:][inside[:, 1:]] = matrices[self._below_diagonal]
        shifted = np.where(inside, self.diagonals(matrices), 4 * largest)[:, :, None]
        shifted = shifted - (np.take_along_axis(energies, states, axis=1) + _ASIDE * largest)[:, None, :]
        shifted = shifted.transpose(1, 0, 2).reshape(size, -1)
        vectors, squares, gamma, _ = twisted(shifted, np.repeat(below.T[1:], most, axis=1), space)
        bound = _RESIDUAL * size * np.repeat(largest, most) * np.sqrt(squares)
        if not (np.isfinite(squares) & (np.abs(gamma) <= bound)).all():
            return None
        return energies + zero[:, None], vectors.reshape(size, count, most).transpose(1, 0, 2).copy()

    def matrix(self, matrices: Floats, place: int) -> Floats:
        """The lower triangle of one block, of all of them one behind the other."""
        n = int(self.sizes[place])
        return matrices[self.offsets[place] : self.offsets[place + 1]].reshape(n, n)

    def diagonals(self, matrices: Floats) -> Floats:
        """The diagonals (blocks, size) of the matrices, one behind the other, 0 beyond a block."""
        out = np.zeros((len(self.sizes), self.size))
        out[np.arange(self.size) < self.sizes[:, None]] = matrices[self._diagonal]
        return out

    def slopes(self, vectors: Floats, states: Ints | None, space: Workspace) -> Floats:
        """⟨n|O_i|n⟩ (blocks, states, parameters of the blocks) of some states (blocks, states), or of all."""
        (count, elements), size = self.rows.shape, self.size
        if states is not None:
            places = size * size * np.arange(count)[:, None, None] + size * np.arange(size)[:, None]
            chosen = space.array("chosen", count, size, states.shape[1])
            vectors = vectors.ravel().take(places + states[:, None, :], out=chosen, mode="clip")
        most = vectors.shape[2]
        by_function = vectors.reshape(count * size, most)
        weights = by_function.take(self.rows, axis=0, out=space.array("weights", count, elements, most), mode="clip")
        weights *= by_function.take(self.columns, axis=0, out=space.array("others", count, elements, most), mode="clip")
        return np.asarray(weights.transpose(0, 2, 1) @ self.factors @ self.mix)


def stack_numbers(shapes: Sequence[tuple[int, int, int]]) -> list[Ints]:
    """Positions of the blocks that are worked on together, from size, elements and units of each: of like size, of bounded memory."""
    order = sorted(range(len(shapes)), key=lambda i: shapes[i])
    costs = [elements * max(units, size) for size, elements, units in shapes]
    sizes = [shapes[i][0] for i in order]
    runs = runs_of_similar_size(sizes, _LIKE, _SMALL, _AT_ONCE, [costs[i] for i in order])
    return [np.array(order[run]) for run in runs]


class WeightedElements(NamedTuple):
    """Elements of the matrices of several parameters: places row * size + column, none twice, factors (elements, parameters), and which
    parameters."""

    places: Ints
    factors: Floats
    parameters: Ints


def linear_block(size: int, elements: Sequence[WeightedElements]) -> LinearBlock:
    """The block of elements of lower triangles, which add up.

    >>> found = WeightedElements(np.array([0, 2]), np.array([[1.0], [0.5]]), np.array([3]))
    >>> block = linear_block(2, [found])
    >>> block.rows.tolist(), block.columns.tolist(), block.factors.ravel().tolist(), block.parameters.tolist()
    ([0, 1, 1], [0, 0, 1], [1.0, 0.5, 0.0], [3])
    """
    diagonal = np.arange(size) * (size + 1)
    places, position = numbered(np.concatenate([diagonal, *(element.places for element in elements)]), size * size)
    parameters = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(element.parameters for element in elements)]))
    factors, start = np.zeros((len(places), len(parameters))), size
    for element in elements:
        stop = start + len(element.places)
        factors[position[start:stop, None], np.searchsorted(parameters, element.parameters)] += element.factors
        start = stop
    acting = np.flatnonzero(factors.any(axis=0))
    return LinearBlock(
        size, *np.divmod(places, size), factors[:, acting], np.eye(len(acting)), parameters[acting]
    )  # fmt: skip


def numbered(values: Ints, count: int) -> tuple[Ints, Ints]:
    """The different ones of whole numbers from 0 to `count`, rising, and the place of each value among them.

    >>> [found.tolist() for found in numbered(np.array([3, 1, 3]), 4)]
    [[1, 3], [1, 0, 1]]
    """
    there = np.zeros(count, dtype=bool)
    there[values] = True
    occurring = np.flatnonzero(there)
    place = np.empty(count, dtype=np.int64)
    place[occurring] = np.arange(len(occurring))
    return occurring, place[values]
