"""Thermal angular momentum of a body, and a start near its intermediate axis.

In a classical canonical ensemble the three components of L in principal axes are independent normal deviates of
variance I_i kT: the Hamiltonian is Σ L_i²/2I_i, and the measure of phase space, d³L times that of orientations, has
no other weight (Landau and Lifshitz, Statistical Physics, section 51). A linear rotor has no L along its axis.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments


def mean_thermal_momentum(moments: ArrayLike, kt: ArrayLike) -> Floats:
    """Thermal mean of |L| at the temperature kT, (...), in the units of √(moment x energy).

    With L_i = √(I_i kT) |z| n_i, z of three normal deviates and n its direction,

        ⟨|L|⟩ = ⟨|z|⟩ √kT ⟨√(Σ I_i n_i²)⟩ = √(8kT/π) R_G(I1, I2, I3) ,

    R_G being the mean of √(Σ I_i n_i²) over the sphere (NIST DLMF, equation 19.23.6_5). It is √I for a
    sphere and √I π/4 for (0, I, I), where √(πIkT/2) is the mean of two degrees of freedom.

    moments: (..., 3), one may be zero. kt: (...), not negative.

    >>> round(float(mean_thermal_momentum([0.0, 2.0, 2.0], 1.0)) / math.sqrt(math.pi), 14)
    1.0
    """
    from scipy.special import elliprg

    moments, kt = checked_moments(moments), np.asarray(kt, dtype=np.float64)
    if np.any(kt < 0.0) or not np.all(np.isfinite(kt)):
        raise ValueError(f"kT must be finite and not negative; got {kt.tolist()}")
    return np.asarray(np.sqrt(8.0 * kt / math.pi) * elliprg(*np.moveaxis(moments, -1, 0)))


def off_intermediate_axis(moments: ArrayLike, momentum: float, tilt_rad: float) -> Floats:
    """L (3,) of one body, of length `momentum`, tipped by `tilt_rad` off its axis of intermediate moment.

    The tilt is halfway between the other two axes; for a linear rotor, which has no L along its axis, towards the third.
    If two moments are equal, the second after a stable sort counts as intermediate.

    >>> off_intermediate_axis([3.0, 1.0, 2.0], 10.0, math.radians(0.5)).round(4)
    array([0.0617, 0.0617, 9.9996])
    """
    moments = checked_moments(moments)
    if moments.shape != (3,):
        raise ValueError(f"expected the three moments of one body; got shape {moments.shape}")
    between = np.argsort(moments, kind="stable")[1]  # stable: equal moments keep the order of the axes
    aside = np.where(moments > 0.0, 1.0, 0.0)
    aside[between] = 0.0  # the tilt is away from the middle axis
    direction = math.sin(tilt_rad) * aside / np.linalg.norm(aside)
    direction[between] = math.cos(tilt_rad)
    return np.asarray(momentum * direction)
