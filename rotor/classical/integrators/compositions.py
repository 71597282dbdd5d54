"""Compositions: a sequence of symmetric steps of order 2 with suitable fractions is a step of higher order.

The fractions γ of the step are symmetric with Σγ = 1; order 4 requires Σγ³ = 0, order 6 also Σγ⁵ = 0 and another condition (Hairer,
Lubich, Wanner, Geometric Numerical Integration, section V.3). The composition inherits the conserved quantities and the reversibility of
the step.
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats

_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))  # M. Suzuki, Phys. Lett. A 146, 319 (1990)

# W. Kahan and R.-C. Li, Math. Comp. 66, 1089 (1997): s9odr6a and s17odr8a; the first halves and the middle
_KAHAN_LI_6 = [
    0.39216144400731413927925056,
    0.33259913678935943859974864,
    -0.70624617255763935980996482,
    0.08221359629355080023149045,
    0.79854399093482996339895035,
]
_KAHAN_LI_8 = [
    0.13020248308889008087881763,
    0.56116298177510838456196441,
    -0.38947496264484728640807860,
    0.15884190655515560089621075,
    -0.39590389413323757733623154,
    0.18453964097831570709183254,
    0.25837438768632204729397911,
    0.29501172360931029887096624,
    -0.60550853383003451169892108,
]

_FRACTIONS: dict[int, list[float]] = {
    2: [1.0],
    4: [_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI, _SUZUKI, _SUZUKI],
    6: _KAHAN_LI_6 + _KAHAN_LI_6[-2::-1],
    8: _KAHAN_LI_8 + _KAHAN_LI_8[-2::-1],
}


def fractions(order: int) -> Floats:
    """Fractions γ (s,) of the step for order 2, 4 (Suzuki, s = 5), 6 (Kahan and Li, s = 9) or 8 (s = 17).

    >>> float(fractions(4).sum().round(15)), len(fractions(8))
    (1.0, 17)
    """
    if order not in _FRACTIONS:
        raise ValueError(f"compositions exist of order 2, 4, 6 and 8; got {order!r}")
    return np.array(_FRACTIONS[order])
