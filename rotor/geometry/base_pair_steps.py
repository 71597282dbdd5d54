"""Rigid base pairs of DNA: the six parameters of a base-pair step, and the persistence length of a chain.

The parameters are shift, slide, rise (lengths along x, y, z) and tilt, roll, twist (degrees, about x, y, z) in the frame halfway
between the two pairs (M. A. El Hassan, C. R. Calladine, J. Mol. Biol. 251, 648 (1995)):

    q = Z(twist/2) B Z(twist/2),   B = exp(tilt, roll, 0),   p = Z(twist/2) B^½ (shift, slide, rise).

Multiplied out, q = (cos Γ/2 cos Ω/2, sin Γ/2 (tilt, roll)/Γ, cos Γ/2 sin Ω/2) with Γ = √(tilt² + roll²) and Ω the twist. The
inverse follows from this form.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, with_components
from rotor.geometry.rotations import conjugate, exp, multiply, rotate, to_matrix

NODES = 5  # Gauss-Hermite points per angle: exact for polynomials of degree 9 in the angles


def step_pose(parameters: ArrayLike) -> tuple[Floats, Floats]:
    """Attitude (..., 4) and position (..., 3) of the second pair in the frame of the first; parameters (..., 6).

    >>> q, position = step_pose([0.0, 0.0, 3.4, 0.0, 0.0, 36.0])
    >>> position.tolist(), float((2 * np.degrees(np.arccos(q[0]))).round(12))
    ([0.0, 0.0, 3.4], 36.0)
    """
    values = with_components(parameters, 6, "shift, slide, rise, tilt, roll, twist of base-pair steps")
    bend, half_twist = np.radians(values[..., 3:5]), 0.5 * np.radians(values[..., 5])
    flat = np.concatenate([bend, np.zeros_like(bend[..., :1])], axis=-1)
    upright = np.stack([np.zeros_like(half_twist), np.zeros_like(half_twist), half_twist], axis=-1)
    turn = exp(upright)
    q = multiply(multiply(turn, exp(flat)), turn)
    return q, rotate(multiply(turn, exp(0.5 * flat)), values[..., :3])


def step_parameters(q: ArrayLike, position: ArrayLike) -> Floats:
    """The six parameters (..., 6) of a step, the inverse of `step_pose`, for bends below 180 degrees.

    >>> step_parameters(*step_pose([0.1, -0.2, 3.3, -1.4, 4.5, 35.1])).round(12).tolist()
    [0.1, -0.2, 3.3, -1.4, 4.5, 35.1]
    """
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    sign = np.where(w < 0.0, -1.0, 1.0)
    w, x, y, z = sign * w, sign * x, sign * y, sign * z
    twist, sine = 2.0 * np.arctan2(z, w), np.hypot(x, y)
    scale = np.divide(2.0 * np.arctan2(sine, np.hypot(w, z)), sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    bend = np.stack([scale * x, scale * y, np.zeros_like(x)], axis=-1)
    upright = np.stack([np.zeros_like(twist), np.zeros_like(twist), 0.5 * twist], axis=-1)
    middle = multiply(exp(upright), exp(0.5 * bend))
    angles = np.degrees(np.stack([bend[..., 0], bend[..., 1], twist], axis=-1))
    return np.concatenate([rotate(conjugate(middle), position), angles], axis=-1)


def mean_rotation(mean_degrees: ArrayLike, covariance_degrees2: ArrayLike) -> Floats:
    """⟨R⟩ (..., 3, 3) of steps with normally distributed tilt, roll, twist, by Gauss-Hermite quadrature.

    mean_degrees: (..., 3). covariance_degrees2: (..., 3, 3), of the three angles.

    >>> mean_rotation([0.0, 0.0, 0.0], np.diag([0.0, 0.0, 900.0]))[0, 0].round(6) == np.exp(-np.radians(30.0) ** 2 / 2).round(6)
    np.True_
    """
    mean, covariance = np.asarray(mean_degrees, dtype=np.float64), np.asarray(covariance_degrees2, dtype=np.float64)
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.prod(np.stack(np.meshgrid(weights, weights, weights, indexing="ij"), axis=-1).reshape(-1, 3), axis=-1)
    angles = mean[..., None, :] + np.einsum("...ij,nj->...ni", root, grid)
    rotations = to_matrix(step_pose(np.concatenate([np.zeros_like(angles), angles], axis=-1))[0])
    return np.asarray(np.einsum("n,...nij->...ij", weight / weight.sum(), rotations))


def persistence_steps(rotation: ArrayLike) -> float:
    """Number of independent steps over which the direction of a chain decays to 1/e, from ⟨R⟩ (3, 3) of a step.

    This is -1/ln λ: ⟨z_0·z_n⟩ = zᵀ ⟨R⟩ⁿ z decays with the largest real eigenvalue λ of ⟨R⟩. (The complex pair belongs to
    directions that rotate with the twist.)

    >>> round(persistence_steps(np.diag([0.5, 0.5, np.exp(-0.02)])), 9)
    50.0
    """
    values = np.linalg.eigvals(np.asarray(rotation, dtype=np.float64))
    real = values.real[np.abs(values.imag) < 1e-12]
    largest = float(real.max())
    if not 0.0 < largest < 1.0:
        raise ValueError(f"a chain of constant steps has no persistence length: the largest eigenvalue is {largest:g}")
    return -1.0 / math.log(largest)
