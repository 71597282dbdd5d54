"""Widths of lines, which a line list neglects.

| neglected | full width at half maximum |
|---|---|
| Doppler width | ν √(8 ln2 kT/mc²) (`rotor.spectra.profiles`) |
| pressure width | 2 n ⟨v⟩ σ/2π, σ = π (4 Å)² + π μ²/(2 · 4πε₀ ħ⟨v⟩): hard cores and V. Weisskopf's radius of dipoles |
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotor import units
from rotor.requests.budget import size_text
from rotor.requests.plan import LeftOut

if TYPE_CHECKING:
    from rotor.tops.top import Top

COLLISION_M = 4e-10  # diameter of small molecules
HBAR_J_S = units.PLANCK_J_S / (2 * math.pi)
MILLIBAR = 1e-3  # bar


def doppler(top: Top, frequency_mhz: float, temperature_k: float) -> LeftOut | None:
    """The Doppler width of a line; None for a top without a mass."""
    if top.mass_u is None:
        return None
    from rotor.spectra.profiles import doppler_fwhm

    width = float(doppler_fwhm(frequency_mhz, temperature_k, top.mass_u))
    return LeftOut(
        "Doppler width", width, "MHz", f"full width at half maximum at {frequency_mhz:g} MHz, {temperature_k:g} K"
    )


def pressure_width(top: Top, temperature_k: float, pressure_bar: float | None) -> LeftOut | None:
    """The width from collisions of these molecules with each other; None for a top without a mass.

    Without a pressure (of a cell, a jet or interstellar gas) it is not estimated; the text then gives the width at 1 mbar.

    Neglected: resonance of the levels, higher multipoles, dependence on J. The dipole term holds up to a factor of order one; with ½,
    CO and OCS agree with measured widths within a factor of 3.

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
        basis = (
            f"no pressure is given; {size_text(width, 'MHz')} for each mbar of these molecules at {temperature_k:g} K"
        )
        return LeftOut("pressure width", None, "MHz", basis)
    basis = f"full width at half maximum at {1e3 * pressure_bar:g} mbar of these molecules, {temperature_k:g} K"
    return LeftOut("pressure width", width, "MHz", basis)
