"""Helpers of tests with linear blocks over labelled functions: products, real functions, real phases, and contraction of blocks."""

from __future__ import annotations

import numpy as np
from coupled_spaces import Space, contracted_elements

from rotor.quantum.basis.labelled import Elements, merged
from rotor.quantum.blocks.connected import connected_blocks, part_numbers
from rotor.quantum.operators.algebra import shift

NEGLIGIBLE = 1e-12  # of the largest element of an operator between two sectors: round-off of zero
PURE = 1e-10  # share of the other part of an element up to which it counts as real, or as imaginary


def product(*factors):
    """Labels of the products of functions of several factors, the last factor running fastest."""
    labels, count = {}, 1
    for factor in factors:
        size = len(next(iter(factor.values())))
        labels = {name: np.repeat(column, size) for name, column in labels.items()}
        labels |= {name: np.tile(np.asarray(column), count) for name, column in factor.items()}
        count *= size
    return labels


def ket_bra(new, old, label="v"):
    """|new⟩⟨old| of one label, such as the number of a vibrational state."""
    return shift(lambda labels: np.asarray(labels[label] == old, dtype=float), **{label: new - old})


class RealFunctions:
    """The functions |a ±) of a basis under time reversal θ, θ|a⟩ = ε_a |a'⟩ with K to -K, k to -k and ε = (-1)^K.

        |a +) = φ (|a⟩ + θ|a⟩)/√2,    |a -) = i φ (|a⟩ - θ|a⟩)/√2,    φ = i^J,

    for a function that is its own partner φ|a⟩ where ε = 1 and iφ|a⟩ where ε = -1; the pair a, a' stands at the rows of a (+) and a' (-).
    Scalars that θ leaves alone have real elements between them; tensors of odd rank are i times real.
    """

    def __init__(self, basis):
        self.basis = basis
        rows = np.arange(len(basis))
        changed = {name: -basis.labels[name] for name in ("K", "k") if name in basis.labels}
        sign = np.where(basis.labels["K"] % 2, -1.0, 1.0)
        partner = basis.rows({**basis.labels, **changed})
        later, alone = rows >= partner, rows == partner
        phase = 1j ** (np.asarray(basis.labels["J"]) % 4)
        half = 1 / np.sqrt(2)
        plus = np.where(alone, np.where(sign > 0, 1.0, 1.0j), half * np.where(later, 1.0, sign))
        minus = np.where(alone, 0.0, 1j * half * np.where(later, 1.0, -sign))
        representative = np.where(later, rows, partner)
        self.labels = {name: column[representative] for name, column in basis.labels.items()}
        self.labels["s"] = np.where(later, np.where(alone & (sign < 0), -1, 1), -1)
        self._functions = np.stack([representative, np.where(later, partner, rows)])
        self._factors = np.stack([plus, minus]) * phase

    def elements(self, operators):
        """Elements of operators between the real functions."""
        plain = self.basis.elements(operators)
        pieces = []
        for a in (0, 1):
            for b in (0, 1):
                factor = self._factors[a, plain.rows].conj() * self._factors[b, plain.columns]
                acts = np.flatnonzero(factor)
                rows, columns = self._functions[a, plain.rows[acts]], self._functions[b, plain.columns[acts]]
                pieces.append((rows, columns, plain.values[:, acts] * factor[acts]))
        rows, columns, values = (np.concatenate(piece, axis=-1) for piece in zip(*pieces, strict=True))
        return merged(plain.count, rows, columns, values)


def with_real_phases(elements):
    """The elements with phases 1 or i of the functions, real if any such choice makes all of them real, unchanged otherwise.

    A real element between two functions asks for equal phases, an imaginary one for different ones. Each function stands twice in a graph,
    once for either phase; a choice exists where no function is connected with its other self.
    """
    if not np.iscomplexobj(elements.values):
        return elements
    real, imaginary = np.abs(elements.values.real), np.abs(elements.values.imag)
    scale = np.maximum(np.abs(elements.values).max(axis=1, initial=0.0), np.finfo(float).tiny)[:, None]
    real_share, imaginary_share = (real / scale).max(axis=0), (imaginary / scale).max(axis=0)
    if (np.minimum(real_share, imaginary_share) > PURE).any():
        return elements
    n, rows, columns = elements.count, elements.rows, elements.columns
    odd = np.where(imaginary_share > real_share, 1, 0)
    doubled = np.concatenate([rows, rows + n]), np.concatenate([columns + n * odd, columns + n * (1 - odd)])
    part = part_numbers(2 * n, *doubled)
    if (part[:n] == part[n:]).any():
        return elements
    quarters = np.asarray(part[:n] > part[n:], dtype=np.int64)
    turned = elements.values * 1j ** ((quarters[columns] - quarters[rows]) % 4)
    return Elements(n, rows, columns, np.ascontiguousarray(turned.real))


def energies_of(blocks, count, values):
    """Energies of linear blocks at values of their terms, at the rows of so many functions; nan for those of no block."""
    energies = np.full(count, np.nan)
    for rows, block in blocks:
        energies[rows] = block.energies(np.array(values))
    return energies


def states_of(blocks, values):
    """The rows of the functions of each linear block, its energies and vectors at values of its terms."""
    return [(rows, *np.linalg.eigh(block.lower(np.array(values)))) for rows, block in blocks]


def slopes_of(states, elements):
    """⟨ψ|O|ψ⟩ (functions, operators) of the states of linear blocks."""
    slopes = np.zeros((elements.count, len(elements.values)))
    for number in range(len(elements.values)):
        matrix = elements.dense(number)
        for rows, _, vectors in states:
            slopes[rows, number] = (vectors.conj() * (matrix[np.ix_(rows, rows)] @ vectors)).sum(axis=0).real
    return slopes


def contracted(states, functions, tensors):
    """The eigenfunctions of linear blocks as a space; tensors: rank and operator by name."""
    elements = {name: (rank, functions.elements([operator])) for name, (rank, operator) in tensors.items()}
    return contracted_elements(states, functions.labels["J"], elements)


def flat_elements(count, terms, pieces):
    """Elements of pieces (rows, columns, number of the term, values)."""
    rows, columns, term, values = zip(*pieces, strict=True)
    number = np.repeat(term, [len(piece) for piece in rows])
    joined = np.concatenate(values)
    table = np.zeros((terms, len(joined)), dtype=joined.dtype)
    table[number, np.arange(len(joined))] = joined
    return merged(count, np.concatenate(rows), np.concatenate(columns), table)


def linear_blocks_of_coupled(coupled):
    """Linear blocks of the energies before coupling ("energy") and of the coupled terms of a product of two spaces."""
    space = Space(coupled.sectors, {})
    start, count = space.starts(), len(space)
    diagonal = np.arange(count)
    pieces = [(diagonal, diagonal, 0, np.concatenate([sector.energies for sector in coupled.sectors]))]
    names = ["energy", *coupled.terms]
    for i, entries in enumerate(coupled.terms.values(), 1):
        for (a, b), entry in entries.items():
            r, c = np.nonzero(np.abs(entry) > NEGLIGIBLE * np.abs(entry).max(initial=0.0))
            pieces.append((start[a] + r, start[b] + c, i, entry[r, c]))
            if a != b:
                pieces.append((start[b] + c, start[a] + r, i, entry[r, c].conj()))
    return connected_blocks(space.labels(), with_real_phases(flat_elements(count, len(names), pieces)))
