"""Thermodynamic functions of the rotation about a bond: from the sum over its levels, and from the usual approximations.

Energies count from the minimum of the potential. σ is the symmetry number of the rotation, x = V/kT, u = hν/kT in a well of energy V_i.

| method | Q |
|---|---|
| levels | (1/σ) Σ exp(-E/kT) |
| free rotor | (1/σ) Σ exp(-E/kT), the levels with V = 0 |
| harmonic | (1/σ) Σ_wells exp(-V_i/kT) exp(-u/2)/(1 - exp(-u)) |
| classical | (1/σ)(1/2π) ∫ dα √(πkT/F(α)) exp(-x), from ∫∫ dp dα/h |
| Pitzer-Gwinn | Q_classical · Q_harmonic/Q_classical harmonic, the latter with 1/u in place of the oscillator |
| tanh | Q_harmonic · tanh(Q_classical free/Q_classical harmonic) |

The classical Q is exact for classical motion. Pitzer-Gwinn (K. S. Pitzer and W. D. Gwinn, J. Chem. Phys. 10 (1942) 428, in the form of
the documentation of RMG-Py, "Torsional degrees of freedom") multiplies it by the quantum correction of harmonic wells. The tanh form
interpolates between the harmonic oscillator at low temperature and the free rotor at high temperature. Unverified: it is usually
attributed to D. G. Truhlar, but no source was read; only its two limits are tested.

From ln Q follow U/RT = d ln Q/d ln T, C_v/R = U/RT + d(U/RT)/d ln T and S/R = ln Q + U/RT. Nuclear spins enter through σ only; this is
valid for kT above the splittings between the species.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.quantum.bond_torsion import BondTorsion, FourierSeries
from rotor.table import Table
from rotor.thermodynamics.functions import GAS_CONSTANT

HIGHEST_KT = 40.0  # highest level in kT: exp(-40) = 4e-18
METHODS = ("levels", "free rotor", "harmonic", "classical", "Pitzer-Gwinn", "tanh")


@dataclass(frozen=True, eq=False)
class LogPartition:
    """ln Q and its derivatives at temperatures (n,): u = U/RT and cv = C_v/R."""

    ln_q: Floats
    u: Floats
    cv: Floats

    def times(self, other: LogPartition, sign: float = 1.0) -> LogPartition:
        """The product of two partition functions (sum of logarithms), or with sign -1 their ratio."""
        return LogPartition(self.ln_q + sign * other.ln_q, self.u + sign * other.u, self.cv + sign * other.cv)


@dataclass(frozen=True, eq=False, repr=False)
class HinderedRotorFunctions(Table):
    """Functions by method and temperature; U counts from the minimum of the potential and includes the zero-point energy."""

    method: NDArray[np.str_]
    temperature_k: Floats
    ln_q: Floats
    energy_j_per_mol: Floats
    entropy_j_per_mol_k: Floats
    cv_over_r: Floats

    @property
    def columns(self) -> dict[str, NDArray[np.generic]]:
        """Method, temperature, ln Q, U, S and C_v/R."""
        return {
            "method": self.method,
            "temperature_k": self.temperature_k,
            "ln_q": self.ln_q,
            "energy_j_per_mol": self.energy_j_per_mol,
            "entropy_j_per_mol_k": self.entropy_j_per_mol_k,
            "cv_over_r": self.cv_over_r,
        }

    def for_method(self, name: str) -> HinderedRotorFunctions:
        """The rows of a method."""
        rows = self.method == name
        return HinderedRotorFunctions(**{key: getattr(self, key)[rows] for key in self.__dataclass_fields__})


def hindered_rotor_functions(
    torsion: BondTorsion, temperatures_k: ArrayLike, symmetry_number: int
) -> HinderedRotorFunctions:
    """Functions of a torsion by all methods of METHODS.

    Parameters
    ----------
    torsion : BondTorsion
        F(α) and V(α).
    temperatures_k : (n,) array
        Above 0 K.
    symmetry_number : int
        σ.

    Returns
    -------
    HinderedRotorFunctions
        Rows by method, each at all temperatures; without wells in V, the methods that need harmonic wells are missing.

    Raises
    ------
    ValueError
        For a group so heavy that the sum over levels would not end.

    Notes
    -----
    Formulas and approximations are listed at the head of this module.

    Examples
    --------
    >>> from rotor.quantum.bond_torsion import FourierSeries
    >>> methyl = BondTorsion(FourierSeries(160e3), FourierSeries(0.0), 3)
    >>> functions = hindered_rotor_functions(methyl, [1000.0], 3)
    >>> functions.for_method("levels").cv_over_r.round(6).tolist()  # 1/2 of a free rotor
    [0.5]
    """
    t = np.atleast_1d(np.asarray(temperatures_k, dtype=float))
    kt = t * units.MHZ_PER_K
    free = BondTorsion(torsion.kinetic, FourierSeries(0.0), torsion.fold)
    waves = torsion.waves_for(HIGHEST_KT * float(kt.max()))
    parts = {
        "levels": _level_partition(torsion.all_energies(waves), kt),
        "free rotor": _level_partition(free.all_energies(waves), kt),
        "classical": _classical(torsion, kt),
    }
    wells = torsion.wells()
    if wells and min(well.quantum_mhz for well in wells) > 0:
        energies = np.array([well.energy_mhz for well in wells])
        quanta = np.array([well.quantum_mhz for well in wells])
        harmonic, limit = _harmonic(energies, quanta, kt), _classical_harmonic(energies, quanta, kt)
        parts["harmonic"] = harmonic
        parts["Pitzer-Gwinn"] = parts["classical"].times(harmonic).times(limit, -1.0)
        parts["tanh"] = harmonic.times(_log_tanh(_classical(free, kt).times(limit, -1.0)))
    return _table(t, [(name, parts[name]) for name in METHODS if name in parts], symmetry_number)


def _table(t: Floats, parts: list[tuple[str, LogPartition]], symmetry_number: int) -> HinderedRotorFunctions:
    ln_q = [part.ln_q - np.log(symmetry_number) for _, part in parts]
    return HinderedRotorFunctions(
        np.repeat([name for name, _ in parts], len(t)),
        np.tile(t, len(parts)),
        np.concatenate(ln_q),
        np.concatenate([GAS_CONSTANT * t * part.u for _, part in parts]),
        np.concatenate([GAS_CONSTANT * (ln_z + part.u) for ln_z, (_, part) in zip(ln_q, parts, strict=True)]),
        np.concatenate([part.cv for _, part in parts]),
    )


def _weighted(ln_q: Floats, u: Floats, cv: Floats) -> LogPartition:
    """The sum Q = Σ Q_i from ln Q_i, U_i/RT and C_i/R (temperatures, parts)."""
    highest = ln_q.max(axis=1, keepdims=True)
    weights = np.exp(ln_q - highest)
    total = weights.sum(axis=1)
    p = weights / total[:, None]
    mean = np.sum(p * u, axis=1)
    spread = np.sum(p * (u - mean[:, None]) ** 2, axis=1)
    return LogPartition(highest[:, 0] + np.log(total), mean, np.sum(p * cv, axis=1) + spread)


def _level_partition(energies: Floats, kt: Floats) -> LogPartition:
    """Q of the levels: each is a part with ln Q_i = -x and U_i/RT = x."""
    x = energies[None, :] / kt[:, None]
    return _weighted(-x, x, np.zeros_like(x))


def _classical(torsion: BondTorsion, kt: Floats) -> LogPartition:
    """Classical Q: each angle is a part with √(πkT/F) exp(-x)/samples; the sum converges exponentially for a periodic function."""
    _, f, v = torsion.sampled()
    x = v[None, :] / kt[:, None]
    ln_q = 0.5 * np.log(np.pi * kt[:, None] / f[None, :]) - x - np.log(len(f))
    return _weighted(ln_q, x + 0.5, np.full_like(x, 0.5))


def _harmonic(energies: Floats, quanta: Floats, kt: Floats) -> LogPartition:
    x, u = energies[None, :] / kt[:, None], quanta[None, :] / kt[:, None]
    occupied = np.exp(-u)
    n = occupied / -np.expm1(-u)
    return _weighted(-x - u / 2 - np.log1p(-occupied), x + u * (0.5 + n), u * u * n * (1 + n))


def _classical_harmonic(energies: Floats, quanta: Floats, kt: Floats) -> LogPartition:
    x, u = energies[None, :] / kt[:, None], quanta[None, :] / kt[:, None]
    return _weighted(-x - np.log(u), x + 1.0, np.ones_like(x))


def _log_tanh(ratio: LogPartition) -> LogPartition:
    """ln tanh y and its derivatives: g = d ln y/d ln T, d ln tanh y/d ln T = g h, h = 2y/sinh 2y, dh/d ln T = g h (1 - 2y coth 2y)."""
    double = 2 * np.exp(np.minimum(ratio.ln_q, 5.0))  # tanh is 1 to double precision here; the derivatives vanish too
    g, h = ratio.u, double / np.sinh(double)
    slope = (ratio.cv - ratio.u) * h + g * g * h * (1 - double / np.tanh(double))
    return LogPartition(np.log(np.tanh(double / 2)), g * h, g * h + slope)
