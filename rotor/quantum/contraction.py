"""Solved parts as the basis of the next factor: coupled angular momenta, spins, and fields.

A *space* is a set of sectors, each with a total angular momentum and energies, and tensor operators by reduced matrix elements between
sectors. The eigenfunctions of linear blocks make a space (`contracted`); a space times a spin is a space again, with (Edmonds, Angular
Momentum in Quantum Mechanics, 1957, eq. 7.1.5)

    ⟨(a b)F‖[A^k1 × B^k2]^k‖(a' b')F'⟩ = √((2F+1)(2F'+1)(2k+1)) {a a' k1; b b' k2; F F' k} ⟨a‖A‖a'⟩⟨b‖B‖b'⟩,
    ⟨F|A^k·B^k|F⟩ = (-1)^k √((2k+1)/(2F+1)) ⟨F‖[A^k × B^k]^0‖F⟩,

and in a field along z (eq. 5.4.1) ⟨F M|T^k_0|F' M⟩ = (-1)^(F-M) (F k F'; -M 0 M) ⟨F‖T^k‖F'⟩. Coupled terms and fields make linear blocks
again, so that fits, fields and further spins need nothing else.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import Elements
from rotor.quantum.blocks import LinearBlocks, SolvedBlocks
from rotor.quantum.connected import connected_parts
from rotor.quantum.one_to_one import match_names
from rotor.quantum.solvers.hermitian import eigenstates
from rotor.quantum.spins.coupling import reduced_spin
from rotor.quantum.wigner import nine_j

Pair = tuple[int, int]  # row and column of sectors


@dataclass(frozen=True, eq=False)
class Sector:
    """States with one total angular momentum, twice which is `twice_j`: energies (n,), and labels that name their origin."""

    twice_j: int
    energies: Floats
    labels: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.energies)


@dataclass(frozen=True, eq=False)
class Tensor:
    """A tensor operator of a rank: reduced matrix elements by pairs of sectors."""

    rank: int
    blocks: Mapping[Pair, NDArray[Any]]


class Entry(NamedTuple):
    """factor · A ⊗ B between two sectors of a product, A and B being shared by all total angular momenta."""

    factor: float
    first: NDArray[Any]
    second: NDArray[Any]

    def matrix(self) -> NDArray[Any]:
        """The product written out."""
        if self.second.shape == (1, 1):
            return np.asarray(self.factor * self.second[0, 0] * self.first)
        return np.asarray(self.factor * np.kron(self.first, self.second))


@dataclass(frozen=True, eq=False)
class Space:
    """Sectors, and tensors between them by name."""

    sectors: tuple[Sector, ...]
    tensors: Mapping[str, Tensor]

    def __len__(self) -> int:
        return sum(len(sector) for sector in self.sectors)

    @property
    def unit(self) -> Tensor:
        """The unit operator as a tensor of rank 0: ⟨F‖1‖F⟩ = √(2F+1)."""
        return Tensor(0, {(i, i): np.sqrt(s.twice_j + 1) * np.eye(len(s)) for i, s in enumerate(self.sectors)})

    def starts(self) -> Ints:
        """Row of the first state of each sector, and the number of all states."""
        return np.cumsum([0, *[len(sector) for sector in self.sectors]])

    def labels(self) -> dict[str, Ints]:
        """Twice the total angular momentum, sector and rank of each state."""
        sizes = [len(sector) for sector in self.sectors]
        return {
            "twice_j": np.repeat([sector.twice_j for sector in self.sectors], sizes),
            "sector": np.repeat(np.arange(len(sizes)), sizes),
            "rank": np.concatenate([np.arange(size) for size in sizes]),
        }


def contracted_elements(
    solved: SolvedBlocks, tensors: Mapping[str, tuple[int, Elements]], retained: Mapping[int, Ints] | None = None
) -> Space:
    """The eigenfunctions of linear blocks of one J each as a space, one sector for each block, in the order of their numbers.

    tensors: rank and reduced elements by name. retained: by block the ranks of the states to take; all by default.
    """
    linear = solved.linear
    present = [
        int(n) for n in np.unique(linear.block) if n >= 0 and (retained is None or len(retained.get(int(n), ())))
    ]
    number = {block: i for i, block in enumerate(present)}
    states = [solved.vectors(block) for block in present]
    ranks = [
        np.arange(v.shape[1]) if retained is None else retained[n] for n, (_, v) in zip(present, states, strict=True)
    ]
    states = [(rows, vectors[:, rank]) for (rows, vectors), rank in zip(states, ranks, strict=True)]
    sectors = []
    for block, (rows, _), rank in zip(present, states, ranks, strict=True):
        energies = solved.energies[rows[rank]]
        labels = {"block": block, "functions": rows[rank]}
        sectors.append(Sector(2 * int(linear.labels["J"][rows[0]]), energies, labels))
    reduced = {
        name: Tensor(rank, _between_blocks(linear, states, number, elements))
        for name, (rank, elements) in tensors.items()
    }
    return Space(tuple(sectors), reduced)


def _between_blocks(
    linear: LinearBlocks, states: Sequence[tuple[Ints, NDArray[Any]]], number: Mapping[int, int], elements: Elements
) -> dict[Pair, NDArray[Any]]:
    """V† O V of each pair of blocks that an operator connects."""
    blocks = {}
    for (up, low), (rows, columns, values) in linear.between_blocks(elements, np.array([*number])).items():
        left, right = states[number[up]][1], states[number[low]][1]
        matrix = np.zeros((len(left), len(right)), dtype=values.dtype)
        matrix[rows, columns] = values[0]
        blocks[number[up], number[low]] = left.conj().T @ (matrix @ right)
    return blocks


def spin_space(twice_i: int) -> Space:
    """A spin: one state, with the tensors "I" and, for I ≥ 1, "Q" = [I × I]² / 2I(2I-1), see `reduced_spin`.

    >>> round(float(spin_space(2).tensors["I"].blocks[0, 0][0, 0] ** 2), 9)  # I(I+1)(2I+1)
    6.0
    """
    ranks = {"I": 1, "Q": 2} if twice_i > 1 else {"I": 1}
    tensors = {k: Tensor(rank, {(0, 0): np.full((1, 1), reduced_spin(twice_i, rank))}) for k, rank in ranks.items()}
    return Space((Sector(twice_i, np.zeros(1)),), tensors)


@dataclass(frozen=True, eq=False)
class CoupledSpace:
    """A product of two spaces by total angular momentum, its scalar terms not yet solved.

    space: the product functions with the tensors that were carried along, written out when asked for. terms: of each scalar product the
    entries of the lower triangle of sectors.
    """

    sectors: tuple[Sector, ...]
    terms: Mapping[str, Mapping[Pair, Entry]]
    tensors: Mapping[str, tuple[int, Mapping[Pair, Entry]]]

    def solve(self, coefficients: Mapping[str, float]) -> Space:
        """The space of eigenfunctions of the energies plus Σ c_i (A_i·B_i)."""
        parts = connected_parts(len(self.sectors), (pair for entries in self.terms.values() for pair in entries))
        states, where = _solved_parts(self, parts, coefficients)
        tensors = {name: Tensor(rank, _moved(entries, states, where)) for name, (rank, entries) in self.tensors.items()}
        return Space(tuple(sector for sector, _ in states), tensors)


def coupled(
    first: Space,
    second: Space,
    scalars: Mapping[str, tuple[str, str]],
    carried: Mapping[str, tuple[str | None, str | None, int]],
    totals: Sequence[int],
) -> CoupledSpace:
    """The product of two spaces, coupled to the doubled total angular momenta `totals`.

    scalars: the terms A·B by name, with the names of A and B. carried: tensors [A × B]^k for later use: A, B (None: the unit operator) and
    k.
    """
    sectors: list[Sector] = []
    rows: dict[Pair, dict[int, int]] = {}
    for (i, a), (j, b) in product(enumerate(first.sectors), enumerate(second.sectors)):
        rows[i, j] = {}
        for total in totals:
            if (
                abs(a.twice_j - b.twice_j) <= total <= a.twice_j + b.twice_j
                and (a.twice_j + b.twice_j - total) % 2 == 0
            ):
                rows[i, j][total] = len(sectors)
                energies = (a.energies[:, None] + b.energies).ravel()
                sectors.append(Sector(total, energies, {"factors": (i, j)}))
    terms = {}
    for name, (left, right) in scalars.items():
        a_tensor, b_tensor = first.tensors[left], second.tensors[right]
        root = (-1.0) ** a_tensor.rank * np.sqrt(2.0 * a_tensor.rank + 1)
        terms[name] = {
            (row, column): entry._replace(factor=root / np.sqrt(sectors[row].twice_j + 1.0) * entry.factor)
            for (row, column), entry in _product(first, second, a_tensor, b_tensor, 0, rows).items()
            if column <= row
        }
    tensors = {}
    for name, (first_name, other, rank) in carried.items():
        left_tensor = first.tensors[first_name] if first_name else first.unit
        right_tensor = second.tensors[other] if other else second.unit
        tensors[name] = rank, _product(first, second, left_tensor, right_tensor, rank, rows)
    return CoupledSpace(tuple(sectors), terms, tensors)


def _product(
    first: Space, second: Space, left: Tensor, right: Tensor, rank: int, rows: Mapping[Pair, Mapping[int, int]]
) -> dict[Pair, Entry]:
    """[A × B]^k in the coupled functions (Edmonds 7.1.5), without elements whose symbol is 0."""
    places, numbers, factors = list[Pair](), list[Any](), list[tuple[NDArray[Any], NDArray[Any]]]()
    for ((a, c), in_first), ((b, d), in_second) in product(left.blocks.items(), right.blocks.items()):
        j = first.sectors[a].twice_j, first.sectors[c].twice_j
        other_j = second.sectors[b].twice_j, second.sectors[d].twice_j
        for (total, row), (other, column) in product(rows[a, b].items(), rows[c, d].items()):
            if abs(total - other) <= 2 * rank <= total + other:
                places.append((row, column))
                numbers.append(([*j, 2 * left.rank], [*other_j, 2 * right.rank], [total, other, 2 * rank]))
                factors.append((in_first, in_second))
    if not places:
        return {}
    twice = np.array(numbers)
    roots = np.sqrt((twice[:, 2, 0] + 1.0) * (twice[:, 2, 1] + 1) * (2 * rank + 1))
    values = (roots * nine_j(twice / 2)).tolist()
    return {place: Entry(value, *both) for place, value, both in zip(places, values, factors, strict=True) if value}


def _solved_parts(
    space: CoupledSpace, parts: Sequence[Sequence[int]], coefficients: Mapping[str, float]
) -> tuple[list[tuple[Sector, NDArray[Any]]], dict[int, tuple[int, slice]]]:
    """Sectors of eigenfunctions with their vectors, and (part, rows) of each sector of the product."""
    where: dict[int, tuple[int, slice]] = {}
    matrices: list[NDArray[Any]] = []
    for number, part in enumerate(parts):
        start = 0
        for sector in part:
            where[sector] = number, slice(start, start + len(space.sectors[sector]))
            start += len(space.sectors[sector])
        matrices.append(np.diag(np.concatenate([space.sectors[sector].energies for sector in part])))
    for name, value in coefficients.items():
        for (a, b), entry in space.terms[name].items():
            number, up = where[a]
            matrix = value * entry.matrix()
            if np.iscomplexobj(matrix) and not np.iscomplexobj(matrices[number]):
                matrices[number] = matrices[number].astype(complex)
            matrices[number][up, where[b][1]] += matrix
    by_size: dict[tuple[int, bool], list[int]] = defaultdict(list)
    for number, matrix in enumerate(matrices):
        by_size[len(matrix), np.iscomplexobj(matrix)].append(number)
    solved: dict[int, tuple[Sector, NDArray[Any]]] = {}
    for numbers in by_size.values():
        energies, vectors = eigenstates(np.stack([matrices[number] for number in numbers]))
        for number, e, v in zip(numbers, energies, vectors, strict=True):
            labels = {
                "sectors": tuple(parts[number]),
                "functions": _named_functions(space, parts[number], v),
                "vectors": v,
            }
            solved[number] = Sector(space.sectors[parts[number][0]].twice_j, e, labels), v
    return [solved[number] for number in range(len(parts))], where


def _named_functions(space: CoupledSpace, part: Sequence[int], vectors: NDArray[Any]) -> Ints:
    """(sector, rank) (states, 2) of the product function that each state mostly is: one to one where all states are there."""
    places = np.array([(sector, rank) for sector in part for rank in range(len(space.sectors[sector]))])
    shares = np.abs(vectors) ** 2
    whole = vectors.shape[0] == vectors.shape[1]
    return np.asarray(places[match_names(shares) if whole else shares.argmax(axis=0)])


def _moved(
    entries: Mapping[Pair, Entry], states: Sequence[tuple[Sector, NDArray[Any]]], where: Mapping[int, tuple[int, slice]]
) -> dict[Pair, NDArray[Any]]:
    """V† T V over the eigenfunctions, of whole parts: one product for many pairs of sectors."""
    blocks: dict[Pair, NDArray[Any]] = {}
    for (a, b), entry in entries.items():
        (up, rows), (low, columns) = where[a], where[b]
        matrix = entry.matrix()
        if (up, low) not in blocks:
            blocks[up, low] = np.zeros((len(states[up][1]), len(states[low][1])), dtype=matrix.dtype)
        elif np.iscomplexobj(matrix) and not np.iscomplexobj(blocks[up, low]):
            blocks[up, low] = blocks[up, low].astype(complex)
        blocks[up, low][rows, columns] = matrix
    return {(up, low): states[up][1].conj().T @ (matrix @ states[low][1]) for (up, low), matrix in blocks.items()}
