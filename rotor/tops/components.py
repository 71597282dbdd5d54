"""Dipoles and polarizabilities as checked components along the principal axes a, b, c."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.geometry.inertia import PrincipalFrame

Vector = tuple[float, float, float]
Tensor = tuple[Vector, Vector, Vector]
FRAME_NOISE = 1e-5  # of a norm; the axes of a relaxed geometry are off those of its symmetry by some 1e-6 radian


def in_frame(frame: PrincipalFrame, dipole: Floats) -> Vector | None:
    """Components along a, b, c; those below 1e-5 of the norm are rounding of the frame and set to 0."""
    components = frame.axes @ dipole
    return dipole_vector(np.where(np.abs(components) < FRAME_NOISE * np.linalg.norm(components), 0.0, components))


def tensor_in_frame(frame: PrincipalFrame, tensor: Floats) -> Tensor:
    """The tensor along a, b, c; elements below 1e-5 of the norm are rounding of the frame and set to 0."""
    rotated = frame.axes @ tensor @ frame.axes.T
    return symmetric_tensor(
        np.where(np.abs(rotated) < FRAME_NOISE * np.linalg.norm(rotated), 0.0, (rotated + rotated.T) / 2)
    )


def symmetric_tensor(tensor: ArrayLike) -> Tensor:
    """A polarizability as nested tuples; checked to be (3, 3), finite, and symmetric within 1e-9 of its size.

    >>> symmetric_tensor([[2, 0, 0], [0, 1, 0], [0, 0, 1]])
    ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    """
    values = np.asarray(tensor, dtype=float)
    if values.shape != (3, 3) or not np.isfinite(values).all():
        raise ValueError(f"a polarizability is a (3, 3) tensor of finite numbers in Å³, not {values.tolist()}")
    if not np.allclose(values, values.T, rtol=0, atol=1e-9 * float(np.abs(values).max())):
        raise ValueError(f"a polarizability is a symmetric tensor, this one is not: {values.tolist()}")
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in values)
    return a, b, c


def dipole_vector(vector: ArrayLike | None) -> Vector | None:
    """A dipole in debye as three checked numbers; None for None.

    >>> dipole_vector([1, 0, 2])
    (1.0, 0.0, 2.0)
    """
    if vector is None:
        return None
    values = np.asarray(vector, dtype=float)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"a dipole is three finite numbers (μa, μb, μc) in debye, not {values.tolist()}")
    return float(values[0]), float(values[1]), float(values[2])


def known_dipole(vector: Vector | None, estimated: bool) -> Vector | None:
    """A dipole as it is shown: an estimated one has one decimal, since its error is 0.2 D."""
    return dipole_vector(np.round(vector, 1)) if vector is not None and estimated else vector


def dipole_line(vector: Vector | None, estimated: bool) -> str:
    """A dipole in D."""
    shown = known_dipole(vector, estimated)
    if shown is None:
        return "not known"
    return ", ".join(f"{mu + 0.0:.5g}" for mu in shown) + (" D (estimated)" if estimated else " D")
