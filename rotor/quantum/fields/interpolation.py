"""All states of a Hamiltonian Σ x^n H_n at many fields x, where the field changes them little: eigenvectors interpolated in the field.

The matrix is solved in full at fields near the nodes of Chebyshev. Their eigenvectors, in the order of those of the field before by overlap
and turned to a real positive one, are interpolated by the polynomial of Lagrange. With E_i = ⟨i|H|i⟩ of the interpolated vectors and the
residual r_i = H|i⟩ - E_i|i⟩, an eigenvalue lies within |r_i| of E_i. It lies within |r_i|²/gap, too: if no eigenvalue is between λ and μ,
then 0 ≤ ⟨(H - λ)(H - μ)⟩ = |r|² + (E - λ)(E - μ). Since (E_k - E_i)⟨i|k⟩ = ⟨i|r_k⟩ - ⟨r_i|k⟩, vectors of small residual are orthogonal
unless their energies nearly coincide; these overlaps are computed. As many orthogonal vectors as functions are all states, so that their
order in energy is known. A field at which a residual or an overlap is too large, such as near an avoided crossing, is solved in full; after
a few of them the fields that remain are divided into halves.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints

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
        between = Interpolation(fields, anchors, np.array([solve(place) for place in anchors.tolist()]))
        failures = 0
        for place in range(start, stop):
            if place in full:
                continue
            if (states := improved(matrix_at(place), between.at(place), largest_mhz)) is not None:
                store(place, states)
                continue
            solve(place)
            failures += 1
            if failures > FAILURES:
                middle = (place + 1 + stop) // 2
                ranges += [(middle, stop), (place + 1, middle)]
                break
    return energies, vectors, errors


class Interpolation:
    """Interpolated states between full solutions at a few of the rising fields.

    anchors: places of the fields solved in full. vectors (anchors, n, n): their eigenvectors, which are ordered and turned in place.
    """

    def __init__(self, fields: Floats, anchors: Ints, vectors: Vectors) -> None:
        for before, here in pairwise(vectors):
            overlaps = before.conj().T @ here
            alike = np.abs(overlaps).argmax(axis=1)
            if len(np.unique(alike)) == len(alike):
                here[:] = here[:, alike]
                overlaps = overlaps[:, alike]
            overlap = np.diagonal(overlaps)
            here *= (overlap / np.maximum(np.abs(overlap), TINY)).conj()
        self.vectors, self.factors = vectors, _lagrange(fields, fields[anchors])

    def at(self, place: int) -> Vectors:
        """Normalised vectors (n, n) at a field."""
        vectors = np.tensordot(self.factors[place], self.vectors, 1)
        vectors /= np.sqrt(np.einsum("nk,nk->k", vectors.conj(), vectors).real)
        return np.asarray(vectors)


def _lagrange(fields: Floats, nodes: Floats) -> Floats:
    """Factors (fields, nodes) of the values at nodes in the polynomial through them."""
    apart = fields[:, None] - nodes
    others = ~np.eye(len(nodes), dtype=bool)
    above = np.array([apart[:, rest].prod(axis=1) for rest in others]).T
    return np.asarray(above / np.array([(node - nodes[rest]).prod() for node, rest in zip(nodes, others, strict=True)]))


def chebyshev_places(fields: Floats) -> Ints:
    """Places of the rising fields next to the Chebyshev nodes of their range, with both ends."""
    middle, half = (fields[0] + fields[-1]) / 2, (fields[-1] - fields[0]) / 2
    nodes = middle - half * np.cos(np.pi * np.arange(NODES) / (NODES - 1))
    return np.unique(np.abs(fields[:, None] - nodes).argmin(axis=0))


def improved(matrix: Vectors, vectors: Vectors, largest_mhz: float) -> States | None:
    """Energies, vectors and errors by energy of approximate eigenvectors of a matrix; None if a residual or an overlap is too large."""
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
