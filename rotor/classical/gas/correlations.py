"""Closed forms of correlation functions of a free gas: short times, whole curves of simple tops, and long times.

Short times (R. G. Gordon, J. Chem. Phys. 40, 1973 (1964); 41, 1819 (1964)), e a unit vector and β a tensor in principal axes:

    C1 = 1 - ½ M2 t² + M4 t⁴/24 - ...,    M2 = kT Σ_i (1 - e_i²)/I_i,
    C2 = 1 - ½ N2 t² + ...,               N2 = kT Σ_i |[ε_i, β]|²/(I_i |β|²),   ε_i generates turns about axis i.

Whole curves (A. G. St. Pierre and W. A. Steele, Phys. Rev. 184, 172 (1969)), τ = t √(kT/I), D Dawson's integral:

    linear       C1 = F(τ) = 1 - √2 τ D(τ/√2) = M(1, ½, -τ²/2),    C2 = ¼ + ¾ F(2τ)
    spherical    C_l = [1 + 2 Σ_m g(mτ)]/(2l+1), m = 1 ... l,     g(x) = (1 - x²) exp(-x²/2)
    symmetric    the figure axis precesses about L: an integral over the angle between them, `symmetric_curves`.

Long times: a free body rotates about L, so the component of u along L, averaged over the polhode, does not decay,

    C1(∞) = Σ_i e_i² <(mean of L_i/|L| over a polhode)²>:   ⅓ for a sphere, 0 for a linear molecule and along the
    intermediate axis, and for the axis that L circles B3/|L| · π/2K with the constants in the head of `theta.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, gyroscopic_rate, inverse_moments

NODES = 96  # Gauss-Legendre points


@dataclass(frozen=True)
class ShortTime:
    """Coefficients of short times: M2, M4 of a vector, N2 of a tensor, in 1/time², 1/time⁴, 1/time²; see the head."""

    m2: float
    m4: float
    n2: float


def short_time(
    moments: ArrayLike, kt: float, vector: ArrayLike = (1.0, 0.0, 0.0), tensor: ArrayLike | None = None
) -> ShortTime:
    """C1 and C2 at short times: M2, M4 of a vector and N2 of a tensor.

    Parameters
    ----------
    moments : (3,) array
        Principal moments, one may be zero.
    kt : float
        Temperature as an energy.
    vector : (3,) array
        In principal axes, of any length.
    tensor : (3, 3) array, optional
        Symmetric, in principal axes; default: u uᵀ of the vector.

    Returns
    -------
    ShortTime
        M2, N2 in 1/time², M4 in 1/time⁴, coherent units.

    Notes
    -----
    M4 = <|ü|²> with ü = ω̇ x u + ω x (ω x u), Euler's equations for ω̇, and <ω_i²> = kT/I_i (Gordon 1964, head of the module).
    Classical mechanics of a rigid, free molecule.

    >>> start = short_time([0.0, 2.0, 2.0], 3.0)  # linear: 2 kT/I, 8 (kT/I)², 6 kT/I
    >>> start.m2, start.m4, round(start.n2, 12)
    (3.0, 18.0, 9.0)
    """
    inertia = checked_moments(moments)
    square = kt * inverse_moments(inertia)  # <ω_i²>
    unit = np.asarray(vector, dtype=np.float64)
    unit = unit / np.linalg.norm(unit)
    beta = np.outer(unit, unit) if tensor is None else np.asarray(tensor, dtype=np.float64)
    beta = beta - np.trace(beta) / 3.0 * np.eye(3)
    changes = [np.linalg.norm(g @ beta - beta @ g) ** 2 for g in _generators()]
    return ShortTime(
        float(square @ (1.0 - unit**2)),
        float(unit**2 @ [_fourth(inertia, square, axis) for axis in range(3)]),
        float(square @ changes / np.linalg.norm(beta) ** 2),
    )


def linear_curves(times: ArrayLike, moment: float, kt: float) -> tuple[Floats, Floats]:
    """C1 and C2 of a linear molecule.

    >>> c1, c2 = linear_curves([0.0, 1.0], 1.0, 1.0)
    >>> float(c1[0]), round(float(c1[1]), 6)
    (1.0, 0.275222)
    """
    from scipy.special import dawsn

    tau = np.asarray(times, dtype=np.float64) * np.sqrt(kt / moment)
    # Dawson's integral does not overflow, exp times erf would
    f, f2 = (1.0 - np.sqrt(2.0) * x * dawsn(x / np.sqrt(2.0)) for x in (tau, 2.0 * tau))
    return np.asarray(f), np.asarray(0.25 + 0.75 * f2)  # C2 of a planar rotation: ¼ + ¾ ⟨cos 2θ⟩


def spherical_curves(times: ArrayLike, moment: float, kt: float) -> tuple[Floats, Floats]:
    """C1 of any vector and C2 of any tensor of a spherical top.

    >>> c1, c2 = spherical_curves([0.0, 1e3], 1.0, 1.0)  # and at long times
    >>> c1.round(4).tolist(), c2.round(4).tolist()
    ([1.0, 0.3333], [1.0, 0.2])
    """
    tau = np.asarray(times, dtype=np.float64) * np.sqrt(kt / moment)
    g, g2 = ((1.0 - x * x) * np.exp(-0.5 * x * x) for x in (tau, 2.0 * tau))
    # C1 = (1 + 2g)/3 and C2 = (1 + 2g + 2g₂)/5 of a spherical top
    return (1.0 + 2.0 * g) / 3.0, (1.0 + 2.0 * g + 2.0 * g2) / 5.0


def symmetric_curves(times: ArrayLike, moment: float, moment_of_axis: float, kt: float) -> tuple[Floats, Floats]:
    """C1 and C2 of the figure axis of a symmetric top.

    Parameters
    ----------
    times : (...) array
        Coherent units with the others.
    moment, moment_of_axis : float
        The top has moments (moment, moment, moment_of_axis), none of them 0.
    kt : float
        Temperature as an energy.

    Returns
    -------
    (...) array, (...) array
        C1 and C2.

    Notes
    -----
    The axis precesses about L at |L|/moment, at an angle of cosine μ. With weight a^(-3/2), a(μ) = (1 - μ²)/I + μ²/I_z,

        C1 = <μ² + (1 - μ²) g(s)>,    C2 = <P2(μ)² + 3 μ² (1 - μ²) g(s) + ¾ (1 - μ²)² g(2s)>,    s = t √(kT/a)/I ,

    g as in the head: the length of L is integrated in closed form, μ by 96 points (exact to 1e-12 for I_z/I from 0.1 to 2).
    """
    x, weight = np.polynomial.legendre.leggauss(NODES)
    mu2 = (0.5 * (x + 1.0)) ** 2  # μ = cos of the angle between axis and L, on 0 to 1 by symmetry
    a = (1.0 - mu2) / moment + mu2 / moment_of_axis
    weight = weight * a**-1.5  # directions of L weigh as (Σ n²/I)^(-3/2): the integral over |L|
    weight /= weight.sum()
    s = np.asarray(times, dtype=np.float64)[..., None] * np.sqrt(kt / a) / moment
    g, g2 = ((1.0 - y * y) * np.exp(-0.5 * y * y) for y in (s, 2.0 * s))
    c1 = mu2 + (1.0 - mu2) * g
    # C2 with P2(μ), and the parts that oscillate once and twice
    c2 = (1.5 * mu2 - 0.5) ** 2 + 3.0 * mu2 * (1.0 - mu2) * g + 0.75 * (1.0 - mu2) ** 2 * g2
    return c1 @ weight, c2 @ weight


def plateau(moments: ArrayLike, vector: ArrayLike) -> float:
    """C1(∞), the limit of C1 at long times, of a vector in principal axes; it does not depend on the temperature.

    moments: (3,), any order and unit. By quadrature over the directions of L, to about 2e-7.

    >>> round(plateau([1.0, 1.0, 1.0], [0, 0, 1]), 6), plateau([0.0, 1.0, 1.0], [1, 0, 0])
    (0.333333, 0.0)
    """
    inertia = checked_moments(moments)
    unit = np.asarray(vector, dtype=np.float64)
    unit = unit / np.linalg.norm(unit)
    if np.any(inertia == 0.0):
        return 0.0
    order = np.argsort(inertia, kind="stable")
    ascending = inertia[order]
    if ascending[0] == ascending[2]:
        return 1.0 / 3.0
    limit = np.zeros(3)
    limit[order[2]] = _limit_along_third(ascending)
    limit[order[0]] = _limit_along_third(ascending[::-1])
    return float(limit @ unit**2)


def _limit_along_third(moments: Floats) -> float:
    """<(mean of L3/|L|)²> over all L that circle axis 3, moments in increasing or decreasing order.

    With L2/|L| = s and the angle φ in the plane of axes 1 and 3 they fill 0 < φ < atan √(I1 (I3-I2)/(I3 (I2-I1))); 1/K²
    vanishes at that edge like a logarithm, so points crowd there.
    """
    from scipy.special import ellipkm1

    i1, i2, i3 = moments
    if i2 == i3:  # no L circles it
        return 0.0
    x, weight = np.polynomial.legendre.leggauss(NODES)
    v, dv = 0.5 * (x + 1.0), 0.5 * weight
    edge = np.arctan2(np.sqrt(abs(i1 * (i3 - i2))), np.sqrt(abs(i3 * (i2 - i1))))
    # φ = edge (1 - v⁶): points crowd at the separatrix, where the integrand has a logarithm
    phi, s2 = edge * (1.0 - v**6)[:, None], v**2
    measure = (edge * 6.0 * v**5 * dv)[:, None] * dv
    n1, n3 = (1.0 - s2) * np.sin(phi) ** 2, (1.0 - s2) * np.cos(phi) ** 2
    d1 = s2 * (i2 - i1) / i2 + n3 * (i3 - i1) / i3
    d2 = n3 * (i3 - i2) / i3 - n1 * (i2 - i1) / i1
    # the lower limit keeps the logarithm finite on the separatrix itself
    mc = np.clip(d2 * (i3 - i1) / (d1 * (i3 - i2)), 1e-300, 1.0)
    mean = np.sqrt(i3 * d1 / (i3 - i1)) * 0.5 * np.pi / ellipkm1(mc)
    weighed = (n1 / i1 + s2 / i2 + n3 / i3) ** -1.5
    return float(np.sum(measure * weighed * mean**2) / _direction_weight(moments))


def _direction_weight(moments: Floats) -> float:
    """∫ (Σ n_i²/I_i)^(-3/2) over an octant: (π/2) √(I1 I2 I3), the volume in which L is normal."""
    return float(0.5 * np.pi * np.sqrt(np.prod(moments)))


def _generators() -> Floats:
    """(ε_i)_jk = -ε_ijk, the three antisymmetric matrices of turns."""
    levi_civita = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        levi_civita[i, j, k], levi_civita[i, k, j] = 1.0, -1.0
    return -levi_civita


def _fourth(moments: Floats, w: Floats, axis: int) -> float:
    """<|ü|²> of the unit vector along an axis, the third of (i, j, k) cyclic; w = <ω²>, normal deviates.

    |ü|² = ω̇_i² + ω̇_j² + ω² (ω_i² + ω_j²) + 2 ω_k (ω̇_j ω_i - ω̇_i ω_j), where Euler's equations give ω̇_i = d_i ω_j ω_k, cyclic.
    """
    i, j, k = (axis + 1) % 3, (axis + 2) % 3, axis
    unit = np.eye(3)
    di = _acceleration(moments, unit[j] + unit[k])[i]
    dj = _acceleration(moments, unit[k] + unit[i])[j]
    turning = di**2 * w[j] * w[k] + dj**2 * w[k] * w[i]
    across = 3.0 * w[i] ** 2 + 3.0 * w[j] ** 2 + 2.0 * w[i] * w[j] + w[k] * (w[i] + w[j])
    return float(turning + across + 2.0 * w[k] * (dj * w[i] - di * w[j]))


def _acceleration(moments: Floats, omega: Floats) -> Floats:
    """ω̇ of a free body, 0 about the axis of a linear rotor."""
    return gyroscopic_rate(moments * omega, omega) * inverse_moments(moments)
