"""Energies of a top against a field: maps of levels with M, their labels, dipoles and cosines.

H(x) = H0 + F + x V over every exact block of states, x the field that is varied, F what else acts (the light of a laser beside a
static field). Each block is solved for all fields, its lowest states only, in a basis of the lowest free states that is doubled
until the energies stand still; J max is raised until they do. The population of the highest J is reported with each state.

Labels. Inside an exact symmetry block levels do not cross, so the state of rank r at any field is named after the free level of
rank r in that block: adiabatic labels, which no grid of fields can change. Labels by overlap do depend on the grid. Diabatic ones
swap where two neighbours come closer than a stated gap (`rotor.quantum.diabatic`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.field_blocks import FieldBlock, FieldSpace
from rotor.table import Table

Matrix = NDArray[Any]

EDGE = 2  # the highest values of J whose population is leakage
FIRST_BASIS = 64
DENSE = 48  # blocks up to this size are solved whole, all fields at once
HIGHEST_J = 300
FIRST_ANCHORS = 5  # fields solved in full at first, of many
SPANNED = 101  # fields at which a basis for many is tested while it is made
BUFFER = 4  # further states in the basis of a map
DEPENDENT = 1e-7  # of the largest singular value: directions of a basis below it are left out
STEP_J = 6


class BlockProblem(NamedTuple):
    """Matrices over a block, all (n, n): what is fixed, in MHz; what the field multiplies, in MHz per unit of field; observables."""

    fixed: Matrix
    slope: Matrix
    observables: dict[str, Matrix]


@dataclass(frozen=True, repr=False)
class FieldMap(Table):
    """States in a field as columns of equal length: all fields of one state after each other.

    field: (n,) in the unit that `field_name` names. m, rank: M, and the order in energy inside its exact block. block: which block.
    energy_mhz: E/h. label: the free level of that rank. slope: -dE/dfield, in `slope_name`. cosines: expectation values by name.
    edge_population: of the two highest J. copies: states that coincide (M and -M). diabatic_label: or None. free_row: of the level
    in the free top. jmax: of the basis. accuracy_mhz: by which energies still moved when J max was raised.
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
    jmax: int
    accuracy_mhz: float
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
        }
        return out if self.diabatic_label is None else {**out, "diabatic_label": self.diabatic_label}

    @property
    def provenance(self) -> dict[str, Any]:
        """J max and what was found about accuracy."""
        return {
            "jmax": self.jmax,
            "accuracy_mhz": self.accuracy_mhz,
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


@dataclass(frozen=True)
class MapRequest:
    """What a map is of.

    space: makes the states up to a J max. problem: the matrices of a block. fields: rising. j_highest: free levels up to this J are
    followed. m_values: |M|, or signed where `signed`. tolerance_mhz: of energies. diabatic_gap_mhz: None for no diabatic labels.
    """

    space: Callable[[int], FieldSpace]
    problem: Callable[[FieldBlock], BlockProblem]
    fields: Floats
    j_highest: int
    m_values: tuple[int, ...]
    tolerance_mhz: float
    field_name: str
    slope_name: str
    slope_unit_mhz: float
    diabatic_gap_mhz: float | None = None


class _Solved(NamedTuple):
    """Of one block: energies, slopes -dE/dx in MHz, edge populations (fields, states), cosines by name, and the free rows (states,)."""

    energies: Floats
    slopes: Floats
    edge: Floats
    cosines: dict[str, Floats]
    rows: Ints
    block: FieldBlock


def field_map(request: MapRequest, jmax: int | None = None, executor: Executor | None = None) -> FieldMap:
    """The map that a request asks for.

    jmax: of the basis; by default it is raised until no energy at the highest field moves by more than the tolerance.
    executor: blocks are spread over it.

    Raises ValueError where a given J max is too small for the tolerance, and where J of 300 would not be enough.
    """
    given = jmax is not None
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
        moved = float(np.abs(after - before).max(initial=0.0))
        if moved <= request.tolerance_mhz:
            return _tabulated(request, jmax, moved, executor)
        if given:
            raise ValueError(
                f"J max {jmax} is too small: with {more} energies at the highest field move by {moved:.3g} MHz, more than "
                f"{request.tolerance_mhz:g}; give a higher J max, or none and it is chosen"
            )
        jmax, before = more, after
        if jmax > HIGHEST_J:
            raise ValueError(f"the field needs J beyond {HIGHEST_J}: it is too strong for this top")


def _blocks(request: MapRequest, jmax: int) -> list[FieldBlock]:
    space = request.space(jmax)
    return [block for m in request.m_values for block in space.blocks(m) if (block.j <= request.j_highest).any()]


def _jobs(
    request: MapRequest, jmax: int, fields: Floats, executor: Executor | None, with_vectors: bool
) -> list[_Solved]:
    blocks = _blocks(request, jmax)
    run = partial(_solve_block, request, fields=fields, with_vectors=with_vectors)
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
    solved = _jobs(request, jmax, fields, executor, False)
    return np.concatenate(
        [one.energies[:, one.block.levels.j[one.rows] <= request.j_highest].ravel() for one in solved]
    )


def free_order(block: FieldBlock) -> Ints:
    """Places of the states of a block in order of their free energies, J deciding between equal ones."""
    return np.lexsort((block.j, np.round(block.energies_mhz, 9)))


def followed(block: FieldBlock, j_highest: int) -> int:
    """How many of the lowest states of a block hold all free levels up to J = `j_highest`."""
    order = free_order(block)
    return int(np.flatnonzero(block.j[order] <= j_highest)[-1]) + 1


def _count(request: MapRequest, block: FieldBlock) -> int:
    """States to be solved: those followed, and where labels are diabatic as many above as they may cross."""
    count = followed(block, request.j_highest)
    return count if request.diabatic_gap_mhz is None else min(len(block), count + count // 2 + 4)


def _solve_block(request: MapRequest, block: FieldBlock, fields: Floats, with_vectors: bool) -> _Solved:
    problem, count = request.problem(block), _count(request, block)
    order = free_order(block)
    basis = _enough(problem, order, count, fields, request.tolerance_mhz)
    fixed, slope = (matrix[np.ix_(basis, basis)] for matrix in (problem.fixed, problem.slope))
    energies, vectors = solve_fields(fixed, slope, fields, count, with_vectors, request.tolerance_mhz)
    if not with_vectors:
        return _Solved(energies, energies, energies, {}, block.rows[order[:count]], block)
    slopes = -_expectation(slope, vectors)
    cosines = {name: _expectation(one[np.ix_(basis, basis)], vectors) for name, one in problem.observables.items()}
    edge = (np.abs(vectors[:, block.j[basis] > block.levels.j.max() - EDGE]) ** 2).sum(axis=1)
    return _Solved(energies, slopes, edge, cosines, block.rows[order[:count]], block)


def _expectation(matrix: Matrix, vectors: Matrix) -> Floats:
    """⟨v|O|v⟩ of vectors (fields, n, states), (fields, states)."""
    return np.asarray(np.einsum("fns,fns->fs", vectors.conj(), matrix @ vectors).real)


def _enough(problem: BlockProblem, order: Ints, count: int, fields: Floats, tolerance_mhz: float) -> Ints:
    """Of the free states the lowest that are enough at the strongest field, found by doubling; in the order of the block."""
    size = max(FIRST_BASIS, 2 * count)
    if len(order) <= max(size, 2 * DENSE):
        return np.arange(len(order))
    strongest = fields[np.argmax(np.abs(fields))][None]
    before = None
    while size < len(order):
        basis = np.sort(order[:size])
        fixed, slope = (matrix[np.ix_(basis, basis)] for matrix in (problem.fixed, problem.slope))
        energies = solve_fields(fixed, slope, strongest, count, False)[0]
        if before is not None and np.abs(energies - before).max() <= 0.1 * tolerance_mhz:
            return basis
        before, size = energies, int(1.4 * size) + 1
    return np.arange(len(order))


def solve_fields(
    fixed: Matrix, slope: Matrix, fields: Floats, count: int, with_vectors: bool, tolerance_mhz: float = 0.0
) -> tuple[Floats, Matrix]:
    """The lowest `count` states of fixed + x slope: energies (fields, count), vectors (fields, n, count).

    Small matrices are solved for all fields at once, large ones one by one or, where many fields are asked for, in a basis of
    their own eigenvectors at a few fields (`reduced_basis`), to `tolerance_mhz`.
    """
    if len(fixed) <= DENSE:
        stack = fixed + fields[:, None, None] * slope
        if not with_vectors:
            return np.asarray(np.linalg.eigvalsh(stack)[:, :count], dtype=np.float64), stack[:, :, :0]
        solved = np.linalg.eigh(stack)
        return np.asarray(solved.eigenvalues[:, :count], dtype=np.float64), solved.eigenvectors[:, :, :count]
    if len(fields) >= 3 * FIRST_ANCHORS and tolerance_mhz > 0 and count + BUFFER < len(fixed) // 4:
        return reduced_basis(fixed, slope, fields, count, tolerance_mhz)
    return _each(fixed, slope, fields, count, with_vectors)


def _each(fixed: Matrix, slope: Matrix, fields: Floats, count: int, with_vectors: bool = True) -> tuple[Floats, Matrix]:
    solved = [_lowest(fixed + x * slope, count, with_vectors) for x in fields.tolist()]
    return np.array([energies for energies, _ in solved]), np.array([vectors for _, vectors in solved])


def _lowest(matrix: Matrix, count: int, with_vectors: bool = True) -> tuple[Floats, Matrix]:
    from scipy.linalg import eigh

    chosen = (0, min(count, len(matrix)) - 1)
    if with_vectors:
        energies, vectors = eigh(matrix, subset_by_index=chosen, overwrite_a=True, check_finite=False)
        return energies, vectors
    energies = eigh(matrix, subset_by_index=chosen, eigvals_only=True, overwrite_a=True, check_finite=False)
    return energies, matrix[:, :0]


def reduced_basis(
    fixed: Matrix, slope: Matrix, fields: Floats, count: int, tolerance_mhz: float
) -> tuple[Floats, Matrix]:
    """The lowest states at many fields from full solutions at a few: energies (fields, count), vectors (fields, n, count)."""
    basis = spanning(fixed, slope, fields[:: len(fields) // SPANNED + 1], count, tolerance_mhz)
    if basis is None:
        return _each(fixed, slope, fields, count)
    energies, vectors, error = _in_basis(basis, (fixed @ basis, slope @ basis), fields, count)
    return (energies, vectors) if error.max() <= tolerance_mhz else _each(fixed, slope, fields, count)


def spanning(fixed: Matrix, slope: Matrix, fields: Floats, count: int, tolerance_mhz: float) -> Matrix | None:
    """A basis (n, r) for the lowest states at all fields; None where it would be as large as half of the matrix.

    The eigenvectors at some fields, a few more than are asked for, span a space that holds those at the fields between. In it
    the matrices are small. An energy is wrong by |residual|²/gap, the gap reaching to the highest of the further states; the field
    where that is largest is solved in full and joins, until it is below a tenth of the tolerance everywhere.
    """
    anchors = np.unique(np.linspace(0, len(fields) - 1, FIRST_ANCHORS).astype(int)).tolist()
    found = [_lowest(fixed + fields[place] * slope, count + BUFFER)[1] for place in anchors]
    while True:
        basis = _orthonormal(np.concatenate(found, axis=1))
        if basis.shape[1] > len(fixed) // 2:
            return None
        error = _in_basis(basis, (fixed @ basis, slope @ basis), fields, count)[2]
        error[anchors] = 0.0
        worst = int(np.argmax(error))
        if error[worst] <= 0.1 * tolerance_mhz:
            return basis
        anchors.append(worst)
        found.append(_lowest(fixed + fields[worst] * slope, count + BUFFER)[1])


def _orthonormal(vectors: Matrix) -> Matrix:
    """An orthonormal basis (n, r) of what vectors (n, many) span, dependent directions left out."""
    left, sizes, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.ascontiguousarray(left[:, sizes > DEPENDENT * sizes[0]])


def _in_basis(basis: Matrix, moved: tuple[Matrix, Matrix], fields: Floats, count: int) -> tuple[Floats, Matrix, Floats]:
    """Energies, vectors and the largest error estimate (fields,) of the lowest states in a basis."""
    small = [basis.conj().T @ one for one in moved]
    energies, inside = np.linalg.eigh(small[0] + fields[:, None, None] * small[1])
    gaps = np.maximum(energies[:, min(count + BUFFER, energies.shape[1]) - 1, None] - energies[:, :count], 1e-9)
    energies, inside = energies[:, :count], inside[:, :, :count]
    vectors = basis @ inside
    residual = moved[0] @ inside + fields[:, None, None] * (moved[1] @ inside) - energies[:, None, :] * vectors
    return energies, vectors, ((np.abs(residual) ** 2).sum(axis=1) / gaps).max(axis=1)


def _tabulated(request: MapRequest, jmax: int, moved: float, executor: Executor | None) -> FieldMap:
    solved = _jobs(request, jmax, request.fields, executor, True)
    fields, rows = request.fields, []
    named = [None if request.diabatic_gap_mhz is None else _diabatic_ranks(request, one) for one in solved]
    for one, names in zip(solved, named, strict=True):
        ours = one.block.levels.j[one.rows] <= request.j_highest
        listed = ours if names is None else ours | ours[names].any(axis=0)
        rows += [(one, rank) for rank in np.flatnonzero(listed).tolist()]

    def column(pick: Callable[[_Solved, int], Any]) -> NDArray[Any]:
        return np.concatenate([np.broadcast_to(pick(one, rank), len(fields)) for one, rank in rows])

    cosines = list(solved[0].cosines) if solved else []
    return FieldMap(
        field_name=request.field_name,
        slope_name=request.slope_name,
        field=np.tile(fields, len(rows)),
        m=column(lambda one, rank: one.block.m),
        block=column(lambda one, rank: np.array(one.block.label)),
        rank=column(lambda one, rank: rank),
        energy_mhz=column(lambda one, rank: one.energies[:, rank]),
        label=column(lambda one, rank: np.array(one.block.levels.label(int(one.rows[rank])))),
        slope=column(lambda one, rank: one.slopes[:, rank] / request.slope_unit_mhz),
        cosines={name: column(partial(_cosine, name)) for name in cosines},
        edge_population=column(lambda one, rank: one.edge[:, rank]),
        copies=column(lambda one, rank: one.block.copies),
        free_row=column(lambda one, rank: one.rows[rank]),
        jmax=jmax,
        accuracy_mhz=moved,
        diabatic_label=_diabatic_labels(solved, named, rows),
    )


def _cosine(name: str, one: _Solved, rank: int) -> Floats:
    return one.cosines[name][:, rank]


def _diabatic_ranks(request: MapRequest, one: _Solved) -> Ints:
    """Whose name each state of a block has at each field, (fields, states)."""
    from rotor.quantum.diabatic import diabatic_ranks

    count, gap = one.energies.shape[1], request.diabatic_gap_mhz or 0.0
    return diabatic_ranks(
        partial(_energies_and_slopes, *_small(request, one.block, count), count), request.fields, count, gap
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


def _small(request: MapRequest, block: FieldBlock, count: int) -> tuple[Matrix, Matrix]:
    """Both matrices of a block in a basis for its lowest states at all fields."""
    problem = request.problem(block)
    states = _enough(problem, free_order(block), count, request.fields, request.tolerance_mhz)
    fixed, slope = (matrix[np.ix_(states, states)] for matrix in (problem.fixed, problem.slope))
    if len(fixed) <= DENSE:
        return fixed, slope
    fields = np.linspace(request.fields[0], request.fields[-1], SPANNED)
    basis = spanning(fixed, slope, fields, count, request.tolerance_mhz)
    if basis is None:
        return fixed, slope
    return basis.conj().T @ fixed @ basis, basis.conj().T @ slope @ basis


def _energies_and_slopes(fixed: Matrix, slope: Matrix, count: int, fields: Floats) -> tuple[Floats, Floats]:
    """Of the lowest states at fields (f,): energies and dE/dx (f, count)."""
    energies, vectors = np.linalg.eigh(fixed + fields[:, None, None] * slope)
    return energies[:, :count], _expectation(slope, vectors[:, :, :count])


def checked_fields(fields: Any, unit: str, highest: float) -> Floats:
    """Fields (n,) that rise, finite and within ±`highest`; ValueError where they are not."""
    values = np.unique(np.atleast_1d(np.asarray(fields, dtype=np.float64)))
    if not len(values) or not np.isfinite(values).all():
        raise ValueError(f"fields must be finite numbers of {unit}; got {np.asarray(fields).tolist()!r}")
    if np.abs(values).max() > highest:
        raise ValueError(
            f"a field of {values[np.argmax(np.abs(values))]:g} {unit} is beyond {highest:g} {unit}, where no molecule holds together; "
            "check the unit"
        )
    return values


def checked_tolerance_mhz(tolerance_mhz: float) -> float:
    """A tolerance of energies above zero, or ValueError."""
    if not (math.isfinite(tolerance_mhz) and tolerance_mhz > 0):
        raise ValueError(f"tolerance {tolerance_mhz} MHz: a finite number above 0 is expected")
    return float(tolerance_mhz)
