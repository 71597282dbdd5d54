"""Reduced elements of a tensor over all |J k⟩: the plain form, from one coupling coefficient at a time."""

from __future__ import annotations

import numpy as np

from rotor.quantum.operators.symmetric_top_elements import coupling


def symmetric_top_elements(j_up: int, j_low: int, components):
    """⟨J'k'‖T^K‖J k⟩ over all k' and k, rising from -J' and -J, (2J'+1, 2J+1): the plain form, for any T^K_q.

    components: T^K_q, q = -K ... K.
    """
    parts = np.asarray(components, dtype=complex)
    rank, k = len(parts) // 2, np.arange(-j_low, j_low + 1)
    out = np.zeros((2 * j_up + 1, 2 * j_low + 1), dtype=complex)
    for q, part in enumerate(parts, -rank):
        reached = np.abs(k + q) <= j_up
        out[k[reached] + q + j_up, k[reached] + j_low] = part * coupling(j_low, j_up, rank, q, k[reached])
    return out
