"""Rotations as quaternions (..., 4): scalar first, body to space, every function broadcasting.

A quaternion q = (w, x, y, z) = (cos θ/2, n sin θ/2) turns a vector of the body frame into one of the space frame,
v_space = q v_body q*. q and -q are the same orientation. Unless a function says otherwise its quaternions are of
unit length; where only the direction of q matters (`rotate`, `to_matrix`, `log`, `distance`) any length serves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, with_components
from rotor.geometry import quaternions

IDENTITY: Floats = np.array([1.0, 0.0, 0.0, 0.0])
IDENTITY.setflags(write=False)

ORTHOGONALITY_TOLERANCE = 1e-6  # largest |RᵀR - 1| that `from_matrix` takes for round-off of a printed matrix
POLE = 1e-8  # sin(θ/2) or cos(θ/2) below which the first and last Euler angle are known to fewer than 8 digits


@dataclass(frozen=True, eq=False)
class NearestRotation:
    """The rotation nearest to a matrix, how far the matrix was from it, and whether another is as near.

    rotation: (..., 3, 3), proper orthogonal.
    distance_from_input: (...), Frobenius norm of matrix - rotation.
    unique: (...), False where the nearest rotation is not unique (a rank below 2, or a reflection with equal axes).
    """

    rotation: Floats
    distance_from_input: Floats
    unique: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class EulerAngles:
    """Angles of R = R_z(phi) R_y(theta) R_z(chi), in radians, theta within [0, π], the others within [-π, π].

    at_pole: True where the axes of phi and chi fall together. Only phi + chi (theta = 0) or phi - chi (theta = π)
    is determined there; exactly at the pole chi = 0 is chosen.
    """

    phi: Floats
    theta: Floats
    chi: Floats
    at_pole: NDArray[np.bool_]


def multiply(p: ArrayLike, q: ArrayLike) -> Floats:
    """Product p q: first the rotation q, then p.

    Hamilton's rule, i j = k. Shapes (..., 4) broadcast.

    >>> multiply([0, 1, 0, 0], [0, 0, 1, 0])
    array([0., 0., 0., 1.])
    """
    return _joined(quaternions.product(_separate(_components(p)), _separate(_components(q))))


def conjugate(q: ArrayLike) -> Floats:
    """The inverse rotation: the vector part changes sign.

    >>> conjugate([0.6, 0.8, 0, 0])
    array([ 0.6, -0.8, -0. , -0. ])
    """
    return _joined(quaternions.conjugate(_separate(_components(q))))


def normalised(q: ArrayLike) -> Floats:
    """q at unit length; a quaternion of zero length is refused.

    >>> normalised([3, 4, 0, 0])
    array([0.6, 0.8, 0. , 0. ])
    """
    q = _components(q)
    return q / _length(q)[..., None]


def rotate(q: ArrayLike, vector: ArrayLike) -> Floats:
    """Vectors (..., 3) turned from body to space, v + 2 (w u + v⃗ x u) with u = v⃗ x v and q = (w, v⃗).

    >>> rotate(exp([0, 0, np.pi / 2]), [1, 0, 0]).round(15)
    array([0., 1., 0.])
    """
    return _joined(quaternions.turned(_separate(normalised(q)), _separate(_vectors(vector))))


def vector_product(a: ArrayLike, b: ArrayLike) -> Floats:
    """a x b of vectors (..., 3).

    >>> vector_product([1, 0, 0], [0, 1, 0])
    array([0., 0., 1.])
    """
    return _joined(quaternions.cross(_separate(_vectors(a)), _separate(_vectors(b))))


def exp(rotation_vector: ArrayLike) -> Floats:
    """Quaternion of the rotation by |r| radians about r, (..., 3) to (..., 4).

    >>> exp([0, 0, 1e-8])
    array([1.e+00, 0.e+00, 0.e+00, 5.e-09])
    """
    r = _vectors(rotation_vector)
    half = 0.5 * _norm3(r)
    sinc = np.divide(np.sin(half), half, out=np.ones_like(half), where=half > 0.0)
    return _joined(quaternions.exponential(np.cos(half), 0.5 * sinc, _separate(r)))


def log(q: ArrayLike) -> Floats:
    """Rotation vector (..., 3) of length at most π: 2 atan2(|v|, |w|) along v, of the shorter of q and -q.

    atan2 keeps full relative accuracy for the smallest rotations and at π, where an arc cosine loses half the digits.
    At exactly π both signs are right; the one of q's own vector part is returned.

    >>> log([1.0, 0.0, 5e-9, 0.0])
    array([0.e+00, 1.e-08, 0.e+00])
    """
    q = normalised(q)
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = _norm3(q[..., 1:])
    angle = np.asarray(2.0 * np.arctan2(sine, q[..., 0]))
    scale = np.divide(angle, sine, out=np.full_like(angle, 2.0), where=sine > 0.0)
    return scale[..., None] * q[..., 1:]


def distance(p: ArrayLike, q: ArrayLike) -> Floats:
    """Angle in [0, π] of the rotation that leads from p to q, 2 atan2(|v|, |w|) of p* q; p and -p are the same.

    >>> f"{distance(IDENTITY, -exp([0, 1e-8, 0])):.16g}"
    '1e-08'
    """
    between = multiply(conjugate(p), q)
    _length(between)
    return np.asarray(2.0 * np.arctan2(_norm3(between[..., 1:]), np.abs(between[..., 0])))


def continuous(path: ArrayLike) -> Floats:
    """A path (..., n, 4) with the signs chosen so that neighbours are near each other; the first keeps its sign.

    >>> continuous([[1, 0, 0, 0], [-1, 0, 0, 0]])
    array([[ 1.,  0.,  0.,  0.],
           [ 1., -0., -0., -0.]])
    """
    path = _components(path)
    if path.ndim < 2:
        raise ValueError(f"a path of quaternions has shape (..., n, 4), not {path.shape}")
    overlap = np.sum(path[..., 1:, :] * path[..., :-1, :], axis=-1)
    steps = np.concatenate([np.ones_like(path[..., :1, 0]), np.where(overlap < 0.0, -1.0, 1.0)], axis=-1)
    return path * np.cumprod(steps, axis=-1)[..., None]


def slerp(p: ArrayLike, q: ArrayLike, fraction: ArrayLike) -> Floats:
    """The orientation at `fraction` (...) of the shorter great circle from p (0) to q (1): p exp(f log(p* q)).

    >>> log(slerp(IDENTITY, exp([0, 0, 1.0]), 0.25))
    array([0.  , 0.  , 0.25])
    """
    fraction = np.asarray(fraction, dtype=float)[..., None]
    return multiply(p, exp(fraction * log(multiply(conjugate(p), q))))


def to_matrix(q: ArrayLike) -> Floats:
    """Matrices (..., 3, 3) with v_space = R v_body; the columns are the body's axes seen from space.

    >>> to_matrix([0, 0, 0, 1])
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0.,  1.]])
    """
    return np.stack([_joined(row) for row in quaternions.matrix(_separate(normalised(q)))], axis=-2)


def from_matrix(matrix: ArrayLike) -> Floats:
    """Quaternions of rotation matrices (..., 3, 3), scalar part not negative.

    The entries of R give the symmetric matrix 4 q qᵀ; its row with the largest diagonal never cancels (Shepperd,
    J. Guidance Control 1, 223 (1978)). A matrix that is no rotation to 1e-6 is refused; `nearest_rotation` finds the nearest one.

    >>> from_matrix(np.diag([1.0, -1.0, -1.0]))
    array([0., 1., 0., 0.])
    """
    m = _matrices(matrix)
    _require_rotation(m)
    outer = _four_times_outer(m)
    diagonal = np.diagonal(outer, axis1=-2, axis2=-1)
    best = np.argmax(diagonal, axis=-1)[..., None, None]
    q = normalised(np.take_along_axis(outer, best, axis=-2)[..., 0, :])
    return np.where(q[..., :1] < 0.0, -q, q)


def nearest_rotation(matrix: ArrayLike) -> NearestRotation:
    """The proper rotation nearest in the Frobenius norm to a corrupted matrix (..., 3, 3), and how far off it was.

    R = U diag(1, 1, det U det V) Vᵀ of the singular value decomposition (Kabsch, Acta Cryst. A32, 922 (1976)).

    >>> f"{nearest_rotation(1.01 * np.eye(3)).distance_from_input:.6f}"  # 0.01 √3
    '0.017321'
    """
    m = _matrices(matrix)
    u, s, vt = np.linalg.svd(m)
    parity = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    signs = np.stack([np.ones_like(parity), np.ones_like(parity), parity], axis=-1)
    rotation = (u * signs[..., None, :]) @ vt
    distance_from_input = np.linalg.norm(m - rotation, axis=(-2, -1))
    gap = s[..., 1] + parity * s[..., 2]
    return NearestRotation(rotation, distance_from_input, gap > 1e-12 * np.maximum(s[..., 0], np.finfo(float).tiny))


def from_euler(phi: ArrayLike, theta: ArrayLike, chi: ArrayLike) -> Floats:
    """Quaternion of R_z(phi) R_y(theta) R_z(chi), radians (R. N. Zare, Angular Momentum, section 3.3).

    >>> rotate(from_euler(0.0, np.pi / 2, 0.3), [0, 0, 1]).round(15)
    array([1., 0., 0.])
    """
    phi, theta, chi = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (phi, theta, chi)))
    c, s = np.cos(theta / 2), np.sin(theta / 2)
    half_sum, half_difference = (phi + chi) / 2, (chi - phi) / 2
    parts = [c * np.cos(half_sum), s * np.sin(half_difference), s * np.cos(half_difference), c * np.sin(half_sum)]
    return np.stack(parts, axis=-1)


def to_euler(q: ArrayLike) -> EulerAngles:
    """z-y-z angles of q, with a flag where theta is at a pole and only phi ± chi is determined.

    >>> to_euler(from_euler(0.1, 0.2, 0.3)).theta.round(15)
    np.float64(0.2)
    """
    w, x, y, z = np.moveaxis(normalised(q), -1, 0)
    sine, cosine = np.hypot(x, y), np.hypot(w, z)
    half_sum, half_difference = np.arctan2(z, w), np.arctan2(x, y)
    phi, chi = half_sum - half_difference, half_sum + half_difference
    phi = np.where(sine == 0.0, 2 * half_sum, np.where(cosine == 0.0, -2 * half_difference, phi))
    chi = np.where((sine == 0.0) | (cosine == 0.0), 0.0, chi)
    at_pole = np.minimum(sine, cosine) < POLE
    return EulerAngles(_wrapped(phi), np.asarray(2 * np.arctan2(sine, cosine)), _wrapped(chi), at_pole)


def uniform(size: int | tuple[int, ...] = (), *, rng: np.random.Generator) -> Floats:
    """Orientations drawn uniformly (Haar measure): four normal deviates at unit length, shape (*size, 4).

    >>> uniform(1000, rng=np.random.default_rng(1)).shape
    (1000, 4)
    """
    shape = (size,) if isinstance(size, int) else tuple(size)
    return normalised(rng.standard_normal((*shape, 4)))


def to_scalar_last(q: ArrayLike) -> Floats:
    """(x, y, z, w), the order of `scipy.spatial.transform.Rotation`, from our (w, x, y, z).

    >>> to_scalar_last([1, 2, 3, 4])
    array([2., 3., 4., 1.])
    """
    return np.roll(_components(q), -1, axis=-1)


def from_scalar_last(q: ArrayLike) -> Floats:
    """Our (w, x, y, z) from (x, y, z, w), the order of `scipy.spatial.transform.Rotation`.

    >>> from_scalar_last([2, 3, 4, 1])
    array([1., 2., 3., 4.])
    """
    return np.roll(_components(q), 1, axis=-1)


def _components(q: ArrayLike) -> Floats:
    return with_components(q, 4, "quaternions, scalar first,")


def _vectors(v: ArrayLike) -> Floats:
    return with_components(v, 3, "vectors")


def _matrices(m: ArrayLike) -> Floats:
    array = np.asarray(m, dtype=np.float64)
    if array.shape[-2:] != (3, 3):
        raise ValueError(f"rotation matrices have shape (..., 3, 3); got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError("a rotation matrix holds a number that is not finite")
    return array


def _separate(array: Floats) -> tuple[Floats, ...]:
    """The components (...) of an array (..., n)."""
    return tuple(array[..., k] for k in range(array.shape[-1]))


def _joined(components: tuple[Floats, ...]) -> Floats:
    """An array (..., n) of n components (...)."""
    out = np.empty((*components[0].shape, len(components)))
    for k, component in enumerate(components):
        out[..., k] = component
    return out


def _norm3(v: Floats) -> Floats:
    """|v| without overflow or underflow of the squares."""
    return np.asarray(np.hypot(np.hypot(v[..., 0], v[..., 1]), v[..., 2]))


def _length(q: Floats) -> Floats:
    length = np.asarray(np.hypot(np.hypot(q[..., 0], q[..., 1]), np.hypot(q[..., 2], q[..., 3])))
    if not np.all(length > 0.0) or not np.all(np.isfinite(length)):
        raise ValueError(
            "a quaternion of zero or undefined length is not a rotation; give finite components, not all 0"
        )
    return length


def _wrapped(angle: Floats) -> Floats:
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def _four_times_outer(m: Floats) -> Floats:
    """4 q qᵀ from the entries of the rotation matrix of q."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = ([m[..., i, j] for j in range(3)] for i in range(3))
    rows = [
        [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _require_rotation(m: Floats) -> None:
    worst = float(np.max(np.abs(np.swapaxes(m, -1, -2) @ m - np.eye(3)), initial=0.0))
    if worst > ORTHOGONALITY_TOLERANCE:
        raise ValueError(
            f"not a rotation matrix: RᵀR departs from 1 by {worst:.3g} (at most {ORTHOGONALITY_TOLERANCE:g} is taken "
            "for round-off); nearest_rotation() gives the nearest rotation and its distance"
        )
    if np.any(np.linalg.det(m) < 0.0):
        raise ValueError(
            "a matrix of determinant -1 is a reflection, not a rotation; nearest_rotation() gives the nearest rotation"
        )
