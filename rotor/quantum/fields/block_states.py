"""The lowest states of blocks of a map at several fields, in the smallest sufficient basis of free states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import MapRequest, terms_over
from rotor.quantum.fields.solver import DENSE, Matrix, Terms, solve_fields, solve_together
from rotor.quantum.fields.truncation import left_out_mhz

FIRST_BASIS = 64
PART_OF_TOLERANCE = 0.1  # share of the tolerance for states below J max that a basis leaves out


class BlockStates(NamedTuple):
    """The lowest states of one block.

    rows: free levels (states,) that label them. energies: (fields, states), MHz. places: (n,) functions of the block that form the basis of
    the vectors (fields, n, states). error: bound of the truncation error of each energy (fields, states), MHz.
    """

    block: FieldBlock
    rows: Ints
    energies: Floats
    places: Ints
    vectors: Matrix
    error: Floats

    @property
    def j(self) -> Ints:
        """J of the free levels (states,)."""
        return self.block.levels.j[self.rows]


def basis_order(block: FieldBlock, jmax: int) -> Ints:
    """Places of the states up to J max, in order of their free energies."""
    order = block.free_order
    return order[block.j[order] <= jmax]


def count_of(request: MapRequest, block: FieldBlock, order: Ints) -> int:
    """Number of states to solve: those that contain all levels of the map, and for diabatic labels as many above as they may cross."""
    count = int(np.flatnonzero(block.j[order] <= request.j_highest)[-1]) + 1
    return count if request.diabatic_gap_mhz is None else min(len(order), count + count // 2 + 4)


def solve_blocks(
    request: MapRequest, blocks: Sequence[tuple[FieldBlock, Terms]], fields: Floats, jmax: int
) -> list[BlockStates]:
    """The states that a map follows in blocks of the space of `jmax + request.margin`; the bound of truncation is added to the solver's."""
    orders = [basis_order(block, jmax) for block, _ in blocks]
    counts = [count_of(request, block, order) for (block, _), order in zip(blocks, orders, strict=True)]
    bases = [
        enough_states(terms, order, count, fields, request.tolerance_mhz)
        for (_, terms), order, count in zip(blocks, orders, counts, strict=True)
    ]
    if len(blocks) == len(fields) == 1 and bases[0][1] is not None:
        solved = [bases[0][1]]
    else:
        parts = [terms_over(terms, places) for (_, terms), (places, _) in zip(blocks, bases, strict=True)]
        solved = solve_together(list(zip(parts, counts, strict=True)), fields, request.tolerance_mhz)
    out = []
    for (block, terms), order, (places, _), states in zip(blocks, orders, bases, solved, strict=True):
        energies, vectors, error = states
        bound = error + left_out_mhz(terms, places, energies, vectors, fields)
        out.append(BlockStates(block, block.rows[order[: energies.shape[1]]], energies, places, vectors, bound))
    return out


def solve_block(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> BlockStates:
    """`solve_blocks` of one block."""
    return solve_blocks(request, [(block, request.matrices(block))], fields, jmax)[0]


def enough_states(
    terms: Terms, order: Ints, count: int, fields: Floats, tolerance_mhz: float
) -> tuple[Ints, tuple[Floats, Matrix, Floats] | None]:
    """The lowest free states, in rising places, that suffice as a basis at the strongest field, and their solution there if it was solved.

    order: states of the basis by energy. Further states of it may change an energy by a tenth of the tolerance.
    """
    size, rising = max(FIRST_BASIS, 2 * count), np.sort(order)
    if len(order) <= max(size, 2 * DENSE):
        return rising, None
    strongest = fields[np.argmax(np.abs(fields))][None]
    whole = terms_over(terms, rising)
    while size < len(order):
        places = np.searchsorted(rising, np.sort(order[:size]))
        states = solve_fields(terms_over(whole, places), strongest, count)
        if left_out_mhz(whole, places, *states[:2], strongest).max() <= PART_OF_TOLERANCE * tolerance_mhz:
            return rising[places], states
        size = int(1.4 * size) + 1
    return rising, None
