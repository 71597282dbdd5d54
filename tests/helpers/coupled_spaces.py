"""Products of spaces of angular momenta by 9j symbols, in the most general form, as a check of what the package does faster.

A space is a set of sectors, each with a total angular momentum and energies, and tensors by reduced elements between sectors. A product of
two spaces is (A. R. Edmonds, Angular Momentum in Quantum Mechanics, 1957, eq. 7.1.5)

    ⟨(a b)F‖[A^k1 × B^k2]^k‖(a' b')F'⟩ = √((2F+1)(2F'+1)(2k+1)) {a a' k1; b b' k2; F F' k} ⟨a‖A‖a'⟩⟨b‖B‖b'⟩,
    ⟨F|A^k·B^k|F⟩ = (-1)^k √((2k+1)/(2F+1)) ⟨F‖[A^k × B^k]^0‖F⟩.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from rotor.quantum.blocks.connected import connected_parts, elements_by_blocks
from rotor.quantum.operators.wigner import nine_j
from rotor.quantum.spins.coupling import reduced_spin


@dataclass(frozen=True, eq=False)
class Sector:
    """States with one total angular momentum, twice which is `twice_j`."""

    twice_j: int
    energies: np.ndarray

    def __len__(self):
        return len(self.energies)


@dataclass(frozen=True, eq=False)
class Space:
    """Sectors, and tensors by name: their rank, and reduced elements by pairs of sectors."""

    sectors: list
    tensors: dict

    def __len__(self):
        return sum(map(len, self.sectors))

    def starts(self):
        """Row of the first state of each sector, and the number of all states."""
        return np.cumsum([0, *map(len, self.sectors)])

    def labels(self):
        """Twice the total angular momentum, sector and rank of each state."""
        sizes = list(map(len, self.sectors))
        return {
            "twice_j": np.repeat([sector.twice_j for sector in self.sectors], sizes),
            "sector": np.repeat(np.arange(len(sizes)), sizes),
            "rank": np.concatenate([np.arange(size) for size in sizes]),
        }


@dataclass(frozen=True, eq=False)
class Coupled:
    """A product of spaces, its scalar terms (lower triangles by pairs of sectors) not yet solved."""

    sectors: list
    terms: dict
    tensors: dict

    def solve(self, coefficients):
        """The space of eigenfunctions of the energies plus Σ c_i (A_i·B_i)."""
        start = Space(self.sectors, {}).starts()
        parts = connected_parts(len(self.sectors), (pair for entries in self.terms.values() for pair in entries))
        part_of, vectors, solved = {}, [], []
        for part in parts:
            rows = np.concatenate([np.arange(start[i], start[i + 1]) for i in part])
            place = {i: np.searchsorted(rows, start[i]) + np.arange(len(self.sectors[i])) for i in part}
            matrix = np.diag(np.concatenate([self.sectors[i].energies for i in part])).astype(complex)
            for name, value in coefficients.items():
                for (a, b), entry in self.terms[name].items():
                    if a in place:
                        matrix[np.ix_(place[a], place[b])] += value * entry
            energies, states = np.linalg.eigh(matrix)
            part_of |= {i: (len(solved), place[i]) for i in part}
            solved.append(Sector(self.sectors[part[0]].twice_j, energies))
            vectors.append(states)
        return Space(solved, {name: (rank, _moved(of, part_of, vectors)) for name, (rank, of) in self.tensors.items()})


def _moved(entries, part_of, vectors):
    """V† T V between eigenfunctions."""
    out = {}
    for (a, b), entry in entries.items():
        (up, rows), (low, columns) = part_of[a], part_of[b]
        moved = vectors[up][rows].conj().T @ entry @ vectors[low][columns]
        out[up, low] = out[up, low] + moved if (up, low) in out else moved
    return out


def contracted_elements(states, j, tensors):
    """States (rows, energies, vectors) of linear blocks of one J each as a space; tensors: rank and reduced elements by name."""
    sectors = [Sector(2 * int(j[rows[0]]), energies) for rows, energies, _ in states]
    reduced = {}
    for name, (rank, elements) in tensors.items():
        blocks = {}
        members = [rows for rows, _, _ in states]
        for (up, low), (rows, columns, values) in elements_by_blocks(elements, members).items():
            left, right = states[up][2], states[low][2]
            matrix = np.zeros((len(left), len(right)), dtype=values.dtype)
            matrix[rows, columns] = values[0]
            blocks[up, low] = left.conj().T @ (matrix @ right)
        reduced[name] = rank, blocks
    return Space(sectors, reduced)


def spin_space(twice_i):
    """A spin: one state, with the tensors "I" and "Q" = [I × I]² / 2I(2I-1)."""
    ranks = {"I": 1, "Q": 2} if twice_i > 1 else {"I": 1}
    tensors = {name: (rank, {(0, 0): np.full((1, 1), reduced_spin(twice_i, rank))}) for name, rank in ranks.items()}
    return Space([Sector(twice_i, np.zeros(1))], tensors)


def coupled(first, second, scalars, carried, totals):
    """The product of two spaces, coupled to the doubled total angular momenta `totals`.

    scalars: the names of A and B of terms A·B. carried: A and k of tensors [A × 1]^k for later use.
    """
    sectors, rows = [], {}
    for (i, a), (j, b) in product(enumerate(first.sectors), enumerate(second.sectors)):
        lowest, highest = abs(a.twice_j - b.twice_j), a.twice_j + b.twice_j
        rows[i, j] = {}
        for total in totals:
            if lowest <= total <= highest and (highest - total) % 2 == 0:
                rows[i, j][total] = len(sectors)
                sectors.append(Sector(total, (a.energies[:, None] + b.energies).ravel()))
    terms = {}
    for name, (left, right) in scalars.items():
        rank = first.tensors[left][0]
        entries = _product(first, second, first.tensors[left], second.tensors[right], 0, rows)
        root = (-1.0) ** rank * np.sqrt(2.0 * rank + 1)
        terms[name] = {
            (r, c): root / np.sqrt(sectors[r].twice_j + 1.0) * entry for (r, c), entry in entries.items() if c <= r
        }
    unit = 0, {(i, i): np.sqrt(s.twice_j + 1) * np.eye(len(s)) for i, s in enumerate(second.sectors)}
    tensors = {
        name: (rank, _product(first, second, first.tensors[left], unit, rank, rows))
        for name, (left, rank) in carried.items()
    }
    return Coupled(sectors, terms, tensors)


def _product(first, second, left, right, rank, rows):
    """[A × B]^k by pairs of sectors, without elements whose symbol is 0."""
    out = {}
    for ((a, c), in_first), ((b, d), in_second) in product(left[1].items(), right[1].items()):
        j, k = (
            (first.sectors[a].twice_j, first.sectors[c].twice_j),
            (second.sectors[b].twice_j, second.sectors[d].twice_j),
        )
        for (total, row), (other, column) in product(rows[a, b].items(), rows[c, d].items()):
            if abs(total - other) <= 2 * rank <= total + other:
                symbol = nine_j(np.array([[*j, 2 * left[0]], [*k, 2 * right[0]], [total, other, 2 * rank]]) / 2)
                if symbol:
                    root = np.sqrt((total + 1.0) * (other + 1) * (2 * rank + 1))
                    out[row, column] = root * symbol * np.kron(in_first, in_second)
    return out
