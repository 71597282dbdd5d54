"""Some eigenvectors of many tridiagonal matrices side by side, from their eigenvalues.

T - λ = L D⁺ Lᵀ from above and U D⁻ Uᵀ from below meet in row k, where γ_k = D⁺_k + D⁻_k - (T_kk - λ) is least; there z_k = 1, and

    z_(i+1) = -T_(i,i+1) z_i / D⁻_(i+1) below,    z_(i-1) = -T_(i-1,i) z_i / D⁺_(i-1) above.

Source: I. S. Dhillon and B. N. Parlett, Linear Algebra Appl. 387 (2004) 1 (twisted factorization). A fit needs the vectors of labelled
states alone; where these are few it takes less time than a diagonalisation with all vectors.
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints, Workspace

_NEAR = 1e-6  # of the largest eigenvalue: nearer ones would have vectors with less than nine digits
_ASIDE = 1e-15  # of it, by which λ is moved: a pivot that is 0 exactly could not be divided by
_NOTHING = 1e-280  # in place of the largest eigenvalue of a matrix that is 0
_RESIDUAL = 1e-12  # of it, times the size: |γ| above it is more than round-off


def vectors_of_values(
    diagonal: Floats, beside: Floats, values: Floats, matrix: Ints, state: Ints, space: Workspace
) -> Floats | None:
    """Eigenvectors (size, n) of length 1 of some states: which matrix, and which of its eigenvalues.

    Parameters
    ----------
    diagonal, beside : (matrices, size) array
        Elements (i, i) and (i, i + 1); beyond the size of a matrix both are 0.
    values : (matrices, size) array
        All eigenvalues, rising, infinite beyond the size of a matrix.
    matrix, state : (n,) array
    space : Workspace
        In which the vectors are.

    Returns
    -------
    array or None
        None where two eigenvalues are so near each other that their vectors had better be found together, or a division fails.

    Examples
    --------
    >>> matrix = np.zeros((1, 2)), np.array([[1.0, 0.0]])
    >>> found = vectors_of_values(*matrix, np.array([[-1.0, 1.0]]), np.array([0]), np.array([1]), Workspace())
    >>> np.round(found[:, 0] ** 2, 12).tolist()
    [0.5, 0.5]
    """
    size, inside = diagonal.shape[1], np.isfinite(values)
    known = np.where(inside, values, 0.0)
    largest = np.abs(known).max(axis=1) + _NOTHING
    near = np.diff(known, axis=1) <= _NEAR * largest[:, None]
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
    """D⁺ and D⁻ (size, n) are put into `above` and `below`."""
    above[0], below[-1] = shifted[0], shifted[-1]
    for i in range(1, len(shifted)):
        np.divide(squared[i - 1], above[i - 1], out=above[i])
        np.subtract(shifted[i], above[i], out=above[i])
        np.divide(squared[-1 - i], below[-i], out=below[-1 - i])
        np.subtract(shifted[-1 - i], below[-1 - i], out=below[-1 - i])


def _products(row: Ints, down: Floats, up: Floats, lower: Floats, upper: Floats) -> Floats:
    """z (size, n), in place of `lower`: 1 in a row of its own, and from there the products of the negative ratios down and up."""
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
