"""Eigenvalues and eigenvectors of a Hermitian matrix, by the solver that its shape calls for.

| shape | solver |
|---|---|
| size 1 | the element itself |
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


def eigenstates(lower: NDArray[Any]) -> tuple[Floats, NDArray[Any]]:
    """Energies (size,), rising, and eigenvectors (size, size) in columns, of a lower triangle."""
    if len(lower) == 1:
        return lower[0].real.copy(), np.ones_like(lower)
    energies, vectors = np.linalg.eigh(lower)
    return energies, vectors


def eigenvalues(lower: NDArray[Any]) -> Floats:
    """Energies (size,), rising, of a lower triangle, as a banded matrix where its elements lie near the diagonal."""
    size = len(lower)
    if size == 1:
        return np.asarray(lower[0].real)
    if size < LARGE:
        return np.asarray(np.linalg.eigvalsh(lower))
    rows, columns = np.nonzero(np.tril(lower))
    width = int((rows - columns).max(initial=0))
    if NARROW * width > size:
        return np.asarray(np.linalg.eigvalsh(lower))
    from scipy.linalg import eigvals_banded

    bands = np.zeros((width + 1, size), dtype=lower.dtype)
    bands[rows - columns, columns] = lower[rows, columns]
    return np.asarray(eigvals_banded(bands, lower=True, check_finite=False))
