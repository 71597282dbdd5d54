"""Elements of moments that are written out as products of direction cosines and components of N (`rotor.quantum.moments.Written`).

Over |N k⟩ each factor is a matrix: N_i of `j_operators`, φ_pi the reduced elements of `tensors`, so that a word is their product, with the
components of N to the left at N' and those to the right at N. A component of N along an axis of the molecule does not change what is
measured along an axis in space, so that the product is the reduced element of the word. Over Wang functions |J K s)) (`tensors`) a moment
that time reversal leaves alone is i times a real matrix, one that it turns around is real.

From the first state to the second, the other way round, a moment acts as its Hermitian conjugate:

    ⟨N k‖M†‖N'k'⟩ = (-1)^(N'-N) ⟨N'k'‖M‖N k⟩*
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.moments import Word, Written
from rotor.quantum.spins.operators import Basis, functions_of
from rotor.quantum.symmetric_top_elements import symmetric_top_elements
from rotor.quantum.tensors import Complexes, spherical_components
from rotor.quantum.wang.basis import WangBlock
from rotor.quantum.wang.j_operators import components


def written_elements(
    moment: Written, up: Basis, low: Basis, representation: str, conjugate: bool = False
) -> Floats | None:
    """The real elements of a moment between two bases, those of an electric one without their factor i; None where all are zero.

    Parameters
    ----------
    moment : Written
        Its words along a, b, c.
    up, low : WangBlock or AxialState
        Functions of N' (rows) and N (columns); of |N K⟩ those with K = 0 alone.
    representation : str
        Which axes are x, y, z.
    conjugate : bool, optional
        Whether the Hermitian conjugate acts.

    Returns
    -------
    (up.size, low.size) array or None
        Reduced elements in the unit of the words.

    Raises
    ------
    ValueError
        For |N K⟩ with K > 0, whose functions of K and -K are one here.
    """
    if abs(up.j - low.j) > 1:
        return None
    if conjugate:
        between = _matrix(moment, low.j, up.j, representation).conj().T
        between = -between if (up.j - low.j) % 2 else between
    else:
        between = _matrix(moment, up.j, low.j, representation)
    own = functions_of(up).conj().T @ between @ functions_of(low)
    found = own.imag if moment.electric and isinstance(up, WangBlock) else own.real
    return np.asarray(found) if np.abs(found).max(initial=0.0) > _NOTHING * np.abs(between).max(initial=1.0) else None


_NOTHING = 1e-13  # of the largest element of |N k⟩: round-off of a product of a few numbers


@lru_cache(maxsize=512)
def _matrix(moment: Written, up: int, low: int, representation: str) -> Complexes:
    """⟨N'k'‖M‖N k⟩ over all k' and k."""
    total = np.zeros((2 * up + 1, 2 * low + 1), dtype=np.complex128)
    for word in moment.words:
        total += word.factor * _of_word(word, up, low, representation)
    if moment.commutator:
        total *= (up * (up + 1.0) - low * (low + 1.0)) / 2
    if moment.of_k is not None:
        k, above = np.arange(-low, low + 1.0), np.arange(-up, up + 1.0)
        total *= moment.of_k(low, above[:, None], k[None, :])
    return total


def _of_word(word: Word, up: int, low: int, representation: str) -> Complexes:
    if not word.cosine:
        if up != low:
            return np.zeros((2 * up + 1, 2 * low + 1), dtype=np.complex128)
        return _product(word.left + word.right, low, representation)
    between = _cosine(word.cosine, up, low, representation)
    return _product(word.left, up, representation) @ between @ _product(word.right, low, representation)


@lru_cache(maxsize=512)
def _cosine(axis: str, up: int, low: int, representation: str) -> Complexes:
    along = [float(axis == one) for one in "abc"]
    return symmetric_top_elements(up, low, spherical_components(along, 1, representation))


@lru_cache(maxsize=512)
def _product(letters: str, j: int, representation: str) -> Complexes:
    """N_i N_j ... of one N; the unit matrix of no letters."""
    if not letters:
        return np.eye(2 * j + 1, dtype=np.complex128)
    return np.asarray(components(j, representation)[letters[0]].matrix @ _product(letters[1:], j, representation))
