"""Raman strengths of all transitions between solved levels: pairs of states and S of the polarizability's anisotropy.

S(i, f) = (3/2) Σ_{M' M p} |⟨f M'|α_2p(space)|i M⟩|²,     Σ_f S(i, f) = (2J+1) γ²,     γ² = (3 Σ α_gh² - (Σ α_gg)²)/2,

the elastic term f = i among them, so that S = (2J+1) b γ² with the coefficients b of G. Placzek and E. Teller, Z. Phys. 81,
209 (1933). With D functions α_2p(space) = Σ_q D²*_pq α_2q(body), and after the sum over M', M and p what is left is

    S = (3/2) |Σ_{k q} c'_{k+q} c_k α_2q √(2J+1) ⟨J k 2 q|J' k+q⟩|²

(R. N. Zare, Angular Momentum, 1988, eq. 3.118 for the integral over three D functions). Body components, with the
phases of conventions.md: α_20 = (2α_zz - α_xx - α_yy)/√6, α_2±1 = ∓α_xz - iα_yz, α_2±2 = (α_xx - α_yy)/2 ± iα_xy.
The diagonal elements and each of α_xy, α_xz, α_yz connect different pairs of symmetry species, so they never interfere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.quantum.basis import REPRESENTATIONS
from rotor.quantum.levels import Levels, SolvedBlock

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Parts = dict[int, float]  # α_2q by q, up to a common phase

ROUND_OFF = 1e-6  # of γ: components of a symmetric top's tensor below it are no more than the rounding of a frame
_MIXED = {"oe": "ab", "oo": "ac", "eo": "bc"}  # parities of (ΔKa, ΔKc) -> element off the diagonal


@dataclass(frozen=True)
class RamanTransitions:
    """Columns (n,): S in Å⁶ over all components, and rows of the two states in the levels, the lower in energy first."""

    strength_angstrom6: Floats
    lower: Ints
    upper: Ints


def anisotropy_squared(polarizability: ArrayLike) -> float:
    """γ² of a polarizability (3, 3), in the square of its unit: (α∥ - α⊥)² of an axial one.

    >>> anisotropy_squared([[3.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    4.0
    """
    tensor = np.asarray(polarizability, dtype=float)
    spread = tensor - np.eye(3) * np.trace(tensor) / 3
    return float(1.5 * np.sum(spread * spread))


def coupling(j: int, k: ArrayLike, q: int, rise: int) -> Floats:
    """√(2J+1) ⟨J k 2 q|J+rise k+q⟩ for an array of k with |k + q| ≤ J + rise, rise = 0, 1 or 2.

    Closed forms of the Clebsch-Gordan coefficients of rank 2 (D. A. Varshalovich, A. N. Moskalev and V. K. Khersonskii,
    Quantum Theory of Angular Momentum, 1988, table 8.4), those of negative q by ⟨J -k 2 -q|J' -k'⟩ = (-1)^rise ⟨J k 2 q|J' k'⟩.

    >>> round(float(coupling(1, 0, 0, 2)) ** 2, 6)  # (3/2) (J+1)(J+2)/(2J+3) of a linear molecule
    1.8
    """
    k = np.asarray(k, dtype=float)
    if q < 0:
        return np.asarray((-1) ** rise * coupling(j, -k, -q, rise))
    if rise == 2:
        return np.asarray(np.sqrt(_two_up(j, k, q) / ((j + 1) * (2 * j + 3) * (j + 2))))
    if j == 0:  # nothing of rank 2 leads from 0 to 0 or 1
        return np.zeros_like(k)
    factor, above = _one_up(j, k, q) if rise == 1 else _level(j, k, q)
    norm = 2 * j * (j + 1) * (j + 2) if rise == 1 else (2 * j - 1) * 2 * j * (j + 1) * (2 * j + 3) / (2 * j + 1)
    return np.asarray(factor * np.sqrt(above / norm))


def _two_up(j: int, k: Floats, q: int) -> Floats:
    if q == 0:
        return 1.5 * (j - k + 1) * (j - k + 2) * (j + k + 1) * (j + k + 2)
    if q == 1:
        return (j - k + 1) * (j + k + 1) * (j + k + 2) * (j + k + 3)
    return 0.25 * (j + k + 1) * (j + k + 2) * (j + k + 3) * (j + k + 4)


def _one_up(j: int, k: Floats, q: int) -> tuple[Floats, Floats]:
    if q == 0:
        return k, 6 * (j - k + 1) * (j + k + 1)
    if q == 1:
        return 2 * k - j, (j + k + 1) * (j + k + 2)
    return np.full_like(k, -1.0), (j - k) * (j + k + 1) * (j + k + 2) * (j + k + 3)


def _level(j: int, k: Floats, q: int) -> tuple[Floats, Floats]:
    if q == 0:
        return 3 * k * k - j * (j + 1), np.full_like(k, 2.0)
    if q == 1:
        return -(2 * k + 1), 3 * (j - k) * (j + k + 1)
    return np.ones_like(k), 3 * (j - k) * (j - k - 1) * (j + k + 1) * (j + k + 2)


def raman_transitions(levels: Levels, polarizability_abc: ArrayLike) -> RamanTransitions:
    """Every pair of different levels that a polarizability (3, 3) along a, b, c in Å³ connects, in no particular order.

    Selection rules: ΔJ = 2 for a linear molecule; ΔJ = 1, 2 and ΔK = 0 for a symmetric top with an axial tensor; ΔJ = 0,
    1, 2 for an asymmetric top, between species of (Ka, Kc) parity that the tensor's elements connect (the same species
    for the diagonal ones); none for a spherical top. Levels must start at J = 0. Raises ValueError for a spherical top
    whose tensor is anisotropic, and for one that is not axial with spin weights by K, which need an axis.
    """
    tensor = np.asarray(polarizability_abc, dtype=float)
    if levels.representation is not None:
        return _joined(list(_of_blocks(levels, tensor)))
    if levels.kind == "spherical":
        if anisotropy_squared(tensor) > (ROUND_OFF * np.trace(tensor)) ** 2:
            raise ValueError("a spherical top's polarizability is isotropic, and this one is not; check the tensor")
        return _joined([])
    if levels.kind == "linear":
        return _linear(levels, tensor)
    return _symmetric(levels, tensor)


def _joined(pieces: list[RamanTransitions]) -> RamanTransitions:
    if not pieces:
        return RamanTransitions(np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
    return RamanTransitions(
        np.concatenate([piece.strength_angstrom6 for piece in pieces]),
        np.concatenate([piece.lower for piece in pieces]),
        np.concatenate([piece.upper for piece in pieces]),
    )


def _ordered(levels: Levels, strength: Floats, first: Ints, second: Ints) -> RamanTransitions:
    """Transitions between levels that exist, with a strength, the one lower in energy first."""
    exists = (strength > 0) & (levels.weight[first] > 0) & (levels.weight[second] > 0)
    strength, first, second = strength[exists], first[exists], second[exists]
    falls = levels.energy_mhz[second] < levels.energy_mhz[first]
    return RamanTransitions(strength, np.where(falls, second, first), np.where(falls, first, second))


# Linear and symmetric tops


def _linear(levels: Levels, tensor: Floats) -> RamanTransitions:
    """S = (3/2) (J+1)(J+2)/(2J+3) Δα² from J to J + 2."""
    anisotropy = tensor[0, 0] - (tensor[1, 1] + tensor[2, 2]) / 2
    first = np.arange(max(len(levels) - 2, 0))
    j = levels.j[first]
    strength = 1.5 * (j + 1) * (j + 2) / (2 * j + 3) * anisotropy**2
    return _ordered(levels, strength, first, first + 2)


def _symmetric(levels: Levels, tensor: Floats) -> RamanTransitions:
    """Strengths by squares of single elements, summed over both signs of K on either side."""
    x, y, z = ("abc".index(axis) for axis in REPRESENTATIONS["Ir" if levels.kind == "prolate" else "IIIr"])
    squares = {
        0: (2 * tensor[z, z] - tensor[x, x] - tensor[y, y]) ** 2 / 6,
        1: tensor[x, z] ** 2 + tensor[y, z] ** 2,
        2: (tensor[x, x] - tensor[y, y]) ** 2 / 4 + tensor[x, y] ** 2,
    }
    least = ROUND_OFF**2 * anisotropy_squared(tensor)
    squares = {q: square for q, square in squares.items() if square > least}
    pieces = [
        _ordered(levels, *_of_step(levels, rise, step, square))
        for q, square in squares.items()
        for step in dict.fromkeys((q, -q))
        for rise in (0, 1, 2)
    ]
    return _summed(levels, _joined(pieces))


def _of_step(levels: Levels, rise: int, step: int, square: float) -> tuple[Floats, Ints, Ints]:
    """Strengths and rows of k → k + step for k = K and k = -K, J → J + rise; each pair of rows from one side alone."""
    strengths, firsts, seconds = [], [], []
    for j in range(levels.jmax + 1 - rise):
        k = np.arange(-j, j + 1)
        k = k[np.abs(k + step) <= j + rise]
        first, second = _row(j, np.abs(k)), _row(j + rise, np.abs(k + step))
        once = second > first
        strengths.append((1.5 * square * coupling(j, k, step, rise) ** 2)[once])
        firsts.append(first[once])
        seconds.append(second[once])
    return np.concatenate(strengths), np.concatenate(firsts), np.concatenate(seconds)


def _row(j: int, k: Ints) -> Ints:
    return np.asarray(j * (j + 1) // 2 + k)


def _summed(levels: Levels, found: RamanTransitions) -> RamanTransitions:
    """One line for every pair of rows."""
    keys, place = np.unique(found.lower * len(levels) + found.upper, return_inverse=True)
    strength: Floats = np.zeros(len(keys))
    np.add.at(strength, place, found.strength_angstrom6)
    return RamanTransitions(strength, keys // len(levels), keys % len(levels))


# Asymmetric tops


def parts_of(tensor: Floats, species: str, other: str, axes: str) -> Parts:
    """The α_2q, up to a common phase, of the elements that connect two species; empty where they are 0.

    axes: the principal axes at x, y, z of the representation.
    """
    change = "".join("e" if p == q else "o" for p, q in zip(species, other, strict=True))
    x, y, z = ("abc".index(axis) for axis in axes)
    if change == "ee":
        along = (2 * tensor[z, z] - tensor[x, x] - tensor[y, y]) / np.sqrt(6)
        across = (tensor[x, x] - tensor[y, y]) / 2
        return {q: float(value) for q, value in ((0, along), (2, across), (-2, across)) if value}
    first, second = ("abc".index(axis) for axis in _MIXED[change])
    value = float(tensor[first, second])
    if not value:
        return {}
    if {first, second} == {x, y}:
        return {2: value, -2: -value}
    return {1: -value, -1: value} if {first, second} == {x, z} else {1: value, -1: value}


def amplitudes(up: SolvedBlock, low: SolvedBlock, parts: Parts) -> Floats:
    """√(2J+1) Σ c' c α_2q ⟨J k 2 q|J' k+q⟩ between all states of two blocks, (n_up, n_low); S = 3/2 of its square.

    |K s⟩ = n_K (|K⟩ + s|-K⟩), n_0 = 1/2, else 1/√2; a function of the upper block has √2 of its coefficient at K > 0.
    """
    j, rise = low.basis.j, up.basis.j - low.basis.j
    own = np.where(low.basis.k == 0, 0.5, np.sqrt(0.5))
    between = np.zeros((up.basis.size, low.basis.size))
    for side in (1, -1):
        for q, value in parts.items():
            target = side * low.basis.k + q
            place = (target - up.basis.first_k) // 2
            column = np.flatnonzero((target >= 0) & (place >= 0) & (place < up.basis.size))
            other = np.where(target[column] == 0, 1.0, np.sqrt(2.0))
            sign = low.basis.sign if side < 0 else 1
            factor = coupling(j, side * low.basis.k[column], q, rise)
            between[place[column], column] += sign * value * own[column] * other * factor
    return np.asarray(up.vectors.T @ between @ low.vectors)


def _of_blocks(levels: Levels, tensor: Floats) -> Iterator[RamanTransitions]:
    axes = REPRESENTATIONS[str(levels.representation)]
    by_j: dict[int, list[SolvedBlock]] = {}
    for block in levels.blocks:
        by_j.setdefault(block.basis.j, []).append(block)
    for j, lows in by_j.items():
        for i, low in enumerate(lows):
            for up in (*lows[i:], *by_j.get(j + 1, []), *by_j.get(j + 2, [])):
                parts = parts_of(tensor, up.basis.species, low.basis.species, axes)
                if parts:
                    yield _between(levels, up, low, 1.5 * amplitudes(up, low, parts) ** 2)


def _between(levels: Levels, up: SolvedBlock, low: SolvedBlock, strength: Floats) -> RamanTransitions:
    """All transitions between two blocks; of a block with itself each pair once, and no state with itself."""
    wanted = np.tril(np.ones_like(strength, dtype=bool), -1) if up is low else np.ones_like(strength, dtype=bool)
    i, k = np.nonzero(wanted)
    return _ordered(levels, strength[i, k], k + low.start, i + up.start)
