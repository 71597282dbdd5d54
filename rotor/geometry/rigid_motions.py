"""Rigid motions with their velocities and forces: poses, twists, wrenches, and the adjoint that carries them over.

A pose (q, position) takes a point from body to space, x_space = q x_body q* + position. A twist (..., 6) is (ω, v):
angular velocity, and velocity of the body's point at the frame's origin. A wrench (..., 6) is (torque about the
origin, force). Their product τ·ω + f·v is the power, the same in every frame. (R. M. Murray, Z. Li, S. S. Sastry,
A Mathematical Introduction to Robotic Manipulation, chapter 2, which writes v first.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, with_components
from rotor.geometry.rotations import exp, log, multiply, rotate, to_matrix

SERIES_BELOW = 1.0  # rad: below it the coefficients of exp and log are summed as series to avoid cancellation
TERMS = 10  # x²⁰/23! is below 1e-22 at x = 1


def compose(q1: ArrayLike, position1: ArrayLike, q2: ArrayLike, position2: ArrayLike) -> tuple[Floats, Floats]:
    """The pose of applying pose 2 first, then pose 1.

    Parameters
    ----------
    q1, q2 : (..., 4) array
        Attitudes.
    position1, position2 : (..., 3) array
        Positions.

    Returns
    -------
    (..., 4) array, (..., 3) array
        q1 q2 and q1 p2 q1* + p1.

    Examples
    --------
    >>> compose([1, 0, 0, 0], [1, 0, 0], [1, 0, 0, 0], [0, 2, 0])[1].tolist()
    [1.0, 2.0, 0.0]
    """
    return multiply(q1, q2), rotate(q1, position2) + _three(position1)


def adjoint(q: ArrayLike, position: ArrayLike) -> Floats:
    """Ad (..., 6, 6) with twist_space = Ad twist_body: [[R, 0], [p̂ R, R]].

    >>> adjoint([1, 0, 0, 0], [0, 0, 2.0])[3:, :3].tolist()  # p̂
    [[0.0, -2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """
    rotation = to_matrix(q)
    lower = _hat(_three(position)) @ rotation
    rotation = np.broadcast_to(rotation, lower.shape)
    top = np.concatenate([rotation, np.zeros_like(lower)], axis=-1)
    return np.concatenate([top, np.concatenate([lower, rotation], axis=-1)], axis=-2)


def twist_to_space(twist: ArrayLike, q: ArrayLike, position: ArrayLike) -> Floats:
    """A body twist (..., 6) seen from space: (R ω, R v + p x R ω).

    >>> twist_to_space([0, 0, 1, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0]).tolist()  # spin about a vertical axis at x = 1
    [0.0, 0.0, 1.0, 0.0, -1.0, 0.0]
    """
    twist = _six(twist)
    omega, velocity = rotate(q, twist[..., :3]), rotate(q, twist[..., 3:])
    return np.concatenate([omega, velocity + np.cross(_three(position), omega)], axis=-1)


def wrench_to_space(wrench: ArrayLike, q: ArrayLike, position: ArrayLike) -> Floats:
    """A body wrench (..., 6) seen from space: (R τ + p x R f, R f), the inverse transpose of the adjoint.

    >>> wrench_to_space([0, 0, 0, 0, 1, 0], [1, 0, 0, 0], [2, 0, 0]).tolist()  # a unit force on an arm of 2
    [0.0, 0.0, 2.0, 0.0, 1.0, 0.0]
    """
    wrench = _six(wrench)
    torque, force = rotate(q, wrench[..., :3]), rotate(q, wrench[..., 3:])
    return np.concatenate([torque + np.cross(_three(position), force), force], axis=-1)


def power(twist: ArrayLike, wrench: ArrayLike) -> Floats:
    """τ·ω + f·v, (...).

    >>> float(power([0, 0, 2, 1, 0, 0], [0, 0, 3, 4, 0, 0]))
    10.0
    """
    return np.asarray(np.sum(_six(twist) * _six(wrench), axis=-1))


def twist_exp(twist: ArrayLike) -> tuple[Floats, Floats]:
    """The pose reached by moving with a constant twist for unit time: a screw.

    q = exp(ω), p = v + (1 - cos θ)/θ² ω x v + (θ - sin θ)/θ³ ω x (ω x v), θ = |ω|.

    >>> twist_exp([0, 0, np.pi, 0, 1, 0])[1].round(6).tolist()  # half a turn about the vertical axis at x = -1/π
    [-0.63662, 0.0, 0.0]
    """
    twist = _six(twist)
    omega, velocity = twist[..., :3], twist[..., 3:]
    theta = np.linalg.norm(omega, axis=-1, keepdims=True)
    first, second = 0.5 * np.sinc(theta / (2 * np.pi)) ** 2, _cubic_coefficient(theta)
    bent = np.cross(omega, velocity)
    return exp(omega), velocity + first * bent + second * np.cross(omega, bent)


def twist_log(q: ArrayLike, position: ArrayLike) -> Floats:
    """The twist (..., 6) that reaches the pose in unit time, with |ω| at most π.

    v = p - ½ ω x p + (1 - (θ/2) cot(θ/2))/θ² ω x (ω x p).

    >>> twist_log(*twist_exp([0.1, 0.2, 0.3, 1.0, 2.0, 3.0])).round(12).tolist()
    [0.1, 0.2, 0.3, 1.0, 2.0, 3.0]
    """
    omega = log(q)
    theta = np.linalg.norm(omega, axis=-1, keepdims=True)
    position = _three(position)
    bent = np.cross(omega, position)
    velocity = position - 0.5 * bent + _cotangent_coefficient(theta) * np.cross(omega, bent)
    return np.concatenate(np.broadcast_arrays(omega, velocity), axis=-1)


@dataclass(frozen=True, eq=False)
class Screw:
    """A turn by `angle` (rad) about the line through `point` (3,) along `axis` (3,), and a shift along it.

    point: the one of the line that is nearest to the origin. A pure translation has the angle 0 and the point (0, 0, 0).
    """

    axis: Floats
    point: Floats
    angle: float
    shift: float


def chasles_screw(q: ArrayLike, position: ArrayLike) -> Screw:
    """The screw (Chasles) of one pose: with the twist (ω, v), axis ω/θ, shift v·ω/θ, point ω x v/θ².

    >>> turn = chasles_screw([np.sqrt(0.5), 0, 0, np.sqrt(0.5)], [1.0, -1.0, 0.5])  # a quarter turn about the line (1, 0, z)
    >>> (turn.point.round(12) + 0.0).tolist(), round(turn.shift, 12), round(np.degrees(turn.angle), 9) == 90.0
    ([1.0, 0.0, 0.0], 0.5, np.True_)
    """
    twist = twist_log(q, position)
    omega, velocity = twist[:3], twist[3:]
    angle, length = float(np.linalg.norm(omega)), float(np.linalg.norm(velocity))
    if angle == 0.0:
        return Screw(velocity / length if length > 0.0 else np.array([0.0, 0.0, 1.0]), np.zeros(3), 0.0, length)
    axis = omega / angle
    return Screw(axis, np.cross(omega, velocity) / angle**2, angle, float(velocity @ axis))


def bracket(first: ArrayLike, second: ArrayLike) -> Floats:
    """The Lie bracket (..., 6) of twists, (ω1 x ω2, ω1 x v2 - ω2 x v1).

    Moving by s along the first, s along the second, and back along each is exp(s² [first, second]) up to order s³: a sequence of
    allowed motions can produce a motion that is not allowed.

    >>> bracket([0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]).tolist()  # turning and driving make a sideways motion
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    """
    a, b = _six(first), _six(second)
    spin = np.cross(a[..., :3], b[..., :3])
    return np.concatenate([spin, np.cross(a[..., :3], b[..., 3:]) - np.cross(b[..., :3], a[..., 3:])], axis=-1)


def _six(array: ArrayLike) -> Floats:
    return with_components(array, 6, "twists and wrenches, the rotational half first,")


def _three(array: ArrayLike) -> Floats:
    return with_components(array, 3, "positions")


def _hat(v: Floats) -> Floats:
    """v̂ with v̂ u = v x u."""
    zero = np.zeros_like(v[..., 0])
    x, y, z = np.moveaxis(v, -1, 0)
    rows = ([zero, -z, y], [z, zero, -x], [-y, x, zero])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _cubic_coefficient(theta: Floats) -> Floats:
    """(θ - sin θ)/θ³."""
    small = theta < SERIES_BELOW
    x, y = np.where(small, theta, 0.0), np.where(small, SERIES_BELOW, theta)
    series = sum((-1) ** k * x ** (2 * k) / math.factorial(2 * k + 3) for k in range(TERMS))
    return np.asarray(np.where(small, series, (y - np.sin(y)) / y**3))


def _cotangent_coefficient(theta: Floats) -> Floats:
    """(1 - h cot h)/θ², h = θ/2; the numerator over h² is (sin h - h cos h)/(h² sin h)."""
    half = 0.5 * theta
    small = half < SERIES_BELOW
    x, y = np.where(small, half, 0.0), np.where(small, SERIES_BELOW, half)
    series = sum((-1) ** (k + 1) * 2 * k * x ** (2 * k - 2) / math.factorial(2 * k + 1) for k in range(1, TERMS))
    sinc = np.sinc(x / np.pi)
    return np.asarray(0.25 * np.where(small, series / sinc, (1.0 - y / np.tan(y)) / y**2))
