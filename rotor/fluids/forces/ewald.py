"""Ewald sum for charges in a rectangular cell: wave vectors, weights, and α and cutoffs for a given accuracy.

E = k_e [ ½ Σ' q q erfc(αr)/r + (2π/V) Σ_k≠0 exp(-k²/4α²)/k² |S(k)|² - α/√π Σ q² - Σ_inside q q erf(αr)/r ], the
surrounding a conductor. M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids, 2nd ed. (2017), ch. 6; errors: J. Kolafa,
J. W. Perram, Mol. Simul. 9, 351 (1992). The cost is proportional to N times the number of wave vectors; for boxes of more than some
thousand molecules an engine with a particle mesh is faster.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Integers

# e²/4πε0: 14.39964...
COULOMB_EV_ANGSTROM = units.ELEMENTARY_CHARGE_C / (4 * math.pi * units.VACUUM_PERMITTIVITY_F_PER_M) * 1e10


@dataclass(frozen=True)
class EwaldParameters:
    """alpha_per_angstrom: width of the split. k_cut_per_angstrom: wave vectors up to this length, 2π included, are summed."""

    alpha_per_angstrom: float
    k_cut_per_angstrom: float

    def __post_init__(self) -> None:
        for name in ("alpha_per_angstrom", "k_cut_per_angstrom"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} = {getattr(self, name)}: expected a number above 0")


def real_space_error(alpha: float, cutoff: float, charges_squared: float, count: int, volume: float) -> float:
    """Rms error of a force (eV/Å) from pairs beyond the cutoff, 2 Q² exp(-α² r_c²)/√(N r_c V), Q² = k_e Σ q².

    alpha: 1/Å. cutoff: r_c, Å. charges_squared: Σ q², e². count: number of charges N. volume: V, Å³.
    """
    q = COULOMB_EV_ANGSTROM * charges_squared
    return 2 * q * math.exp(-((alpha * cutoff) ** 2)) / math.sqrt(count * cutoff * volume)


def fourier_error(alpha: float, k_cut: float, charges_squared: float, count: int, volume: float) -> float:
    """Rms error of a force (eV/Å) from wave vectors beyond k_c, 2 Q² α/L √(1/(π n N)) exp(-k_c²/4α²), n = k_c L/2π, L = ∛V.

    k_cut: k_c, 1/Å; the others as of `real_space_error`.
    """
    q, edge = COULOMB_EV_ANGSTROM * charges_squared, volume ** (1 / 3)
    shells = k_cut * edge / (2 * math.pi)
    return float(2 * q * alpha / edge / math.sqrt(math.pi * shells * count) * math.exp(-(k_cut**2) / (4 * alpha**2)))


def _least(fails: Callable[[float], bool], low: float, high: float) -> float:
    """The point at which a decreasing error reaches its bound, by bisection."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fails(middle) else (low, middle)
    return high


def parameters_for(
    tolerance: float, cutoff_angstrom: float, charges_e: Floats, lengths_angstrom: Floats
) -> EwaldParameters:
    """α and k_cut for which each part of the Ewald sum has the given error.

    Parameters
    ----------
    tolerance : float
        Root mean square error of a force over that between two unit charges 1 Å apart (14.4 eV/Å).
    cutoff_angstrom : float
        Cutoff in real space.
    charges_e : (n,) array
        All charges.
    lengths_angstrom : (3,) array
        Edges of the cell.

    Returns
    -------
    EwaldParameters
        α, k_cut.

    Examples
    --------
    >>> box = np.array([31.0, 31.0, 31.0])
    >>> ewald = parameters_for(1e-5, 9.0, np.tile([-0.8476, 0.4238, 0.4238], 1000), box)
    >>> round(ewald.alpha_per_angstrom, 3), round(ewald.k_cut_per_angstrom, 2)
    (0.332, 1.99)
    """
    if not 1e-14 < tolerance < 1:
        raise ValueError(f"tolerance = {tolerance}: expected a relative error of forces between 1e-14 and 1")
    expected = tolerance * COULOMB_EV_ANGSTROM
    numbers = (float(np.sum(charges_e**2)), len(charges_e), float(np.prod(lengths_angstrom)))
    alpha = _least(lambda a: real_space_error(a, cutoff_angstrom, *numbers) > expected, 1e-3, 7.0 / cutoff_angstrom)
    k_cut = _least(lambda k: fourier_error(alpha, k, *numbers) > expected, 1e-3, 20 * alpha)
    return EwaldParameters(alpha, k_cut)


@dataclass(frozen=True)
class WaveVectors:
    """Half of the wave vectors of a cell, in columns of equal (nx, ny).

    vectors_per_angstrom: (n, 3). weights_ev_angstrom2: 2 k_e (2π/V) exp(-k²/4α²)/k² of each, including the other half.
    columns: (m, 5) nx, ny, lowest nz, highest nz, place of nz = 0. highest: largest |nx|, |ny|. turn: 2π/L.
    """

    vectors_per_angstrom: Floats
    weights_ev: Floats
    columns: Integers
    highest: Integers
    turn_per_angstrom: Floats


def wave_vectors(parameters: EwaldParameters, lengths_angstrom: Floats) -> WaveVectors:
    """All k ≠ 0 up to k_cut in one half space."""
    turn = 2 * np.pi / np.asarray(lengths_angstrom, float)
    k_cut, alpha = parameters.k_cut_per_angstrom, parameters.alpha_per_angstrom
    most = np.floor(k_cut / turn).astype(np.int64)
    columns: list[tuple[int, int, int, int, int]] = []
    numbers: list[Floats] = []
    used = 0
    for nx in range(most[0] + 1):
        for ny in range(-most[1] if nx else 0, most[1] + 1):
            rest = k_cut**2 - (nx * turn[0]) ** 2 - (ny * turn[1]) ** 2
            high = int(math.sqrt(rest) / turn[2]) if rest >= 0 else -1
            low = -high if (nx, ny) != (0, 0) else 1
            if high < low:
                continue
            columns.append((nx, ny, low, high, used - low))
            nz = np.arange(low, high + 1)
            numbers.append(np.stack((np.full_like(nz, nx), np.full_like(nz, ny), nz), axis=1))
            used += len(nz)
    if not columns:
        raise ValueError(f"k_cut = {k_cut:g} per Å holds no wave vector of a cell of {lengths_angstrom} Å")
    vectors = np.concatenate(numbers) * turn
    squares = np.sum(vectors**2, axis=1)
    volume = float(np.prod(lengths_angstrom))
    weights = 4 * np.pi / volume * COULOMB_EV_ANGSTROM * np.exp(-squares / (4 * alpha**2)) / squares
    return WaveVectors(vectors, weights, np.array(columns, dtype=np.int64), most, turn)


def self_energy(alpha_per_angstrom: float, charges_e: Floats) -> float:
    """-k_e α/√π Σ q², eV."""
    return -COULOMB_EV_ANGSTROM * alpha_per_angstrom / math.sqrt(math.pi) * float(np.sum(charges_e**2))


def fourier_virial(waves: WaveVectors, energies_ev: Floats, alpha_per_angstrom: float) -> Floats:
    """Σ F ⊗ r of the sum over wave vectors, all sites moving freely: Σ E_k (δ - 2 k k (1/k² + 1/4α²)), (3, 3), eV."""
    k = waves.vectors_per_angstrom
    factor = 2 * energies_ev * (1 / np.sum(k**2, axis=1) + 1 / (4 * alpha_per_angstrom**2))
    return np.asarray(np.eye(3) * energies_ev.sum() - np.einsum("n,na,nb->ab", factor, k, k))
