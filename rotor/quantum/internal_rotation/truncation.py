"""Error of the truncation to n_v torsional functions."""

from __future__ import annotations

import numpy as np

from rotor.quantum.internal_rotation.contracted import WAVES
from rotor.quantum.internal_rotation.levels import TurningTops, species_blocks
from rotor.quantum.internal_rotation.several_tops import EACH, SeveralTops

STEP = 4  # functions added for the comparison
MARGIN = 1.5  # factor on the change from n_v to n_v + 4 functions: the error falls at least fivefold in four functions
ROUNDING = 64 * float(np.finfo(float).eps)  # round-off relative to the largest energy in a block


def truncation_mhz(model: TurningTops, jmax: int, vt_max: int, count: int) -> float:
    """Bound (MHz) of the truncation error of levels with v_t ≤ vt_max at J = jmax, where it is largest.

    Energies are upper bounds and fall with n_v. The bound is 1.5 times their change from n_v to n_v + 4 functions (2 n_v products for
    several tops), plus round-off.

    >>> from rotor.quantum.internal_rotation.model import RamModel
    >>> model = RamModel({"A": 9e3, "B": 4e3, "C": 3e3, "Dab": 0.0, "F": 2e5, "rho": 0.1, "V3": 1e7})
    >>> truncation_mhz(model, 3, 0, 9) < 1e-5
    True
    """
    largest, scale = 0.0, 0.0
    products = EACH ** len(model.tops) if isinstance(model, SeveralTops) else 0
    enlarged = min(2 * count, products) if products else min(count + STEP, 2 * WAVES + 1)
    for name in model.species:
        energies = []
        for functions in (count, enlarged):
            levels = species_blocks(model, name, jmax, jmax, functions).solve_once(model.coefficients, vt_max)
            order = np.lexsort([levels.quanta[number] for number in ("kc", "ka", "vt")])
            energies.append(levels.energies[order])
            scale = max(scale, levels.highest_mhz)
        largest = max(largest, float(np.abs(energies[0] - energies[1]).max()))
    return MARGIN * largest + ROUNDING * scale
