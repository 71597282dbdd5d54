"""Elements of operators of the rotation between two Wang blocks or |N K⟩, one pair at a time, from full matrices over |N k⟩."""

from __future__ import annotations

import numpy as np

from rotor.quantum.basis.labelled import Basis, rotation_labels
from rotor.quantum.operators.rotation import sum_of_powers
from rotor.quantum.operators.symmetric_top_elements import coupling
from rotor.quantum.operators.tensors import block_elements, phase_exponent
from rotor.quantum.spins.scheme import (
    AxialState,
    ByElements,
    Cosines,
    Scalar,
    axis_tensor,
    factors_with_n,
    tensor_of,
)

NOTHING = 1e-13  # round-off of a product of a few numbers, relative to the largest element over |N k⟩


def matrix_of_j(operator, low, up=None):
    """⟨J'K'|O|J K⟩ over all K' and K, both rising, from J = low to J' = up, by default the same."""
    above = low if up is None else up
    basis = Basis(rotation_labels(max(low, above), min(low, above)))
    whole = basis.elements([operator]).dense().astype(complex)
    return whole[np.ix_(*(np.flatnonzero(basis.labels["J"] == j) for j in (above, low)))]


def functions_of(basis):
    """The functions of a Wang block over |N k⟩ (k rising from -N) in columns."""
    out = np.zeros((2 * basis.j + 1, basis.size), dtype=complex)
    for column, k in enumerate(basis.k.tolist()):
        out[basis.j + k, column] = np.sqrt(0.5) if k else 1.0
        out[basis.j - k, column] = basis.sign * np.sqrt(0.5) if k else 1.0
    return out * 1j ** phase_exponent(basis)


def tensor_elements(up, low, tensor):
    """Real reduced elements of a tensor; between axial states of one sign of K, with the absolute value of a component across the axis."""
    if tensor is None:
        return None
    if isinstance(up, AxialState):
        q = up.axial_k - low.axial_k
        if abs(q) > tensor.rank or not abs(up.j - low.j) <= tensor.rank <= up.j + low.j:
            return None
        part = tensor.components[tensor.rank + q]
        values = coupling(low.j, up.j, tensor.rank, q, [low.axial_k])[:, None]
        return (abs(part) if q else part.real) * values if part else None
    return block_elements(up, low, tensor) if tensor.connects(up, low) else None


def operator_elements(operator, up, low):
    """Real elements of an operator of the algebra, None where they are zero."""
    between = matrix_of_j(operator, low.j, up.j)
    reduced = (functions_of(up).conj().T @ between @ functions_of(low)).real
    return reduced if np.abs(reduced).max(initial=0.0) > NOTHING * np.abs(between).max(initial=0.0) else None


def rotor_elements(rotor, up, low, representation):
    """The real reduced matrix of an operator with spins between two blocks, None where it is zero."""
    if isinstance(rotor, Scalar):
        return operator_elements(sum_of_powers(dict(rotor.operators)), up, low) if up == low else None
    if isinstance(rotor, ByElements):
        within = abs(up.j - low.j) <= rotor.rank <= up.j + low.j
        return operator_elements(rotor.operator, up, low) if within else None
    if isinstance(rotor, Cosines):
        matrix = tensor_elements(up, low, tensor_of(rotor.components, rotor.rank, representation))
        return -matrix if matrix is not None and rotor.rank == 1 else matrix  # i · (i E)
    c, n, m = np.array(rotor.components), low.j, up.j
    if abs(m - n) > 1 or not m + n:
        return None
    stretch, change, length = factors_with_n(float(m), float(n))
    terms = [
        (stretch, tensor_elements(up, low, tensor_of(rotor.components, 2, representation))),
        (change, tensor_elements(up, low, axis_tensor(rotor.components, representation))),
        (float(np.trace(c)) / 3, length * np.eye(low.size) if up == low else None),
    ]
    acting = [factor * matrix for factor, matrix in terms if matrix is not None and factor]
    return sum(acting) if acting else None
