"""Levels of one species of a molecule with an internal rotor: solved blocks with names."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.blocks import LinearBlocks, SolvedBlocks, blocks_of_elements
from rotor.quantum.internal_rotation.contracted import Terms
from rotor.quantum.internal_rotation.functions import TorsionRotation
from rotor.quantum.internal_rotation.labels import (
    counted_ka_kc,
    kc_of_pairs,
    kc_of_parity,
    named_by_energy,
    named_by_overlap,
    torsional_numbers,
)


@dataclass(frozen=True, eq=False)
class SpeciesBlocks:
    """H_b(c) = Σ c_i O_i,b of one species over torsion-rotation functions."""

    functions: TorsionRotation
    linear: LinearBlocks

    def solve(self, coefficients: ArrayLike, vt_max: int, by_energy: bool = False) -> SpeciesLevels:
        """Levels with v_t up to `vt_max`; with `by_energy` Ka and Kc are counted by energy inside v_t."""
        values = np.asarray(coefficients, dtype=float)
        return SpeciesLevels(self.functions, self.linear.solve(values), self._zeroth_order(values), vt_max, by_energy)

    def _zeroth_order(self, coefficients: Floats) -> Floats:
        """⟨J K t|H|J K t⟩ of the functions: of combined ones the mean of s = ±1, without what couples K and -K."""
        linear = self.linear
        diagonal = np.zeros(len(linear.block))
        here = np.flatnonzero(linear.rows == linear.columns)
        diagonal[linear.rows[here]] = (coefficients @ linear.values[:, here]).real
        labels = linear.labels
        minus = np.flatnonzero((labels["s"] < 0) & (labels["K"] > 0))
        plus = np.flatnonzero((labels["s"] > 0) & (labels["K"] > 0))
        if len(minus) == len(plus) > 0:  # in one order of J, K, t
            diagonal[plus] = diagonal[minus] = (diagonal[plus] + diagonal[minus]) / 2
        return diagonal


def species_blocks(functions: TorsionRotation, terms: Terms, needed: NDArray[np.bool_] | None = None) -> SpeciesBlocks:
    """The blocks of one species, of named sums of products."""
    elements = functions.elements(list(terms.values()))
    return SpeciesBlocks(functions, blocks_of_elements(tuple(terms), functions.labels, elements, needed))


@dataclass(frozen=True, eq=False)
class SpeciesLevels:
    """Named levels of one species with v_t ≤ vt_max.

    rows: where each level stands in the arrays of `solved`: the function of its block with its rank. By block, rising in energy.
    """

    functions: TorsionRotation
    solved: SolvedBlocks
    zeroth_order: Floats
    vt_max: int
    by_energy: bool = False

    @cached_property
    def _named(self) -> tuple[Ints, Ints, Ints]:
        """Rows, v_t, and the function that names each level."""
        t = self.functions.labels["t"]
        rows, numbers, names = [], [], []
        for block in self.blocks:
            members, vectors = self.solved.vectors(block)
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

    @cached_property
    def blocks(self) -> list[int]:
        """Numbers of the blocks."""
        present = np.unique(self.solved.linear.block)
        return [int(block) for block in present if block >= 0]

    @property
    def rows(self) -> Ints:
        """Rows of the levels in the arrays of `solved`."""
        return self._named[0]

    @property
    def energies(self) -> Floats:
        """MHz, from the foot of the torsional potential."""
        return np.asarray(self.solved.energies[self.rows])

    @cached_property
    def quanta(self) -> dict[str, Ints]:
        """J, v_t, K (signed, of σ = 0 not below 0), Ka and Kc."""
        _, v, name = self._named
        labels = self.functions.labels
        j, k = labels["J"][name], labels["K"][name]
        if self.by_energy:
            k, kc = counted_ka_kc(j, v, self.energies)
        elif self.functions.folded:
            kc = kc_of_parity(j, k, labels["s"][name] * self.functions.torsion.parity[v])
        else:
            kc = kc_of_pairs({"J": j, "vt": v}, k, self.energies)
        return {"j": j, "vt": v, "k": k, "ka": np.abs(k), "kc": kc}

    def slopes(self) -> Floats:
        """∂E/∂c (levels, terms)."""
        return self.solved.slopes(self.rows)
