"""How large is what a scene leaves out: each effect with its size, its formula and where that is from.

What a Hamiltonian leaves out is the core's: distortion of the next order, couplings of spins, geometry in place of constants, internal
rotation, inversion, electron spin (`rotor.quantum.estimates.limits` and `beyond`). The conditions of a scene add these:

| left out | size |
|---|---|
| Doppler width | ν √(8 ln2 kT/mc²), full width at half maximum (`rotor.spectra.profiles`) |
| pressure width | 2 n ⟨v⟩ σ/2π, σ = π (4 Å)² + π μ²/(2 · 4πε₀ ħ⟨v⟩): a hard core, and V. Weisskopf's radius of dipoles |
| Stark shift of a stray field | linear, J = 0: (μE)²/6hB, second order; symmetric, J = K = 1: μE KM/J(J+1), first order |
| the same of an asymmetric top | J = M = 1: two levels that a component couples |
| quantum corrections of a classical gas | a/T of ln Q (`rotor.thermodynamics.classical_limit`) |
| centrifugal distortion of a classical gas | d T of ln Q (there) |
| quantum corrections of a fluid | ħ²/24(kT)³ (⟨F²⟩/m + Σ⟨T²⟩/I) of A/NkT (J. G. Powles and G. Rickayzen, Mol. Phys. 38, 1875 (1979)) |
| step of a fluid | h²/12 Σ⟨T²⟩/I of the rotational energy (`rotor.fluids.motion.thermometers`) |
| box of a fluid | N^(-1/3) of the diffusion (S. A. Khrapak, J. Phys. Chem. B (2024), arXiv:2402.09348), a short form of Yeh and Hummer's |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotor import units

if TYPE_CHECKING:
    from rotor.arrays import Floats
    from rotor.fluids.motion.bodies import Bodies
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

STRAY_KV_PER_CM = 1e-3  # 1 V/cm
COLLISION_M = 4e-10  # a diameter of small molecules
HBAR_J_S = units.PLANCK_J_S / (2 * math.pi)


HYPERFINE_KEY = (
    "its constants are known, effects.hyperfine = true adds them"  # of scenes; no other text names their keys
)


@dataclass(frozen=True)
class LeftOut:
    """Something that a scene leaves out. size: in `unit`; None: not estimated. basis: how the size was found, and for what."""

    name: str
    size: float | None
    unit: str
    basis: str


def of_levels(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[LeftOut]:
    """What levels and lines of one J leave out, largest first, in MHz; what is not estimated comes last."""
    from rotor.quantum.estimates.beyond import COMPUTE
    from rotor.quantum.estimates.limits import every_limit

    limits = every_limit(top, j, effects)
    found = [
        LeftOut(one.name, one.size_mhz, "MHz", f"at J = {j}: {one.text.replace(COMPUTE, HYPERFINE_KEY)}")
        for one in limits
    ]
    field = stray_field(top)
    return largest_first(found if field is None else [*found, field])


def largest_first(found: Sequence[LeftOut]) -> list[LeftOut]:
    """By size; what is not estimated comes last."""
    return sorted(found, key=lambda one: (one.size is None, -(one.size or 0.0)))


def stray_field(top: Top) -> LeftOut | None:
    """The Stark shift in 1 V/cm of a level of J = 1 at most that shows it first; asymmetry doublets of higher J shift more.

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
    """The largest shift of 1(0,1), 1(1,1), 1(1,0) with M = 1: two levels δ apart that ½ μE couples, √(δ²/4 + (½μE)²) - δ/2.

    μ_a couples 1(1,1) and 1(1,0), B - C apart, μ_b 1(0,1) and 1(1,0), A - C apart, μ_c 1(0,1) and 1(1,1), A - B apart.
    """
    a, b, c = top.rotational_constants_mhz
    couplings = [0.5 * abs(mu) * units.MHZ_PER_DEBYE_KV_PER_CM * STRAY_KV_PER_CM for mu in top.dipole_abc_debye or ()]
    gaps = (b - c, a - c, a - b)
    sizes = [w**2 / (gap / 2 + math.hypot(gap / 2, w)) if w else 0.0 for w, gap in zip(couplings, gaps, strict=True)]
    which = "abc"[sizes.index(max(sizes))]
    basis = f"of J = M = 1 in 1 V/cm, two levels that μ_{which} couples; near degeneracies of higher J have more"
    return LeftOut("Stark shift of a stray field", max(sizes), "MHz", basis)


