"""Energies of a top against a field: maps of levels with M, their labels, dipoles and cosines.

H(x) = H0 + F + x V over every exact block of states, x the field that is varied, F what else acts (the light of a laser beside a
static field). Each block is solved for all fields, its lowest states only, in a basis of the lowest free states that is doubled
until the energies stand still; J max is raised until they do. The population of the highest J is reported with each state.

Labels. Inside an exact symmetry block levels do not cross, so the state of rank r at any field is named after the free level of
rank r in that block: adiabatic labels, which no grid of fields can change. Labels by overlap do depend on the grid. Diabatic ones
swap where two neighbours come closer than a stated gap (`rotor.quantum.fields.diabatic`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.block_states import BlockStates, block_states, count_of, enough_states, states_of
from rotor.quantum.fields.blocks import AxialBlock, FieldBlock
from rotor.quantum.fields.chains import TOGETHER
from rotor.quantum.fields.map_request import BlockProblem, MapRequest, over
from rotor.quantum.fields.solver import (
    DENSE,
    SPANNED,
    Terms,
    at_fields,
    derivatives,
    expectation,
    solve_together,
    spanning,
)
from rotor.table import Table

Of = TypeVar("Of")

EDGE = 2  # the highest values of J whose population is leakage
HIGHEST_J = 300
STEP_J = 6
ROUND_OFF = 2 * float(np.finfo(np.float64).eps)  # of the norm of a matrix


@dataclass(frozen=True, eq=False, repr=False)
class FieldMap(Table):
    """States in a field as columns of equal length: all fields of one state after each other.

    field: (n,) in the unit that `field_name` names. m, rank: M, and the order in energy inside its exact block. block: which block.
    energy_mhz: E/h. label: the free level of that rank. slope: -dE/dfield, in `slope_name`. cosines: expectation values by name.
    edge_population: of the two highest J. copies: states that coincide (M and -M). diabatic_label: or None. free_row, free_mhz,
    weight: of the level in the free top, the spin weight that of one state. jmax: of the basis. moved_mhz: by how much the energy of
    each state still moved when J max was raised, at the highest field. round_off_mhz: of each energy, a few units in the last
    place of the largest one of its matrix. block_number: place of the block in `blocks_of_map`. request: what the map was
    made from.
    """

    field_name: str
    slope_name: str
    field: Floats
    m: Ints
    block: NDArray[np.str_]
    rank: Ints
    energy_mhz: Floats
    label: NDArray[np.str_]
    slope: Floats
    cosines: dict[str, Floats]
    edge_population: Floats
    copies: Ints
    free_row: Ints
    free_mhz: Floats
    weight: Floats
    jmax: int
    moved_mhz: Floats
    round_off_mhz: Floats
    block_number: Ints
    request: MapRequest
    diabatic_label: NDArray[np.str_] | None = None

    def __len__(self) -> int:
        return len(self.energy_mhz)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The field first, then m, rank, energy_mhz, label, the slope, cosines, block, edge_population, copies."""
        out: dict[str, NDArray[Any]] = {
            self.field_name: self.field,
            "m": self.m,
            "rank": self.rank,
            "energy_mhz": self.energy_mhz,
            "label": self.label,
            self.slope_name: self.slope,
            **self.cosines,
            "block": self.block,
            "edge_population": self.edge_population,
            "copies": self.copies,
            "accuracy_mhz": self.moved_mhz + self.round_off_mhz,
        }
        return out if self.diabatic_label is None else {**out, "diabatic_label": self.diabatic_label}

    @property
    def accuracy_mhz(self) -> float:
        """The largest error of an energy that is known: what J max leaves, and round-off."""
        here = np.isfinite(self.moved_mhz)
        return float((self.moved_mhz + self.round_off_mhz)[here].max(initial=0.0))

    @property
    def provenance(self) -> dict[str, Any]:
        """J max and what was found about accuracy."""
        return {
            "jmax": self.jmax,
            "accuracy_mhz": self.accuracy_mhz,
            "round_off_mhz": float(self.round_off_mhz.max(initial=0.0)),
            "edge_population": float(self.edge_population.max(initial=0.0)),
        }

    @property
    def fields(self) -> Floats:
        """The fields, each once."""
        return np.unique(self.field)

    def curves(self) -> list[slice]:
        """Rows of each state, all fields in order."""
        count = len(self.fields)
        return [slice(first, first + count) for first in range(0, len(self), count)]

    def curve(self, label: str, m: int) -> slice:
        """Rows of the state with a label and |M|; ValueError where there is none."""
        for rows in self.curves():
            if self.label[rows.start] == label and self.m[rows.start] == m:
                return rows
        known = sorted({(str(self.label[rows.start]), int(self.m[rows.start])) for rows in self.curves()})
        raise ValueError(
            f"no state {label!r} with M = {m}; there are {', '.join(f'{name!r} M={value}' for name, value in known)}"
        )


