"""The lowest states of a Hamiltonian that is a polynomial in a field, H(x) = Σ x^n H_n, at many fields.

Small matrices are solved for all fields at once. Large ones are solved in full at a few fields. Their eigenvectors, a few more than
requested, span a small space for the fields between, and an error estimate shows where another field must be solved in full.

Where the field changes all states little, eigenvectors are interpolated in it. The matrix is solved in full at fields near the nodes of
Chebyshev. Their eigenvectors, in the order of those of the field before by overlap and turned to a real positive one, are interpolated by
the polynomial of Lagrange. With E_i = ⟨i|H|i⟩ of the interpolated vectors and the residual r_i = H|i⟩ - E_i|i⟩, an eigenvalue lies within
|r_i| of E_i. It lies within |r_i|²/gap, too: if no eigenvalue is between λ and μ, then 0 ≤ ⟨(H - λ)(H - μ)⟩ = |r|² + (E - λ)(E - μ). Since
(E_k - E_i)⟨i|k⟩ = ⟨i|r_k⟩ - ⟨r_i|k⟩, vectors of small residual are orthogonal unless their energies nearly coincide; these overlaps are
computed. As many orthogonal vectors as functions are all states, so that their order in energy is known. A field at which a residual or an
overlap is too large, such as near an avoided crossing, is solved in full; after a few of them the fields that remain are divided into
halves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.chains import chain_states, is_chain, lagrange

Matrix = NDArray[Any]
Terms = tuple[Matrix, ...]  # H_n (n, n)

DENSE = 48  # matrices up to this size are solved in full, all fields at once
MANY_FIELDS = 40  # with at least so many fields, chains are interpolated between a few
FIRST_ANCHORS = 5  # fields that are solved in full first
SPANNED = 101  # fields at which a basis for diabatic labels is tested
BUFFER = 4  # further states in a reduced basis
PART_OF_TOLERANCE = 0.1  # share of the tolerance for the error of a reduced basis
# share of the states above which all of them take less time than the lowest alone (LAPACK's evd and evr)
SUBSET = 1 / 8
DEPENDENT = 1e-7  # directions of a basis with smaller singular values, relative to the largest, are left out


def derivatives(terms: Terms, fields: Floats, vectors: Matrix) -> Floats:
    """dE/dx = Σ n x^(n-1) ⟨v|H_n|v⟩ (theorem of Hellmann and Feynman), (fields, states)."""
    each = [n * fields[:, None] ** (n - 1) * expectation(term, vectors) for n, term in enumerate(terms[1:], 1)]
    return np.asarray(sum(each))


def at_fields(terms: Terms, fields: Floats) -> Matrix:
    """H at fields (f, n, n)."""
    out = terms[0] + fields[:, None, None] * terms[1]
    for power, term in enumerate(terms[2:], 2):
        out += fields[:, None, None] ** power * term
    return np.asarray(out)


def expectation(matrix: Matrix, vectors: Matrix) -> Floats:
    """⟨v|O|v⟩ (fields, states) of vectors (fields, n, states)."""
    fields, size, states = vectors.shape
    if size > DENSE:  # field by field: products of all fields together exceed the cache, and half of the time is theirs
        return np.array([np.einsum("nk,nk->k", each.conj(), matrix @ each).real for each in vectors])
    # one matrix product instead of one for each field
    columns = vectors.transpose(1, 0, 2).reshape(size, fields * states)
    means = np.einsum("nk,nk->k", columns.conj(), matrix @ columns).real
    return np.asarray(means.reshape(fields, states))


def solve_fields(terms: Terms, fields: Floats, count: int, tolerance_mhz: float = 0.0) -> tuple[Floats, Matrix, Floats]:
    """Energies (f, count), vectors (f, n, count) and errors (f, count) of the lowest states of Σ x^n H_n at fields x (f,).

    Small matrices are solved for all fields at once, large ones one by one or, at many fields, in a basis of eigenvectors at a few fields
    (`spanned_states`), with errors of up to `tolerance_mhz`; 0 solves all fields in full.
    """
    if len(fields) >= MANY_FIELDS and is_chain(terms):
        states = chain_states([(terms, count)], fields)
        if states is not None:
            return _exact(*states[0])
    size = len(terms[0])
    if size <= DENSE:
        solved = np.linalg.eigh(at_fields(terms, fields))
        return _exact(np.asarray(solved.eigenvalues[:, :count], dtype=np.float64), solved.eigenvectors[:, :, :count])
    if len(fields) >= 3 * FIRST_ANCHORS and tolerance_mhz > 0 and count + BUFFER < size // 4:
        spanned = spanned_states(terms, fields, count, tolerance_mhz)
        if spanned is None or spanned[1][2].max() > tolerance_mhz:  # dependent directions were left out
            return _each(terms, fields, count)
        return spanned[1]
    if len(fields) >= FEWEST_FIELDS and tolerance_mhz > 0 and count > SUBSET * size:
        return interpolated_states(partial(_at, terms, fields), fields, count, PART_OF_TOLERANCE * tolerance_mhz)
    return _each(terms, fields, count)


def solve_together(
    blocks: Sequence[tuple[Terms, int]], fields: Floats, tolerance_mhz: float
) -> list[tuple[Floats, Matrix, Floats]]:
    """`solve_fields` for several blocks, each with its number of states; chains are solved together."""
    if len(fields) >= MANY_FIELDS and all(is_chain(terms) for terms, _ in blocks):
        states = chain_states(blocks, fields)
        if states is not None:
            return [_exact(*pair) for pair in states]
    return [solve_fields(terms, fields, count, tolerance_mhz) for terms, count in blocks]


def _exact(energies: Floats, vectors: Matrix) -> tuple[Floats, Matrix, Floats]:
    """A full solution with error 0."""
    return energies, vectors, np.zeros(energies.shape)


def _each(terms: Terms, fields: Floats, count: int) -> tuple[Floats, Matrix, Floats]:
    """Full solutions field by field."""
    solved = [_lowest(_at(terms, fields, place), count) for place in range(len(fields))]
    return _exact(np.array([energies for energies, _ in solved]), np.array([vectors for _, vectors in solved]))


def _at(terms: Terms, fields: Floats, place: int) -> Matrix:
    """H at one of the fields."""
    return np.asarray(at_fields(terms, fields[place : place + 1])[0])


def _lowest(matrix: Matrix, count: int) -> tuple[Floats, Matrix]:
    """The lowest eigenvalues and eigenvectors of a matrix."""
    if count > SUBSET * len(matrix):
        energies, vectors = np.linalg.eigh(matrix)
        return energies[:count], vectors[:, :count]
    from scipy.linalg import eigh

    chosen = (0, min(count, len(matrix)) - 1)
    energies, vectors = eigh(matrix, subset_by_index=chosen, overwrite_a=True, check_finite=False)
    return energies, vectors


def spanned_states(
    terms: Terms, fields: Floats, count: int, tolerance_mhz: float
) -> tuple[Matrix, tuple[Floats, Matrix, Floats]] | None:
    """A basis (n, r) for the lowest states at all rising fields, from eigenvectors at a few of them, and the states in it.

    The eigenvectors at some fields, a few more than requested, span a small space for the fields between. The error of an energy is
    |residual|²/gap, where the gap reaches to the highest of the further states. The field with the largest error is solved in full and
    added, until the error is below a tenth of the tolerance, first between full solutions, then at all fields. None if the basis would have
    more than half the size of the matrix.
    """
    anchors = np.unique(np.linspace(0, len(fields) - 1, FIRST_ANCHORS).astype(int)).tolist()
    full = [_lowest(_at(terms, fields, place), count + BUFFER)[1] for place in anchors]
    while True:
        basis = _orthonormal(np.concatenate(full, axis=1))
        if basis.shape[1] > len(terms[0]) // 2:
            return None
        moved, ordered = tuple(term @ basis for term in terms), sorted(anchors)
        middles = np.array([(i + k) // 2 for i, k in pairwise(ordered) if k > i + 1], dtype=np.int64)
        for places in (middles, np.arange(len(fields))) if len(middles) else (np.arange(len(fields)),):
            states = _in_basis(basis, moved, fields[places], count)
            error = np.where(np.isin(places, anchors), 0.0, states[2].max(axis=1))
            if error.max(initial=0.0) > PART_OF_TOLERANCE * tolerance_mhz:
                break
        else:
            return basis, states
        worst = int(places[np.argmax(error)])
        anchors.append(worst)
        full.append(_lowest(_at(terms, fields, worst), count + BUFFER)[1])


def _orthonormal(vectors: Matrix) -> Matrix:
    """An orthonormal basis (n, r) of the space of vectors (n, many), without dependent directions."""
    left, sizes, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.ascontiguousarray(left[:, sizes > DEPENDENT * sizes[0]])


def _in_basis(basis: Matrix, moved: Terms, fields: Floats, count: int) -> tuple[Floats, Matrix, Floats]:
    """Energies, vectors and error estimates (fields, count) of the lowest states in a basis; moved: H_n times it."""
    energies, inside = np.linalg.eigh(at_fields(tuple(basis.conj().T @ term for term in moved), fields))
    gaps = np.maximum(energies[:, min(count + BUFFER, energies.shape[1]) - 1, None] - energies[:, :count], 1e-9)
    energies, inside = energies[:, :count], inside[:, :, :count]
    vectors = basis @ inside
    acted = sum(fields[:, None, None] ** n * (term @ inside) for n, term in enumerate(moved))
    residual = acted - energies[:, None, :] * vectors
    return energies, vectors, (np.abs(residual) ** 2).sum(axis=1) / gaps


NODES = 9
FEWEST_FIELDS = 2 * NODES
OVERLAP = 1e-7  # largest overlap of two vectors
FAILURES = 3  # fields of a range at which interpolation may fail
TINY = 1e-300  # instead of 0 in a denominator

Vectors = NDArray[Any]
States = tuple[Floats, Vectors, Floats]  # energies, vectors in columns and errors of the states of one matrix


def interpolated_states(
    matrix_at: Callable[[int], Vectors], fields: Floats, count: int, largest_mhz: float
) -> tuple[Floats, Vectors, Floats]:
    """Energies (f, count), vectors (f, n, count) and errors (f, count) of the lowest states of a matrix at rising fields.

    matrix_at: H (n, n) at the field of a place. largest_mhz: residual of interpolated vectors.
    """
    first = matrix_at(0)
    energies, errors = np.empty((len(fields), count)), np.empty((len(fields), count))
    vectors = np.empty((len(fields), len(first), count), dtype=first.dtype)
    full: dict[int, Vectors] = {}

    def store(place: int, states: States) -> None:
        energies[place], vectors[place], errors[place] = states[0][:count], states[1][:, :count], states[2][:count]

    def solve(place: int) -> Vectors:
        if place not in full:
            values, full[place] = np.linalg.eigh(matrix_at(place))
            store(place, (values, full[place], np.zeros(len(values))))
        return full[place]

    ranges = [(0, len(fields))]
    while ranges:
        start, stop = ranges.pop()
        if stop - start < FEWEST_FIELDS:
            for place in range(start, stop):
                solve(place)
            continue
        anchors = start + chebyshev_places(fields[start:stop])
        at_anchors = _in_one_order(np.array([solve(place) for place in anchors.tolist()]))
        factors, failures = lagrange(fields, fields[anchors]), 0
        for place in range(start, stop):
            if place in full:
                continue
            between = np.tensordot(factors[place], at_anchors, 1)
            if (states := improved(matrix_at(place), between, largest_mhz)) is not None:
                store(place, states)
                continue
            solve(place)
            failures += 1
            if failures > FAILURES:
                middle = (place + 1 + stop) // 2
                ranges += [(middle, stop), (place + 1, middle)]
                break
    return energies, vectors, errors


def _in_one_order(vectors: Vectors) -> Vectors:
    """Eigenvectors at rising fields (anchors, n, n), in place in the order of the field before by overlap, and turned to a positive one."""
    for before, here in pairwise(vectors):
        overlaps = before.conj().T @ here
        alike = np.abs(overlaps).argmax(axis=1)
        if len(np.unique(alike)) == len(alike):
            here[:] = here[:, alike]
            overlaps = overlaps[:, alike]
        overlap = np.diagonal(overlaps)
        here *= (overlap / np.maximum(np.abs(overlap), TINY)).conj()
    return vectors


def chebyshev_places(fields: Floats) -> Ints:
    """Places of the rising fields next to the Chebyshev nodes of their range, with both ends."""
    middle, half = (fields[0] + fields[-1]) / 2, (fields[-1] - fields[0]) / 2
    nodes = middle - half * np.cos(np.pi * np.arange(NODES) / (NODES - 1))
    return np.unique(np.abs(fields[:, None] - nodes).argmin(axis=0))


def improved(matrix: Vectors, vectors: Vectors, largest_mhz: float) -> States | None:
    """Energies, vectors and errors by energy of approximate eigenvectors of a matrix; None if a residual or an overlap is too large."""
    vectors = vectors / np.sqrt(np.einsum("nk,nk->k", vectors.conj(), vectors).real)
    acted = matrix @ vectors
    energies = np.einsum("nk,nk->k", vectors.conj(), acted).real
    acted -= vectors * energies
    residual = np.sqrt(np.einsum("nk,nk->k", acted.conj(), acted).real)
    order = np.argsort(energies, kind="stable")
    energies, vectors, residual = energies[order], vectors[:, order], residual[order]
    if residual.max() > largest_mhz or _overlap(energies, vectors, 2 * largest_mhz / OVERLAP) > OVERLAP:
        return None
    gaps = np.diff(energies, prepend=-np.inf, append=np.inf)
    nearest = np.maximum(np.minimum(gaps[:-1], gaps[1:]) - residual.max(), np.maximum(residual, TINY))
    return energies, vectors, residual**2 / nearest


def _overlap(energies: Floats, vectors: Vectors, close_mhz: float) -> float:
    """The largest overlap of two vectors whose energies, which rise, are close."""
    largest = 0.0
    for step in range(1, len(energies)):
        lower = np.flatnonzero(energies[step:] - energies[:-step] < close_mhz)
        if not len(lower):
            break
        overlaps = np.einsum("nk,nk->k", vectors[:, lower].conj(), vectors[:, lower + step])
        largest = max(largest, float(np.abs(overlaps).max()))
    return largest
