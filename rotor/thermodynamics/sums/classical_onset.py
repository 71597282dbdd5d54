"""The temperature above which the heat capacity of rotation is classical to a given accuracy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.thermodynamics.sums.classical_limit import classical_limit, rotational_temperatures_k
from rotor.thermodynamics.sums.level_sums import OutOfReachError, level_sums

if TYPE_CHECKING:
    from rotor.tops.top import Top


def classical_above_k(top: Top, tolerance: float = 0.01) -> float:
    """The highest temperature at which C_v of the rigid quantum top differs from n R/2 by a fraction `tolerance`.

    Distortion is neglected in both; spin weights count, with all species in equilibrium. The search covers 40 temperatures per
    decade from 0.01 to 10 times the largest finite Θ (higher if C_v still differs there) and is refined to 1e-6. For a linear
    molecule C_v/R = 1 + (Θ/T)²/45 + ... differs by 1 % at 1.93 Θ. Raises ValueError if no sum over levels reaches that temperature.

    >>> from rotor.tops.top import Top
    >>> round(classical_above_k(Top.from_constants("B=20836.619 MHz")), 2)  # Θ = 1 K
    1.93
    """
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance {tolerance}: expected a fraction of the classical heat capacity, between 0 and 1")
    rigid, theta = _rigid(top), max(t for t in rotational_temperatures_k(top) if math.isfinite(t))
    classical = classical_limit(rigid).degrees / 2

    def beyond(temperatures: Floats) -> NDArray[np.bool_]:
        sums = level_sums(rigid, [rigid.spin_weights], temperatures, tolerance * 1e-4)[0]
        return np.asarray(np.abs(sums.cv_over_r / classical - 1) > tolerance)

    grid = theta * np.logspace(-2, 1, 121)
    apart = beyond(grid)
    while apart[-20:].any():  # stop after half a decade without a difference
        higher = grid[-1] * np.logspace(0.025, 0.5, 20)
        grid, apart = np.append(grid, higher), np.append(apart, beyond(higher))
    last = np.flatnonzero(apart)[-1]
    while grid[last + 1] - grid[last] > 1e-6 * grid[last]:
        grid = np.linspace(grid[last], grid[last + 1], 50)
        last = np.flatnonzero([True, *beyond(grid[1:-1]), False])[-1]
    return float(grid[last])


def classical_above_if_known(top: Top, tolerance: float = 0.01) -> float | None:
    """`classical_above_k`, or None if no sum over levels reaches that temperature."""
    try:
        return classical_above_k(top, tolerance)
    except OutOfReachError:
        return None


def _rigid(top: Top) -> Top:
    """The top without distortion."""
    from rotor.tops.constants.constants import constants_from_moments
    from rotor.tops.top import Top

    constants = constants_from_moments(top.moments_u_angstrom2, top.kind)
    return Top.from_constants(constants, spin_weights=top.spin_weights)