def doppler(top: Top, frequency_mhz: float, temperature_k: float) -> LeftOut | None:
    """The Doppler width of a line; None of a top without a mass."""
    if top.mass_u is None:
        return None
    from rotor.spectra.profiles import doppler_fwhm

    width = float(doppler_fwhm(frequency_mhz, temperature_k, top.mass_u))
    return LeftOut(
        "Doppler width", width, "MHz", f"full width at half maximum at {frequency_mhz:g} MHz, {temperature_k:g} K"
    )


def of_classical_gas(top: Top, temperature_k: float) -> list[LeftOut]:
    """What a classical gas of rigid molecules leaves out, as parts of Q in percent, largest first."""
    from rotor.thermodynamics.classical_limit import classical_limit

    limit = classical_limit(top)
    quantum, distortion = abs(limit.a) / temperature_k, abs(limit.d) * temperature_k
    return largest_first(
        [
            LeftOut("quantum corrections", 100 * quantum, "%", f"a/T of ln Q at {temperature_k:g} K"),
            LeftOut("centrifugal distortion", 100 * distortion, "%", f"d T of ln Q at {temperature_k:g} K"),
        ]
    )


MILLIBAR = 1e-3  # bar


def pressure_width(top: Top, temperature_k: float, pressure_bar: float | None) -> LeftOut | None:
    """The width that collisions of these molecules among each other give a line; None of a top without a mass.

    Without a pressure it is not estimated: it may be that of a cell, of a jet or of interstellar gas. Then the width at 1 mbar is named.

    Neglected: resonance of the levels, higher multipoles, J. The factor ½ of the dipoles is one of order one, with which CO and OCS
    come out within a factor of 3 of the measured ones.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6081.5 MHz", dipole_abc_debye=(0.715, 0, 0), mass_u=59.967)
    >>> f"{pressure_width(rod, 300.0, 1e-3).size:.1f}"  # MHz at 1 mbar
    '7.6'
    """
    if top.mass_u is None:
        return None
    kt = units.BOLTZMANN_J_PER_K * temperature_k
    density = (MILLIBAR if pressure_bar is None else pressure_bar) * 1e5 / kt
    speed = math.sqrt(16 * kt / (math.pi * top.mass_u * units.ATOMIC_MASS_KG))  # √(8kT/πm_red), m_red half the mass
    dipole2 = sum(mu**2 for mu in top.dipole_abc_debye or ())
    dipole2 *= units.DEBYE_C_M**2 / (4 * math.pi * units.VACUUM_PERMITTIVITY_F_PER_M)  # J m³
    area = math.pi * COLLISION_M**2 + math.pi * dipole2 / (2 * HBAR_J_S * speed)
    width = 2 * density * speed * area / (2 * math.pi) / 1e6
    if pressure_bar is None:
        basis = f"no pressure is given; {width:.2g} MHz for each mbar of these molecules at {temperature_k:g} K"
        return LeftOut("pressure width", None, "MHz", basis)
    basis = f"full width at half maximum at {1e3 * pressure_bar:g} mbar of these molecules, {temperature_k:g} K"
    return LeftOut("pressure width", width, "MHz", basis)


def of_fluid(bodies: Bodies, force: Floats, torque: Floats, temperature_k: float, step_fs: float) -> list[LeftOut]:
    """What a box of rigid classical molecules leaves out, in percent, largest first; vibration is not estimated.

    Parameters
    ----------
    bodies : Bodies
        The molecules.
    force, torque : (n, 3) array
        In space, and in body axes, at some moment of the run; ASE's units.
    temperature_k : float
        Of the fluid.
    step_fs : float
        Length of a step.

    Returns
    -------
    list of LeftOut
    """
    from rotor.fluids.motion.thermometers import step_correction

    kt, count = units.EV_PER_K * temperature_k, len(bodies)
    quantum = step_correction(bodies, force, torque, units.HBAR_CLASSICAL / kt).total_ev / (24 * kt * count)
    degrees = int((bodies.inverse_moments > 0).sum())
    turning = step_correction(bodies, force, torque, step_fs * 1e-3 / units.ASE_TIME_PS).rotation_ev / 12
    found = [
        LeftOut("quantum mechanics of nuclei", 100 * quantum, "%", "of kT a molecule, free energy, to order ħ²"),
        LeftOut("finite box", 100 * count ** (-1 / 3), "%", "of the diffusion, which a periodic box slows down"),
    ]
    if degrees:
        share = turning / (0.5 * degrees * kt)
        found.append(LeftOut("finite step", 100 * share, "%", "of the rotational temperature at full steps"))
    return largest_first([*found, LeftOut("vibration", None, "", "molecules are rigid")])
