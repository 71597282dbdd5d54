"""Elements of moments that are products of direction cosines and components of N (`rotor.quantum.moments.Written`).

Over |N k⟩ each factor is a matrix: N_i of `j_operators`, and the reduced elements of φ_pi of `tensors`. A word is their product, with
components of N to the left of φ taken at N' and those to the right at N. Molecule-fixed components of N commute with rotations in space, so
the product is the reduced element of the word. Over Wang functions |J K s)) (`tensors`) a moment that is even under time reversal is i
times a real matrix; an odd moment is real.

In the opposite direction, between the same two states, a moment acts as its Hermitian conjugate:

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
    """Real elements of a moment, or its Hermitian conjugate, between two bases, of an electric one without the factor i; None for zeros.

    Raises ValueError for axial states with K > 0, which represent both K and -K.
    """
    if abs(up.j - low.j) > 1:
        return None
    if conjugate:
        between = _matrix(moment, low.j, up.j, representation).conj().T
        between = -between if (up.j - low.j) % 2 else between
    else:
        between = _matrix(moment, up.j, low.j, representation)
    elements = functions_of(up).conj().T @ between @ functions_of(low)
    real = elements.imag if moment.electric and isinstance(up, WangBlock) else elements.real
    return np.asarray(real) if np.abs(real).max(initial=0.0) > _NOTHING * np.abs(between).max(initial=1.0) else None


_NOTHING = 1e-13  # round-off of a product of a few numbers, relative to the largest element over |N k⟩


@lru_cache(maxsize=512)
def _matrix(moment: Written, up: int, low: int, representation: str) -> Complexes:
    """⟨N'k'‖M‖N k⟩ over all k' and k."""
    total = np.zeros((2 * up + 1, 2 * low + 1), dtype=np.complex128)
    for word in moment.words:
        total += word.factor * _word_elements(word, up, low, representation)
    if moment.commutator:
        total *= (up * (up + 1.0) - low * (low + 1.0)) / 2
    if moment.factor_of_k is not None:
        k, above = np.arange(-low, low + 1.0), np.arange(-up, up + 1.0)
        total *= moment.factor_of_k(low, above[:, None], k[None, :])
    return total


def _word_elements(word: Word, up: int, low: int, representation: str) -> Complexes:
    """Reduced elements of one word over all k' and k."""
    if not word.cosine:
        if up != low:
            return np.zeros((2 * up + 1, 2 * low + 1), dtype=np.complex128)
        return _product(word.left + word.right, low, representation)
    between = _cosine(word.cosine, up, low, representation)
    return _product(word.left, up, representation) @ between @ _product(word.right, low, representation)


@lru_cache(maxsize=512)
def _cosine(axis: str, up: int, low: int, representation: str) -> Complexes:
    """Reduced elements of the direction cosine of one axis."""
    along = [float(axis == letter) for letter in "abc"]
    return symmetric_top_elements(up, low, spherical_components(along, 1, representation))


@lru_cache(maxsize=512)
def _product(letters: str, j: int, representation: str) -> Complexes:
    """N_i N_j ... within one N; the unit matrix for no letters."""
    if not letters:
        return np.eye(2 * j + 1, dtype=np.complex128)
    return np.asarray(components(j, representation)[letters[0]].matrix @ _product(letters[1:], j, representation))
