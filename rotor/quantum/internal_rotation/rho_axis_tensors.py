"""Tensors of the molecule and of its nuclei as tensors of the rotation along the axes of ρ.

    H = Σ_i χ_i T²(u_i)·T²(I, I)/(2I(2I-1)) + Σ_i C_i Σ_gh (u_i)_gh ½{Φ_g, N_h}·I

with the matrix u_i that a constant multiplies, such as (aa) or (bb) - (cc), in the axes of A, B, C: those of ρ in the RAM, principal
axes in the PAM, turned into the axes z, x, y of ρ. The torsional functions multiply each tensor by their overlaps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.internal_rotation.terms import AXES, PRINCIPAL, Axes
from rotor.quantum.operators.algebra import Operator, half_anticommutator
from rotor.quantum.operators.rotation import body_tensor
from rotor.quantum.operators.tensors import cartesian_of, spherical_components
from rotor.quantum.spins.scheme import Cosines, CosinesWithN, Rotor

REPRESENTATION = "Ir"  # of the rho-axis frame: z, x, y = a, b, c


def turned_by(body: Floats, frame: Axes) -> Floats:
    """A vector or tensor along the axes z, x, y of ρ from that along a, b, c."""
    turn = frame.matrix
    return np.asarray(turn @ body if body.ndim == 1 else turn @ body @ turn.T)


def slope_by_tilt(rotor: Rotor, frame: Axes, towards: str) -> Cosines | CosinesWithN:
    """The derivative, along a, b, c, of a tensor along the axes of ρ by the angle of a turn of ρ towards x or y."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    z, x, y = frame.matrix
    other = x if towards == "x" else y
    turn = np.outer(z, other) - np.outer(other, z)
    matrix = np.array(rotor.components)
    first, second, third = (turn @ matrix + matrix @ turn.T).tolist()
    return type(rotor)((tuple(first), tuple(second), tuple(third)))


def turned_components(components: NDArray[Any], frame: Axes) -> NDArray[Any]:
    """Spherical components along the axes of ρ from those along a, b, c; real if possible."""
    if frame != PRINCIPAL:
        body = turned_by(cartesian_of(components, REPRESENTATION), frame)
        components = spherical_components(body, body.ndim, REPRESENTATION)
    return _real(components)


def operator_beside_spins(rotor: Rotor, frame: Axes) -> Operator:
    """T²(c) or Σ_gh c_gh ½{Φ_g, N_h} along the axes of ρ."""
    assert isinstance(rotor, Cosines | CosinesWithN)
    matrix = turned_by(np.array(rotor.components, dtype=float), frame)
    if isinstance(rotor, Cosines):
        return body_tensor(_real(spherical_components(matrix, 2, REPRESENTATION)))
    vectors = [body_tensor(_real(spherical_components(column, 1, REPRESENTATION))) for column in matrix.T]
    return sum((half_anticommutator(vector, axis) for vector, axis in zip(vectors, AXES, strict=True)), Operator())


def _real(components: NDArray[Any]) -> NDArray[Any]:
    """Components as a real array if none has an imaginary part."""
    return components if np.abs(components.imag).max() else components.real
