"""Rotations found in data: best fit of point clouds, rotation and stretch apart, strain and vorticity of a flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.geometry.rotations import from_matrix, nearest_rotation


@dataclass(frozen=True, eq=False)
class Superposition:
    """target ≈ rotation mobile + translation, in the sense of weighted least squares.

    rotation: (..., 3, 3) proper; quaternion: (..., 4); translation: (..., 3); rmsd: (...), root of the weighted mean
    square distance that remains; unique: (...), False for points on a line, and where a mirrored cloud fits two ways.
    """

    rotation: Floats
    quaternion: Floats
    translation: Floats
    rmsd: Floats
    unique: NDArray[np.bool_]

    def apply(self, points: ArrayLike) -> Floats:
        """The points (..., n, 3) moved onto the target."""
        points = np.asarray(points, dtype=np.float64)
        return np.asarray(points @ np.swapaxes(self.rotation, -1, -2) + self.translation[..., None, :])


@dataclass(frozen=True, eq=False)
class Polar:
    """gradient = rotation @ stretch = left_stretch @ rotation; rotation proper, both stretches symmetric (..., 3, 3).

    A gradient that mirrors (determinant < 0) keeps a proper rotation; its smallest stretch is then negative.
    unique: (...), False where the gradient does not determine the rotation.
    """

    rotation: Floats
    stretch: Floats
    left_stretch: Floats
    unique: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FlowGradient:
    """Strain rate (..., 3, 3), symmetric; vorticity (..., 3) = curl v; angular velocity (..., 3) = ½ curl v."""

    strain_rate: Floats
    vorticity: Floats
    angular_velocity: Floats


def superpose(mobile: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> Superposition:
    """The proper rotation and translation that best superpose `mobile` (..., n, 3) on `target` (..., n, 3).

    Minimises Σ w |R x + t - y|². With centred clouds and C = Σ w y xᵀ = U S Vᵀ, R = U diag(1, 1, det U det V) Vᵀ
    (W. Kabsch, Acta Cryst. A32, 922 (1976); A34, 827 (1978)): a rotation for planar and mirrored clouds too.
    weights: (..., n), not negative, e.g. masses; default: equal.

    >>> square = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    >>> fit = superpose(square, square @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [1, 2, 3])  # a quarter turn
    >>> fit.translation.round(12).tolist(), round(float(fit.rmsd), 12)
    ([1.0, 2.0, 3.0], 0.0)
    """
    x, y = _clouds(mobile, target)
    w = _weights(weights, x.shape[-2])
    x0, y0 = np.sum(w[..., None] * x, axis=-2), np.sum(w[..., None] * y, axis=-2)
    dx, dy = x - x0[..., None, :], y - y0[..., None, :]
    covariance = np.swapaxes(w[..., None] * dy, -1, -2) @ dx
    fit = nearest_rotation(covariance)
    rotation = fit.rotation
    rest = dx @ np.swapaxes(rotation, -1, -2) - dy
    rmsd = np.sqrt(np.sum(w * np.sum(rest * rest, axis=-1), axis=-1))
    translation = y0 - (rotation @ x0[..., None])[..., 0]
    return Superposition(rotation, from_matrix(rotation), translation, rmsd, fit.unique)


def polar(gradient: ArrayLike) -> Polar:
    """Rotation and stretch of a deformation gradient (..., 3, 3), F = R U = V R.

    >>> bent = polar([[0.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # stretch 2 along y, then a quarter turn
    >>> bent.rotation.round(12).tolist(), np.diag(bent.stretch).round(12).tolist()
    ([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [1.0, 2.0, 1.0])
    """
    f = np.asarray(gradient, dtype=np.float64)
    fit = nearest_rotation(f)
    turned_back = np.swapaxes(fit.rotation, -1, -2)
    return Polar(fit.rotation, _symmetric_part(turned_back @ f), _symmetric_part(f @ turned_back), fit.unique)


def flow_gradient(gradient: ArrayLike) -> FlowGradient:
    """Strain rate and rotation of a velocity gradient G_ij = ∂v_i/∂x_j, (..., 3, 3).

    The antisymmetric part turns the fluid like a rigid body at ½ curl v (G. K. Batchelor, An Introduction to Fluid
    Dynamics, section 2.3).

    >>> shear = flow_gradient([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # v = (y, 0, 0)
    >>> shear.angular_velocity.tolist()
    [0.0, 0.0, -0.5]
    """
    g = np.asarray(gradient, dtype=np.float64)
    if g.shape[-2:] != (3, 3):
        raise ValueError(f"a velocity gradient has shape (..., 3, 3), row i the gradient of v_i; got {g.shape}")
    curl = np.stack([g[..., 2, 1] - g[..., 1, 2], g[..., 0, 2] - g[..., 2, 0], g[..., 1, 0] - g[..., 0, 1]], axis=-1)
    return FlowGradient(_symmetric_part(g), curl, 0.5 * curl)


def _symmetric_part(matrix: Floats) -> Floats:
    return np.asarray(0.5 * (matrix + np.swapaxes(matrix, -1, -2)))


def _clouds(mobile: ArrayLike, target: ArrayLike) -> tuple[Floats, Floats]:
    x, y = np.asarray(mobile, dtype=np.float64), np.asarray(target, dtype=np.float64)
    for name, cloud in (("mobile", x), ("target", y)):
        if cloud.ndim < 2 or cloud.shape[-1] != 3 or cloud.shape[-2] == 0:
            raise ValueError(f"{name}: a point cloud has shape (..., n, 3) with n >= 1; got {cloud.shape}")
        if not np.all(np.isfinite(cloud)):
            raise ValueError(f"{name}: a coordinate is not finite")
    if x.shape[-2] != y.shape[-2]:
        raise ValueError(
            f"clouds of {x.shape[-2]} and {y.shape[-2]} points: expected the same number, in the same order"
        )
    return x, y


def _weights(weights: ArrayLike | None, n: int) -> Floats:
    """Weights that sum to one."""
    if weights is None:
        return np.full(n, 1.0 / n)
    w = np.asarray(weights, dtype=np.float64)
    if w.ndim == 0 or w.shape[-1] != n:
        raise ValueError(f"weights have shape (..., {n}), one for each point; got {w.shape}")
    total = np.sum(w, axis=-1, keepdims=True)
    if not np.all(np.isfinite(w)) or np.any(w < 0.0) or np.any(total <= 0.0):
        raise ValueError("weights must be finite, not negative, and not all zero")
    return np.asarray(w / total)
