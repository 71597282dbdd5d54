"""Plans of levels: effects with their sizes, good quantum numbers, basis, blocks and method, and sizes of effects that levels and lines
neglect: the next order of distortion, spin couplings, errors of a geometry, internal rotation, inversion, electron spin
(`rotor.quantum.estimates.limits` and `beyond`), and the Stark shift of a stray field.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rotor import units
from rotor.requests.budget import size_text
from rotor.requests.plan import Cost, LeftOut, largest_first

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.internal_rotation import InternalRotationConstants
    from rotor.tops.top import Top

STRAY_KV_PER_CM = 1e-3  # 1 V/cm
# for scenes, whose keys no other text names
HYPERFINE_KEY = "its constants are known, effects.hyperfine = true adds them"


def neglected_in_levels(top: Top, j: int, effects: Sequence[QuantumEffect]) -> tuple[LeftOut, ...]:
    """Neglected effects of levels and lines of one J in MHz, largest first; effects without an estimate come last."""
    from rotor.quantum.estimates.limits import COMPUTE, all_limits

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


ENERGY = "energies are eigenvalues of the truncated Hamiltonian"
MOST_J_COMPARED = {1: 30, 2: 8, 3: 3}  # highest J at which the torsional truncation is estimated, by number of tops


def plan_fields(top: Top, j: int, effects: Sequence[QuantumEffect]) -> dict[str, Any]:
    """Effects, good quantum numbers and neglected effects, as fields of a plan."""
    from rotor.quantum.solve import solve_levels

    good = solve_levels(top, 1, effects=effects, vectors=False).quanta_names
    return {"effects": effect_texts(top, j, effects), "good": good, "left_out": neglected_in_levels(top, j, effects)}


def level_parts(top: Top, jmax: int, effects: Sequence[QuantumEffect]) -> list[tuple[str, str]]:
    """Basis, blocks and method of the levels of a top."""
    from rotor.quantum.estimates.convergence import converges_to
    from rotor.quantum.wang.basis import wang_blocks
    from rotor.quantum.wang.rotation import representation_of

    spins = [spin for effect in effects for spin in effect.spins(top)]
    if top.internal_rotation is not None:
        return torsional_parts(top, top.internal_rotation, jmax)
    if top.kind in ("linear", "spherical", "prolate", "oblate"):
        basis, method = f"J to {jmax}; no matrix", f"closed form: H is diagonal in the basis of a {top.kind} top"
    else:
        largest = max(block.size for block in wang_blocks(jmax, representation_of(top)))
        basis = f"J to {jmax}; four Wang blocks of each J, of up to {largest} states"
        method = f"Wang blocks one by one, {representation_of(top)}; {ENERGY}"
    parts = [("basis", basis), ("method", method)]
    if (reach := converges_to(top, jmax, effects)) < jmax:
        text = f"the distortion series converges to J = {reach}; energies above at the highest K are not to be trusted"
        parts.append(("warning", text))
    if spins:
        size = math.prod(spin.twice + 1 for spin in spins)
        names = ", ".join(dict.fromkeys(spin.name for spin in spins))
        parts.append(("spins", f"blocks of F over the solved rotation, {size} spin functions: {names}"))
    return parts


def effect_texts(top: Top, j: int, effects: Sequence[QuantumEffect]) -> tuple[str, ...]:
    """Name and size of each effect."""
    from rotor.quantum.effect import effect_sizes

    return tuple(
        f"{effect.name}, {size_text(effect.size_mhz, 'MHz')} at J = {j}" for effect in effect_sizes(top, j, effects)
    )


def torsional_parts(top: Top, constants: InternalRotationConstants, jmax: int) -> list[tuple[str, str]]:
    """Basis, method and truncation error of levels with an internal rotor."""
    from rotor.quantum.internal_rotation.levels import turning_tops
    from rotor.quantum.internal_rotation.truncation import truncation_mhz

    count = constants.functions
    size = (2 * jmax + 1) * count
    compared = min(jmax, MOST_J_COMPARED[constants.tops])
    error = truncation_mhz(turning_tops(top, constants), compared, constants.vt_max, count)
    functions = "torsional functions" if constants.tops == 1 else "products of torsional functions"
    return [
        ("basis", f"J to {jmax}; {count} {functions} for each K, blocks of up to {size} states"),
        ("method", f"torsion of each K and species first; {ENERGY}"),
        ("truncation", f"at most {error:.1g} MHz at J = {compared}, v_t up to {constants.vt_max}"),
    ]


def describe_levels(request: Any, _: Cost) -> dict[str, Any]:
    """What a list of levels is."""
    top, jmax, first = request.top, request.jmax, request.jmin
    count = (jmax + 1) ** 2 - first**2 if top.kind == "asymmetric" else jmax + 1 - first
    if top.kind in ("prolate", "oblate"):
        count = (jmax + 1) * (jmax + 2) // 2 - first * (first + 1) // 2
    return {
        **plan_fields(top, max(jmax, 1), request.effects),
        "parts": tuple(level_parts(top, jmax, request.effects)),
        "counts": {"levels": count},
    }
