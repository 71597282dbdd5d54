"""Polhodes: the curves on which L moves in the body, drawn on the unit sphere of its directions.

A polhode is the intersection of the sphere |L| = const with the ellipsoid Σ L_i²/I_i = 2E (Landau and Lifshitz, Mechanics, section
37). With the unit vector s = L/|L| it is the curve of a level, Σ s_i²/I_i = 2E/L². Eliminating the component along the axis a that it
circles gives an ellipse in the other two,

    s_b² (1/I_b - 1/I_a) + s_c² (1/I_c - 1/I_a) = level - 1/I_a .
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, kinetic_energy


def level(moments: ArrayLike, momentum: ArrayLike) -> Floats:
    """2E/L² = Σ s_i²/I_i of angular momenta (..., 3), between 1/I of the largest and of the smallest moment.

    >>> float(level([1.0, 2.0, 4.0], [0.0, 3.0, 0.0]))
    0.5
    """
    moments, momentum = _massive(moments), np.asarray(momentum, dtype=np.float64)
    direction = momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)
    return 2.0 * kinetic_energy(direction, direction / moments)


def centre_axis(moments: ArrayLike, level: float) -> int:
    """The axis that the polhode of a level circles: that of the largest moment below the separatrix, otherwise of the smallest.

    >>> centre_axis([1.0, 2.0, 4.0], 0.4), centre_axis([1.0, 2.0, 4.0], 0.6)
    (2, 0)
    """
    moments = _massive(moments)
    small, middle, large = np.argsort(moments, kind="stable")  # stable: equal moments keep the order of the axes
    below = level < 1.0 / moments[middle] or moments[small] == moments[middle]
    return int(large if below else small)


def polhode(moments: ArrayLike, level: float, points: int = 361) -> Floats:
    """Both branches of the polhode of a level as closed curves (2, points, 3) on the unit sphere.

    On the separatrix, level = 1/I2, they are pairs of half circles through the intermediate axis. Raises ValueError for an impossible
    level, and for a spherical top, whose L is constant in the body.

    >>> polhode([1.0, 2.0, 4.0], 0.3)[0, 0].round(4).tolist()  # (0.3 - 1/4)/(1 - 1/4) = s1²
    [0.2582, 0.0, 0.9661]
    """
    moments = _massive(moments)
    inverse = 1.0 / moments
    if np.ptp(moments) == 0.0:
        raise ValueError("a spherical top has no polhodes: L stands still in the body, wherever it points")
    if not inverse.min() <= level <= inverse.max():
        raise ValueError(f"level {level:g} lies outside of 1/I, from {inverse.min():g} to {inverse.max():g}")
    a = centre_axis(moments, level)
    b, c = (axis for axis in range(3) if axis != a)
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    curves = np.empty((2, points, 3))
    curves[..., b] = np.sqrt((level - inverse[a]) / (inverse[b] - inverse[a])) * np.cos(angle)
    curves[..., c] = np.sqrt((level - inverse[a]) / (inverse[c] - inverse[a])) * np.sin(angle)
    # rounding may leave less than 0 at the edge
    along = np.sqrt(np.maximum(0.0, 1.0 - curves[0, :, b] ** 2 - curves[0, :, c] ** 2))
    curves[0, :, a], curves[1, :, a] = along, -along
    return curves


def separatrix(moments: ArrayLike, points: int = 361) -> Floats:
    """The two great circles (2, points, 3) of the separatrix: through the intermediate axis, level 1/I2.

    s3/s1 = ± √((1/I1 - 1/I2)/(1/I2 - 1/I3)), axes in order of their moments. Raises ValueError if two moments are
    equal: there is no separatrix, but a circle, or a sphere, of stationary points.

    >>> separatrix([1.0, 2.0, 4.0])[0, 90].round(4).tolist()  # s3²/s1² = (1/2)/(1/4)
    [0.5774, 0.0, 0.8165]
    """
    moments = _massive(moments)
    small, middle, large = np.argsort(moments, kind="stable")
    below, above = 1.0 / moments[small] - 1.0 / moments[middle], 1.0 / moments[middle] - 1.0 / moments[large]
    if below <= 0.0 or above <= 0.0:
        raise ValueError(f"moments {moments.tolist()}: two of them are equal, and there is no separatrix")
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    circles = np.empty((2, points, 3))
    circles[..., middle] = np.cos(angle)
    for circle, sign in zip(circles, (1.0, -1.0), strict=True):
        circle[:, small] = np.sqrt(above / (above + below)) * np.sin(angle)
        circle[:, large] = sign * np.sqrt(below / (above + below)) * np.sin(angle)
    return circles


def even_levels(moments: ArrayLike, per_side: int) -> Floats:
    """Levels of evenly spaced polhodes: `per_side` about each axis that polhodes circle, without the axes themselves.

    They cross the great circle from the axis of largest moment to that of the smallest at equal angles on either side
    of the separatrix.

    >>> even_levels([1.0, 1.0, 2.0], 2).round(4).tolist()  # an oblate top: circles at 30 and 60 degrees
    [0.625, 0.875]
    """
    inverse = np.sort(1.0 / _massive(moments))
    if inverse[0] == inverse[2]:
        return np.empty(0)
    edge = np.arcsin(np.sqrt((inverse[1] - inverse[0]) / (inverse[2] - inverse[0])))  # angle of the separatrix
    fractions = np.arange(1, per_side + 1) / (per_side + 1)
    sides = [(0.0, edge), (edge, np.pi / 2)]
    # sides without a width have no level between
    angles = np.concatenate([low + (high - low) * fractions for low, high in sides if high - low > 1e-9])
    return np.asarray(inverse[0] + (inverse[2] - inverse[0]) * np.sin(angles) ** 2)


def _massive(moments: ArrayLike) -> Floats:
    moments = checked_moments(moments)
    if moments.shape != (3,) or np.any(moments == 0.0):
        raise ValueError(f"polhodes: expected a single body with three moments above zero; got {moments.tolist()}")
    return moments
