"""Single eigenvectors of real tridiagonal matrices, many side by side, from their eigenvalues.

T - λ = L D⁺ Lᵀ from above and U D⁻ Uᵀ from below meet in row k, where γ_k = D⁺_k + D⁻_k - (T_kk - λ) is smallest. There z_k = 1, and

    z_(i+1) = -T_(i,i+1) z_i / D⁻_(i+1) below,    z_(i-1) = -T_(i-1,i) z_i / D⁺_(i-1) above

(I. S. Dhillon and B. N. Parlett, Linear Algebra Appl. 387 (2004) 1).
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints, Workspace


def twisted(shifted: Floats, beside: Floats, space: Workspace) -> tuple[Floats, Floats, Floats, Ints]:
    """Normalised z (size, n) of T - λ, their squared lengths before, γ in the row where z = 1, and how many D⁺ are below 0 (n,).

    shifted: elements of T - λ on the diagonal (size, n), overwritten. beside: next to it (size - 1, n).
    """
    ratio, above, below, other = space.array("twisted", 4, *shifted.shape)
    with np.errstate(all="ignore"):
        np.multiply(beside, beside, out=ratio[:-1])
        _pivots(shifted, ratio, above, below)
        np.add(above, below, out=other)
        other -= shifted
        row, columns = np.abs(other, out=shifted).argmin(axis=0), np.arange(shifted.shape[1])
        gamma, negative = other[row, columns], np.count_nonzero(above < 0, axis=0)
        down, up = np.divide(beside, below[1:], out=ratio[:-1]), np.divide(beside, above[:-1], out=above[:-1])
        vectors = _products(row, down, up, shifted, other)
        squares = np.einsum("il,il->l", vectors, vectors)
        vectors /= np.sqrt(squares)
    return vectors, squares, gamma, negative


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
