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

from rotor.arrays import Floats
from rotor.quantum.fields.axial import AxialSpace
from rotor.quantum.fields.block_states import BlockStates, solve_block
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import MapRequest
from rotor.quantum.fields.solved_space import SolvedSpace


def states_of_both_signs(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> list[BlockStates]:
    """The states of a block; for M = ½ also those of M = -½, which the block represents and μ_1 connects with it."""
    here = solve_block(request, block, fields, jmax)
    if not isinstance(block.space, SolvedSpace) or block.paired or block.twice_m != 1:
        return [here]
    vectors = block.space.reversed_states(block, here.places, here.vectors)
    return [
        here._replace(block=replace(block, copies=1)),
        here._replace(block=replace(block, m=-block.m, copies=1), vectors=vectors),
    ]


def pairs_of_blocks(blocks: Sequence[FieldBlock]) -> Iterator[tuple[int, int, int, int]]:
    """Each block with itself, and those of M and M + 1: places of both, q, and number of pairs with the same elements."""
    by_m: dict[float, list[int]] = {}
    for place, block in enumerate(blocks):
        by_m.setdefault(block.m, []).append(place)
    for m, lows in by_m.items():
        for low in lows:
            paired = blocks[low].paired
            yield low, low, 0, blocks[low].copies
            if m > -1 or paired:
                copies = 2 if paired or m >= 0 else 1
                yield from ((up, low, 1, copies) for up in by_m.get(m + 1, []) if _same_k(blocks[up], blocks[low]))


def _same_k(up: FieldBlock, low: FieldBlock) -> bool:
    """Whether K is the same; at M = 0 the block of K represents that of -K too."""
    if isinstance(low.space, AxialSpace):
        (k_up,), (k_low,) = up.members, low.members
        return abs(k_up) == abs(k_low) if low.m == 0 else k_up == k_low
    return up.paired == low.paired
