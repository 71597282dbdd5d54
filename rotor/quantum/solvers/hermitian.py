"""Eigenvalues and eigenvectors of many Hermitian matrices of one size, by the solver that their shape calls for.

| shape | solver |
|---|---|
| size 1 | the element itself |
| small matrices, many of them | one stacked call |
| large, banded, energies alone | LAPACK's banded reduction |
| other | LAPACK's divide and conquer |
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats

LARGE = 100  # size from which shapes are looked at
NARROW = 15  # bandwidths in a size from which a banded solver is faster


def eigenstates(matrices: NDArray[Any]) -> tuple[Floats, NDArray[Any]]:
    """Energies (blocks, size), rising, and eigenvectors (blocks, size, size) in columns, of the lower triangles."""
    if matrices.shape[1] == 1:
        return matrices[:, 0].real.copy(), np.ones_like(matrices)
    energies, vectors = np.linalg.eigh(matrices)
    return energies, vectors


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
