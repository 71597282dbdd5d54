"""Matrices of scalar operators of the angular momentum in the Wang basis, block by block, and their eigenvalues.

An operator is a table {(p, q, n): c in MHz} of c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0: c · J^2p Jz^2q). With X = J(J+1),

    ⟨K|H|K⟩     = Σ c X^p K^2q                                             (n = 0)
    ⟨K+2n|H|K⟩  = Σ c X^p ½[(K+2n)^2q + K^2q] √∏_{i<2n} (J-K-i)(J+K+i+1)    (n > 0)

with the phases of J∓ (body-fixed) real and positive.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.wang.basis import WangBlock
from rotor.tops.constants.operators import Operators, Powers

FEW = 20  # bisection pays for at most one in so many eigenvalues
AT_ONCE = 32  # matrices of one size with at most so many rows are solved together
AT_ONCE_BLOCKS = 128  # blocks whose matrix elements are computed together: those of 32 J
_NONE: Floats = np.zeros((0, 0))
_ROOT_2 = float(np.sqrt(2))
SMALL = 100  # tridiagonal blocks with at most so many rows do not justify loading scipy.linalg (0.2 s)


def scalar_energy(operators: Operators, j: int) -> float:
    """The part Σ c X^p that is equal for all states of a J; matrices do not contain it, which reduces round-off."""
    x = j * (j + 1)
    return float(sum(c * x**p for (p, q, n), c in operators.items() if q == n == 0))


def diagonal_elements(operators: Operators, j: Ints, k: Ints) -> Floats:
    """Σ c X^p K^2q of the terms without ladders, at every J and K (n,)."""
    x, squares = (j * (j + 1)).astype(float), (k * k).astype(float)
    return np.asarray(sum((c * x**p * squares**q for (p, q, n), c in operators.items() if not n), np.zeros(x.shape)))


def order_of(operators: Iterable[Powers]) -> int:
    """The highest power n of the ladder operators."""
    return max((n for _, _, n in operators), default=0)


def elements_by_order(operators: Operators, js: Sequence[int]) -> list[Floats]:
    """⟨K+2n|H|K⟩ by n, (J, K) for K from -2 `order_of` to the highest J; zero for n > 0 and K + 2n beyond J."""
    order = order_of(operators)
    k, steps = _steps(js, order)
    with np.errstate(over="ignore", invalid="ignore"):  # reported where the block is diagonalised
        return [_elements_of_order(operators, js, k, n, steps) for n in range(order + 1)]


def _steps(js: Sequence[int], order: int) -> tuple[Ints, Floats]:
    """K from -2 `order` to the highest J, and elements of J₊ over |J K⟩ (J, K) up to K + 2 `order`, zero beyond K = J."""
    k, j = np.arange(-2 * order, max(js) + 2 * order + 1), np.array(js)[:, None]
    return k[: len(k) - 2 * order], np.sqrt(np.maximum((j - k) * (j + k + 1), 0))


def _elements_of_order(operators: Operators, js: Sequence[int], k: Ints, n: int, steps: Floats) -> Floats:
    """⟨K+2n|H|K⟩ = ½[P((K+2n)²) + P(K²)] times the ladder, P(y) = Σ_q y^q Σ_p c X^p: (J, K)."""
    powers = [(p, q, c) for (p, q, order), c in operators.items() if order == n]
    coefficients = np.zeros((len(js), 1 + max((q for _, q, _ in powers), default=0)))
    x = np.array(js) * (np.array(js) + 1.0)
    for p, q, c in powers:
        coefficients[:, -1 - q] += c * x**p

    squares = np.arange(k[0], k[-1] + 2 * n + 1.0) ** 2
    values = np.repeat(coefficients[:, :1], len(squares), axis=1)
    for column in range(1, coefficients.shape[1]):
        values *= squares
        values += coefficients[:, column, None]
    if n == 0:
        return values
    total = 0.5 * (values[:, : len(k)] + values[:, 2 * n :])
    for i in range(2 * n):
        total *= steps[:, i : i + len(k)]
    return np.asarray(total)


class WangRows(NamedTuple):
    """Functions of Wang blocks side by side: row of J in tables of elements, K (blocks, size), sign and size of each block as columns."""

    rows: Ints
    k: Ints
    sign: Ints
    sizes: Ints

    @classmethod
    def from_blocks(cls, blocks: Sequence[WangBlock], taken: Sequence[int]) -> tuple[list[int], WangRows]:
        """The J of the blocks, rising, and the rows. taken: how many of the functions of each block."""
        js, rows = np.unique([block.j for block in blocks], return_inverse=True)
        first, sign, sizes = (
            np.array(column)[:, None]
            for column in zip(*((b.first_k, b.sign, n) for b, n in zip(blocks, taken, strict=True)), strict=True)
        )
        return js.tolist(), cls(rows, first + 2 * np.arange(max(taken)), sign, sizes)

    def add(self, elements: Floats, n: int, order: int, diagonals: Sequence[Floats]) -> None:
        """Add ⟨K+2n|H|K⟩ (J, K), K from -2 `order` on, to the diagonals (blocks, size) of the blocks; the d-th has the elements (i + d, i).

        ⟨K' s|H|K s⟩ = ⟨K'|H|K⟩ + s ⟨K'|H|-K⟩, times √2 if one of K, K' is 0. The second term exists for K + K' = 2n; it folds an
        operator of high n back to lower diagonals.
        """
        index, last = np.arange(self.k.shape[1]), elements.shape[1] - 1
        direct = elements[self.rows[:, None], np.minimum(2 * order + self.k, last)]
        if n:
            direct[self.k == 0] *= _ROOT_2
        diagonals[n][...] += np.where(index + n < self.sizes, direct, 0.0)
        for low in range(1, n + 1):
            here = (self.k == low) & (index + n - low < self.sizes)
            folded = self.sign * elements[self.rows, 2 * order - low][:, None]
            diagonals[n - low][...] += np.where(here, folded, 0.0)


def block_bands(operators: Operators, blocks: Sequence[WangBlock]) -> Iterator[list[Floats]]:
    """Diagonals of the matrix of each block without the scalar part; the n-th has the elements (i+n, i), (size - n,)."""
    order, others = order_of(operators), {powers: c for powers, c in operators.items() if any(powers[1:])}
    for first in range(0, len(blocks), AT_ONCE_BLOCKS):
        chunk = blocks[first : first + AT_ONCE_BLOCKS]
        js, rows = WangRows.from_blocks(chunk, [block.size for block in chunk])
        diagonals = [np.zeros(rows.k.shape) for _ in range(order + 1)]
        with np.errstate(over="ignore", invalid="ignore"):  # reported where the block is diagonalised
            for n, elements in enumerate(elements_by_order(others, js)):
                rows.add(elements, n, order, diagonals)
        for number, block in enumerate(chunk):
            yield [diagonal[number, : block.size - n] for n, diagonal in enumerate(diagonals[: block.size])]


def diagonalise_all(matrices: Sequence[list[Floats]], vectors: bool = True) -> list[tuple[Floats, Floats]]:
    """Eigenvalues (rising) and eigenvectors (columns) of symmetric matrices from their diagonals.

    LAPACK's divide and conquer solves tridiagonal matrices (dstevd), its dense form (dsyevd, numpy's eigh) wider ones and small ones, those
    of equal size and width in one call. If scipy.linalg is not loaded yet, which takes longer than that, the dense form solves tridiagonal
    matrices of up to `SMALL` rows; both give identical bits.

    Raises ValueError if LAPACK does not converge or a matrix is not finite.
    """
    alike: dict[tuple[int, int], list[int]] = {}
    out: list[tuple[Floats, Floats]] = [(_NONE, _NONE)] * len(matrices)
    small = SMALL if "scipy.linalg" not in sys.modules else AT_ONCE if vectors else 0
    for number, bands in enumerate(matrices):
        size, width = len(bands[0]), len(bands)
        if width > 2 or (width == 2 and size <= small):
            alike.setdefault((size, width), []).append(number)
        else:
            out[number] = (_diagonal if width == 1 else _tridiagonal)(bands, vectors)
    for (size, width), numbers in alike.items():
        stacked = np.zeros((len(numbers), size * size))
        for n in range(width):
            stacked[:, n * size :: size + 1] = [matrices[number][n] for number in numbers]  # the lower triangle
        _refuse_infinite(stacked)
        whole = stacked.reshape(-1, size, size)
        if vectors:
            energies, states = np.linalg.eigh(whole)
            states = np.ascontiguousarray(states.transpose(0, 2, 1)).transpose(0, 2, 1)  # components side by side
        else:
            energies, states = np.linalg.eigvalsh(whole), np.broadcast_to(_NONE, (len(numbers), 0, 0))
        for place, number in enumerate(numbers):
            out[number] = energies[place], states[place]
    return out


def _refuse_infinite(*arrays: Floats) -> None:
    if not all(np.isfinite(array).all() for array in arrays):
        raise ValueError("a block of the Hamiltonian overflows: J max is too high for these distortion constants")


def _diagonal(bands: list[Floats], vectors: bool) -> tuple[Floats, Floats]:
    """Sorted energies and vectors of a diagonal matrix."""
    if len(bands[0]) == 1:
        return bands[0], np.ones((1, 1))
    _refuse_infinite(*bands)
    order = np.argsort(bands[0], kind="stable")
    return bands[0][order], np.eye(len(order))[:, order] if vectors else _NONE


def _tridiagonal(bands: list[Floats], vectors: bool) -> tuple[Floats, Floats]:
    """Energies and vectors of a tridiagonal matrix."""
    from scipy.linalg.lapack import dstevd

    _refuse_infinite(*bands)
    energies, states, info = dstevd(*bands, compute_v=int(vectors))
    if info:
        raise ValueError(f"LAPACK dstevd did not converge on a block of size {len(energies)} (info = {info})")
    return energies, states


def lowest_energies(bands: list[Floats], below: float) -> Floats:
    """Eigenvalues up to `below`, rising, and higher ones where computing all takes no longer. Raises as `diagonalise_all` does.

    A few eigenvalues of a large tridiagonal matrix are computed by bisection (LAPACK's dstebz).
    """
    size = len(bands[0])
    if size <= SMALL or len(bands) != 2:
        return diagonalise_all([bands], vectors=False)[0][0]
    _refuse_infinite(*bands)
    from scipy.linalg.lapack import dstebz

    # below all Gershgorin discs, which extend 2|e| to each side
    lowest = -2.0 * (np.abs(bands[0]).max() + np.abs(bands[1]).max())
    if below <= lowest:
        return np.zeros(0)
    rough, *_ = dstebz(bands[0], bands[1], 1, lowest, below, 1, size, below - lowest, b"E")  # their number, at once
    if rough * FEW > size:
        return diagonalise_all([bands], vectors=False)[0][0]
    count, energies, _, _, info = dstebz(bands[0], bands[1], 1, lowest, below, 1, size, 0.0, b"E")
    if info:
        raise ValueError(f"LAPACK dstebz did not converge on a block of size {size} (info = {info})")
    return np.sort(energies[:count])


def unit_diagonals(
    blocks: Sequence[WangBlock], taken: Sequence[int], units: Sequence[tuple[int, int]]
) -> tuple[Floats, ...]:
    """Diagonal d of ½[Jz^2q, J₊^2n + J₋^2n]₊ at (block, state, (q, n)), state i with i + d; zero beyond a block.

    taken: how many of the states of each block.
    """
    js, rows = WangRows.from_blocks(blocks, taken)
    order = order_of((0, q, n) for q, n in units)
    k, steps = _steps(js, order)
    out = tuple(np.zeros((*rows.k.shape, len(units))) for _ in range(order + 1))
    for place, (q, n) in enumerate(units):
        if (q, n) == (0, 0):
            out[0][:, :, place] = np.arange(rows.k.shape[1]) < rows.sizes
            continue
        elements = _elements_of_order({(0, q, n): 1.0}, js, k, n, steps)
        rows.add(elements, n, order, [diagonal[:, :, place] for diagonal in out])
    return out