class _Solved(NamedTuple):
    """Of one block: energies, slopes -dE/dx in MHz, edge populations (fields, states), cosines by name, and the free rows (states,).

    round_off: of an energy, MHz.
    """

    energies: Floats
    slopes: Floats
    edge: Floats
    cosines: dict[str, Floats]
    rows: Ints
    block: FieldBlock
    round_off: float


def field_map(request: MapRequest, jmax: int | None = None, executor: Executor | None = None) -> FieldMap:
    """The map that a request asks for.

    jmax: of the basis; by default it is raised until no energy at the highest field moves by more than the tolerance, and until no
    state has more of its population in the two highest J than the request allows.
    executor: blocks are spread over it.

    Raises ValueError where a given J max is too small for either, and where J of 300 would not be enough.
    """
    tried = jmax
    while True:
        enough, moved = converged_jmax(request, tried, executor, given=jmax is not None)
        found = _tabulated(request, enough, moved, executor)
        leaked = float(found.edge_population.max(initial=0.0))
        if leaked <= request.most_at_edge:
            return found
        if jmax is not None:
            raise ValueError(
                f"J max {jmax} is too small: a state has {leaked:.2g} of its population in the two highest J, more than "
                f"{request.most_at_edge:g}; give a higher J max, or none and it is chosen"
            )
        tried = enough + max(STEP_J, enough // 4)


def converged_jmax(
    request: MapRequest, jmax: int | None = None, executor: Executor | None = None, given: bool | None = None
) -> tuple[int, Floats]:
    """J max of the basis of a map, and by how many MHz each energy at the highest field moves with a higher one.

    Parameters
    ----------
    request : MapRequest
        What is solved.
    jmax : int, optional
        Where to begin; by default the lowest that can serve.
    executor : Executor, optional
        Blocks are spread over it.
    given : bool, optional
        Whether no other J max may be taken; by default where one is given.

    Returns
    -------
    jmax : int
        That is enough.
    moved : (states,) array
        Of the states that come from levels up to the J asked for, in the order of the map.

    Raises
    ------
    ValueError
        As `field_map`.
    """
    given = jmax is not None if given is None else given
    jmax = jmax if jmax is not None else _first_jmax(request)
    if jmax < request.j_highest + EDGE:
        raise ValueError(
            f"J max {jmax}: states up to J = {request.j_highest} are followed; give at least {request.j_highest + EDGE}"
        )
    ends = np.unique(np.abs(request.fields))[-1:]
    before = _energies_at(request, jmax, ends, executor)
    while True:
        more = jmax + max(STEP_J, jmax // 4)
        after = _energies_at(request, more, ends, executor)
        moved = np.abs(after - before)
        worst = float(moved.max(initial=0.0))
        if worst <= request.tolerance_mhz:
            return jmax, moved
        if given:
            raise ValueError(
                f"J max {jmax} is too small: with {more} energies at the highest field move by {worst:.3g} MHz, more than "
                f"{request.tolerance_mhz:g}; give a higher J max, or none and it is chosen"
            )
        least = max(_round_off(request.problem(block), ends) for block in blocks_of_map(request, more))
        if worst <= least:
            raise ValueError(
                f"tolerance_mhz: {request.tolerance_mhz:g}: energies at the highest field have a round-off of {least:.1e} MHz; give more"
            )
        jmax, before = more, after
        if jmax > HIGHEST_J:
            raise ValueError(f"the field needs J beyond {HIGHEST_J}: it is too strong for this top")


def blocks_of_map(request: MapRequest, jmax: int) -> list[FieldBlock]:
    """The blocks that hold states of a map, in its order."""
    space = request.space(jmax)
    return [block for m in request.m_values for block in space.blocks(m) if (block.j <= request.j_highest).any()]


def each_block(
    request: MapRequest, jmax: int, run: Callable[[FieldBlock], Of], executor: Executor | None = None
) -> list[Of]:
    """`run` of every block that holds states of the map.

    Parameters
    ----------
    request : MapRequest
        What is solved.
    jmax : int
        Highest J of the basis.
    run : callable
        Takes a block; must be picklable for a pool of processes.
    executor : Executor, optional
        The blocks are spread over it.

    Returns
    -------
    list
        What `run` returned, in the order of the blocks.
    """
    blocks = blocks_of_map(request, jmax)
    return list(executor.map(run, blocks) if executor else map(run, blocks))


def _first_jmax(request: MapRequest) -> int:
    """The J from which on all free levels lie above those that are followed; they would shift the ranks."""
    jmax = request.j_highest + STEP_J
    while jmax <= HIGHEST_J:
        levels = request.space(jmax).levels
        top = levels.energy_mhz[levels.j <= request.j_highest].max()
        if levels.energy_mhz[levels.j == jmax].min() > top:
            return jmax
        jmax += max(STEP_J, jmax // 4)
    raise ValueError(f"levels beyond J = {HIGHEST_J} lie among those up to J = {request.j_highest}; follow fewer")


def _energies_at(request: MapRequest, jmax: int, fields: Floats, executor: Executor | None) -> Floats:
    solved = each_block(request, jmax, partial(block_states, request, fields=fields, with_vectors=False), executor)
    return np.concatenate(
        [one.energies[:, one.block.levels.j[one.rows] <= request.j_highest].ravel() for one in solved]
    )


def _solve_block(request: MapRequest, block: FieldBlock) -> _Solved:
    problem = request.problem(block)
    return _measured(request, block, problem, states_of(request, block, problem, request.fields, True))


def _solve_blocks(request: MapRequest, blocks: Sequence[FieldBlock]) -> list[_Solved]:
    """All blocks in this process, in one go where they are chains."""
    parts = []
    for block in blocks:
        problem, count, order = request.problem(block), count_of(request, block), block.free_order
        places = enough_states(problem, order, count, request.fields, request.tolerance_mhz)
        parts.append((block, problem, block.rows[order[:count]], places, (problem.terms(places), count)))
    found = solve_together([part[-1] for part in parts], request.fields, request.tolerance_mhz)
    return [
        _measured(request, block, problem, BlockStates(block, rows, energies, places, vectors))
        for (block, problem, rows, places, _), (energies, vectors) in zip(parts, found, strict=True)
    ]


def _is_small(request: MapRequest, blocks: Sequence[FieldBlock]) -> bool:
    """Whether all blocks are chains that one sweep holds together: milliseconds, which other processes would not shorten."""
    states = sum(count_of(request, block) for block in blocks)
    chains = all(isinstance(block, AxialBlock) for block in blocks)
    return chains and max(map(len, blocks), default=0) * len(request.fields) * states <= TOGETHER


def _measured(request: MapRequest, block: FieldBlock, problem: BlockProblem, found: BlockStates) -> _Solved:
    """Slopes, cosines and leakage of the states of a block."""
    fields, vectors = request.fields, found.vectors
    slopes = -derivatives(problem.terms(found.places), fields, vectors)
    cosines = {name: expectation(over(made(), found.places), vectors) for name, made in problem.observables.items()}
    edge = (np.abs(vectors[:, block.j[found.places] > block.levels.j.max() - EDGE]) ** 2).sum(axis=1)
    return _Solved(found.energies, slopes, edge, cosines, found.rows, block, _round_off(problem, fields))


def _round_off(problem: BlockProblem, fields: Floats) -> float:
    """Of eigenvalues at any field: LAPACK's are those of a matrix that is off by a few last places of |H|, and move by no more."""
    strongest = float(np.abs(fields).max())
    given = (problem.fixed, problem.slope, problem.curvature)
    norms = [strongest**n * np.abs(one).sum(axis=1).max() for n, one in enumerate(given) if one is not None]
    return ROUND_OFF * float(sum(norms))


def _tabulated(request: MapRequest, jmax: int, moved: Floats, executor: Executor | None) -> FieldMap:
    blocks = blocks_of_map(request, jmax)
    if executor is None or _is_small(request, blocks):
        solved = _solve_blocks(request, blocks)
    else:
        solved = each_block(request, jmax, partial(_solve_block, request), executor)
    fields, rows, numbers = request.fields, [], []
    named = [None if request.diabatic_gap_mhz is None else _diabatic_ranks(request, one) for one in solved]
    for number, (one, names) in enumerate(zip(solved, named, strict=True)):
        ours = one.block.levels.j[one.rows] <= request.j_highest
        listed = ours if names is None else ours | ours[names].any(axis=0)
        ranks = np.flatnonzero(listed).tolist()
        rows += [(one, rank) for rank in ranks]
        numbers += [number] * len(ranks)

    def column(pick: Callable[[_Solved, int], Floats]) -> Floats:
        return np.concatenate([pick(one, rank) for one, rank in rows])

    def repeated(pick: Callable[[_Solved, int], Any]) -> NDArray[Any]:
        return np.repeat([pick(one, rank) for one, rank in rows], len(fields))

    cosines = list(solved[0].cosines) if solved else []
    return FieldMap(
        field_name=request.field_name,
        slope_name=request.slope_name,
        field=np.tile(fields, len(rows)),
        m=repeated(lambda one, rank: one.block.m),
        block=repeated(lambda one, rank: one.block.label),
        rank=repeated(lambda one, rank: rank),
        energy_mhz=column(lambda one, rank: one.energies[:, rank]),
        label=repeated(lambda one, rank: one.block.levels.label(int(one.rows[rank]))),
        slope=column(lambda one, rank: one.slopes[:, rank]) / request.slope_unit_mhz,
        cosines={name: column(partial(_cosine, name)) for name in cosines},
        edge_population=column(lambda one, rank: one.edge[:, rank]),
        copies=repeated(lambda one, rank: one.block.copies),
        free_row=repeated(lambda one, rank: one.rows[rank]),
        free_mhz=repeated(lambda one, rank: one.block.levels.energy_mhz[one.rows[rank]]),
        weight=repeated(lambda one, rank: one.block.levels.weight[one.rows[rank]]),
        jmax=jmax,
        moved_mhz=np.repeat(_accuracy(request, rows, moved), len(fields)),
        round_off_mhz=repeated(lambda one, rank: one.round_off),
        block_number=np.repeat(np.array(numbers, dtype=np.int64), len(fields)),
        request=request,
        diabatic_label=_diabatic_labels(solved, named, rows),
    )


def _accuracy(request: MapRequest, rows: list[tuple[_Solved, int]], moved: Floats) -> Floats:
    """By how much the energy of each state moves with a higher J max; NaN for states listed for their diabatic label alone."""
    asked = np.array([one.block.levels.j[one.rows[rank]] <= request.j_highest for one, rank in rows], dtype=bool)
    out = np.full(len(rows), np.nan)
    out[asked] = moved
    return out


def _cosine(name: str, one: _Solved, rank: int) -> Floats:
    return one.cosines[name][:, rank]


def _diabatic_ranks(request: MapRequest, one: _Solved) -> Ints:
    """Whose name each state of a block has at each field, (fields, states)."""
    from rotor.quantum.fields.diabatic import diabatic_ranks

    count, gap = one.energies.shape[1], request.diabatic_gap_mhz or 0.0
    return diabatic_ranks(
        partial(_energies_and_slopes, _small(request, one.block, count), count), request.fields, count, gap
    )


def _diabatic_labels(
    solved: Sequence[_Solved], named: Sequence[Ints | None], rows: list[tuple[_Solved, int]]
) -> NDArray[np.str_] | None:
    if not rows or named[0] is None:
        return None
    of_block = {}
    for one, names in zip(solved, named, strict=True):
        labels = np.array([one.block.levels.label(int(row)) for row in one.rows])
        of_block[id(one)] = labels[names]
    return np.concatenate([of_block[id(one)][:, rank] for one, rank in rows])


def _small(request: MapRequest, block: FieldBlock, count: int) -> Terms:
    """The Hamiltonian of a block in a basis for its lowest states at all fields."""
    problem = request.problem(block)
    terms = problem.terms(enough_states(problem, block.free_order, count, request.fields, request.tolerance_mhz))
    if len(terms[0]) <= DENSE:
        return terms
    fields = np.linspace(request.fields[0], request.fields[-1], SPANNED)
    basis = spanning(terms, fields, count, request.tolerance_mhz)
    return terms if basis is None else tuple(basis.conj().T @ one @ basis for one in terms)


def _energies_and_slopes(terms: Terms, count: int, fields: Floats) -> tuple[Floats, Floats]:
    """Of the lowest states at fields (f,): energies and dE/dx (f, count)."""
    energies, vectors = np.linalg.eigh(at_fields(terms, fields))
    return energies[:, :count], derivatives(terms, fields, vectors[:, :, :count])
