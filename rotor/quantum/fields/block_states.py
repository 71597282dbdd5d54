"""The lowest states of one block of a map at several fields, in the smallest sufficient basis of free states."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import BlockProblem, MapRequest
from rotor.quantum.fields.solver import DENSE, Matrix, solve_fields
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


def basis_order(block: FieldBlock, jmax: int) -> Ints:
    """Places of the states up to J max, in order of their free energies."""
    order = block.free_order
    return order[block.j[order] <= jmax]


def followed(block: FieldBlock, order: Ints, j_highest: int) -> int:
    """Number of lowest states of a basis that contain all free levels up to J = `j_highest`."""
    return int(np.flatnonzero(block.j[order] <= j_highest)[-1]) + 1


def count_of(request: MapRequest, block: FieldBlock, order: Ints) -> int:
    """Number of states to solve: those of the map, and for diabatic labels as many above as they may cross."""
    count = followed(block, order, request.j_highest)
    return count if request.diabatic_gap_mhz is None else min(len(order), count + count // 2 + 4)


def block_states(request: MapRequest, block: FieldBlock, fields: Floats, jmax: int) -> BlockStates:
    """The states of a block that a map follows, at several fields.

    Parameters
    ----------
    request : MapRequest
        Hamiltonian, fields and states of the map.
    block : FieldBlock
        A block of the space of `jmax + request.margin`.
    fields : (f,) array
        Fields in the unit of the request.
    jmax : int
        Highest J of the basis.

    Returns
    -------
    BlockStates
        Energies (f, states) in MHz, and the states.
    """
    return solve_block(request, block, request.problem(block), fields, jmax)


def solve_block(
    request: MapRequest, block: FieldBlock, problem: BlockProblem, fields: Floats, jmax: int
) -> BlockStates:
    """`block_states` with the matrices of the block, so that they are computed once."""
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
    """Solved states with labels; the bound of the truncation error is added to the error of the solver."""
    error = error + left_out_mhz(problem, places, energies, vectors, fields)
    return BlockStates(block, block.rows[order[: energies.shape[1]]], energies, places, vectors, error)


def enough_states(
    problem: BlockProblem, order: Ints, count: int, fields: Floats, tolerance_mhz: float
) -> tuple[Ints, tuple[Floats, Matrix, Floats] | None]:
    """The lowest free states that form a sufficient basis at the strongest field.

    Parameters
    ----------
    problem : BlockProblem
        Matrices of the block.
    order : (n,) array
        States of the basis by energy.
    count : int
        Number of lowest energies that are computed.
    fields : (f,) array
        Fields in the unit of the request.
    tolerance_mhz : float
        Further states of the basis may change an energy by a tenth of it.

    Returns
    -------
    places : (m,) array
        Places in the block, rising.
    states : tuple or None
        The lowest states in this basis at the strongest field, as from `solve_fields`; None if they were not solved.
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
