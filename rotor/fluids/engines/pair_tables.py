"""The pair potential for engines: parameters of closed forms, or a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.engines.engine_input import EngineInput
from rotor.fluids.forces.ewald import COULOMB_EV_ANGSTROM
from rotor.fluids.forces.interactions import mixed, reaction_field, screened, switched, tail
from rotor.fluids.forces.models import Site
from rotor.fluids.settings import Settings


@dataclass(frozen=True)
class Form:
    """Parameters of the potential outside `Settings`; the defaults are those of the built-in calculator.

    switch_angstrom: width of the Lennard-Jones switch before the cutoff, 0 for a hard cut. dielectric: outside the
    sphere of the reaction field, infinite for a conductor. alpha_per_angstrom: damping of shifted charges.
    """

    switch_angstrom: float = 1.0
    dielectric: float = float("inf")
    alpha_per_angstrom: float = 0.2


def pair_energy(r: Floats, sites: tuple[Site, Site], settings: Settings, form: Form) -> tuple[Floats, Floats]:
    """Energy (eV) and force (eV/Å) of two sites at distances (n,) in Å up to the cutoff.

    S 4ε [(σ/r)¹² - (σ/r)⁶] + q₁q₂/4πε₀ f(r) with the switch S and the form f of charges under a cutoff as in
    `rotor.fluids.forces.interactions`, and minus its slope.
    """
    first, other = sites
    sigma, epsilon = mixed((first.sigma_angstrom, other.sigma_angstrom), (first.epsilon_ev, other.epsilon_ev))
    sixth = (sigma / r) ** 6
    _, begin, slope = switched(settings.cutoff_angstrom, form.switch_angstrom)
    t = np.clip((r - begin) * slope, 0.0, 1.0)
    switch, fall = 1 - t**3 * (10 - 15 * t + 6 * t**2), 30 * t**2 * (1 - t) ** 2 * slope
    bare = 4 * epsilon * (sixth**2 - sixth)
    energy, force = switch * bare, switch * 24 * epsilon * (2 * sixth**2 - sixth) / r + fall * bare
    f, g = _charges(r, settings, form)
    qq = COULOMB_EV_ANGSTROM * first.charge_e * other.charge_e
    return energy + qq * f, force + qq * g


def _charges(r: Floats, settings: Settings, form: Form) -> tuple[Floats, Floats]:
    """f(r) and -f'(r) of unit charges under a cutoff."""
    from scipy.special import erfc

    if settings.electrostatics == "reaction-field":
        _, k, c = reaction_field(settings.cutoff_angstrom, form.dielectric)
        return 1 / r + k * r**2 - c, 1 / r**2 - 2 * k * r
    _, b, c, alpha, slope, cutoff = screened(settings.cutoff_angstrom, form.alpha_per_angstrom, True)
    damped = erfc(alpha * r) / r
    return damped - c + b * (r - cutoff), damped / r + slope * np.exp(-((alpha * r) ** 2)) / r - b


def dispersion_tail(engine_input: EngineInput, settings: Settings, form: Form) -> tuple[float, float]:
    """Energy (eV) and pressure (eV/Å³) of the dispersion beyond the cutoff, for a uniform fluid."""
    counts = np.bincount(engine_input.kinds, minlength=len(engine_input.species))
    models = tuple(kind.model for kind in engine_input.species)
    energy, pressure = tail(models, counts, settings.cutoff_angstrom, form.switch_angstrom)
    volume = float(np.prod(engine_input.edges))
    return energy / volume, pressure / volume**2
