"""Eigenstates that lie mostly in a few functions, of a matrix that couples these to many others at a distance.

Davidson's method for a block of states: from the chosen functions, the space grows by approximate solutions of (E - H) w = r outside them,

    w₀ = (E - D)⁻¹ r,      w ← w + (E - D)⁻¹ (r - (E - H) w), twice,      r = (H - E) x,

D being the diagonal of H, r the residues of the Ritz states x with the largest shares in the chosen functions, until what second order says
of the rest, Σ r_i²/|E - D_i|, is below a tolerance for each state. w₀ is the usual correction; the further steps know how H couples the
functions outside, and cost one product with the sparse matrix each where they spare about half of the enlargements. A function at the
energy of a state enters by its small denominator.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints

TOLERANCE_MHZ = 5e-8  # of an energy
REPEATS = 2  # of the correction
SMALLEST_GAP = 1e-3  # MHz, in place of smaller denominators
SMALL = 150  # size up to which all states are solved as fast
ORTHOGONAL = 1e-13  # overlap of new functions with the space, which moves energies of 1e8 MHz by its square
# largest share of chosen functions; with more, all states are solved: 0.5 to 1 of that time at 0.04, twice at 0.08 (two tops, J = 26)
SHARE = 0.05
SPACE = 0.2  # largest share of functions in the space, which grows where functions lie at the energies of states


def is_dominated(size: int, count: int) -> bool:
    """Whether so many states of a matrix are fewer than all to solve."""
    return size > SMALL and 0 < count <= SHARE * size


def dominated_states(lower: Any, chosen: Ints) -> tuple[Floats, NDArray[Any]] | None:
    """Energies (p,), rising, and vectors (n, p) of the p states with the largest shares in p chosen functions.

    lower: sparse lower triangle of a Hermitian matrix in MHz. None where all states are to be solved instead: for a small matrix, many
    functions, and without convergence.

    >>> from scipy.sparse import csr_array
    >>> rng = np.random.default_rng(1)
    >>> matrix = rng.normal(size=(200, 200)) + np.diag(np.where(np.arange(200) < 8, 0.0, 1e3) + np.arange(200))
    >>> matrix = (matrix + matrix.T) / 2
    >>> energies, vectors = dominated_states(csr_array(np.tril(matrix)), np.arange(8))
    >>> bool(np.abs(energies - np.linalg.eigvalsh(matrix)[:8]).max() < 1e-7)
    True
    """
    size, count = lower.shape[0], len(chosen)
    if not is_dominated(size, count):
        return None
    diagonal = lower.diagonal().real
    whole = (lower + lower.conj().T).tocsr()
    whole.setdiag(diagonal)
    image = whole[:, chosen].toarray()  # of H on the space: the chosen functions, then `beyond`
    inner, beyond = image[chosen], np.zeros((size, 0), dtype=image.dtype)
    while len(inner) <= SPACE * size:
        energies, mixing = np.linalg.eigh(inner)
        best = np.sort(np.argsort(-(np.abs(mixing[:count]) ** 2).sum(axis=0), kind="stable")[:count])
        energies, mixing = energies[best], mixing[:, best]
        vectors = beyond @ mixing[count:]
        vectors[chosen] = mixing[:count]
        rest = image @ mixing - vectors * energies
        gaps = energies - diagonal[:, None]
        gaps[np.abs(gaps) < SMALLEST_GAP] = SMALLEST_GAP
        step = rest / gaps
        wrong = np.abs(rest * step).sum(axis=0) > TOLERANCE_MHZ
        if not wrong.any():
            return energies, vectors
        rest, step, gaps = rest[:, wrong], step[:, wrong], gaps[:, wrong]
        for _ in range(REPEATS):
            step += (rest - step * energies[wrong] + whole @ step) / gaps
            step[chosen] = 0.0  # r is 0 there, and E - D small
        more = _orthonormal(step, beyond)
        applied = whole @ more
        beside = np.vstack([applied[chosen], beyond.conj().T @ applied])
        inner = np.block([[inner, beside], [beside.conj().T, more.conj().T @ applied]])
        beyond, image = np.hstack([beyond, more]), np.hstack([image, applied])
    return None


def _orthonormal(vectors: NDArray[Any], space: NDArray[Any]) -> NDArray[Any]:
    """The part of vectors outside a space as orthonormal columns; again where rounding has left some of the space."""
    outside = np.linalg.qr(vectors - space @ (space.conj().T @ vectors))[0]
    inside = space.conj().T @ outside
    if np.abs(inside).max(initial=0.0) < ORTHOGONAL:
        return np.asarray(outside)
    return np.asarray(np.linalg.qr(outside - space @ inside)[0])
