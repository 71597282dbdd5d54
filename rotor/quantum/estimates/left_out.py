"""Sizes of effects that levels and lines neglect: the next order of distortion, spin couplings, errors of a geometry, internal rotation,
inversion, electron spin (`rotor.quantum.estimates.limits` and `beyond`), and the Stark shift of a stray field:

| top | shift in 1 V/cm |
|---|---|
| linear, J = 0 | (μE)²/6hB, second order |
| symmetric, J = K = 1 | μE KM/J(J+1), first order |
| asymmetric, J = M = 1 | shift of two levels that a component couples |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotor import units
from rotor.requests.plan import LeftOut, largest_first

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

STRAY_KV_PER_CM = 1e-3  # 1 V/cm
# for scenes, whose keys no other text names
HYPERFINE_KEY = "its constants are known, effects.hyperfine = true adds them"


def neglected_in_levels(top: Top, j: int, effects: Sequence[QuantumEffect]) -> tuple[LeftOut, ...]:
    """Neglected effects of levels and lines of one J in MHz, largest first; effects without an estimate come last."""
    from rotor.quantum.estimates.beyond import COMPUTE
    from rotor.quantum.estimates.limits import all_limits

    limits = all_limits(top, j, effects)
    parts = [
        LeftOut(limit.name, limit.size_mhz, "MHz", f"at J = {j}: {limit.text.replace(COMPUTE, HYPERFINE_KEY)}")
        for limit in limits
    ]
    field = stray_field(top)
    return largest_first(parts if field is None else [*parts, field])


def stray_field(top: Top) -> LeftOut | None:
    """The largest Stark shift of a level with J ≤ 1 in 1 V/cm; asymmetry doublets of higher J shift more.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> f"{stray_field(rod).size:.2e}"  # (μE)²/6hB
    '3.45e-06'
    """
    if not any(top.dipole_abc_debye or ()) or top.kind == "spherical" or top.states is not None:
        return None
    if top.kind == "asymmetric":
        return _asymmetric_stray_field(top)
    energy = math.hypot(*(top.dipole_abc_debye or ())) * units.MHZ_PER_DEBYE_KV_PER_CM * STRAY_KV_PER_CM
    if top.kind == "linear":
        size, basis = energy**2 / (6 * top.rotational_constants_mhz[1]), "of J = 0 in 1 V/cm: (μE)²/6hB"
    else:
        size, basis = energy / 2, "of J = K = 1 in 1 V/cm: μE KM/J(J+1)"
    return LeftOut("Stark shift of a stray field", size, "MHz", basis)


def _asymmetric_stray_field(top: Top) -> LeftOut:
    """The largest shift of 1(0,1), 1(1,1), 1(1,0) with M = 1: √(δ²/4 + (½μE)²) - δ/2 for two levels δ apart that ½ μE couples.

    μ_a couples 1(1,1) and 1(1,0), δ = B - C; μ_b 1(0,1) and 1(1,0), δ = A - C; μ_c 1(0,1) and 1(1,1), δ = A - B.
    """
    a, b, c = top.rotational_constants_mhz
    couplings = [0.5 * abs(mu) * units.MHZ_PER_DEBYE_KV_PER_CM * STRAY_KV_PER_CM for mu in top.dipole_abc_debye or ()]
    gaps = (b - c, a - c, a - b)
    sizes = [w**2 / (gap / 2 + math.hypot(gap / 2, w)) if w else 0.0 for w, gap in zip(couplings, gaps, strict=True)]
    which = "abc"[sizes.index(max(sizes))]
    basis = f"of J = M = 1 in 1 V/cm, two levels that μ_{which} couples; near degeneracies of higher J have more"
    return LeftOut("Stark shift of a stray field", max(sizes), "MHz", basis)
