"""Matrices of scalar operators of the angular momentum in the Wang basis, block by block, and their eigenvalues.

An operator is a table {(p, q, n): c in MHz} of c · ½[Jz^2q, J₊^2n + J₋^2n]₊ · J^2p (n = 0: c · J^2p Jz^2q). With X = J(J+1),

    ⟨K|H|K⟩     = Σ c X^p K^2q                                             (n = 0)
    ⟨K+2n|H|K⟩  = Σ c X^p ½[(K+2n)^2q + K^2q] √∏_{i<2n} (J-K-i)(J+K+i+1)    (n > 0)

with the phases of J∓ (body-fixed) real and positive.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.wang.basis import WangBlock
from rotor.tops.operators import Operators

FEW = 20  # bisection pays for at most one in so many eigenvalues
AT_ONCE = 32  # matrices of one size with at most so many rows are solved together
J_AT_ONCE = 32  # number of J whose matrix elements are computed together
_NONE: Floats = np.zeros((0, 0))
_ROOT_2 = float(np.sqrt(2))
_OVERFLOW = "a block of the Hamiltonian overflows: J max is too high for these distortion constants"
SMALL = 100  # tridiagonal blocks with at most so many rows do not justify loading scipy.linalg (0.2 s)


def scalar_energy(operators: Operators, j: int) -> float:
    """The part Σ c X^p that is equal for all states of a J; matrices do not contain it, which reduces round-off."""
    x = j * (j + 1)
    return float(sum(c * x**p for (p, q, n), c in operators.items() if q == n == 0))


class JMatrix:
    """Matrix elements over |J K⟩ of one J without the scalar part, for its four Wang blocks.

    elements: elements that `matrices_of` computed for many J; by default they are computed here.
    """

    def __init__(self, operators: Operators, j: int, elements: list[Floats] | None = None) -> None:
        self.order = _order(operators)
        self._margin = 2 * self.order  # K starts at -margin, to include folded elements
        self._elements = _elements(operators, [j])[0] if elements is None else elements

    def element(self, k: NDArray[np.int64], n: int) -> NDArray[np.float64]:
        """⟨K+2n|H|K⟩ for K from -2 `order` to J; zero where K + 2n is beyond J."""
        return self._elements[n][self._margin + k]

    def folded(self, low: int, n: int) -> float:
        """⟨2n - low|H|-low⟩, which connects K = low and K = 2n - low of a Wang block."""
        return float(self._elements[n][self._margin - low])

    def band(self, block: WangBlock, n: int) -> NDArray[np.float64]:
        """⟨K+2n|H|K⟩ over the K of a block, (size - n,)."""
        first = self._margin + block.first_k
        return self._elements[n][first : first + 2 * (block.size - n) : 2].copy()


def matrices_of(operators: Operators, js: Sequence[int]) -> Iterator[JMatrix]:
    """Matrix elements of each J, computed for several J together."""
    for first in range(0, len(js), J_AT_ONCE):
        chunk = js[first : first + J_AT_ONCE]
        for j, elements in zip(chunk, _elements(operators, chunk), strict=True):
            yield JMatrix(operators, j, elements)


def _order(operators: Operators) -> int:
    """The highest power n of the ladder operators."""
    return max((n for _, _, n in operators), default=0)


def _elements(operators: Operators, js: Sequence[int]) -> list[list[Floats]]:
    """⟨K+2n|H|K⟩ of each J by n, for K from -2 `order` to J."""
    order, highest = _order(operators), max(js)
    k, j = np.arange(-2 * order, highest + 2 * order + 1), np.array(js)[:, None]
    steps = np.sqrt(np.maximum((j - k) * (j + k + 1), 0))  # elements of J₊ over |J K⟩; zero beyond K = J
    with np.errstate(over="ignore", invalid="ignore"):  # reported where the block is diagonalised
        by_n = [_elements_of_order(operators, js, k[: len(k) - 2 * order], n, steps) for n in range(order + 1)]
    return [[elements_of_n[row, : 2 * order + number + 1] for elements_of_n in by_n] for row, number in enumerate(js)]


def _elements_of_order(operators: Operators, js: Sequence[int], k: Ints, n: int, steps: Floats) -> Floats:
    """⟨K+2n|H|K⟩ = ½[P((K+2n)²) + P(K²)] times the ladder, P(y) = Σ_q y^q Σ_p c X^p: (J, K)."""
    powers = [(p, q, c) for (p, q, order), c in operators.items() if order == n and (n or q)]
    coefficients = np.zeros((len(js), 1 + max((q for _, q, _ in powers), default=0)))
    for row, j in enumerate(js):
        x = float(j * (j + 1))
        for p, q, c in powers:
            coefficients[row, -1 - q] += c * x**p

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


def block_bands(matrix: JMatrix, block: WangBlock) -> list[NDArray[np.float64]]:
    """Diagonals of the block's matrix without the scalar part; the n-th has the elements (i+n, i), (size - n,).

    ⟨K' s|H|K s⟩ = ⟨K'|H|K⟩ + s ⟨K'|H|-K⟩, times √2 if one of K, K' is 0. The second term exists for K + K' = 2n; it folds an operator of
    high n back to lower diagonals.
    """
    bands = [matrix.band(block, n) for n in range(min(matrix.order, block.size - 1) + 1)]
    if block.first_k == 0:
        for band in bands[1:]:
            band[0] *= _ROOT_2

    last = block.first_k + 2 * (block.size - 1)
    for n in range(1, matrix.order + 1):
        for low in range(max(block.first_k, 2 - block.first_k % 2), n + 1, 2):
            high = 2 * n - low
            if high <= last:
                bands[(high - low) // 2][(low - block.first_k) // 2] += block.sign * matrix.folded(low, n)
    return bands


def diagonalise(bands: list[Floats], vectors: bool = True) -> tuple[Floats, Floats]:
    """Eigenvalues (rising) and eigenvectors (columns) of a symmetric matrix from its diagonals.

    LAPACK's divide and conquer solves tridiagonal matrices (dstevd), its dense form wider ones (dsyevd, numpy's eigh). The dense form also
    solves tridiagonal matrices of up to `SMALL` rows if scipy.linalg is not loaded yet, as loading takes longer; both give identical bits.

    Raises ValueError if LAPACK does not converge or the matrix is not finite.
    """
    size = len(bands[0])
    if size == 1:
        return bands[0], np.ones((1, 1))
    if not _are_finite(bands):
        raise ValueError(_OVERFLOW)
    if len(bands) == 1:
        return _diagonal(bands[0], vectors)
    if len(bands) > 2 or (size <= SMALL and "scipy.linalg" not in sys.modules):
        return _dense(bands, vectors)

    from scipy.linalg.lapack import dstevd

    energies, states, info = dstevd(bands[0], bands[1], compute_v=int(vectors))
    if info:
        raise ValueError(f"LAPACK dstevd did not converge on a block of size {size} (info = {info})")
    return energies, states


def diagonalise_all(matrices: Sequence[list[Floats]], vectors: bool = True) -> list[tuple[Floats, Floats]]:
    """`diagonalise` for many matrices; with vectors, small ones of equal size and band width are solved in one call."""
    alike: dict[tuple[int, int], list[int]] = {}
    out: list[tuple[Floats, Floats]] = []
    for number, bands in enumerate(matrices):
        small = vectors and len(bands) > 1 and len(bands[0]) <= AT_ONCE
        out.append((bands[0], _NONE) if small else diagonalise(bands, vectors))
        if small:
            alike.setdefault((len(bands[0]), len(bands)), []).append(number)
    for (size, width), numbers in alike.items():
        stacked = np.zeros((len(numbers), size * size))
        for n in range(width):
            stacked[:, n * size :: size + 1] = [
                matrices[number][n] for number in numbers
            ]  # eigh reads the lower triangle
        if not _are_finite([stacked]):
            raise ValueError(_OVERFLOW)
        energies, states = np.linalg.eigh(stacked.reshape(-1, size, size))
        states = np.ascontiguousarray(states.transpose(0, 2, 1)).transpose(0, 2, 1)  # a state's components side by side
        for place, number in enumerate(numbers):
            out[number] = energies[place], states[place]
    return out


def _are_finite(bands: list[Floats]) -> bool:
    return all(np.isfinite(band).all() for band in bands)


def lowest_energies(bands: list[Floats], below: float) -> Floats:
    """Eigenvalues up to `below`, rising, and higher ones where computing all takes no longer. Raises as `diagonalise` does.

    A few eigenvalues of a large tridiagonal matrix are computed by bisection (LAPACK's dstebz).
    """
    size = len(bands[0])
    if size <= SMALL or len(bands) != 2 or not _are_finite(bands):
        return diagonalise(bands, vectors=False)[0]
    from scipy.linalg.lapack import dstebz

    # below all Gershgorin discs, which extend 2|e| to each side
    lowest = -2.0 * (np.abs(bands[0]).max() + np.abs(bands[1]).max())
    if below <= lowest:
        return np.zeros(0)
    rough, *_ = dstebz(bands[0], bands[1], 1, lowest, below, 1, size, below - lowest, b"E")  # their number, at once
    if rough * FEW > size:
        return diagonalise(bands, vectors=False)[0]
    count, energies, _, _, info = dstebz(bands[0], bands[1], 1, lowest, below, 1, size, 0.0, b"E")
    if info:
        raise ValueError(f"LAPACK dstebz did not converge on a block of size {size} (info = {info})")
    return np.sort(energies[:count])


def _diagonal(band: Floats, vectors: bool) -> tuple[Floats, Floats]:
    """Sorted energies and vectors of a diagonal matrix."""
    order = np.argsort(band, kind="stable")
    return band[order], np.eye(len(band))[:, order] if vectors else np.zeros((0, 0))


def _dense(bands: list[Floats], vectors: bool) -> tuple[Floats, Floats]:
    """Energies and vectors by the dense solver."""
    size = len(bands[0])
    matrix = np.zeros((size, size))
    for n, band in enumerate(bands):
        matrix.flat[n * size :: size + 1] = band  # eigh reads the lower triangle
    if not vectors:
        return np.asarray(np.linalg.eigvalsh(matrix), dtype=np.float64), np.zeros((0, 0))
    solved = np.linalg.eigh(matrix)
    return np.asarray(solved.eigenvalues), np.asfortranarray(solved.eigenvectors)  # a state's components side by side
