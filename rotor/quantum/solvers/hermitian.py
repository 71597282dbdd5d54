"""Eigenvalues and eigenvectors of many Hermitian matrices of one size, by the solver that their shape calls for.

| shape | solver |
|---|---|
| size 1 | the element itself |
| small matrices, many of them | one stacked call |
| large, and only the lowest few states needed | LAPACK's relatively robust representations, for these states alone |
| large, banded, energies alone | LAPACK's banded reduction |
| other | LAPACK's divide and conquer |
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats

FEW = 0.34  # share of the states up to which computing these alone is faster
LARGE = 100  # size from which it is
NARROW = 15  # bandwidths in a size from which a banded solver is faster


def eigenstates(matrices: NDArray[Any], lowest: int | None = None) -> tuple[Floats, NDArray[Any]]:
    """Energies (blocks, n), rising, and eigenvectors (blocks, size, n) in columns.

    Parameters
    ----------
    matrices : (blocks, size, size) array
        Hermitian; the lower triangles are read.
    lowest : int, optional
        How many of the lowest states of each matrix; all by default.

    Returns
    -------
    energies, vectors : arrays
        Of n = min(size, lowest) states.
    """
    size = matrices.shape[1]
    count = size if lowest is None else min(size, lowest)
    if size == 1:
        return matrices[:, 0].real.copy(), np.ones_like(matrices)
    if size < LARGE or count > FEW * size:
        energies, vectors = np.linalg.eigh(matrices)
        return energies[:, :count], vectors[:, :, :count]
    from scipy.linalg import eigh

    solved = [eigh(matrix, subset_by_index=(0, count - 1), driver="evr", check_finite=False) for matrix in matrices]
    return np.stack([energies for energies, _ in solved]), np.stack([vectors for _, vectors in solved])


def eigenvalues(matrices: NDArray[Any]) -> Floats:
    """Energies (blocks, size), rising."""
    size = matrices.shape[1]
    if size == 1:
        return matrices[:, 0].real.copy()
    if size < LARGE:
        return np.linalg.eigvalsh(matrices)
    return np.stack([_eigenvalues_of_large(matrix) for matrix in matrices])


def _eigenvalues_of_large(matrix: NDArray[Any]) -> Floats:
    """Energies (size,) of one matrix, as a banded one where its elements lie near the diagonal."""
    rows, columns = np.nonzero(np.tril(matrix))
    width = int((rows - columns).max(initial=0))
    if NARROW * width > len(matrix):
        return np.linalg.eigvalsh(matrix)
    from scipy.linalg import eigvals_banded

    bands = np.zeros((width + 1, len(matrix)), dtype=matrix.dtype)
    bands[rows - columns, columns] = matrix[rows, columns]
    return np.asarray(eigvals_banded(bands, lower=True, check_finite=False))
