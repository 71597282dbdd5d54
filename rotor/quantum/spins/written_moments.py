"""Elements of moments that are operators, such as products of direction cosines and components of N (`rotor.quantum.moments.Written`).

Molecule-fixed components of N commute with rotations in space, so that a product is the reduced element of the whole, with components of N
to the left of φ taken at N' and those to the right at N. Over Wang functions |J K s)) (`tensors`) a moment that is even under time reversal
is i times a real matrix; an odd moment is real.

In the opposite direction, between the same two states, a moment acts as its Hermitian conjugate:

    ⟨N k‖M†‖N'k'⟩ = (-1)^(N'-N) ⟨N'k'‖M‖N k⟩*
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.moments import Written
from rotor.quantum.operators.rotation import matrix_of_j
from rotor.quantum.spins.operators import Basis, functions_of
from rotor.quantum.wang.basis import WangBlock


def written_elements(moment: Written, up: Basis, low: Basis, conjugate: bool = False) -> Floats | None:
    """Real elements of a moment, or its Hermitian conjugate, between two bases, of an electric one without the factor i; None for zeros.

    Raises ValueError for axial states with K > 0, which represent both K and -K.
    """
    if abs(up.j - low.j) > 1:
        return None
    if conjugate:
        between = _matrix(moment.operator, up.j, low.j).conj().T
        between = -between if (up.j - low.j) % 2 else between
    else:
        between = _matrix(moment.operator, low.j, up.j)
    elements = functions_of(up).conj().T @ between @ functions_of(low)
    real = elements.imag if moment.electric and isinstance(up, WangBlock) else elements.real
    return np.asarray(real) if np.abs(real).max(initial=0.0) > _NOTHING * np.abs(between).max(initial=1.0) else None


_matrix = lru_cache(maxsize=64)(matrix_of_j)
_NOTHING = 1e-13  # round-off of a product of a few numbers, relative to the largest element over |N k⟩
