"""Elements of the dipole between states of different M, from the blocks of a static field.

    ⟨F'τ'M'|μ_q|F τ M⟩ = (-1)^(F'-M') (F' 1 F; -M' q M) ⟨F'τ'‖μ‖F τ⟩,      q = M' - M.

μ_0 = μ_Z; for M' = M + 1 the squares of μ_X and of μ_Y are each half of that of μ_1. A field along Z has the same energies for M and -M,
and by reflection the same squares for (M, M') and (-M, -M'). Only M, M' ≥ 0 are therefore computed, and -½ to ½ for half-integers; states
that are paired with their mirror images have both signs of M in the map. States of mixed M have elements of μ_X, μ_Y and μ_Z between any
two blocks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from rotor.arrays import Floats
from rotor.quantum.fields.axial import AxialBlock
from rotor.quantum.fields.block_states import BlockStates, solve_block
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import MapRequest
from rotor.quantum.fields.solved_space import SolvedFieldBlock


class BlockPair(NamedTuple):
    """Places of two blocks between which μ_q acts, q = 0 or 1; copies: number of pairs with the same elements."""

    up: int
    low: int
    q: int
    copies: int


def states_of_both_signs(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> list[BlockStates]:
    """The states of a block; for M = ½ also those of M = -½, which the block represents and μ_1 connects with it."""
    here = solve_block(request, block, fields, jmax)
    if not isinstance(block, SolvedFieldBlock) or block.paired or block.twice_m != 1:
        return [here]
    signs = block.signs[here.places][:, None]
    minus = replace(block, m=-block.m, copies=1)
    return [
        here._replace(block=replace(block, copies=1)),
        here._replace(block=minus, vectors=signs * here.vectors.conj()),
    ]


def pairs_of_blocks(blocks: Sequence[FieldBlock]) -> Iterator[BlockPair]:
    """Each block with itself, and those of M and M + 1."""
    by_m: dict[float, list[int]] = {}
    for place, block in enumerate(blocks):
        by_m.setdefault(block.m, []).append(place)
    for m, lows in by_m.items():
        for low in lows:
            paired = _is_paired(blocks[low])
            yield BlockPair(low, low, 0, blocks[low].copies)
            if m > -1 or paired:
                copies = 2 if paired or m >= 0 else 1
                yield from (
                    BlockPair(up, low, 1, copies) for up in by_m.get(m + 1, []) if _same_k(blocks[up], blocks[low])
                )


def _is_paired(block: FieldBlock) -> bool:
    """Whether the states of a block represent their mirror images too."""
    return isinstance(block, SolvedFieldBlock) and block.paired


def _same_k(up: FieldBlock, low: FieldBlock) -> bool:
    """Whether K is the same; at M = 0 the block of K represents that of -K too."""
    if isinstance(up, AxialBlock) and isinstance(low, AxialBlock):
        return abs(up.k) == abs(low.k) if low.m == 0 else up.k == low.k
    return _is_paired(up) == _is_paired(low)
