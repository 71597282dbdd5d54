"""Elements of moments that are products of direction cosines and components of N (`rotor.quantum.moments.Written`).

Over |N k⟩ each factor is an operator: N_i and the reduced elements of φ_pi, of `operators.rotation`. A word is their product, with
components of N to the left of φ taken at N' and those to the right at N. Molecule-fixed components of N commute with rotations in space, so
the product is the reduced element of the word. Over Wang functions |J K s)) (`tensors`) a moment that is even under time reversal is i
times a real matrix; an odd moment is real.

In the opposite direction, between the same two states, a moment acts as its Hermitian conjugate:

    ⟨N k‖M†‖N'k'⟩ = (-1)^(N'-N) ⟨N'k'‖M‖N k⟩*
"""

from __future__ import annotations

from functools import lru_cache, reduce

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.moments import Word, Written
from rotor.quantum.operators.algebra import UNIT, Operator
from rotor.quantum.operators.rotation import body_tensor, components, matrix_of_j, weighted
from rotor.quantum.spins.operators import Basis, functions_of
from rotor.quantum.tensors import Complexes, spherical_components
from rotor.quantum.wang.basis import WangBlock


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
    return matrix_of_j(_operator(moment, representation), low, up)


@lru_cache(maxsize=128)
def _operator(moment: Written, representation: str) -> Operator:
    """A moment as an operator."""
    total = Operator()
    for word in moment.words:
        total = total + word.factor * _product(word, representation)
    if moment.commutator:
        total = weighted(total, lambda m, n, above, below: (m * (m + 1.0) - n * (n + 1.0)) / 2)
    if (factor := moment.factor_of_k) is not None:
        total = weighted(total, lambda m, n, above, below: factor(n, above, below))
    return total.merged()


def _product(word: Word, representation: str) -> Operator:
    """The product of components of N and a direction cosine."""
    along = components(representation)
    factors = [along[letter] for letter in word.left]
    if word.cosine:
        cosine = [float(word.cosine == letter) for letter in "abc"]
        factors.append(body_tensor(spherical_components(cosine, 1, representation)))
    factors += [along[letter] for letter in word.right]
    return reduce(lambda left, right: left @ right, factors, UNIT)
