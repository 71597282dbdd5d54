"""Elements of the dipole between states in a field that have spins, and between states of mixed M.

With spins, ⟨F'τ'M'|μ_q|F τ M⟩ = (-1)^(F'-M') (F' 1 F; -M' q M) ⟨F'τ'‖μ‖F τ⟩ (R. N. Zare, Angular Momentum, 1988, eq. 5.14), q = M' - M.
Every M_F is a block of its own here, M and -M apart: of half-integer M_F, -½ and ½ are connected too. States of mixed M have the
elements of μ_X, μ_Y and μ_Z between any two blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.fields.block_states import BlockStates, block_states
from rotor.quantum.fields.blocks import Contraction, FieldBlock
from rotor.quantum.fields.map_request import MapRequest
from rotor.quantum.fields.spin_fields import SpinFieldBlock, axial_k_of
from rotor.quantum.fields.tilted_blocks import TiltedBlock
from rotor.quantum.fields.transitions import BlockPair
from rotor.quantum.wigner import three_j

Z = (0.0, 0.0, 1.0)


def signed_states(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> list[BlockStates]:
    """The states of a block, and of that of -M where the block stands for both."""
    here = block_states(request, block, fields, jmax)
    if not isinstance(block, SpinFieldBlock) or not block.twice_m or axial_k_of(block):
        return [here]  # K and -K of one M are alike, and (K, -M) is a block of the map itself
    own = [replace(block, m=sign * block.m, twice_m=sign * block.twice_m, copies=1) for sign in (1, -1)]
    return [here._replace(block=own[0]), block_states(request, own[1], fields, jmax)]


def pairs_with_spins(blocks: Sequence[FieldBlock]) -> list[BlockPair]:
    """Each block with itself, and those of M_F and M_F + 1 with one K."""
    known = [one for one in blocks if isinstance(one, SpinFieldBlock)]
    out = [BlockPair(place, place, 0, one.copies) for place, one in enumerate(known)]
    for low, one in enumerate(known):
        for up, other in enumerate(known):
            if other.twice_m == one.twice_m + 2 and axial_k_of(other) == axial_k_of(one):
                out.append(BlockPair(up, low, 1, one.copies))
    return out


def elements_with_spins(up: SpinFieldBlock, low: SpinFieldBlock, dipole_abc: Sequence[float]) -> NDArray[Any]:
    """⟨up|μ_q|low⟩ (n_up, n_low) in D, q = M' - M."""
    space, reduced = up.space, up.space.reduced(Contraction(dipole_abc, Z))
    sides = [[(i, space.solved[i]) for i in block.members] for block in (up, low)]
    rows, columns = (np.cumsum([0, *(len(one.energies_mhz) for _, one in side)]) for side in sides)
    out, q = np.zeros((rows[-1], columns[-1]), dtype=np.complex128), (up.twice_m - low.twice_m) // 2
    for a, (i, left) in enumerate(sides[0]):
        for b, (k, right) in enumerate(sides[1]):
            direct = (-left.twice_f, -i) <= (-right.twice_f, -k)  # reduced elements are those of the higher F
            high, under = (left, right) if direct else (right, left)
            m_high, m_under = (up.twice_m, low.twice_m) if direct else (low.twice_m, up.twice_m)
            factor = _in_space(high.twice_f, under.twice_f, m_high, m_under)
            found = reduced(high, under) if factor else None
            if found is None:
                continue
            elements = factor * found if direct else (-1) ** q * factor * found.conj().T
            out[rows[a] : rows[a + 1], columns[b] : columns[b + 1]] = elements
    return out


def _in_space(twice_up: int, twice_low: int, twice_m_up: int, twice_m_low: int) -> float:
    """(-1)^(F'-M') (F' 1 F; -M' q M) of doubled numbers, 0 where a rule forbids it."""
    if (
        abs(twice_up - twice_low) > 2
        or twice_up + twice_low < 2
        or abs(twice_m_up) > twice_up
        or abs(twice_m_low) > twice_low
    ):
        return 0.0
    q = (twice_m_up - twice_m_low) / 2
    symbol = float(three_j(twice_up / 2, 1, twice_low / 2, -twice_m_up / 2, q, twice_m_low / 2))
    return -symbol if (twice_up - twice_m_up) // 2 % 2 else symbol


def elements_of_mixed(up: TiltedBlock, low: TiltedBlock, dipole_abc: Sequence[float]) -> list[Floats]:
    """⟨up|μ_X|low⟩, ⟨up|μ_Y|low⟩ and ⟨up|μ_Z|low⟩ (n_up, n_low) in D, real in the phases of `rotor.quantum.fields.tilted_blocks`."""
    space = up.space
    starts = [np.cumsum([0, *(space.size(pair) for pair in block.members)]) for block in (up, low)]
    place = [
        {pair: int(edges[n]) for n, pair in enumerate(block.members)}
        for block, edges in zip((up, low), starts, strict=True)
    ]
    members = dict.fromkeys((*up.members, *low.members), 0)
    out = []
    for axis in np.eye(3):
        matrix = np.zeros((len(up), len(low)))
        for one, other, elements in space.elements(Contraction(dipole_abc, axis), members):
            sides = [(one, other, elements)] if one == other else [(one, other, elements), (other, one, elements.T)]
            for left, right, values in sides:
                if left in place[0] and right in place[1]:
                    row, column = place[0][left], place[1][right]
                    matrix[row : row + values.shape[0], column : column + values.shape[1]] = values
        out.append(matrix)
    return out
