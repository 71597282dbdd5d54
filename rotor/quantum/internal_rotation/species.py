"""Labelled levels of one species of a molecule with an internal rotor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import Elements
from rotor.quantum.blocks import LinearBlocks, blocks_of_elements
from rotor.quantum.internal_rotation.contracted import Product, Terms
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.labels import (
    counted_ka_kc,
    kc_of_pairs,
    kc_of_parity,
    named_by_energy,
    named_by_overlap,
    torsional_numbers,
)
from rotor.quantum.operators.algebra import Operator


@dataclass(frozen=True, eq=False)
class SpeciesHamiltonian:
    """H_b(c) = Σ c_i O_i,b of one species over torsion-rotation functions.

    needed: functions whose blocks are made; None for all. Elements of each term are computed at first use, for fits that solve at many
    values; `solve_once` computes only those of the sum.
    """

    functions: TorsionRotation
    terms: Terms
    needed: NDArray[np.bool_] | None = None

    @cached_property
    def elements(self) -> Elements:
        """Elements of each term."""
        return self.functions.elements(list(self.terms.values()))

    @cached_property
    def linear(self) -> LinearBlocks:
        """The connected blocks of all terms."""
        return blocks_of_elements(self.functions.labels, self.elements, self.needed)

    def solve(self, coefficients: ArrayLike, vt_max: int, by_energy: bool = False) -> SpeciesLevels:
        """Levels with v_t up to `vt_max`; `by_energy` counts Ka and Kc by energy inside v_t."""
        return self._solved(self.linear, coefficients, vt_max, by_energy)

    def solve_once(self, coefficients: ArrayLike, vt_max: int, by_energy: bool = False) -> SpeciesLevels:
        """Levels as from `solve`, faster where no other values follow."""
        return self._solved(self.summed(coefficients), [1.0], vt_max, by_energy)

    def summed(self, coefficients: ArrayLike, below_mhz: float = math.inf) -> LinearBlocks:
        """Blocks of the single term H at these coefficients, over functions whose Gershgorin discs reach below `below_mhz`."""
        merged = _merged(self.terms, np.asarray(coefficients, dtype=float))
        elements = self.functions.symmetry_allowed(self.functions.elements([merged], half=below_mhz == math.inf))
        needed = self.needed
        if below_mhz < math.inf:
            value = np.where(elements.rows == elements.columns, elements.values[0].real, -np.abs(elements.values[0]))
            low = np.bincount(elements.rows, value, elements.count) <= below_mhz
            elements = elements.between(low)
            needed = low if needed is None else low & needed
        return blocks_of_elements(self.functions.labels, elements, needed)

    def _solved(self, linear: LinearBlocks, coefficients: ArrayLike, vt_max: int, by_energy: bool) -> SpeciesLevels:
        values = np.asarray(coefficients, dtype=float)
        solved = linear.solve(values, linear.labels["t"] <= vt_max)
        return SpeciesLevels(self, solved, _zeroth_order(linear, values), vt_max, by_energy)


def _merged(terms: Terms, coefficients: Floats) -> list[Product]:
    """Σ c_i O_i with one product for each operator of the torsion."""
    rotations: dict[Operator | None, Operator] = {}
    for products, coefficient in zip(terms.values(), coefficients.tolist(), strict=True):
        for product in products if coefficient else ():
            partial_sum = rotations.get(product.torsion, Operator())
            rotations[product.torsion] = partial_sum + coefficient * product.rotation
    return [Product(rotation, torsion) for torsion, rotation in rotations.items()]


def _zeroth_order(linear: LinearBlocks, coefficients: Floats) -> Floats:
    """⟨J K t|H|J K t⟩ of the functions; s = ±1 share their mean, which leaves out the coupling of K and -K."""
    diagonal = np.zeros(len(linear.block))
    for number, block in linear.blocks.items():
        diagonal[linear.members[number]] = block.diagonal(coefficients)
    labels = linear.labels
    minus = np.flatnonzero((labels["s"] < 0) & (labels["K"] > 0))
    plus = np.flatnonzero((labels["s"] > 0) & (labels["K"] > 0))
    if len(minus) == len(plus) > 0:  # both lists have the same order of J, K, t
        diagonal[plus] = diagonal[minus] = (diagonal[plus] + diagonal[minus]) / 2
    return diagonal


@dataclass(frozen=True, eq=False)
class SpeciesLevels:
    """Labelled levels of one species with v_t ≤ vt_max, by block in order of energy; `rows` are their places in the arrays of `solved`."""

    source: SpeciesHamiltonian
    solved: LinearBlocks
    zeroth_order: Floats
    vt_max: int
    by_energy: bool = False

    @property
    def functions(self) -> TorsionRotation:
        """The functions |J K⟩|K t⟩."""
        return self.source.functions

    @cached_property
    def _named(self) -> tuple[Ints, Ints, Ints]:
        """Rows, v_t, and the function that labels each level."""
        t = self.functions.labels["t"]
        rows, numbers, names = [], [], []
        for block in self.blocks:
            members, (_, vectors) = self.solved.members[block], self.solved.states[block]
            v = torsional_numbers(vectors, t[members])
            if self.functions.torsion.sigma and self.functions.torsion.is_near_free:
                name = named_by_overlap(v, t[members], vectors)
            else:
                name = named_by_energy(v, t[members], self.zeroth_order[members])
            retained = np.flatnonzero((v >= 0) & (v <= self.vt_max))
            rows.append(members[retained])
            numbers.append(v[retained])
            names.append(members[name[retained]])
        return np.concatenate(rows), np.concatenate(numbers), np.concatenate(names)

    @property
    def blocks(self) -> list[int]:
        """Numbers of the blocks."""
        return list(self.solved.members)

    @property
    def rows(self) -> Ints:
        """Rows of the levels in the arrays of `solved`."""
        return self._named[0]

    @property
    def energies(self) -> Floats:
        """Energies in MHz above the minimum of the torsional potential."""
        return np.asarray(self.solved.energies_mhz[self.rows])

    @cached_property
    def quanta(self) -> dict[str, Ints]:
        """J, v_t, K (signed; not negative for σ = 0), Ka and Kc."""
        _, v, name = self._named
        labels = self.functions.labels
        j, k = labels["J"][name], labels["K"][name]
        if self.by_energy:
            k, kc = counted_ka_kc(j, v, self.energies)
        elif self.functions.has_parity:
            kc = kc_of_parity(j, k, self._parity(name, v))
        else:
            kc = kc_of_pairs({"J": j, "vt": v}, k, self.energies)
        return {"j": j, "vt": v, "k": k, "ka": np.abs(k), "kc": kc}

    def _parity(self, name: Ints, v: Ints) -> Ints:
        """(-1)^(J + Kc) of the levels that these functions label."""
        s = self.functions.labels["s"][name]
        return np.asarray(s * self.functions.torsion.parity[v] if self.functions.folded else s)

    def slopes(self, rows: Ints | None = None) -> Floats:
        """∂E/∂c (levels, terms) of the levels at `rows` of `solved`; by default of all levels."""
        return self.solved.slopes_of(self.source.elements, self.rows if rows is None else rows)
