"""Line strengths of every allowed transition between solved levels: pairs of states, frequency, S μ².

S_g(J'τ', J″τ″) = Σ_{M' M″ F} |⟨J'τ'M'|Φ_Fg|J″τ″M″⟩|², summed once over space axes F and all M. With the phases of
conventions.md (Jx ∓ iJy real) the reduced amplitudes are, for g = z, x, y of the representation,

    J → J:    z: K√((2J+1)/(J(J+1)));              x, y: K→K±1  √((2J+1)(J∓K)(J±K+1)/(4J(J+1))) × (x: +, y: ±)
    J → J+1:  z: √((J+1-K)(J+1+K)/(J+1));          x, y: K→K±1  √((J±K+1)(J±K+2)/(4(J+1)))      × (x: ∓, y: +)

(squares and sums of the direction cosines of Cross, Hainer and King, J. Chem. Phys. 12, 210 (1944), table I). The
three dipole components connect different pairs of symmetry species, so they never interfere.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.basis import WangBlock
from rotor.quantum.levels import Levels, SolvedBlock

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


@lru_cache(maxsize=16)
def _along(j: int, rise: int) -> Floats:
    """Reduced amplitude of Φz from J to J + rise, K → K, for K = 0 ... J."""
    k = np.arange(j + 1.0)
    if rise:
        return np.asarray(np.sqrt((j + 1 - k) * (j + 1 + k) / (j + 1)))
    return np.asarray(k * np.sqrt((2 * j + 1) / (j * (j + 1))))


@lru_cache(maxsize=16)  # the pairs of blocks come J by J
def _across(j: int, rise: int, step: int) -> Floats:
    """Reduced amplitude of Φy from J to J + rise, K → K + step, for K = 0 ... J in the Wang basis (√2 where a K is 0)."""
    k = np.arange(j + 1.0)
    up, half = step * k, np.where((k == 0) | (k + step == 0), 0.5, 0.25)
    if rise:
        return np.sqrt((j + up + 1) * (j + up + 2) * (half / (j + 1)))
    return step * np.sqrt((j - up) * (j + up + 1) * (half * (2 * j + 1) / (j * (j + 1))))


def _x_over_y(rise: int, step: int) -> int:
    """Sign of the amplitude of Φx where that of Φy is as `_across` has it."""
    return -step if rise else step


def _shifted(low: SolvedBlock, up: WangBlock, step: int) -> tuple[slice, slice]:
    """Which K of `low` land on which K of `up` when K changes by `step`."""
    first = (up.first_k - step - low.basis.first_k) // 2  # place in `low` that lands on place 0 of `up`
    start, stop = max(first, 0), min(low.basis.size, first + up.size)
    return slice(start, stop), slice(start - first, stop - first)


def amplitudes(pair: PairOfBlocks, axes: str) -> Floats:
    """Reduced amplitudes between all states of two blocks, (n_up, n_low); their squares are the line strengths.

    axes: the principal axes at x, y, z of the representation that the vectors are given in.
    """
    up, low, axis = pair
    j, rise = low.basis.j, up.basis.j - low.basis.j
    states = low.vectors.T
    moved = np.zeros((low.basis.size, up.basis.size))
    for step in (0,) if axis == axes[2] else (1, -1):
        source, target = _shifted(low, up.basis, step)
        table = _across(j, rise, step) if step else _along(j, rise)
        amplitude = table[low.basis.first_k :: 2][source]
        if step and axis == axes[0]:
            amplitude = _x_over_y(rise, step) * amplitude
        moved[:, target] += states[:, source] * amplitude
    return np.asarray(up.vectors.T @ moved.T)
