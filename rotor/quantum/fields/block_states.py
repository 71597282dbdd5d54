"""The lowest states of one block of a map at several fields, in a basis of the free states that is just large enough."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import BlockProblem, MapRequest
from rotor.quantum.fields.solver import DENSE, Matrix, solve_fields
from rotor.quantum.fields.truncation import left_out_mhz

FIRST_BASIS = 64
PART_OF_TOLERANCE = 0.1  # for states below J max that a basis leaves out


class BlockStates(NamedTuple):
    """The lowest states of one block.

    rows: free levels (states,) that name them. energies: (fields, states), MHz. places: (n,) functions of the block over which the
    vectors (fields, n, states) are. error: bound of what the basis leaves out of each energy (fields, states), MHz.
    """

    block: FieldBlock
    rows: Ints
    energies: Floats
    places: Ints
    vectors: Matrix
    error: Floats


def basis_order(block: FieldBlock, jmax: int) -> Ints:
    """Places of the states up to J max in order of their free energies."""
    order = block.free_order
    return order[block.j[order] <= jmax]


def followed(block: FieldBlock, order: Ints, j_highest: int) -> int:
    """How many of the lowest states of a basis hold all free levels up to J = `j_highest`."""
    return int(np.flatnonzero(block.j[order] <= j_highest)[-1]) + 1


def count_of(request: MapRequest, block: FieldBlock, order: Ints) -> int:
    """States to be solved: those followed, and where labels are diabatic as many above as they may cross."""
    count = followed(block, order, request.j_highest)
    return count if request.diabatic_gap_mhz is None else min(len(order), count + count // 2 + 4)


def block_states(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> BlockStates:
    """The states of a block that a map follows, at several fields.

    Parameters
    ----------
    request : MapRequest
        What is solved.
    block : FieldBlock
        A block of the space of `jmax + request.margin`.
    fields : (f,) array
        In the unit of the request.
    jmax : int
        Highest J of the basis.

    Returns
    -------
    BlockStates
        Energies (f, states) in MHz, and the states that they belong to.
    """
    return solve_block(request, block, request.problem(block), fields, jmax)


def solve_block(
    request: MapRequest, block: FieldBlock, problem: BlockProblem, fields: Floats, jmax: int
) -> BlockStates:
    """`block_states` with the matrices of the block at hand."""
    order = basis_order(block, jmax)
    count = count_of(request, block, order)
    places, states = enough_states(problem, order, count, fields, request.tolerance_mhz)
    if states is None or len(fields) > 1:
        states = solve_fields(problem.terms(places), fields, count, request.tolerance_mhz)
    energies, vectors, error = states
    return bounded_states(block, problem, order, places, energies, vectors, error, fields)


def bounded_states(
    block: FieldBlock, problem: BlockProblem, order: Ints, places: Ints, energies: Floats, vectors: Matrix, error: Floats,
    fields: Floats,
) -> BlockStates:  # fmt: skip
    """Solved states with their names, and the bound of what their basis leaves out added to the error of the solver."""
    error = error + left_out_mhz(problem, places, energies, vectors, fields)
    return BlockStates(block, block.rows[order[: energies.shape[1]]], energies, places, vectors, error)


def enough_states(
    problem: BlockProblem, order: Ints, count: int, fields: Floats, tolerance_mhz: float
) -> tuple[Ints, tuple[Floats, Matrix, Floats] | None]:
    """The lowest free states that suffice at the strongest field.

    Parameters
    ----------
    problem : BlockProblem
        Matrices of the block.
    order : (n,) array
        States of the basis by energy.
    count : int
        How many of the lowest energies are computed.
    fields : (f,) array
        In the unit of the request.
    tolerance_mhz : float
        A tenth of it is the bound of what further states of the basis may change.

    Returns
    -------
    places : (m,) array
        Places in the block, rising.
    states : tuple or None
        The lowest states in them at the strongest field, as of `solve_fields`, where they were solved.
    """
    size = max(FIRST_BASIS, 2 * count)
    rising = np.sort(order)
    if len(order) <= max(size, 2 * DENSE):
        return rising, None
    strongest = fields[np.argmax(np.abs(fields))][None]
    whole = problem.over(rising)
    while size < len(order):
        basis = np.searchsorted(rising, np.sort(order[:size]))
        states = solve_fields(whole.terms(basis), strongest, count)
        if left_out_mhz(whole, basis, *states[:2], strongest).max() <= PART_OF_TOLERANCE * tolerance_mhz:
            return rising[basis], states
        size = int(1.4 * size) + 1
    return rising, None
