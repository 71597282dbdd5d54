"""The lowest states of blocks of a map at several fields, in the smallest sufficient basis of free states, with bounds of their errors.

The functions of an exact block are divided into those of the basis (1) and the rest (2), H = [[H11, R†], [R, H22]]. The residual r = R v
lowers an eigenvalue E of H below that of H11 by

    δE = r† (H22 - E)⁻¹ r ≤ Σ_k |r_k|²/d_k,     d_k = H_kk - Σ_l≠k |H_kl| - E,     k, l of the rest,

since H22 - diag(H_kk - Σ_l |H_kl|) is diagonally dominant with a positive diagonal, hence not negative (Gershgorin). Where d_k is small,
|r|²/(d/2 + √(d²/4 + |r|²)) replaces |r|²/d; it never exceeds |r| (C.-K. Li and R.-C. Li, A note on eigenvalues of perturbed Hermitian
matrices, doi 10.1016/j.laa.2004.08.026, abstract). The lowering is a positive operator; it mixes two states i, j of the basis by at most
√(δ_i δ_j), which adds min(δ_i δ_j/|E_i - E_j|, √(δ_i δ_j)). Where a level of the rest is not above a state, the bound is |r|: without r the
state would be an eigenstate, and no eigenvalue shifts by more than the norm of what is added (Weyl).

The block reaches twice as far in J beyond the basis as H connects, so that Σ_l is complete for each r_k that is not zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import AxialSpace
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.map_request import MapRequest, terms_over
from rotor.quantum.fields.solved_space import SolvedSpace
from rotor.quantum.fields.solver import DENSE, Matrix, Terms, solve_fields, solve_together

ROUND_OFF = 2 * float(np.finfo(np.float64).eps)  # of eigenvalues, relative to the norm of the matrix
FIRST_BASIS = 64
HELD = 1 << 17  # most numbers in a temporary array: more leave the cache
# states solved above a few followed ones, of which the rest may lower one below them; states of one K, which differ in J alone, do
# not come close
ABOVE = 2
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
    followed = [count_of(request, block, order) for (block, _), order in zip(blocks, orders, strict=True)]
    counts = [
        count if isinstance(block.space, AxialSpace) else min(len(order), count + count // 4 + ABOVE)
        for (block, _), order, count in zip(blocks, orders, followed, strict=True)
    ]
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
    for (block, terms), order, count, (places, _), states in zip(blocks, orders, followed, bases, solved, strict=True):
        energies, vectors, error = states
        error = error + left_out_mhz(terms, places, energies, vectors, fields)
        # a state above, which the rest lowers further, may take the place of a rank
        bound = np.maximum(error, energies - np.sort(energies - error, axis=1))[:, :count]
        out.append(
            BlockStates(block, block.rows[order[:count]], energies[:, :count], places, vectors[:, :, :count], bound)
        )
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


def left_out_mhz(terms: Terms, places: Ints, energies: Floats, vectors: Matrix, fields: Floats) -> Floats:
    """Bound (fields, states) of the lowering of each energy by functions of a block outside the basis, not negative.

    terms: H_0, H_1, ... over the block, which reaches at least twice as far in J beyond the basis as they connect. places: rising, of the
    functions of the basis. energies (f, s) and vectors (f, n, s): of the lowest states in the basis.
    """
    outside = np.ones(len(terms[0]), dtype=bool)
    outside[places] = False
    rest = np.flatnonzero(outside)
    couplings = [term[np.ix_(rest, places)] for term in terms]
    touched = np.flatnonzero(np.any([np.any(coupling, axis=1) for coupling in couplings], axis=0))
    if not len(touched):
        return np.zeros(energies.shape)
    within = [term[np.ix_(rest[touched], rest)] for term in terms]
    diagonals = [matrix[np.arange(len(touched)), touched].real for matrix in within]
    radii = [np.abs(matrix).sum(axis=1) - np.abs(diagonal) for matrix, diagonal in zip(within, diagonals, strict=True)]
    couplings = [matrix[touched] for matrix in couplings]
    step = max(1, HELD // max(len(touched) * energies.shape[1], energies.shape[1] ** 2))
    parts = [
        _lowering(couplings, diagonals, radii, energies[part], vectors[part], fields[part])
        for part in (slice(first, first + step) for first in range(0, len(fields), step))
    ]
    return np.concatenate(parts)


def _lowering(
    couplings: list[Matrix],
    diagonals: list[Floats],
    radii: list[Floats],
    energies: Floats,
    vectors: Matrix,
    fields: Floats,
) -> Floats:
    """`left_out_mhz` at a few fields; couplings (t, n), diagonals (t,) and radii (t,) for each power of the field."""
    powers = [fields**n for n in range(len(couplings))]
    lowest = np.transpose(powers) @ np.array(diagonals) - np.abs(np.transpose(powers)) @ np.array(radii)  # (f, t)
    distance = lowest[:, :, None] - energies[:, None, :]  # (f, t, s)
    above = (distance > 0).all(axis=1, keepdims=True)
    distance = np.where(above, distance, 0.0)
    coupled = np.array([x[:, None, None] * (coupling @ vectors) for x, coupling in zip(powers, couplings, strict=True)])
    residual = np.abs(coupled.sum(axis=0)) ** 2
    total = residual.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        terms = residual / (distance / 2 + np.sqrt(distance**2 / 4 + total))
    return _with_mixing(energies, np.where(residual > 0, terms, 0.0).sum(axis=1))


def _with_mixing(energies: Floats, lowering: Floats) -> Floats:
    """Lowerings (f, s), increased by the mixing of states of nearly equal energy."""
    both = np.sqrt(lowering[:, :, None] * lowering[:, None, :])
    gaps = np.abs(energies[:, :, None] - energies[:, None, :])
    states = np.arange(energies.shape[1])
    both[:, states, states] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mixed = np.where(gaps > both, both**2 / gaps, both)
    return np.asarray(lowering + mixed.sum(axis=2))


def round_off_mhz(terms: Terms, fields: Floats) -> float:
    """Round-off (MHz) of eigenvalues at any field: LAPACK's are exact for a matrix that differs by a few units in the last place of |H|."""
    strongest = float(np.abs(fields).max())
    norms = [strongest**n * np.abs(term).sum(axis=1).max() for n, term in enumerate(terms)]
    return ROUND_OFF * float(sum(norms))


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
    """Each block with itself, and those of M and M + 1: places of both, q = M' - M, and number of pairs with the same elements of μ_q.

    μ_0 = μ_Z; for M' = M + 1 the squares of μ_X and of μ_Y are each half of that of μ_1. A field along Z has the same energies for M and
    -M, and by reflection the same squares for (M, M') and (-M, -M'). Only M, M' ≥ 0 are therefore computed, and -½ to ½ for half-integers;
    states that are paired with their mirror images have both signs of M. States of mixed M have elements between any two blocks.
    """
    by_m: dict[float, list[int]] = {}
    for place, block in enumerate(blocks):
        by_m.setdefault(block.m, []).append(place)
    for m, lows in by_m.items():
        for low in lows:
            paired = blocks[low].paired
            yield low, low, 0, blocks[low].copies
            if m > -1 or paired:
                copies = 2 if paired or m >= 0 else 1
                for up in by_m.get(m + 1, []):
                    same = blocks[up].paired == paired
                    if isinstance(blocks[low].space, AxialSpace):  # at M = 0 the block of K represents that of -K too
                        (k,), (other,) = blocks[up].members, blocks[low].members
                        same = k == other or (m == 0 and k == -other)
                    if same:
                        yield up, low, 1, copies
