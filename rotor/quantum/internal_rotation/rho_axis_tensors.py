"""Tensors of the molecule and of its nuclei as tensors of the rotation along the axes of ρ.

    H = Σ_i χ_i T²(u_i)·T²(I, I)/(2I(2I-1)) + Σ_i C_i Σ_gh (u_i)_gh ½{Φ_g, N_h}·I

with the matrix u_i that a constant multiplies, such as (aa) or (bb) - (cc), in the axes of A, B, C: those of ρ in the RAM, principal
axes, from which ρ lies at an angle, in the PAM. The torsional functions multiply each tensor by their overlaps.
"""

from __future__ import annotations

from typing import Any

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


def operator_beside_spins(rotor: Rotor, angle: float, has_plane: bool) -> Operator:
    """T²(c) or Σ_gh c_gh ½{Φ_g, N_h} along the axes of ρ; has_plane: without the components that a mirror ab excludes."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    matrix = turned_by(np.array(rotor.components, dtype=float), angle)
    if has_plane:
        matrix[:2, 2] = matrix[2, :2] = 0.0
    if isinstance(rotor, Cosines):
        return body_tensor(_real(spherical_components(matrix, 2, REPRESENTATION)))
    vectors = [body_tensor(_real(spherical_components(column, 1, REPRESENTATION))) for column in matrix.T]
    pairs = zip(vectors, (j_z(), j_x(), j_y()), strict=True)
    return sum((half_anticommutator(vector, along) for vector, along in pairs), Operator())


def _real(components: NDArray[Any]) -> NDArray[Any]:
    """Components as a real array if none has an imaginary part."""
    return components if np.abs(components.imag).max() else components.real
