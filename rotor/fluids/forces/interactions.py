"""Pair interactions of sites: mixing rules, switch at the cutoff, charges with a cutoff, and the tail beyond it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Integers
from rotor.fluids.forces.ewald import COULOMB_EV_ANGSTROM
from rotor.fluids.forces.models import RigidModel


@dataclass(frozen=True)
class PairTables:
    """Pairs of sites of every two kinds of molecules.

    starts: (kinds² + 1,) bounds of each ordered couple of kinds. sites: (pairs, 2) in the molecules. numbers: (pairs, 3): qq
    in eV Å, c12 in eV Å¹², c6 in eV Å⁶; pairs where all are 0 do not stand here.
    """

    starts: Integers
    sites: Integers
    numbers: Floats


def mixed(sigma: tuple[float, float], epsilon: tuple[float, float]) -> tuple[float, float]:
    """Lorentz-Berthelot rules: arithmetic mean of the sizes, geometric mean of the depths.

    >>> mixed((3.0, 4.0), (1.0, 4.0))
    (3.5, 2.0)
    """
    return 0.5 * (sigma[0] + sigma[1]), math.sqrt(epsilon[0] * epsilon[1])


def _numbers(first: RigidModel, second: RigidModel, s: int, t: int) -> tuple[float, float, float]:
    site, other = first.sites[s], second.sites[t]
    sigma, epsilon = mixed((site.sigma_angstrom, other.sigma_angstrom), (site.epsilon_ev, other.epsilon_ev))
    return (
        COULOMB_EV_ANGSTROM * site.charge_e * other.charge_e,
        4 * epsilon * sigma**12,
        4 * epsilon * sigma**6,
    )


def pair_tables(models: tuple[RigidModel, ...]) -> PairTables:
    """The tables of a mixture."""
    starts, sites, numbers = [0], [], []
    for first in models:
        for second in models:
            for s in range(len(first.sites)):
                for t in range(len(second.sites)):
                    row = _numbers(first, second, s, t)
                    if any(row):
                        sites.append((s, t))
                        numbers.append(row)
            starts.append(len(sites))
    return PairTables(
        np.array(starts), np.array(sites, dtype=np.int64).reshape(-1, 2), np.array(numbers, float).reshape(-1, 3)
    )


def reaction_field(cutoff_angstrom: float, dielectric: float) -> Floats:
    """r_c², k, c of qq (1/r + k r² - c): k = (ε-1)/(2ε+1)/r_c³, c = 3ε/(2ε+1)/r_c.

    The shift c makes the energy 0 at the cutoff, and with a conductor outside (ε = ∞: k = 1/2r_c³, c = 3/2r_c) the force too.
    Pairs within a molecule are omitted: for rigid molecules they only give a constant. I. G. Tironi et al., J. Chem. Phys. 102, 5451
    (1995), without salt; the form of OpenMM's CutoffPeriodic (default there: ε = 78.3).

    >>> reaction_field(2.0, math.inf).tolist()
    [4.0, 0.0625, 0.75]
    """
    if math.isinf(cutoff_angstrom):
        return np.array([1e9, 0.0, 0.0])
    ratio = 0.5 if math.isinf(dielectric) else (dielectric - 1) / (2 * dielectric + 1)
    shift = 1.5 if math.isinf(dielectric) else 3 * dielectric / (2 * dielectric + 1)
    return np.array([cutoff_angstrom**2, ratio / cutoff_angstrom**3, shift / cutoff_angstrom])


def screened(cutoff_angstrom: float, alpha_per_angstrom: float, shifted: bool) -> Floats:
    """r_c², b, c, α, 2α/√π, r_c of qq [erfc(αr)/r - c + b (r - r_c)]: energy and force 0 at the cutoff if shifted.

    Damped, shifted forces: C. J. Fennell, J. D. Gezelter, J. Chem. Phys. 124, 234104 (2006). Without shift it is the
    part of Ewald's sum in real space.
    """
    alpha, r = alpha_per_angstrom, cutoff_angstrom
    slope = 2 * alpha / math.sqrt(math.pi)
    c = math.erfc(alpha * r) / r
    b = c / r + slope * math.exp(-((alpha * r) ** 2)) / r
    return np.array([r**2, b if shifted else 0.0, c if shifted else 0.0, alpha, slope, r])


def switched(cutoff_angstrom: float, width_angstrom: float) -> Floats:
    """r_c², r_s, 1/(r_c - r_s) of the switch over the last `width` before the cutoff; width 0 cuts hard.

    S = 1 - 10t³ + 15t⁴ - 6t⁵: energy, force and its slope go to 0 smoothly. OpenMM's switching function and LAMMPS' lj/mdf.
    """
    if math.isinf(cutoff_angstrom):
        return np.array([1e9, 0.0, 0.0])
    slope = 1 / width_angstrom if width_angstrom else 0.0
    return np.array([cutoff_angstrom**2, cutoff_angstrom - width_angstrom, slope])


def _beyond(c12: float, c6: float, cutoff: float, width: float) -> tuple[float, float]:
    """∫ ΔU r² dr and -⅓ ∫ ΔU' r³ dr for the part ΔU removed by switch and cutoff: (1 - S) U up to the cutoff, U beyond.

    By partial integration the second is the first plus ⅓ r³ ΔU at a hard cut. The switch region uses 40 Gauss-Legendre points.
    """
    energy = c12 / (9 * cutoff**9) - c6 / (3 * cutoff**3)
    if not width:
        return energy, energy + (c12 / cutoff**9 - c6 / cutoff**3) / 3
    points, weights = np.polynomial.legendre.leggauss(40)
    t = 0.5 * (points + 1)
    r = cutoff - width + width * t
    taken = t**3 * (10 - 15 * t + 6 * t**2) * (c12 / r**12 - c6 / r**6)
    energy += float(np.sum(0.5 * width * weights * taken * r**2))
    return energy, energy


def tail(
    models: tuple[RigidModel, ...], numbers: Integers, cutoff_angstrom: float, width_angstrom: float
) -> tuple[float, float]:
    """Energy (eV Å³, times the volume) and pressure (times its square) of the dispersion beyond the cutoff, for a uniform liquid.

    2π Σ N_a N_b ∫ ΔU r² dr over all ordered couples of molecules and their sites (Allen and Tildesley (2017), ch. 2); numbers: molecules
    of each model; width_angstrom: of the switch before the cutoff.
    """
    energy = pressure = 0.0
    tables = pair_tables(models)
    for couple, (n, m) in enumerate(product(numbers, numbers)):
        for _, c12, c6 in tables.numbers[tables.starts[couple] : tables.starts[couple + 1]]:
            energy_integral, pressure_integral = _beyond(c12, c6, cutoff_angstrom, width_angstrom)
            energy += 2 * math.pi * n * m * energy_integral
            pressure += 2 * math.pi * n * m * pressure_integral
    return energy, pressure
