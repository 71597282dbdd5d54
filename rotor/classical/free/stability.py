"""Closed forms of free rotation: stability of the axes, growth rate of deviations, tumbling period.

A body with three unequal moments rotates stably about its axes of largest and smallest moment, but not about the intermediate axis
(Landau and Lifshitz, Mechanics, section 37). This growth is not chaos: torque-free motion conserves energy and |L|, so that it is
periodic in the body and its largest Lyapunov exponent is zero. The growth rate is that of deviations from the unstable fixed point,
not of the motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, checked_momentum


@dataclass(frozen=True)
class FixedAxis:
    """Steady rotation about a principal axis.

    axis: 0, 1 or 2, in the order of the moments given.
    kind: "stable", "unstable", "neutral" (another axis has the same moment: a deviation drifts or, where all axes that it can turn about
    have the same moment, stays) or "none" (the axis of a linear rotor, about which it cannot rotate).
    rate: of the small oscillation (stable) or of growth (unstable), rad or 1 per time; zero for the other kinds.
    """

    axis: int
    kind: str
    rate: float


@dataclass(frozen=True)
class Stability:
    """Closed-form properties of a free rotation; see the functions of the same names.

    limit: "steady" where L stands still in the body, "saddle" where it stands on the intermediate axis or runs into it, otherwise empty.
    """

    axes: tuple[FixedAxis, FixedAxis, FixedAxis]
    separatrix_ratio: float
    growth_rate: float
    period: float
    asymptotic_period: float
    limit: str = ""

    @property
    def chaos(self) -> str:
        """Why the motion is not chaotic."""
        if self.limit == "saddle":
            return (
                "Free rotation is not chaotic: the growth rate is the largest Lyapunov exponent of the rotation about the intermediate "
                "axis, and of a motion that runs into it; it is zero for every other torque-free motion."
            )
        if self.limit == "steady":
            return (
                "Steady rotation is periodic, not chaotic: L stands still in the body, which turns about it at a single rate; its largest "
                "Lyapunov exponent is zero."
            )
        growth = "the growth rate belongs to the unstable axis alone; " if self.growth_rate > 0 else ""
        return (
            "Free tumbling is quasi-periodic, not chaotic: L repeats in the body, and the body turns about L at a second rate; "
            f"{growth}the largest Lyapunov exponent of this motion is zero."
        )


def axis_rate_squared(moments: ArrayLike, axis: int, momentum: ArrayLike) -> Floats:
    """Squared angular frequency of a small deviation from rotation about `axis`; negative if it grows.

    rate² = (L/I_a)² (I_a - I_b)(I_a - I_c) / (I_b I_c), L = |angular momentum| (...), moments (..., 3).
    The moments must not be zero.

    >>> float(axis_rate_squared([1.0, 2.0, 3.0], 1, 2.0))  # the intermediate axis at one radian per time
    -0.3333333333333333
    """
    moments = _massive(moments)
    a, b, c = (moments[..., (axis + k) % 3] for k in range(3))
    return np.asarray((np.asarray(momentum, dtype=np.float64) / a) ** 2 * ((a - b) * (a - c) / (b * c)))


def growth_rate(moments: ArrayLike, momentum: ArrayLike) -> Floats:
    """Growth rate of deviations from rotation about the intermediate axis, (L/I2) √((I3 - I2)(I2 - I1)/(I1 I3)), per time.

    Zero for symmetric and spherical tops, which have no such axis.

    >>> float(growth_rate([3.0, 1.0, 2.0], 2.0))  # √(1/3)
    0.5773502691896257
    """
    i1, i2, i3 = _ascending(moments)
    return np.asarray(np.asarray(momentum, dtype=np.float64) / i2 * np.sqrt((i3 - i2) * (i2 - i1) / (i1 * i3)))


def separatrix_ratio(moments: ArrayLike) -> Floats:
    """|ω3/ω1| on the separatrix where ω2 = 0, √(I1 (I2 - I1)/(I3 (I3 - I2))), axes in order of their moments.

    0 for I1 = I2, infinite for I2 = I3; a sphere has no separatrix and is refused.

    >>> float(separatrix_ratio([1.0, 2.0, 3.0]))  # √(1/3)
    0.5773502691896257
    """
    i1, i2, i3 = _ascending(moments)
    if np.any(i1 == i3):
        raise ValueError("a spherical top has no separatrix: every axis is steady")
    above = i3 - i2
    # i2 = i3: the separatrix is infinitely wide
    squared = np.divide(i1 * (i2 - i1), i3 * above, out=np.full_like(above, np.inf), where=above > 0.0)
    return np.asarray(np.sqrt(squared))


def precession_rates(moments: ArrayLike, momentum: ArrayLike) -> tuple[Floats, Floats]:
    """Precession rates of a symmetric top (I, I, I3) with L (..., 3) in the body: (I3/I - 1) ω3 in the body, |L|/I in space.

    The first, with its sign, is the rate at which L and ω turn about the third axis as the body sees them (Landau and
    Lifshitz, equation 36.6), the second that of the axis about L in space (section 33).

    >>> [float(rate) for rate in precession_rates([1.0, 1.0, 2.0], [0.0, 3.0, 4.0])]
    [2.0, 5.0]
    """
    moments, momentum = _massive(moments), np.asarray(momentum, dtype=np.float64)
    if np.any(moments[..., 0] != moments[..., 1]):
        raise ValueError(f"precession rates: expected a symmetric top, moments (I, I, I3); got {moments.tolist()}")
    equal, unique = moments[..., 0], moments[..., 2]
    body = (unique / equal - 1.0) * momentum[..., 2] / unique
    return np.asarray(body), np.asarray(np.linalg.norm(momentum, axis=-1) / equal)


def tumbling_period(moments: ArrayLike, momentum: ArrayLike) -> Floats:
    """Period 4K/λ of L in the body, (...), from moments and momentum (..., 3); infinite if L is constant.

    λ² = D1 (I3 - I2)/(I1 I2 I3) and mc = D2 (I3 - I1)/(D1 (I3 - I2)) for motion about axis 3, D_i = L² - 2E I_i; the
    same with 1 and 3 exchanged about axis 1 (Landau and Lifshitz, equations 37.8 to 37.12). The body flips every half
    period. Near the separatrix D2 cancels here; `free.free_motion` keeps it exact.

    >>> float(tumbling_period([1.0, 2.0, 3.0], [0.001, 2.0, 0.003]).round(10))
    55.0616811075
    """
    from scipy.special import ellipkm1

    speed, mc = _speed_and_modulus(moments, momentum)
    moves = (speed > 0.0) & (mc > 0.0)
    quarter = ellipkm1(np.where(moves, mc, 1.0))  # K from 1 - m, exact near the separatrix where m rounds to 1
    return np.asarray(np.divide(4.0 * quarter, speed, out=np.full_like(speed, np.inf), where=moves))


def asymptotic_period(moments: ArrayLike, momentum: ArrayLike) -> Floats:
    """Period near the separatrix, (2/σ) ln(16/mc), σ the growth rate; its relative error is of the order of mc.

    >>> float(asymptotic_period([1.0, 2.0, 3.0], [0.001, 2.0, 0.003]).round(5))
    55.06167
    """
    _, mc = _speed_and_modulus(moments, momentum)
    rate = growth_rate(moments, np.linalg.norm(np.asarray(momentum, dtype=np.float64), axis=-1))
    possible = (mc > 0.0) & (rate > 0.0)
    logarithm = np.log(16.0 / np.where(possible, mc, 16.0))  # K ≈ ½ ln(16/(1 - m)) near the separatrix
    return np.asarray(np.divide(2.0 * logarithm, rate, out=np.full_like(mc, np.inf), where=possible))


def fixed_axes(moments: ArrayLike, momentum: float) -> tuple[FixedAxis, FixedAxis, FixedAxis]:
    """Kind and rate of steady rotation about each principal axis of one body at |L| = momentum.

    >>> [axis.kind for axis in fixed_axes([1.0, 2.0, 3.0], 1.0)]
    ['stable', 'unstable', 'stable']
    """
    moments = checked_moments(moments)
    if moments.shape != (3,):
        raise ValueError(f"fixed_axes takes the three moments of one body; got shape {moments.shape}")
    first, second, third = (_fixed_axis(moments, axis, momentum) for axis in range(3))
    return first, second, third


def stability(moments: ArrayLike, momentum: ArrayLike) -> Stability:
    """All properties of this module for a body with angular momentum (3,) in its principal axes.

    Quantities that do not exist (a sphere's separatrix) are nan.

    >>> tennis = stability([1.0, 2.0, 3.0], [0.001, 2.0, 0.003])
    >>> round(tennis.growth_rate, 4), round(tennis.period, 4)
    (0.5774, 55.0617)
    """
    moments = checked_moments(moments)
    momentum = checked_momentum(momentum, moments)
    size = float(np.linalg.norm(momentum))
    axes = fixed_axes(moments, size)
    if np.any(moments == 0.0):
        return Stability(axes, np.nan, 0.0, np.inf, np.inf, "steady")
    # a spherical top has no separatrix
    ratio = np.nan if np.ptp(moments) == 0.0 else float(separatrix_ratio(moments))
    period, asymptote = float(tumbling_period(moments, momentum)), float(asymptotic_period(moments, momentum))
    growth = float(growth_rate(moments, size))
    speed, mc = _speed_and_modulus(moments, momentum)
    limit = "saddle" if growth > 0.0 and mc == 0.0 else "steady" if speed == 0.0 else ""
    return Stability(axes, ratio, growth, period, asymptote, limit)


def _fixed_axis(moments: Floats, axis: int, momentum: float) -> FixedAxis:
    if moments[axis] == 0.0:
        return FixedAxis(axis, "none", 0.0)
    if np.sum(moments == moments[axis]) > 1:
        return FixedAxis(axis, "neutral", 0.0)
    squared = float(axis_rate_squared(moments, axis, momentum))
    return FixedAxis(axis, "stable" if squared > 0.0 else "unstable", float(np.sqrt(abs(squared))))


def _speed_and_modulus(moments: ArrayLike, momentum: ArrayLike) -> tuple[Floats, Floats]:
    """λ and mc = k'² of the motion; λ = 0 if L is constant, mc = 0 on the separatrix."""
    moments = _massive(moments)
    momentum = checked_momentum(momentum, moments)
    moments, momentum = np.broadcast_arrays(moments, momentum)
    order = np.argsort(moments, axis=-1, kind="stable")
    i1, i2, i3 = np.moveaxis(np.take_along_axis(moments, order, axis=-1), -1, 0)
    m1, m2, m3 = np.moveaxis(np.take_along_axis(momentum, order, axis=-1) ** 2, -1, 0)
    d1 = m2 * ((i2 - i1) / i2) + m3 * ((i3 - i1) / i3)
    d3 = m2 * ((i3 - i2) / i2) + m1 * ((i3 - i1) / i1)
    d2 = m3 * ((i3 - i2) / i3) - m1 * ((i2 - i1) / i1)
    about_third = np.where(d2 >= 0.0, d1 * (i3 - i2), d3 * (i2 - i1))
    product = np.abs(d2) * (i3 - i1)
    mc = np.divide(product, about_third, out=np.ones_like(product), where=about_third > 0.0)
    # L along an axis, or among equal moments: nothing moves in the body
    still = (m1 * m2 * (i2 - i1) == 0.0) & (m2 * m3 * (i3 - i2) == 0.0) & (m3 * m1 * (i3 - i1) == 0.0)
    return np.where(still, 0.0, np.sqrt(about_third / (i1 * i2 * i3))), mc


def _massive(moments: ArrayLike) -> Floats:
    moments = checked_moments(moments)
    if np.any(moments == 0.0):
        raise ValueError("a linear rotor (a moment of zero) turns steadily about L: it has no such rate")
    return moments


def _ascending(moments: ArrayLike) -> tuple[Floats, Floats, Floats]:
    i1, i2, i3 = np.moveaxis(np.sort(_massive(moments), axis=-1), -1, 0)
    return i1, i2, i3
