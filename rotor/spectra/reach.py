"""How far in J a line list has to go before no line can reach the intensity it is cut at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotor import units

if TYPE_CHECKING:
    from rotor.tops.top import Top

JMAX_DEFAULT_LIMIT = 600
USUAL_CUT = -12.0


def jmax_for_cut(top: Top, dipole_abc: tuple[float, float, float], temperature_k: float, q: float, cut: float) -> int:
    """The J beyond which every line is weaker than 10^cut nm² MHz at this temperature.

    The lowest level of each J is above C J(J+1) in a rigid top, a line's strength is at most (J+1) μ² times the spin
    weight, its frequency is taken as 2A(J+1). Without a cut, the reach of the usual cut of -12 is taken.
    Raises ValueError where more than J = 600 would be needed.
    """
    constants = top.rotational_constants_mhz
    a, c = max(x for x in constants if math.isfinite(x)), constants[2]
    kt_mhz = temperature_k * units.MHZ_PER_K
    dipole2 = sum(mu * mu for mu in dipole_abc) or 1.0
    weight = max(top.spin_weights.values)
    wanted = 10.0 ** (USUAL_CUT if math.isinf(cut) else cut)

    for j in range(1, 100_000):
        frequency = 2 * a * (j + 1)
        photon = -math.expm1(-frequency / kt_mhz)
        population = weight * math.exp(-c * j * (j - 1) / kt_mhz) / q
        if j > 1 and 4.16231e-5 * frequency * (j + 1) * dipole2 * photon * population < wanted and c * j * j > kt_mhz:
            break
    if j > JMAX_DEFAULT_LIMIT:
        raise ValueError(
            f"lines above 10^{math.log10(wanted):g} nm² MHz at {temperature_k:g} K reach to J = {j}, more than "
            f"{JMAX_DEFAULT_LIMIT}; give J max yourself, a lower temperature or a higher cut"
        )
    return j
