"""The lowest states of real tridiagonal matrices at many fields at once: a linear or symmetric top in a static field.

Energies at some fields, by LAPACK, are joined by cubics through energies and slopes. At every other field they are improved with the
eigenvectors of a twisted factorisation, T - λ = N D N^T with N lower triangular above row k and upper triangular below it,

    z_k = 1,   z_i = -b_i z_(i+1)/d⁺_i (i < k),   z_i = -b_(i-1) z_(i-1)/d⁻_i (i > k),   λ ← λ + γ_k/|z|²,

k where γ_k = d⁺_k + d⁻_k - (a_k - λ) is smallest: the iteration of the Rayleigh quotient, which converges with the third power (it is
derived by multiplying out). The number of negative d⁺ is that of the energies below λ (Sylvester), so
that a state of another rank is noticed; then LAPACK does it all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints

ANCHORS = 13  # fields that LAPACK solves, of many
SWEEPS = 4  # of the Rayleigh quotient at most
CONVERGED = 4e-16  # of the largest element, for each row: the last change of an energy


def is_chain(terms: tuple[NDArray[np.generic], ...]) -> bool:
    """Whether matrices are real and have no elements beyond the diagonals beside the main one."""
    size = len(terms[0])
    if size < 3 or any(np.iscomplexobj(one) for one in terms):
        return False
    beyond = np.triu_indices(size, 2)
    return not any(one[beyond].any() for one in terms)


def chain_states(terms: tuple[Floats, ...], fields: Floats, count: int) -> tuple[Floats, Floats] | None:
    """Energies (fields, count) and vectors (fields, n, count) of the lowest states; None where the iteration went astray."""
    powers = fields[:, None] ** np.arange(len(terms))
    main = powers @ np.array([np.diag(one) for one in terms])
    beside = powers @ np.array([np.diag(one, 1) for one in terms])
    energies = _between_anchors(terms, fields, count)
    scale = np.abs(main).max() + 2 * np.abs(beside).max()
    for _ in range(SWEEPS):
        vectors, change, below = twisted(main, beside, energies)
        energies = energies + change
        if np.abs(change).max() <= CONVERGED * scale * len(terms[0]):
            ranks = below - np.arange(count)
            return (energies, vectors) if ((ranks == 0) | (ranks == 1)).all() else None
    return None


def _between_anchors(terms: tuple[Floats, ...], fields: Floats, count: int) -> Floats:
    """Energies (fields, count) from cubics through energies and slopes at a few fields."""
    from scipy.interpolate import CubicHermiteSpline

    places = np.unique(np.linspace(0, len(fields) - 1, ANCHORS).astype(int))
    at = fields[places]
    stack = np.einsum("fp,pij->fij", at[:, None] ** np.arange(len(terms)), np.array(terms))
    solved = np.linalg.eigh(stack)
    vectors = solved.eigenvectors[:, :, :count]
    slopes = sum(
        n * at[:, None] ** (n - 1) * np.einsum("fis,fis->fs", vectors, one @ vectors)
        for n, one in enumerate(terms[1:], 1)
    )
    return np.asarray(CubicHermiteSpline(at, solved.eigenvalues[:, :count], slopes)(fields))


def twisted(main: Floats, beside: Floats, energies: Floats) -> tuple[Floats, Floats, Ints]:
    """Normalised vectors (f, n, s), corrections of energies (f, s), and how many energies lie below each (f, s).

    main: (f, n). beside: (f, n - 1). energies: (f, s), approximate.
    """
    size = main.shape[1]
    shifted = main.T[:, :, None] - energies  # (n, f, s)
    squares, between = beside.T[:, :, None] ** 2, -beside.T[:, :, None]
    tiny = np.finfo(float).tiny ** 0.5
    down, up = shifted.copy(), shifted.copy()
    for i in range(1, size):
        down[i] -= squares[i - 1] / _not_zero(down[i - 1], tiny)
        up[size - 1 - i] -= squares[size - 1 - i] / _not_zero(up[size - i], tiny)
    gamma = down + up - shifted
    place = np.argmin(np.abs(gamma), axis=0)
    vectors = (np.arange(size)[:, None, None] == place).astype(np.float64)
    from_below, from_above = between / _not_zero(down[:-1], tiny), between / _not_zero(up[1:], tiny)
    for i in range(1, size):
        vectors[i] += np.where(place < i, from_above[i - 1] * vectors[i - 1], 0.0)
    for i in range(size - 2, -1, -1):
        vectors[i] += np.where(place > i, from_below[i] * vectors[i + 1], 0.0)
    lengths = (vectors**2).sum(axis=0)
    change = np.take_along_axis(gamma, place[None], axis=0)[0] / lengths
    return (vectors / np.sqrt(lengths)).transpose(1, 0, 2), change, (down < 0).sum(axis=0)


def _not_zero(pivots: Floats, tiny: float) -> Floats:
    """Pivots with those that are 0 replaced by the smallest number whose square is one."""
    return np.asarray(np.where(pivots == 0.0, tiny, pivots))
