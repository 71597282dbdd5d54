"""One threefold top that turns: H = F (p - ρK)² + V(α) in free-rotor functions, and its operators.

With V(α) = Σ_n ½ V_n (1 - cos nα), n = 3, 6, 9, and exp(i m α)/√2π, m = 3k + σ of the species σ,

    ⟨m|H|m⟩ = F (m - ρK)² + Σ ½ V_n,        ⟨m + n|H|m⟩ = -¼ V_n,

(C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841, as the reviews that were read cite it; derived here). ρK is the share of the
rotation of the whole molecule; without it (K = 0) this is the torsion alone. E(K, σ) is periodic: ρK → ρK + 3 changes nothing.

Operators for the operator algebra act on the labels k.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.operators.algebra import Operator, diagonal, shift


def torsional_states(
    f_mhz: float, barriers: Mapping[int, float], shifts: Floats, species: int, waves: int
) -> tuple[Floats, Floats]:
    """Energies (points, n), rising, above the foot of V, and vectors (points, k, n) at ρK = `shifts`.

    barriers: V_n in MHz by n. waves: k runs from -waves to waves. Raises ValueError for F not above 0.

    >>> energies, _ = torsional_states(1.0, {3: 100.0}, np.zeros(1), 0, 12)
    >>> round(float(energies[0, 0]), 2)  # 3/2 √(V3 F) - 9F/16 = 14.44 to second order of the oscillator
    14.41
    """
    if not f_mhz > 0:
        raise ValueError(f"F = {f_mhz:g} MHz: expected a number above 0")
    m = 3 * np.arange(-waves, waves + 1) + species
    matrix = np.eye(len(m)) * (0.5 * sum(barriers.values()))
    for n, value in barriers.items():
        beside = np.full(len(m) - n // 3, -0.25 * value)
        matrix += np.diag(beside, -(n // 3)) + np.diag(beside, n // 3)
    hamiltonian = np.repeat(matrix[None], len(shifts), axis=0)
    places = np.arange(len(m))
    hamiltonian[:, places, places] += f_mhz * (m - shifts[:, None]) ** 2
    energies, vectors = np.linalg.eigh(hamiltonian)
    return energies, vectors


@cache  # the same object each time: sums of terms are merged by their operator of the torsion
def p_alpha(sigma: int, power: int = 1) -> Operator:
    """p^r = (-i d/dα)^r, m^r on exp(i m α)."""
    return diagonal(lambda labels: (3 * labels["k"] + float(sigma)) ** power)


@cache
def cosine(multiple: int) -> Operator:
    """cos 3sα for s = `multiple`: half of each shift of k by ±s."""
    return 0.5 * (_step(multiple) + _step(-multiple))


@cache
def sine(multiple: int) -> Operator:
    """sin 3sα = (exp(3isα) - exp(-3isα))/2i."""
    return -0.5j * (_step(multiple) - _step(-multiple))


def _step(multiple: int) -> Operator:
    return shift(lambda labels: 1.0, k=multiple)
