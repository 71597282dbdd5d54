"""Labelled levels of one species of a molecule with an internal rotor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.labelled import Elements
from rotor.quantum.blocks.connected import FunctionBlocks, connected_blocks
from rotor.quantum.blocks.dominated import dominated_states, is_dominated
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.internal_rotation.contracted import Product, Terms
from rotor.quantum.internal_rotation.expectations import Expectations
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.labels import (
    counted_ka_kc,
    functions_of_states,
    kc_of_pairs,
    kc_of_parity,
    torsional_numbers,
)
from rotor.quantum.operators.algebra import Operator


@dataclass(frozen=True, eq=False)
class SpeciesHamiltonian:
    """H_b(c) = Σ c_i O_i,b of one species over torsion-rotation functions.

    needed: functions whose blocks are made; None for all. Elements of each term are computed at first use, for fits that solve at many
    values; `solve_once` computes only those of the sum. normal: the principal axis along y. by_energy: whether
    Ka and Kc are always counted by energy inside v_t.
    """

    functions: TorsionRotation
    terms: Terms
    needed: NDArray[np.bool_] | None = None
    normal: str = "c"
    by_energy: bool = False

    @cached_property
    def elements(self) -> Elements:
        """Elements of each term."""
        return self.functions.elements(list(self.terms.values()))

    @cached_property
    def linear(self) -> FunctionBlocks:
        """The connected blocks of all terms."""
        return connected_blocks(self.functions.labels, self.elements, self.needed)

    def solve(self, coefficients: ArrayLike, vt_max: int, by_energy: bool = False) -> SpeciesLevels:
        """Levels with v_t up to `vt_max`; `by_energy` counts Ka and Kc by energy inside v_t."""
        return self._solved(self.linear, coefficients, vt_max, by_energy)

    def solve_once(self, coefficients: ArrayLike, vt_max: int, by_energy: bool = False) -> SpeciesLevels:
        """Levels as from `solve`, faster where no other values follow."""
        return self._solved(self.summed(coefficients), [1.0], vt_max, by_energy)

    def summed(self, coefficients: ArrayLike, below_mhz: float = math.inf) -> FunctionBlocks:
        """Blocks of the single term H at these coefficients, over functions whose Gershgorin discs reach below `below_mhz`."""
        merged = _merged(self.terms, np.asarray(coefficients, dtype=float))
        elements = self.functions.symmetry_allowed(self.functions.elements([merged], half=below_mhz == math.inf))
        needed = self.needed
        if below_mhz < math.inf:
            value = np.where(elements.rows == elements.columns, elements.values[0].real, -np.abs(elements.values[0]))
            low = np.bincount(elements.rows, value, elements.count) <= below_mhz
            elements = elements.where(low[elements.rows] & low[elements.columns])
            needed = low if needed is None else low & needed
        return connected_blocks(self.functions.labels, elements, needed)

    def _solved(self, linear: FunctionBlocks, coefficients: ArrayLike, vt_max: int, by_energy: bool) -> SpeciesLevels:
        values = np.asarray(coefficients, dtype=float)
        zeroth_order, torsion = self._zeroth_order(linear, values), self.functions.torsion
        labels, by_overlap = self.functions.labels["t"], torsion.sigma and torsion.is_near_free
        solved = [states_of(block, values, labels[rows] <= vt_max) for rows, block in linear]
        levels, states, highest = [], [], []
        for (rows, _), (energies, vectors) in zip(linear, solved, strict=True):
            t = labels[rows]
            vt = torsional_numbers(vectors, t, vt_max)
            name = functions_of_states(vt, t, vectors, None if by_overlap else zeroth_order[rows])
            retained = np.flatnonzero(vt >= 0)
            levels.append((energies[retained], vt[retained], rows[name[retained]]))
            states.append(vectors[:, retained])
            highest.append(float(energies[-1]))
        each, numbers, names = (np.concatenate(column) for column in zip(*levels, strict=True))
        members = [rows for rows, _ in linear]
        return SpeciesLevels(self, members, states, each, numbers, names, max(highest), by_energy or self.by_energy)

    def _zeroth_order(self, linear: FunctionBlocks, coefficients: Floats) -> Floats:
        """⟨J K t|H|J K t⟩ of the functions; s = ±1 share their mean, which leaves out the coupling of K and -K."""
        labels = self.functions.labels
        diagonal = np.zeros(len(labels["t"]))
        for rows, block in linear:
            diagonal[rows] = block.diagonal(coefficients)
        minus = np.flatnonzero((labels["s"] < 0) & (labels["K"] > 0))
        plus = np.flatnonzero((labels["s"] > 0) & (labels["K"] > 0))
        if len(minus) == len(plus) > 0:  # both lists have the same order of J, K, t
            diagonal[plus] = diagonal[minus] = (diagonal[plus] + diagonal[minus]) / 2
        return diagonal


def states_of(block: LinearBlock, values: Floats, mostly_in: NDArray[np.bool_]) -> tuple[Floats, NDArray[Any]]:
    """Energies and vectors of a block, of as many states with the largest shares in the functions `mostly_in` where this is faster."""
    chosen = np.flatnonzero(mostly_in)
    few = dominated_states(block.sparse(values), chosen) if is_dominated(block.size, len(chosen)) else None
    return few or np.linalg.eigh(block.lower(values))


def _merged(terms: Terms, coefficients: Floats) -> list[Product]:
    """Σ c_i O_i with one product for each operator of the torsion."""
    rotations: dict[Operator | None, Operator] = {}
    for products, coefficient in zip(terms.values(), coefficients.tolist(), strict=True):
        for product in products if coefficient else ():
            partial_sum = rotations.get(product.torsion, Operator())
            rotations[product.torsion] = partial_sum + coefficient * product.rotation
    return [Product(rotation, torsion) for torsion, rotation in rotations.items()]


@dataclass(frozen=True, eq=False)
class SpeciesLevels:
    """Labelled levels of one species, by block in order of energy.

    members, vectors: of each block the rows of its functions, and its levels over them (functions, levels). energies: MHz above the minimum
    of the torsional potential. names: row of the function that labels each level. highest_mhz: of all states of the blocks.
    """

    source: SpeciesHamiltonian
    members: list[Ints]
    vectors: list[NDArray[Any]]
    energies: Floats
    vt: Ints
    names: Ints
    highest_mhz: float
    by_energy: bool

    @property
    def functions(self) -> TorsionRotation:
        """The functions |J K⟩|K t⟩."""
        return self.source.functions

    @cached_property
    def starts(self) -> Ints:
        """The first level of each block, and the number of all levels."""
        return np.cumsum([0, *(vectors.shape[1] for vectors in self.vectors)])

    @cached_property
    def quanta(self) -> dict[str, Ints]:
        """J, v_t, K (signed; not negative for σ = 0), Ka and Kc."""
        v, name, labels = self.vt, self.names, self.functions.labels
        j, k = labels["J"][name], labels["K"][name]
        if self.by_energy:
            k, kc = counted_ka_kc(j, v, self.energies)
        elif self.functions.has_parity:
            # (-1)^(J + Kc), of the axis b (-1)^(J + Ka + Kc)
            s = labels["s"][name] * (self.functions.torsion.parity[v] if self.functions.folded else 1)
            kc = kc_of_parity(j, k, s * np.where((k % 2 == 1) & (self.source.normal == "b"), -1, 1))
        else:
            kc = kc_of_pairs({"J": j, "vt": v}, k, self.energies)
        return {"j": j, "vt": v, "k": k, "ka": np.abs(k), "kc": kc}

    def slopes(self, levels: Ints | None = None, further: Sequence[Sequence[Product]] = ()) -> Floats:
        """⟨ψ|O|ψ⟩ (levels, operators) of some levels, by default of all: ∂E/∂c of the terms, then those of further operators."""
        operators = Expectations(self.functions, [*self.source.terms.values(), *further])
        levels = np.arange(len(self.energies)) if levels is None else levels
        block = np.searchsorted(self.starts, levels, side="right") - 1
        slopes = np.zeros((len(levels), len(operators.operators)))
        for number in np.unique(block).tolist():
            here = np.flatnonzero(block == number)
            vectors = self.vectors[number][:, levels[here] - self.starts[number]]
            slopes[here] = operators.of_states(
                self.functions.over_products(self.members[number], vectors, operators.needs_phases)
            )
        return slopes
