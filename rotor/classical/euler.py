"""Euler's equations of the rigid body in angular momentum, and what they conserve: the core of every motion.

The state is the angular momentum L in the body's principal axes and the attitude q (body to space):

    dL/dt = L x ω + torque,      dq/dt = ½ q (0, ω),      ω_i = L_i / I_i .

(Landau and Lifshitz, Mechanics, equations 36.4 and 36.5, written in L instead of ω.) Units are any coherent set.
A linear rotor has one moment equal to zero and no angular momentum about that axis; nothing is ever divided by it.
The axes may stand in any order of moments. The triangle inequality of real mass distributions, I_a + I_b >= I_c, is
not demanded: the equations do not need it, and published test problems break it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, with_components
from rotor.geometry.inertia import kinetic_energy_by_axis
from rotor.geometry.rotations import multiply, rotate, vector_product

LINEAR_MISMATCH = 1e-12  # relative difference of the two moments of a linear rotor: round-off


@dataclass(frozen=True)
class Invariants:
    """Conserved quantities of torque-free motion.

    energy: (...), ½ Σ L_i²/I_i.  momentum: (...), |L|.  space_momentum: (..., 3), L seen from space.
    """

    energy: Floats
    momentum: Floats
    space_momentum: Floats


def gyroscopic_rate(momentum: Floats, omega: Floats) -> Floats:
    """L x ω of arrays (..., 3): the right-hand side of Euler's equations without torque.

    >>> gyroscopic_rate(np.array([0.0, 2.0, 3.0]), np.array([0.0, 1.0, 1.0])).tolist()
    [-1.0, 0.0, 0.0]
    """
    return vector_product(momentum, omega)


def kinetic_energy(momentum: Floats, omega: Floats) -> Floats:
    """½ L·ω, (...), of arrays (..., 3).

    >>> float(kinetic_energy(np.array([1.0, 2.0, 2.0]), np.array([1.0, 1.0, 0.5])))
    2.0
    """
    return np.asarray(np.sum(kinetic_energy_by_axis(momentum, omega), axis=-1))


def checked_moments(moments: ArrayLike) -> Floats:
    """Moments (..., 3) that a rigid body can have: finite, positive, at most one zero (then the others are equal).

    >>> checked_moments([0.0, 2.0, 2.0])
    array([0., 2., 2.])
    """
    array = with_components(moments, 3, "principal moments")
    if not np.all(np.isfinite(array)) or np.any(array < 0.0):
        raise ValueError(f"principal moments must be finite and not negative; got {array.tolist()}")
    if np.any(np.sum(array == 0.0, axis=-1) > 1):
        raise ValueError("two moments are zero: a point has no rotation, a linear rotor has one zero moment (0, I, I)")
    ordered = np.sort(array, axis=-1)
    linear = ordered[..., 0] == 0.0
    if np.any(linear & (ordered[..., 2] - ordered[..., 1] > LINEAR_MISMATCH * ordered[..., 2])):
        raise ValueError("a moment of zero means a linear rotor, whose other two moments are equal: give (0, I, I)")
    return array


def checked_momentum(momentum: ArrayLike, moments: Floats) -> Floats:
    """Body angular momentum (..., 3), finite, with nothing along an axis whose moment is zero."""
    about_axis = "a linear rotor has no angular momentum about its own axis"
    return _checked_vector(momentum, moments, "angular momenta", "an angular momentum", about_axis)


def checked_velocity(omega: ArrayLike, moments: Floats) -> Floats:
    """Body angular velocity (..., 3), finite, with nothing along an axis whose moment is zero.

    >>> checked_velocity([0.0, 1.0, 2.0], np.array([0.0, 3.0, 3.0])).tolist()
    [0.0, 1.0, 2.0]
    """
    about_axis = "a linear rotor does not rotate about its own axis"
    return _checked_vector(omega, moments, "angular velocities", "an angular velocity", about_axis)


def _checked_vector(vector: ArrayLike, moments: Floats, plural: str, singular: str, about_axis: str) -> Floats:
    """A vector (..., 3), finite, with nothing along an axis whose moment is zero; the texts name it in errors."""
    array = with_components(vector, 3, plural)
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{singular} holds a number that is not finite")
    if np.any((moments == 0.0) & (array != 0.0)):
        raise ValueError(f"{about_axis}: set that component to 0")
    return array


def inverse_moments(moments: ArrayLike) -> Floats:
    """1/I_i, and 0 for the axis of a linear rotor, about which it does not rotate.

    >>> inverse_moments([0.0, 2.0, 2.0])
    array([0. , 0.5, 0.5])
    """
    array = checked_moments(moments)
    return np.divide(1.0, array, out=np.zeros_like(array), where=array > 0.0)


def angular_velocity(momentum: ArrayLike, moments: ArrayLike) -> Floats:
    """ω_i = L_i / I_i in body axes, (..., 3).

    >>> angular_velocity([1.0, 2.0, 3.0], [1.0, 2.0, 4.0])
    array([1.  , 1.  , 0.75])
    """
    moments = checked_moments(moments)
    return np.asarray(checked_momentum(momentum, moments) * inverse_moments(moments))


def momentum_rate(momentum: ArrayLike, moments: ArrayLike, torque: ArrayLike = 0.0) -> Floats:
    """dL/dt = L x ω + torque in body axes, (..., 3).

    >>> momentum_rate([1.0, 1.0, 0.0], [1.0, 2.0, 4.0])  # L1 L2 (1/I2 - 1/I1) about axis 3
    array([ 0. ,  0. , -0.5])
    """
    momentum = np.asarray(momentum, dtype=np.float64)
    omega = angular_velocity(momentum, moments)
    return np.asarray(gyroscopic_rate(momentum, omega) + np.asarray(torque, dtype=np.float64))


def attitude_rate(attitude: ArrayLike, omega: ArrayLike) -> Floats:
    """dq/dt = ½ q (0, ω), ω in body axes; (..., 4).

    >>> attitude_rate([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0])
    array([0., 0., 0., 1.])
    """
    omega = np.asarray(omega, dtype=np.float64)
    # q' = ½ q ω, ω as a quaternion without a scalar part
    return 0.5 * multiply(attitude, np.concatenate([np.zeros_like(omega[..., :1]), omega], axis=-1))


def energy(momentum: ArrayLike, moments: ArrayLike) -> Floats:
    """Rotational energy ½ Σ L_i²/I_i, (...).

    >>> energy([1.0, 2.0, 2.0], [1.0, 2.0, 4.0])
    np.float64(2.0)
    """
    omega = angular_velocity(momentum, moments)
    return kinetic_energy(np.asarray(momentum, dtype=np.float64), omega)[()]


def invariants(momentum: ArrayLike, attitude: ArrayLike, moments: ArrayLike) -> Invariants:
    """Energy, |L| and L in space of a motion, which a free motion conserves.

    >>> invariants([1.0, 2.0, 2.0], [1.0, 0.0, 0.0, 0.0], [1.0, 2.0, 4.0]).momentum
    np.float64(3.0)
    """
    momentum = np.asarray(momentum, dtype=np.float64)
    size = np.linalg.norm(momentum, axis=-1)
    return Invariants(energy(momentum, moments), size, rotate(attitude, momentum))


def poinsot_semiaxes(moments: ArrayLike, energy: ArrayLike) -> Floats:
    """Semi-axes √(2E/I_i) of Poinsot's ellipsoid Σ I_i ω_i² = 2E, on which ω moves; infinite where I_i = 0.

    The ellipsoid, fixed in the body, rolls without slipping on a plane normal to L at the distance 2E/|L| from the
    centre (Landau and Lifshitz, section 37).

    >>> poinsot_semiaxes([1.0, 2.0, 4.0], 2.0)
    array([2.        , 1.41421356, 1.        ])
    """
    return _semiaxes(moments, energy, lambda e, inverse: np.sqrt(2.0 * e * inverse))


def momentum_semiaxes(moments: ArrayLike, momentum: ArrayLike) -> Floats:
    """Semi-axes |L|/I_i of the momentum ellipsoid Σ I_i² ω_i² = L²; its meeting with Poinsot's is the polhode.

    >>> momentum_semiaxes([1.0, 2.0, 4.0], 3.0)
    array([3.  , 1.5 , 0.75])
    """
    return _semiaxes(moments, momentum, lambda size, inverse: size * inverse)


def binet_semiaxes(moments: ArrayLike, energy: ArrayLike) -> Floats:
    """Semi-axes √(2E I_i) of the energy ellipsoid Σ L_i²/I_i = 2E in the space of L; it cuts the sphere |L| = const.

    >>> binet_semiaxes([1.0, 2.0, 4.0], 2.0)
    array([2.        , 2.82842712, 4.        ])
    """
    moments = checked_moments(moments)
    return np.sqrt(2.0 * np.asarray(energy, dtype=np.float64)[..., None] * moments)


def _semiaxes(moments: ArrayLike, scale: ArrayLike, rule: Callable[[Floats, Floats], Floats]) -> Floats:
    moments = checked_moments(moments)
    axes = rule(np.asarray(scale, dtype=np.float64)[..., None], inverse_moments(moments))
    return np.where(moments == 0.0, np.inf, axes)  # an axis without inertia has no finite semiaxis
