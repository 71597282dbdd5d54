"""Energies of a top against a field: maps of levels with M, their labels, dipoles and cosines.

H(x) = H0 + F + x V over each exact block of states; x is the varied field, F a constant one (such as laser light). Only the lowest states
of each block are solved, at all fields, in the smallest basis of free states whose truncation error is within the tolerance
(`rotor.quantum.fields.block_states`): J max is chosen first, then the states up to it. Higher levels among those of the map are not
needed where the bound shows that the field does not connect them. The map lists the bound and the population of the highest J of each state
at each field.

Labels: inside an exact symmetry block levels do not cross, so the state of rank r at any field is labelled by the free level of rank r in
that block. These adiabatic labels do not depend on the grid of fields, unlike labels by overlap. Diabatic labels are exchanged where two
neighbours come closer than a stated gap (`rotor.quantum.fields.diabatic`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import AxialSpace
from rotor.quantum.fields.block_states import BlockStates, basis_order, count_of, round_off_mhz, solve_blocks
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.chains import TOGETHER
from rotor.quantum.fields.map_request import MapRequest, over, terms_over
from rotor.quantum.fields.solver import (
    DENSE,
    SPANNED,
    Terms,
    at_fields,
    derivatives,
    expectation,
    spanned_states,
)
from rotor.table import Table

Of = TypeVar("Of")

EDGE = 2  # the highest values of J whose population is leakage
HIGHEST_J = 300
STEP_J = 6
# a bound below this shows that levels outside the basis cross those of the map as if they were not coupled: labels need none of them
NARROW_MHZ = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class FieldMap(Table):
    """States in a field as columns (n,): all fields of one state, then those of the next.

    field: in the unit of `request.kind`. m: M. rank: order in energy among the states of the basis in the exact block. block: its label.
    energy_mhz: E/h. label: the free level of this rank. slope: -dE/dfield, named by `slope_name`. cosines: expectation values by name.
    edge_population: of the two highest J. copies: number of coinciding states (M and -M). diabatic_label: or None. free_mhz, weight:
    energy and spin weight (of one state) of the free level. jmax: of the basis. truncation_mhz: bound of the truncation error
    of each energy; NaN for states listed only for their diabatic label. round_off_mhz: round-off of each energy. block_number: place of the
    block in `blocks_of_map`. request: the request of the map.
    """

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
    free_mhz: Floats
    weight: Floats
    jmax: int
    truncation_mhz: Floats
    round_off_mhz: Floats
    block_number: Ints
    request: MapRequest
    diabatic_label: NDArray[np.str_] | None = None

    def __len__(self) -> int:
        return len(self.energy_mhz)

    @property
    def field_name(self) -> str:
        """Name of the column of the field."""
        return self.request.kind.column

    @property
    def slope_name(self) -> str:
        """Name of the column of -dE/dfield."""
        return self.request.kind.slope

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
            "accuracy_mhz": self.truncation_mhz + self.round_off_mhz,
        }
        return out if self.diabatic_label is None else {**out, "diabatic_label": self.diabatic_label}

    @property
    def accuracy_mhz(self) -> float:
        """Bound of the numerical error of all energies: truncation of the basis and round-off."""
        here = np.isfinite(self.truncation_mhz)
        return float((self.truncation_mhz + self.round_off_mhz)[here].max(initial=0.0))

    @property
    def provenance(self) -> dict[str, Any]:
        """J max and the accuracy of the energies."""
        return {
            "jmax": self.jmax,
            "accuracy_mhz": self.accuracy_mhz,
            "round_off_mhz": float(self.round_off_mhz.max(initial=0.0)),
            "edge_population": float(self.edge_population.max(initial=0.0)),
        }

    @property
    def fields(self) -> Floats:
        """The distinct fields, rising."""
        return np.unique(self.field)

    def curves(self) -> list[slice]:
        """Rows of each state, all fields in order."""
        count = len(self.fields)
        return [slice(first, first + count) for first in range(0, len(self), count)]

    def curve(self, label: str, m: int) -> slice:
        """Rows of the state with this label and M; ValueError if there is none."""
        for rows in self.curves():
            if self.label[rows.start] == label and self.m[rows.start] == m:
                return rows
        present = sorted({(str(self.label[rows.start]), int(self.m[rows.start])) for rows in self.curves()})
        raise ValueError(
            f"no state {label!r} with M = {m}; there are {', '.join(f'{name!r} M={value}' for name, value in present)}"
        )


def field_map(request: MapRequest, jmax: int | None = None, executor: Executor | None = None) -> FieldMap:
    """The map of a request.

    jmax: highest J of the basis. By default the lowest J for which the bounds of all energies are within the tolerance and no state has
    more population in the two highest J than the request allows. executor: solves blocks in parallel.

    Raises ValueError if `jmax` is too small, or if J of 300 is not enough.
    """
    if jmax is not None and jmax < request.j_highest + EDGE:
        raise ValueError(
            f"J max {jmax}: states up to J = {request.j_highest} are followed; give at least {request.j_highest + EDGE}"
        )
    chosen = smallest_jmax(request, executor) if jmax is None else jmax
    while True:
        states = _tabulated(request, chosen, executor)
        error = float(np.nanmax(states.truncation_mhz, initial=0.0))
        leaked = float(states.edge_population.max(initial=0.0))
        if error <= request.tolerance_mhz and leaked <= request.most_at_edge:
            return states
        if jmax is not None:
            reason = (
                f"the error of an energy may be {error:.3g} MHz, more than {request.tolerance_mhz:g}"
                if error > request.tolerance_mhz
                else f"a state has {leaked:.2g} of its population in the two highest J, more than {request.most_at_edge:g}"
            )
            raise ValueError(f"J max {jmax} is too small: {reason}; give a higher J max, or none and it is chosen")
        chosen += 1 if error > request.tolerance_mhz else 2
        _check_highest(chosen)


def _check_highest(jmax: int) -> None:
    """Raise ValueError beyond J of 300."""
    if jmax > HIGHEST_J:
        raise ValueError(f"the field needs J beyond {HIGHEST_J}: it is too strong for this top")


def smallest_jmax(request: MapRequest, executor: Executor | None = None) -> int:
    """The lowest J max, at most 300, for which the bounds of all energies at the strongest field are within the tolerance."""
    lowest = request.j_highest + EDGE if request.tolerance_mhz <= NARROW_MHZ else _lowest_jmax(request)
    costly = request.top.internal_rotation is not None or any(effect.spins(request.top) for effect in request.effects)
    highest = lowest if costly else lowest + STEP_J  # free states with spins or a torsion take longer than a field
    while True:
        _check_highest(highest)
        enough = _smallest_between(request, lowest, highest, executor)
        if enough <= highest:
            return enough
        lowest, highest = highest, highest + max(STEP_J, highest // 4)


def _smallest_between(request: MapRequest, lowest: int, highest: int, executor: Executor | None) -> int:
    """The lowest sufficient J max from `lowest` to `highest` for all blocks, `highest` + 1 if none is.

    Without an executor each block begins at the J max of the block before.
    """
    if executor is not None:
        enough = each_block(request, highest, partial(_smallest_of_block, request, lowest, highest), executor)
        return max(enough, default=lowest)
    # small blocks of large |M| show soonest that `highest` is too low
    for block in reversed(blocks_of_map(request, highest)):
        lowest = _smallest_of_block(request, lowest, highest, block)
        if lowest > highest:
            break
    return lowest


def _smallest_of_block(request: MapRequest, lowest: int, highest: int, block: FieldBlock) -> int:
    """The lowest sufficient J max from `lowest` to `highest` for a block, by bisection; `highest` + 1 if none is."""
    terms = request.matrices(block)
    strongest = request.fields[np.argmax(np.abs(request.fields))][None]

    def serves(jmax: int) -> bool:
        states = solve_blocks(request, [(block, terms)], strongest, jmax)[0]
        return float(states.error[:, states.j <= request.j_highest].max()) <= request.tolerance_mhz

    least = round_off_mhz(terms_over(terms, np.sort(basis_order(block, lowest))), strongest)
    if least > request.tolerance_mhz:
        raise ValueError(
            f"tolerance_mhz: {request.tolerance_mhz:g}: energies at the highest field have a round-off of {least:.1e} MHz; give more"
        )
    if serves(lowest):
        return lowest
    if not serves(highest):
        return highest + 1
    lowest += 1
    while lowest < highest:
        middle = (lowest + highest) // 2
        lowest, highest = (lowest, middle) if serves(middle) else (middle + 1, highest)
    return highest


def blocks_of_map(request: MapRequest, jmax: int) -> list[FieldBlock]:
    """Blocks with states of a map, in its order, with J up to J max plus the margin that bounds need; ValueError if they take too long."""
    space = request.space(jmax + request.margin)
    blocks = [block for m in request.m_values for block in space.blocks(m) if (block.j <= request.j_highest).any()]
    if not isinstance(space, AxialSpace):  # chains take the time of their energies
        request.require_work([int((block.j <= jmax).sum()) for block in blocks])
    return blocks


def each_block(
    request: MapRequest, jmax: int, run: Callable[[FieldBlock], Of], executor: Executor | None = None
) -> list[Of]:
    """Results of `run` (picklable) for each block of the map, in the order of `blocks_of_map`."""
    blocks = blocks_of_map(request, jmax)
    return list(executor.map(run, blocks) if executor else map(run, blocks))


def _lowest_jmax(request: MapRequest) -> int:
    """The lowest J max whose basis contains all free levels below those of the map, which their ranks count."""
    jmax = request.j_highest + STEP_J
    while jmax <= HIGHEST_J:
        levels = request.space(jmax).levels
        family = np.zeros(len(levels), dtype=np.int64) if levels.family is None else levels.family
        tops = np.full(family.max() + 1, -np.inf)
        followed = levels.j <= request.j_highest
        np.maximum.at(tops, family[followed], levels.energy_mhz[followed])
        below = levels.energy_mhz <= tops[family]
        if not below[levels.j == jmax].any():
            return max(int(levels.j[below].max()), request.j_highest + EDGE)
        jmax += max(STEP_J, jmax // 4)
    raise ValueError(f"levels beyond J = {HIGHEST_J} lie among those up to J = {request.j_highest}; follow fewer")


def _is_small(request: MapRequest, blocks: Sequence[FieldBlock]) -> bool:
    """Whether chains are small enough for one sweep, which takes milliseconds and gains nothing from other processes."""
    states = sum(count_of(request, block, block.free_order) for block in blocks)
    return max(map(len, blocks), default=0) * len(request.fields) * states <= TOGETHER


def _tabulated(request: MapRequest, jmax: int, executor: Executor | None) -> FieldMap:
    """The map with J max of the basis, by block and rank."""
    blocks = blocks_of_map(request, jmax)
    columns = partial(_columns, request, jmax)
    if all(isinstance(block.space, AxialSpace) for block in blocks) and (
        executor is None or _is_small(request, blocks)
    ):
        parts = columns(blocks)
    else:  # the vectors of one block at a time are in memory
        apart = (map if executor is None else executor.map)(columns, [[block] for block in blocks])
        parts = [columns_of_block for columns_of_blocks in apart for columns_of_block in columns_of_blocks]
    whole: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    cosines = {name: whole.pop(name) for name in request.observables}
    numbers = np.repeat(np.arange(len(parts)), [len(part["field"]) for part in parts])
    return FieldMap(**whole, cosines=cosines, jmax=jmax, block_number=numbers, request=request)


def _columns(request: MapRequest, jmax: int, blocks: Sequence[FieldBlock]) -> list[dict[str, NDArray[Any]]]:
    """Columns of a map for each block."""
    terms = [request.matrices(block) for block in blocks]
    solved = solve_blocks(request, list(zip(blocks, terms, strict=True)), request.fields, jmax)
    return [_columns_of(request, jmax, *pair) for pair in zip(terms, solved, strict=True)]


def _columns_of(request: MapRequest, jmax: int, terms: Terms, states: BlockStates) -> dict[str, NDArray[Any]]:
    """Columns of the states of a block; the truncation error is NaN for states listed only for their diabatic label."""
    block, fields = states.block, request.fields
    inside, levels = terms_over(terms, states.places), block.levels
    labels = np.array([levels.label(int(row)) for row in states.rows])
    followed = states.j <= request.j_highest
    listed, diabatic = followed, dict[str, NDArray[Any]]()
    if request.diabatic_gap_mhz is not None:
        ranks = _diabatic_ranks(request, inside, len(labels), request.diabatic_gap_mhz)
        listed = followed | followed[ranks].any(axis=0)
        diabatic = {"diabatic_label": labels[ranks][:, listed]}
    vectors, rows = states.vectors[:, :, listed], states.rows[listed]
    columns = {  # (fields, states), or less where they are equal
        "field": fields[:, None],
        "m": block.m,
        "block": block.label,
        "copies": block.copies,
        "round_off_mhz": round_off_mhz(terms, fields),
        "rank": np.flatnonzero(listed),
        "label": labels[listed],
        "free_mhz": levels.energy_mhz[rows],
        "weight": levels.weight[rows],
        "energy_mhz": states.energies[:, listed],
        "truncation_mhz": np.where(followed, states.error, np.nan)[:, listed],
        "slope": 0.0 - derivatives(inside, fields, vectors) / request.kind.slope_mhz,  # without field 0, not -0
        "edge_population": (np.abs(vectors[:, block.j[states.places] > jmax - EDGE]) ** 2).sum(axis=1),
        **diabatic,
    }
    for name, operator in request.observables.items():
        columns[name] = expectation(over(block.dense(operator), states.places), vectors)
    shape = len(fields), len(rows)
    return {name: np.broadcast_to(values, shape).T.ravel() for name, values in columns.items()}


def _diabatic_ranks(request: MapRequest, terms: Terms, count: int, gap_mhz: float) -> Ints:
    """The rank whose label each of the lowest states of a block has at each field, (fields, states)."""
    from rotor.quantum.fields.diabatic import diabatic_ranks

    if len(terms[0]) > DENSE:  # a small basis for these states at all fields
        fields = np.linspace(request.fields[0], request.fields[-1], SPANNED)
        spanned = spanned_states(terms, fields, count, request.tolerance_mhz)
        if spanned is not None:
            terms = tuple(spanned[0].conj().T @ term @ spanned[0] for term in terms)
    return diabatic_ranks(partial(_energies_and_slopes, terms, count), request.fields, count, gap_mhz)


def _energies_and_slopes(terms: Terms, count: int, fields: Floats) -> tuple[Floats, Floats]:
    """Energies and dE/dx (f, count) of the lowest states at fields (f,)."""
    energies, vectors = np.linalg.eigh(at_fields(terms, fields))
    return energies[:, :count], derivatives(terms, fields, vectors[:, :, :count])
