"""Tensors of the molecule and of its nuclei as tensors of the rotation along the axes of ρ.

    H = Σ_i χ_i T²(u_i)·T²(I, I)/(2I(2I-1)) + Σ_i C_i Σ_gh (u_i)_gh ½{Φ_g, N_h}·I

with the matrix u_i that a constant multiplies, such as (aa) or (bb) - (cc), in the axes of A, B, C: those of ρ in the RAM, principal
axes, from which ρ lies at an angle, in the PAM. The torsional functions multiply each tensor by their overlaps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.operators.algebra import Operator, half_anticommutator
from rotor.quantum.operators.rotation import body_tensor, j_x, j_y, j_z
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Rotor
from rotor.quantum.tensors import cartesian_of, spherical_components

REPRESENTATION = "Ir"  # of the rho-axis frame: z, x, y = a, b, c
# derivative of the turn from a towards b at angle 0
TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def turned_by(body: Floats, angle: float) -> Floats:
    """A vector or tensor along the axes of ρ, which lie at an angle (radians) from a towards b."""
    turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ body if body.ndim == 1 else turn @ body @ turn.T)


def slope_by_angle(rotor: Rotor) -> Cosines | CosinesWithN:
    """The derivative of a tensor along the axes of ρ by their angle."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    matrix = np.array(rotor.components)
    first, second, third = (TURN @ matrix + matrix @ TURN.T).tolist()
    return type(rotor)((tuple(first), tuple(second), tuple(third)))


def leaves_plane(rotor: Rotor) -> bool:
    """Whether a mirror ab changes the sign of some elements of a tensor."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    matrix = np.array(rotor.components)
    return bool(matrix[:2, 2].any() or matrix[2, :2].any())


def turned_components(components: NDArray[Any], angle: float) -> NDArray[Any]:
    """Spherical components along the axes of ρ, at an angle (radians, from a towards b) to the tensor's axes; real if possible."""
    if angle:
        body = turned_by(cartesian_of(components, REPRESENTATION), angle)
        components = spherical_components(body, body.ndim, REPRESENTATION)
    return _real(components)


class Component(NamedTuple):
    """A component along two axes (0, 1, 2 for a, b, c): T²_gh (rank 2) or ½{Φ_g, N_h} (rank 1)."""

    rank: int
    g: int
    h: int


def tensor_components(rotor: Rotor, angle: float, has_plane: bool) -> dict[Component, float]:
    """T²(c) or Σ_gh c_gh ½{Φ_g, N_h} by components along the axes of ρ; has_plane: without those that a mirror ab excludes."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    matrix = turned_by(np.array(rotor.components, dtype=float), angle)
    if has_plane:
        matrix[:2, 2] = matrix[2, :2] = 0.0
    if isinstance(rotor, Cosines):  # symmetric; the sum of aa, bb and cc is 0
        matrix = np.triu(matrix + matrix.T) - np.diag(np.diag(matrix) + matrix[2, 2])
    return {Component(rotor.rank, g, h): float(matrix[g, h]) for g, h in np.argwhere(matrix).tolist()}


def unit_operator(component: Component) -> Operator:
    """The operator of the rotation of a component of 1."""
    rank, g, h = component
    unit, along = np.eye(3), (j_z(), j_x(), j_y())
    if rank == 1:
        return half_anticommutator(body_tensor(_real(spherical_components(unit[g], 1, REPRESENTATION))), along[h])
    matrix = (np.outer(unit[g], unit[h]) + np.outer(unit[h], unit[g])) / 2
    return body_tensor(_real(spherical_components(matrix, 2, REPRESENTATION)))


def _real(components: NDArray[Any]) -> NDArray[Any]:
    """Components as a real array if none has an imaginary part."""
    return components if np.abs(components.imag).max() else components.real
