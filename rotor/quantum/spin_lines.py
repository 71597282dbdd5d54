"""Elements of molecule-fixed tensors between levels with spins, and how such levels depend on the parameters.

A dipole touches no spin: its element between two functions is that of the rotation times a product of 6j symbols,

    ⟨r' p'‖T^K‖r p⟩ = t(p', p) ⟨r'‖T^K‖r⟩,

see `spin_coupling.tensor_coefficients`. Elements of the rotation are computed once for all F.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.levels import Levels
from rotor.quantum.reduced import Tensors, rank_of, tensor_between
from rotor.quantum.spin_blocks import Shared, SpinBlock, SpinPart
from rotor.quantum.spin_coupling import tensor_coefficients
from rotor.quantum.spin_operators import AxialState, tensor_elements
from rotor.quantum.spin_rotor import RotorBlock

if TYPE_CHECKING:
    from rotor.tops.top import Top


def amplitudes(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> Floats:
    """Real reduced elements between all states of two blocks, (n_up, n_low); their squares are line strengths."""
    rank, moved = rank_of(tensors), np.zeros((up.vectors.shape[0], low.vectors.shape[1]))
    for target, source, element in _acting(up, low, tensors, rank):
        t = _coefficients(low.shared, rank, target, source, up.twice_f, low.twice_f)
        moved[target.place] += np.kron(t, element) @ low.vectors[source.place]
    return np.asarray(up.vectors.T @ moved)


def connected(up: SpinBlock, low: SpinBlock, tensors: Tensors) -> bool:
    """Whether the tensors have an element between two blocks."""
    return bool(_acting(up, low, tensors, rank_of(tensors)))


def _acting(up: SpinBlock, low: SpinBlock, tensors: Tensors, rank: int) -> list[tuple[SpinPart, SpinPart, Floats]]:
    """Pairs of parts between which the tensors act, with the element of the rotation."""
    if not abs(up.twice_f - low.twice_f) <= 2 * rank <= up.twice_f + low.twice_f:
        return []
    held, known = low.shared.cache.setdefault(id(tensors), (tensors, {}))
    del held  # the cache holds the tensors, so that their id stays theirs
    found = []
    for target in up.parts:
        for source in low.parts:
            if abs(target.rotor.n - source.rotor.n) <= rank:
                key = (target.index, source.index)
                if key not in known:
                    known[key] = _rotor_element(target.rotor, source.rotor, tensors)
                if known[key] is not None:
                    found.append((target, source, known[key]))
    return found


def _rotor_element(up: RotorBlock, low: RotorBlock, tensors: Tensors) -> Floats | None:
    """⟨r'‖T‖r⟩; of axial states √(number of components) of it, so that squares are summed over both signs of K."""
    total: Floats | None = None
    for left in up.parts:
        for right in low.parts:
            found = tensor_elements(left.basis, right.basis, tensor_between(tensors, left.v, right.v))
            if found is not None and found.any():
                moved = up.vectors[left.place].T @ found @ low.vectors[right.place]
                total = moved if total is None else total + moved
    basis = up.parts[0].basis
    if total is not None and isinstance(basis, AxialState) and (basis.axial_k or low.parts[0].basis.k[0]):
        return np.sqrt(2.0) * total
    return total


def _coefficients(shared: Shared, rank: int, up: SpinPart, low: SpinPart, twice_up: int, twice_low: int) -> Floats:
    key = ("tensor", rank, twice_up, up.rotor.n, twice_low, low.rotor.n)
    if key not in shared.cache:
        shared.cache[key] = tensor_coefficients(shared.scheme.twice, rank, up.patterns, low.patterns)
    found: Floats = shared.cache[key]
    return found


def derivatives(top: Top, levels: Levels, names: Sequence[str], rows: Ints) -> Floats:
    """∂E/∂c of levels with spins, (rows, names)."""
    raise NotImplementedError
