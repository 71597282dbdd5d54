"""Line strengths of every allowed transition between solved levels: pairs of states, frequency, S μ².

S_g(J'τ', J″τ″) = Σ_{M' M″ F} |⟨J'τ'M'|Φ_Fg|J″τ″M″⟩|², summed once over space axes F and all M. With the phases of
conventions.md (Jx ∓ iJy real) the reduced amplitudes are, for g = z, x, y of the representation,

    J → J:    z: K√((2J+1)/(J(J+1)));              x, y: K→K±1  √((2J+1)(J∓K)(J±K+1)/(4J(J+1))) × (x: +, y: ±)
    J → J+1:  z: √((J+1-K)(J+1+K)/(J+1));          x, y: K→K±1  √((J±K+1)(J±K+2)/(4(J+1)))      × (x: ∓, y: +)

(squares and sums of the direction cosines of Cross, Hainer and King, J. Chem. Phys. 12, 210 (1944), table I). The
three dipole components connect different pairs of symmetry species, so they never interfere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.quantum.basis import WangBlock
from rotor.quantum.levels import Levels, SolvedBlock

Floats = NDArray[np.float64]

_AXIS_OF_PRODUCT = {"eo": "a", "oe": "c", "oo": "b"}  # parities of (ΔKa, ΔKc) -> component


class PairOfBlocks(NamedTuple):
    """Two Wang blocks with an allowed transition: `up` has the higher or equal J, `axis` is the dipole's component."""

    up: SolvedBlock
    low: SolvedBlock
    axis: str


def component(species: str, other: str) -> str | None:
    """The dipole component that connects two species of (Ka, Kc) parity, None for equal species."""
    change = "".join("e" if p == q else "o" for p, q in zip(species, other, strict=True))
    return _AXIS_OF_PRODUCT.get(change)


def allowed_pairs(levels: Levels, dipole_abc: tuple[float, float, float]) -> Iterator[PairOfBlocks]:
    """Every pair of blocks that a non-zero dipole component and existing spin weights connect, J rising."""
    wanted = {axis for axis, mu in zip("abc", dipole_abc, strict=True) if mu}
    by_j: dict[int, list[SolvedBlock]] = {}
    for block in levels.blocks:
        if levels.weight[block.start] > 0:
            by_j.setdefault(block.basis.j, []).append(block)

    for j, lows in by_j.items():
        for i, low in enumerate(lows):
            for up in lows[i + 1 :] + by_j.get(j + 1, []):
                axis = component(up.basis.species, low.basis.species)
                if axis in wanted:
                    yield PairOfBlocks(up, low, str(axis))


def _along(j: int, rise: int, k: Floats) -> Floats:
    """Reduced amplitude of Φz from J to J + rise, K → K."""
    if rise:
        return np.sqrt((j + 1 - k) * (j + 1 + k) / (j + 1))
    return k * np.sqrt((2 * j + 1) / (j * (j + 1)))


def _across(j: int, rise: int, k: Floats, step: int) -> Floats:
    """Size of the reduced amplitude of Φx and Φy from J to J + rise, K → K + step."""
    if rise:
        return np.sqrt((j + step * k + 1) * (j + step * k + 2) / (4 * (j + 1)))
    return np.sqrt((2 * j + 1) * (j - step * k) * (j + step * k + 1) / (4 * j * (j + 1)))


def _sign(rise: int, along_x: bool, step: int) -> int:
    if rise:
        return -step if along_x else 1
    return 1 if along_x else step


def _turned(low: SolvedBlock, up: WangBlock, shift: int, amplitude: Callable[[Floats], Floats]) -> Floats:
    """Rows of amplitude(K) × vectors of `low`, moved from K to K + shift and set on the K of `up`."""
    first = (up.first_k - shift - low.basis.first_k) // 2  # row of `low` that lands on row 0 of `up`
    rows = np.arange(max(first, 0), min(low.basis.size, first + up.size))
    out = np.zeros((up.size, low.basis.size))
    k = low.basis.k[rows].astype(float)
    factor = amplitude(k)
    if shift:
        factor = np.where((k == 0) | (k + shift == 0), np.sqrt(2) * factor, factor)
    out[rows - first] = factor[:, None] * low.vectors[rows]
    return out


def amplitudes(pair: PairOfBlocks, axes: str) -> Floats:
    """Reduced amplitudes between all states of two blocks, (n_up, n_low); their squares are the line strengths.

    axes: the principal axes at x, y, z of the representation that the vectors are given in.
    """
    up, low, axis = pair
    j, rise = low.basis.j, up.basis.j - low.basis.j
    if axis == axes[2]:
        moved = _turned(low, up.basis, 0, lambda k: _along(j, rise, k))
    else:
        along_x = axis == axes[0]
        moved = _turned(low, up.basis, 1, lambda k: _sign(rise, along_x, 1) * _across(j, rise, k, 1))
        moved += _turned(low, up.basis, -1, lambda k: _sign(rise, along_x, -1) * _across(j, rise, k, -1))
    return up.vectors.T @ moved
