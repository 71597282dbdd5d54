"""Selected eigenvectors of many tridiagonal matrices at once, from their eigenvalues.

T - λ = L D⁺ Lᵀ from above and U D⁻ Uᵀ from below meet in row k, where γ_k = D⁺_k + D⁻_k - (T_kk - λ) is smallest. There z_k = 1, and

    z_(i+1) = -T_(i,i+1) z_i / D⁻_(i+1) below,    z_(i-1) = -T_(i-1,i) z_i / D⁺_(i-1) above.

Source: I. S. Dhillon and B. N. Parlett, Linear Algebra Appl. 387 (2004) 1 (twisted factorization). A fit needs only the vectors of labelled
states; if these are few this is faster than a diagonalisation with all vectors.
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints, Workspace

_NEAR = 1e-6  # closer eigenvalues, relative to the largest, would give vectors with less than nine digits
_ASIDE = 1e-15  # shift of λ, relative to the largest eigenvalue, that avoids division by a pivot of exactly 0
_NOTHING = 1e-280  # replaces the largest eigenvalue of a zero matrix
_RESIDUAL = 1e-12  # |γ| above this, relative to the largest eigenvalue times the size, is more than round-off


def vectors_of_values(
    diagonal: Floats, beside: Floats, values: Floats, matrix: Ints, state: Ints, space: Workspace
) -> Floats | None:
    """Normalised eigenvectors (size, n) of selected states of many matrices; None if two eigenvalues are too close, or a division fails.

    diagonal, beside: elements (i, i) and (i, i + 1), (matrices, size), 0 beyond a matrix. values: all eigenvalues, rising, infinite beyond
    a matrix. matrix, state: of each vector, the number of the matrix and of the eigenvalue.

    >>> matrix = np.zeros((1, 2)), np.array([[1.0, 0.0]])
    >>> vectors = vectors_of_values(*matrix, np.array([[-1.0, 1.0]]), np.array([0]), np.array([1]), Workspace())
    >>> np.round(vectors[:, 0] ** 2, 12).tolist()
    [0.5, 0.5]
    """
    size, inside = diagonal.shape[1], np.isfinite(values)
    finite_values = np.where(inside, values, 0.0)
    largest = np.abs(finite_values).max(axis=1) + _NOTHING
    near = np.diff(finite_values, axis=1) <= _NEAR * largest[:, None]
    if (near & inside[:, 1:]).any():
        return None
    full = np.where(inside, diagonal, 4.0 * largest[:, None]).T.copy()
    shifted, off, ratio, above, below, other = space.array("twisted", 6, size, len(matrix))
    full.take(matrix, axis=1, out=shifted, mode="clip")
    shifted -= values[matrix, state] + _ASIDE * largest[matrix]
    beside.T.copy().take(matrix, axis=1, out=off, mode="clip")
    with np.errstate(all="ignore"):
        np.multiply(off, off, out=ratio)
        _pivots(shifted, ratio, above, below)
        np.add(above, below, out=other)
        other -= shifted
        meeting = np.abs(other, out=other)
        row, least = meeting.argmin(axis=0), meeting.min(axis=0)
        down, up = np.divide(off[:-1], below[1:], out=ratio[:-1]), np.divide(off[:-1], above[:-1], out=off[:-1])
        vectors = _products(row, down, up, shifted, other)
        lengths = np.sqrt(np.einsum("il,il->l", vectors, vectors))
        right = least <= _RESIDUAL * size * largest[matrix] * lengths
        vectors /= lengths
    return vectors if right.all() and np.isfinite(lengths).all() else None


def _pivots(shifted: Floats, squared: Floats, above: Floats, below: Floats) -> None:
    """Compute D⁺ and D⁻ (size, n) into `above` and `below`."""
    above[0], below[-1] = shifted[0], shifted[-1]
    for i in range(1, len(shifted)):
        np.divide(squared[i - 1], above[i - 1], out=above[i])
        np.subtract(shifted[i], above[i], out=above[i])
        np.divide(squared[-1 - i], below[-i], out=below[-1 - i])
        np.subtract(shifted[-1 - i], below[-1 - i], out=below[-1 - i])


def _products(row: Ints, down: Floats, up: Floats, lower: Floats, upper: Floats) -> Floats:
    """z (size, n) in the memory of `lower`: 1 in the row where the factorisations meet, products of ratios below and above it."""
    columns = np.arange(len(row))
    lower.fill(0.0)
    upper.fill(0.0)
    lower[row, columns] = upper[row, columns] = 1.0
    for i in range(1, len(lower)):
        lower[i] -= down[i - 1] * lower[i - 1]
        upper[-1 - i] -= up[-i] * upper[-i]
    lower += upper
    lower[row, columns] = 1.0
    return lower
