"""Tensors made of N and of direction cosines with spins in place of N, as operators on |N K⟩.

The operator of a TYP is a tensor T^L_K made of N (`operators`). With X, Y, Z = Nc, Nb, Na (prolate) or Na, Nb, Nc (oblate) and
{A, B} = AB + BA it is, by its species,

    K = L:      ½ (E + E†), or (E - E†)/2i,                       E = (X + iY)^K
    K = L - 1:  ¼ √(2L) {Z, E + E†}, or {Z, E - E†}/i in its place;  Z where L = 1;  twice that without an axis

the tensor T^L_K(N) normalised as N^L times the spherical harmonic C^L_K, divided by C^L_L of its stretched component. Operators along X
have X, {Y, Z}, ...; along Y: Y, {X, Z}, ...; along Z: Z, {X, Y}, .... With a spin one N is replaced by it, with two spins two are. With
φ± = φ_x ± iφ_y of the direction cosines that are contracted with the spins,

    K = L        A = N₊^L,  φ₊ N₊^(L-1),  φ₊ φ₊ N₊^(L-2)       of no, one, two spins (φ₊ and N₊ commute)
    K = L - 1    ±[N₋, A]/L in place of {Z, N₊^(L-1)},  Z and φ_z where L = 1

since [N₋, N₊^L] = ±L {Z, N₊^(L-1)}, + where X, Y, Z are right-handed, and the other component of any such tensor follows likewise.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rotor.formats.spcat.hamiltonian.code_table import Tensor
from rotor.formats.spcat.hamiltonian.codes import basis_of
from rotor.quantum.operators.algebra import UNIT, Operator, half_anticommutator
from rotor.quantum.operators.rotation import (
    Weight,
    body_tensor,
    components,
    direction_cosine,
    ladder,
    sum_of_powers,
    weighted,
)
from rotor.quantum.spins.operators import ByElements, Cosines, CosinesWithN, Rotor, Scalar
from rotor.quantum.tensors import spherical_components


@lru_cache(maxsize=256)
def tensor_with_spins(tensor: Tensor, spins: int, axes: str) -> ByElements:
    """A tensor with one or two different spins, or none, with a factor i (-i in an oblate basis) for odd rank."""
    return ByElements(min(tensor.rank, spins), tensor_operator(tensor, spins, axes), tensor.odd)


@lru_cache(maxsize=256)
def tensor_operator(tensor: Tensor, spins: int, axes: str) -> Operator:
    """The part of a tensor that acts on N, with this number of spins in place of N."""
    order, rank, z = tensor.rank, min(tensor.rank, spins), axes[2]
    k, cosine, factor, frame = order, True, 1.0 + 0.0j, axes
    if tensor.axis or tensor.odd:
        k, cosine = tensor.shape(z)
        frame = "cba" if z == "a" else "abc"
        factor = (0.5 if k == order else tensor.factor_below()) * imaginary(axes, tensor.odd)
        if k == 0:
            return imaginary(axes, True) * (
                direction_cosine(z, basis_of(axes)) if rank else components(basis_of(axes))[z]
            )
    up, down = ((_stretched if k == order else _below)(order, rank, frame, sign, axes) for sign in (1, -1))
    return factor * (up + down if cosine else -1j * (up - down))  # i(E - E†) is Hermitian, as E + E† is


def imaginary(axes: str, odd: bool) -> complex:
    """1, or i (-i in an oblate basis) for odd L."""
    if not odd:
        return 1.0
    return 1j if axes[2] == "a" else -1j


def _stretched(order: int, rank: int, frame: str, sign: int, axes: str) -> Operator:
    """A of the head of this module, or the operator with - in place of +."""
    x, y = ("abc".index(axis) for axis in frame[:2])
    n = _circular(frame, sign, order - rank, axes)
    if not rank:
        return n
    if rank == 1:
        along_x, along_y = (direction_cosine(axis, basis_of(axes)) for axis in frame[:2])
        return (along_x + sign * 1j * along_y) @ n
    plane = np.zeros((2, 3, 3))
    plane[0, x, x], plane[0, y, y], plane[1, x, y], plane[1, y, x] = 1.0, -1.0, 1.0, 1.0
    real, imaginary_part = (spherical_components(matrix, 2, basis_of(axes)) for matrix in plane)
    return body_tensor(real + sign * 1j * imaginary_part) @ n


def _below(order: int, rank: int, frame: str, sign: int, axes: str) -> Operator:
    """The component K = L - 1 that belongs to A, or that with - in place of +."""
    if not rank:
        along = components(basis_of(axes))[frame[2]]
        return 2.0 * half_anticommutator(along, _circular(frame, sign, order - 1, axes))
    stretched, opposite = _stretched(order, rank, frame, sign, axes), _circular(frame, -sign, 1, axes)
    right = 1.0 if frame in ("abc", "bca", "cab") else -1.0
    return right * sign / order * (opposite @ stretched - stretched @ opposite)


def _circular(frame: str, sign: int, power: int, axes: str) -> Operator:
    """(N_x ± iN_y)^power: a ladder, times ±i for each factor where x, y are y, x of the basis."""
    if not power:
        return UNIT
    oblate, swapped = axes[2] == "c", frame[0] != axes[0]
    lowers = (sign < 0) if oblate else (sign > 0)  # N_x + iN_y lowers K in a right-handed basis, as that of c is not
    return (sign * 1j if swapped else 1.0) ** power * ladder(-power if lowers != swapped else power)


def multiplied(rotor: Rotor, factor: Weight, whole: complex, odd: bool, axes: str) -> ByElements:
    """An operator times a number, its elements times a function.

    rotor: the operator. factor: function of N', N, K' and K. whole: the number. odd: whether time reversal changes the sign of the
    result. axes: the axes x, y, z.
    """
    return ByElements(rotor.rank, whole * weighted(operator_of(rotor, axes), factor), odd)


def operator_of(rotor: Rotor, axes: str) -> Operator:
    """The operator on |N K⟩ of a term with spins."""
    if isinstance(rotor, ByElements):
        return rotor.operator
    if isinstance(rotor, Scalar):
        return sum_of_powers(dict(rotor.operators))
    assert isinstance(rotor, Cosines | CosinesWithN)
    c = np.array(rotor.components, dtype=float)
    if isinstance(rotor, Cosines):
        factor = 1j if rotor.rank == 1 else 1.0
        return factor * body_tensor(spherical_components(c, rotor.rank, basis_of(axes)))
    along, total = components(basis_of(axes)), Operator()
    for i, k in np.argwhere(c).tolist():
        total = total + c[i, k] * half_anticommutator(direction_cosine("abc"[i], basis_of(axes)), along["abc"[k]])
    return total
