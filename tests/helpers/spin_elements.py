"""Reduced elements of a vector between two blocks with spins, part by part: coefficients of one pair of F, elements of one pair of N."""

from __future__ import annotations

import numpy as np
from plain_elements import tensor_elements

from rotor.quantum.spins.coupling import ChainOperator
from rotor.quantum.spins.scheme import AxialState


def elements_of_parts(up, low, tensors):
    """⟨F'‖T‖F⟩ (n_up, n_low); those of |N K⟩ count both signs of K."""
    total, scheme = np.zeros((len(up.vectors), len(low.vectors))), up.spins.shared.scheme
    if not abs(up.twice_total - low.twice_total) <= 2 <= up.twice_total + low.twice_total:
        return total
    vector = ChainOperator((), 1, scalar=False)
    if scheme.equivalent:
        (bra, left), (ket, right) = (scheme.recoupling(block.twice_total) for block in (up, low))
        t = left.T @ vector.coefficients(scheme.twice, bra[:, None], ket) @ right
        t = np.where(np.abs(t) > 1e-13, t, 0.0)
    else:
        t = vector.coefficients(scheme.twice, up.spins.patterns[:, None], low.spins.patterns)

    def between(first, second):
        tensor = tensors.get((first.v, second.v))
        return None if tensor is None else tensor_elements(first.basis, second.basis, tensor)

    for a in up.spins.parts:
        for b in low.spins.parts:
            element = _between_states(a.rotor, b.rotor, between)
            if element is not None:
                bases = a.rotor.parts[0].basis, b.rotor.parts[0].basis
                both = isinstance(bases[0], AxialState) and any(basis.axial_k for basis in bases)
                total[a.place, b.place] = (np.sqrt(2.0) if both else 1.0) * np.kron(t[a.patterns, b.patterns], element)
    return up.vectors.T @ total @ low.vectors


def _between_states(up, low, between):
    """⟨r'|X|r⟩ (n_up, n_low) between the states of two blocks from the elements of X between their parts; None where it is zero."""
    total = None
    for left in up.parts:
        for right in low.parts:
            element = between(left, right)
            if element is not None and element.any():
                moved = up.vectors[left.place].T @ element @ low.vectors[right.place]
                total = moved if total is None else total + moved
    return total
