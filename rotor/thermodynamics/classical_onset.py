"""The temperature above which the heat capacity of rotation is classical to a given accuracy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.thermodynamics.classical_limit import classical_limit, rotational_temperatures_k
from rotor.thermodynamics.level_sums import OutOfReachError, level_sums

if TYPE_CHECKING:
    from rotor.tops.top import Top


def classical_above_k(top: Top, tolerance: float = 0.01) -> float:
    """The highest temperature at which C_v of the rigid quantum top differs from its classical value by `tolerance` of it.

    Above it the classical n R/2 is good to that; distortion, which both could have, is left out of both. The spin weights
    count, all species in equilibrium. Looked for at 40 temperatures a decade from 0.01 to 10 times the largest finite Θ,
    higher where it differs there, and then between two of them to 1e-6. ValueError where no sum reaches so far. A linear
    molecule of Θ, its C_v/R being 1 + (Θ/T)²/45 + ..., parts at 1.93 Θ.

    >>> from rotor.tops.top import Top
    >>> round(classical_above_k(Top.from_constants("B=20836.619 MHz")), 2)  # Θ = 1 K
    1.93
    """
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance {tolerance}: expected a part of the classical heat capacity, between 0 and 1")
    rigid, theta = _rigid(top), max(t for t in rotational_temperatures_k(top) if math.isfinite(t))
    classical = classical_limit(rigid).degrees / 2

    def beyond(temperatures: Floats) -> NDArray[np.bool_]:
        sums = level_sums(rigid, [rigid.spin_weights], temperatures, tolerance * 1e-4)[0]
        return np.asarray(np.abs(sums.cv_over_r / classical - 1) > tolerance)

    grid = theta * np.logspace(-2, 1, 121)
    apart = beyond(grid)
    while apart[-20:].any():  # half a decade without a difference is the end
        higher = grid[-1] * np.logspace(0.025, 0.5, 20)
        grid, apart = np.append(grid, higher), np.append(apart, beyond(higher))
    last = np.flatnonzero(apart)[-1]
    while grid[last + 1] - grid[last] > 1e-6 * grid[last]:
        grid = np.linspace(grid[last], grid[last + 1], 50)
        last = np.flatnonzero([True, *beyond(grid[1:-1]), False])[-1]
    return float(grid[last])


def classical_above_if_known(top: Top, tolerance: float = 0.01) -> float | None:
    """The same; None where no sum over levels reaches so far."""
    try:
        return classical_above_k(top, tolerance)
    except OutOfReachError:
        return None


def _rigid(top: Top) -> Top:
    """This top without distortion."""
    from rotor.tops.top import Top, constants_of_moments

    constants = constants_of_moments(top.moments_u_angstrom2, top.kind)
    return Top.from_constants(constants, spin_weights=top.spin_weights)
