"""Elements of the dipole between states of different M, from the blocks of a static field along Z.

    ⟨J'k'M'|μ_q|J k M⟩ = c(k) c(M) / √((2J'+1)(2J+1)),      q = M' - M

with c the coefficients of `tensors.coupling`, once in the molecule and once in space. μ_0 = μ_Z, and where M' = M + 1 the squares of
μ_X and of μ_Y are each half of that of μ_1. A field along Z has the same energies for M and -M, and by its reflections the same squares
for (M, M') and (-M, -M'), so that only M, M' ≥ 0 are looked at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.fields.blocks import AxialBlock, FieldBlock
from rotor.quantum.fields.wang_blocks import WangBlockInField
from rotor.quantum.reduced import wang_amplitudes
from rotor.quantum.symmetric_top_elements import coupling
from rotor.quantum.tensors import BodyTensor, body_tensor


class BlockPair(NamedTuple):
    """Places of two blocks between which μ_q acts, q = 0 or 1, and how many pairs with the same elements there are."""

    up: int
    low: int
    q: int
    copies: int


def pairs_of_blocks(blocks: Sequence[FieldBlock]) -> Iterator[BlockPair]:
    """Pairs of blocks with M ≥ 0, M' = M (a block with itself) or M + 1."""
    by_m: dict[float, list[int]] = {}
    for place, block in enumerate(blocks):
        if block.m >= 0:
            by_m.setdefault(block.m, []).append(place)
    for m, lows in by_m.items():
        for low in lows:
            yield BlockPair(low, low, 0, blocks[low].copies if m == 0 else 2)
            for up in by_m.get(m + 1, []):
                if _same_k(blocks[up], blocks[low]):
                    yield BlockPair(up, low, 1, 2)


def _same_k(up: FieldBlock, low: FieldBlock) -> bool:
    """Whether K is the same; at M = 0 the block of K stands for that of -K too."""
    if isinstance(up, AxialBlock) and isinstance(low, AxialBlock):
        return abs(up.k) == abs(low.k) if low.m == 0 else up.k == low.k
    return True


def dipole_elements(up: FieldBlock, low: FieldBlock, dipole_abc: Sequence[float]) -> NDArray[Any]:
    """⟨up|μ_q|low⟩ over the free states of two blocks (n_up, n_low), in D; q = M' - M."""
    if isinstance(up, AxialBlock) and isinstance(low, AxialBlock):
        return _of_axial(up, low if low.k == up.k else replace(low, k=up.k), float(dipole_abc[up.axis]))
    if isinstance(up, WangBlockInField) and isinstance(low, WangBlockInField):
        return _of_wang(up, low, body_tensor(dipole_abc, 1, up.space.representation))
    from rotor.quantum.fields.torsion_fields import TorsionFieldBlock  # with all that internal rotation needs

    if isinstance(low, TorsionFieldBlock):
        raise ValueError(
            "lines in a field are not computed with internal rotation; leave its constants out for those of a rigid top"
        )
    raise ValueError("lines need states with a good M: a field along Z alone, or light along it")


def _in_space(j_up: int, j_low: int, q: int, m: int) -> float:
    """(-1)^(J'-M') (J' 1 J; -M' q M)."""
    return float(coupling(j_low, j_up, 1, q, m)) / math.sqrt((2 * j_up + 1) * (2 * j_low + 1))


def _of_axial(up: AxialBlock, low: AxialBlock, dipole: float) -> Floats:
    out = np.zeros((len(up), len(low)))
    place = {int(j): row for row, j in enumerate(up.j)}
    for column, j in enumerate(low.j.tolist()):
        for above in (j - 1, j, j + 1):
            if above in place:
                in_body = float(coupling(j, above, 1, 0, low.k))
                out[place[above], column] = dipole * in_body * _in_space(above, j, up.m - low.m, low.m)
    return out


def _of_wang(up: WangBlockInField, low: WangBlockInField, tensor: BodyTensor) -> NDArray[Any]:
    space = up.space
    ups, lows = [space.solved[i] for i in up.members], [space.solved[i] for i in low.members]
    rows, columns = (np.cumsum([0, *(one.basis.size for one in side)]) for side in (ups, lows))
    out = np.zeros((rows[-1], columns[-1]), dtype=np.complex128)
    for i, left in enumerate(ups):
        for k, right in enumerate(lows):
            if abs(left.basis.j - right.basis.j) > 1 or tensor.between(left.basis, right.basis) is None:
                continue
            factor = _in_space(left.basis.j, right.basis.j, up.m - low.m, low.m)
            phase = 1j ** (low.colours[k] - up.colours[i] + 1)
            elements = wang_amplitudes(left, right, tensor)
            out[rows[i] : rows[i + 1], columns[k] : columns[k + 1]] = phase * factor * elements
    return out
