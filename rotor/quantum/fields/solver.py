"""The lowest states of a Hamiltonian that is a polynomial in a field, H(x) = Σ x^n H_n, at many fields.

Small matrices are solved for all fields at once. Large ones are solved in full at a few fields. Their eigenvectors, a few more than
requested, span a small space for the fields between, and an error estimate shows where another field must be solved in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.fields.chains import chain_states, is_chain
from rotor.quantum.fields.interpolation import FEWEST_FIELDS, interpolated_states

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
