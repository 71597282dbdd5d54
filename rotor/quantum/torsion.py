"""One angle that turns: H = F (p - ρK)² + V(α) in free-rotor functions.

With V(α) = Σ_n ½ V_n (1 - cos nα) + Σ_n ½ W_n sin nα and exp(i m α)/√2π, m = s k + σ, where s divides every n (the fold of the potential)
and σ = 0 ... s - 1 is the species,

    ⟨m|H|m⟩ = F (m - ρK)² + Σ ½ V_n,        ⟨m + n|H|m⟩ = -¼ V_n - ¼ i W_n,

(C. C. Lin and J. D. Swalen, Rev. Mod. Phys. 31 (1959) 841, as the reviews that were read cite it; derived here). ρK is the share of the
rotation of the whole molecule; without it (K = 0) this is the torsion alone. E(K, σ) is periodic: ρK → ρK + s changes nothing.

Operators of α for the operator algebra count the labels k from the species σ of a threefold top, m = 3k + σ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.operators.algebra import Operator, diagonal, shift

WAVES = 12  # |k| of the free-rotor functions: m up to 36 for a threefold top, exact to 1e-12 of a barrier of 1000 F below v_t = 4


@dataclass(frozen=True)
class TorsionalPotential:
    """V(α) = Σ ½ V_n (1 - cos nα) + Σ ½ W_n sin nα; cosines and sines in MHz by n.

    >>> TorsionalPotential({3: 12.0}).values([0.0, np.pi / 3]).round(9).tolist()  # the foot and the top of a threefold barrier
    [0.0, 12.0]
    """

    cosines: Mapping[int, float] = field(default_factory=dict)
    sines: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for n in (*self.cosines, *self.sines):
            if n < 1:
                raise ValueError(f"torsional potential: V_{n}: the terms are counted from n = 1")

    @property
    def fold(self) -> int:
        """The largest s that divides every n with a coefficient: the potential repeats s times in a turn; 1 without any."""
        orders = [n for table in (self.cosines, self.sines) for n, value in table.items() if value]
        return int(np.gcd.reduce(orders)) if orders else 1

    def values(self, angle: ArrayLike) -> Floats:
        """V at angles in radians."""
        alpha = np.asarray(angle, dtype=float)
        even = sum((0.5 * v * (1 - np.cos(n * alpha)) for n, v in self.cosines.items()), np.zeros(alpha.shape))
        return np.asarray(
            even + sum((0.5 * w * np.sin(n * alpha) for n, w in self.sines.items()), np.zeros(alpha.shape))
        )


@dataclass(frozen=True, eq=False)
class TorsionalStates:
    """States of one angle for several ρK: energies (points, n), rising, and vectors (points, functions, n) over exp(i m α)/√2π."""

    m: Ints
    energies: Floats
    vectors: NDArray[Any]

    def functions(self, angle: ArrayLike, point: int = 0) -> NDArray[Any]:
        """Wave functions (angles, n) at angles in radians, of the states at one ρK."""
        waves = np.exp(1j * np.outer(np.asarray(angle, dtype=float), self.m)) / np.sqrt(2 * np.pi)
        return np.asarray(waves @ self.vectors[point])


def torsional_states(
    f_mhz: float,
    potential: TorsionalPotential,
    *,
    shifts: ArrayLike = (0.0,),
    species: int = 0,
    fold: int | None = None,
    waves: int = WAVES,
    count: int | None = None,
) -> TorsionalStates:
    """Energies, above the foot of the cosine series, and states of F (p - ρK)² + V(α) at ρK = `shifts`.

    species: σ of m = s k + σ, k from -waves to waves. fold: s; by default that of the potential. A divisor of it mixes its species: 1 gives
    the states of all together. count: how many of the lowest states; all by default. Vectors are real where the potential is even. Raises
    ValueError for F not above 0, and a fold that does not divide the terms of the potential.

    >>> free = torsional_states(150.0, TorsionalPotential(), count=3)  # F m²
    >>> free.energies[0].tolist()
    [0.0, 150.0, 150.0]
    >>> hindered = torsional_states(1.0, TorsionalPotential({3: 100.0}), count=1)
    >>> round(float(hindered.energies[0, 0]), 2)  # 3/2 √(V3 F) - 9F/16 = 14.44 to second order of the oscillator
    14.41
    """
    if not f_mhz > 0:
        raise ValueError(f"F = {f_mhz:g} MHz: expected a number above 0")
    step = potential.fold if fold is None else fold
    m = step * np.arange(-waves, waves + 1) + species
    rho_k = np.atleast_1d(np.asarray(shifts, dtype=float))
    matrix = _potential_matrix(potential, step, len(m))
    hamiltonian = np.repeat(matrix[None], len(rho_k), axis=0)
    diagonal = np.arange(len(m))
    hamiltonian[:, diagonal, diagonal] += f_mhz * (m - rho_k[:, None]) ** 2
    energies, vectors = np.linalg.eigh(hamiltonian)
    return TorsionalStates(m, energies[:, :count], vectors[:, :, :count])


def _potential_matrix(potential: TorsionalPotential, fold: int, size: int) -> NDArray[Any]:
    """V in exp(i m α), every m = fold k + σ."""
    sines = {n: w for n, w in potential.sines.items() if w}
    matrix = np.zeros((size, size), dtype=complex if sines else float)
    for table, factor in ((potential.cosines, -0.25), (sines, -0.25j)):
        for n, value in table.items():
            if not value:
                continue
            if n % fold:
                raise ValueError(f"torsional potential: V_{n} is not {fold}-fold; use a fold that divides {n}")
            beside = np.full(max(size - n // fold, 0), factor * value)
            matrix += np.diag(beside, -(n // fold)) + np.diag(beside.conj(), n // fold)
    matrix += np.eye(size) * sum(0.5 * value for value in potential.cosines.values())
    return matrix


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
