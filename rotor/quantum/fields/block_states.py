"""The lowest states of one block of a map at several fields, in a basis of the free states that is just large enough."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import BlockProblem, MapRequest
from rotor.quantum.fields.solver import DENSE, Matrix, solve_fields

FIRST_BASIS = 64


class BlockStates(NamedTuple):
    """The lowest states of one block: free rows (states,) that name them, energies (fields, states), vectors (fields, n, states).

    places: (n,) of the functions of the block over which the vectors are.
    """

    block: FieldBlock
    rows: Ints
    energies: Floats
    places: Ints
    vectors: Matrix


def followed(block: FieldBlock, j_highest: int) -> int:
    """How many of the lowest states of a block hold all free levels up to J = `j_highest`."""
    order = block.free_order
    return int(np.flatnonzero(block.j[order] <= j_highest)[-1]) + 1


def count_of(request: MapRequest, block: FieldBlock) -> int:
    """States to be solved: those followed, and where labels are diabatic as many above as they may cross."""
    count = followed(block, request.j_highest)
    return count if request.diabatic_gap_mhz is None else min(len(block), count + count // 2 + 4)


def block_states(request: MapRequest, block: FieldBlock, fields: Floats, with_vectors: bool = True) -> BlockStates:
    """The states of a block that a map follows, at several fields.

    Parameters
    ----------
    request : MapRequest
        What is solved.
    block : FieldBlock
        One of its blocks.
    fields : (f,) array
        In the unit of the request.
    with_vectors : bool, optional
        False leaves the eigenvectors out where energies can be found without them.

    Returns
    -------
    BlockStates
        Energies (f, states) in MHz, and the states that they belong to.
    """
    return states_of(request, block, request.problem(block), fields, with_vectors)


def states_of(
    request: MapRequest, block: FieldBlock, problem: BlockProblem, fields: Floats, with_vectors: bool
) -> BlockStates:
    """The same, the matrices of the block being known.

    Parameters
    ----------
    request : MapRequest
        What is solved.
    block : FieldBlock
        One of its blocks.
    problem : BlockProblem
        Its matrices.
    fields : (f,) array
        In the unit of the request.
    with_vectors : bool
        False leaves the eigenvectors out where energies can be found without them.

    Returns
    -------
    BlockStates
        Energies (f, states) in MHz, and the states that they belong to.
    """
    count, order = count_of(request, block), block.free_order
    places = enough_states(problem, order, count, fields, request.tolerance_mhz)
    energies, vectors = solve_fields(problem.terms(places), fields, count, with_vectors, request.tolerance_mhz)
    return BlockStates(block, block.rows[order[:count]], energies, places, vectors)


def enough_states(problem: BlockProblem, order: Ints, count: int, fields: Floats, tolerance_mhz: float) -> Ints:
    """Of the free states the lowest that are enough at the strongest field, found by doubling.

    Parameters
    ----------
    problem : BlockProblem
        Matrices of the block.
    order : (n,) array
        Its states by energy.
    count : int
        How many of the lowest are asked for.
    fields : (f,) array
        In the unit of the request.
    tolerance_mhz : float
        A tenth of it is how far energies may still move.

    Returns
    -------
    (m,) array
        Places in the block, rising.
    """
    size = max(FIRST_BASIS, 2 * count)
    if len(order) <= max(size, 2 * DENSE):
        return np.arange(len(order))
    strongest = fields[np.argmax(np.abs(fields))][None]
    before = None
    while size < len(order):
        basis = np.sort(order[:size])
        energies = solve_fields(problem.terms(basis), strongest, count, False)[0]
        if before is not None and np.abs(energies - before).max() <= 0.1 * tolerance_mhz:
            return basis
        before, size = energies, int(1.4 * size) + 1
    return np.arange(len(order))
