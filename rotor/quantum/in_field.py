"""What a field does to solved states: one factor for each pair of angular momenta and M, the phases that make a block real.

An operator T^K of rank K between solved states |F τ M⟩ is (R. N. Zare, Angular Momentum, 1988, eq. 5.14)

    ⟨F'τ'M'|T^K_q|F τ M⟩ = (-1)^(F'-M') (F' K F; -M' q M) ⟨F'τ'‖T^K‖F τ⟩,      q = M' - M,

whatever was contracted into τ: rotation, states, spins, torsion. In a static field along Z, H = E + Σ x^n O_n with q = 0.

Phases. Between real functions (`rotor.quantum.tensors`) reduced elements of odd rank are i times real. States of a sector times 1 or i make
all matrices real where such operators lead to the other factor and all others to the same one. From -M to M, with real elements R and
colours c of the sectors,

    v(-M) = (-1)^(F + c) v(M)*,

since (F' K F; M 0 -M) = (-1)^(F' + F + K) (F' K F; -M 0 M) and the elements of odd rank change sign when they are conjugated.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rotor.arrays import Floats
from rotor.quantum.symmetric_top_elements import coupling


def space_factor(twice_up: int, twice_low: int, rank: int, twice_m: int, q: int = 0) -> float:
    """(-1)^(F'-M') (F' K F; -M' q M) of doubled F', F and M, M' = M + q; 0 where a rule forbids it.

    >>> round(space_factor(2, 0, 1, 0), 6)  # 1/√3
    0.57735
    """
    if abs(twice_m) > twice_low or abs(twice_m + 2 * q) > twice_up:
        return 0.0
    return float(_factors(twice_up, twice_low, rank, q)[(twice_low + twice_m) // 2])


@lru_cache(maxsize=8192)
def _factors(twice_up: int, twice_low: int, rank: int, q: int) -> Floats:
    """Of M = -F ... F."""
    m = np.arange(-twice_low, twice_low + 1, 2) / 2
    j_up, j_low = (twice // 2 if twice % 2 == 0 else twice / 2 for twice in (twice_up, twice_low))
    return np.asarray(coupling(j_low, j_up, rank, q, m) / np.sqrt((twice_up + 1.0) * (twice_low + 1)))
