"""Levels of one species with nuclear spins, which are coupled one after another to torsion-rotation levels.

The torsion-rotation levels with v_t ≤ vt_max are the basis. Tensors between them are tensors of the rotation times overlaps of torsional
functions, exact for every K; `rotor.quantum.contraction` couples each nucleus. Elements with states of v_t > vt_max are neglected. They
move levels by χ²/ΔE: below 1e-4 MHz for χ of 20 MHz and torsional states 100 cm⁻¹ apart.

Derivatives are expectation values. For a constant of a nucleus the state |ψ⟩ is expanded in the product functions in which that nucleus
is coupled; for a coefficient of the torsion-rotation, in the functions |J K⟩|K t⟩:

    ∂E/∂c = Σ_path ⟨Ψ_path|O_c|Ψ_path⟩,    Ψ_path = Σ_N U_N ψ_N,path,    path = the intermediate sums F1, F2 ....
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.basis.elements import Elements
from rotor.quantum.contraction import CoupledSpace, Sector, Space, contracted_elements, coupled, spin_space
from rotor.quantum.internal_rotation.contracted import Product
from rotor.quantum.internal_rotation.levels import REPRESENTATION
from rotor.quantum.internal_rotation.nuclei import Nuclei, real_components
from rotor.quantum.internal_rotation.species import SpeciesLevels
from rotor.quantum.operators.rotation import body_tensor
from rotor.quantum.tensors import spherical_components

Path = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class CoupledNucleus:
    """One step of the coupling: product functions of the earlier states with a nucleus, eigenfunctions, and their names by sector."""

    product: CoupledSpace
    space: Space
    quanta: tuple[Mapping[str, Ints], ...]


@dataclass(frozen=True, eq=False)
class CoupledLevels:
    """All states of one species with spins.

    angle: angle (radians) of ρ from the axis a of the tensors. rotation: torsion-rotation levels as a space. steps: one for each nucleus.
    """

    levels: SpeciesLevels
    nuclei: Nuclei
    angle: float
    rotation: Space
    steps: tuple[CoupledNucleus, ...]

    @property
    def space(self) -> Space:
        """The states with all spins."""
        return self.steps[-1].space

    @property
    def sectors(self) -> tuple[Mapping[str, Ints], ...]:
        """Labels of the states by sector: vt, n, ka, kc, sums with spins (doubled), and the row of the torsion-rotation level."""
        return self.steps[-1].quanta

    @cached_property
    def quanta(self) -> dict[str, Ints]:
        """Labels of all states, sector after sector."""
        return {name: np.concatenate([quanta[name] for quanta in self.sectors]) for name in self.sectors[0]}

    @cached_property
    def energies(self) -> Floats:
        """Energies of all states, MHz."""
        return np.concatenate([sector.energies for sector in self.space.sectors])

    def slopes(self, rows: Ints, further: Elements | None = None) -> tuple[Floats, Floats]:
        """Derivatives of states: (rows, terms) by torsion-rotation coefficients and (rows, constants) by constants of nuclei.

        further: operators of the torsion-rotation whose columns follow those of the terms.
        """
        starts = self.space.starts()
        sector_of = np.searchsorted(starts, rows, side="right") - 1
        operators = [self.levels.source.elements, *([further] if further is not None else [])]
        rotation = np.zeros((len(rows), sum(len(elements.values) for elements in operators)))
        spins = np.zeros((len(rows), len(self.nuclei.constants)))
        for sector in np.unique(sector_of).tolist():
            here = np.flatnonzero(sector_of == sector)
            written, spins[here] = self._written_out(sector, rows[here] - starts[sector])
            for functions in written:
                rotation[here] += np.hstack([_expectations(elements, functions) for elements in operators])
        return rotation, spins

    def _written_out(self, sector: int, states: Ints) -> tuple[list[NDArray[Any]], Floats]:
        """States expanded in torsion-rotation functions, an array (functions, states) for each path; and slopes by nuclear constants."""
        slopes = np.zeros((len(states), len(self.nuclei.constants)))
        last = self.space.sectors[sector]
        pieces: dict[Path, dict[int, NDArray[Any]]] = {(): {sector: np.eye(len(last))[:, states]}}
        for number in reversed(range(len(self.steps))):
            parts: dict[Path, dict[int, NDArray[Any]]] = {}
            for path, vectors in pieces.items():
                for solved, vector in vectors.items():
                    products = _over_products(self.steps[number], solved, vector)
                    slopes += self._spin_slopes(number, products)
                    below = (*path, solved)
                    for product, part in products.items():
                        factor = self.steps[number].product.sectors[product].labels["factors"][0]
                        parts.setdefault(below, {})[factor] = part
            pieces = parts
        return [self._over_functions(vectors) for vectors in pieces.values()], slopes

    def _spin_slopes(self, number: int, products: Mapping[int, NDArray[Any]]) -> Floats:
        """Slopes (states, constants) by the constants of one nucleus, from vectors over its product functions."""
        count = next(iter(products.values())).shape[1]
        slopes = np.zeros((count, len(self.nuclei.constants)))
        for column, constant in enumerate(self.nuclei.constants):
            if constant.nucleus != number:
                continue
            for (a, b), entry in self.steps[number].product.terms[constant.name].items():
                if a in products and b in products:
                    twice = 1.0 if a == b else 2.0  # the lower triangle stands for both
                    moved = entry.matrix() @ products[b]
                    slopes[:, column] += twice * np.einsum("ij,ij->j", products[a].conj(), moved).real
        return slopes

    def _over_functions(self, vectors: Mapping[int, NDArray[Any]]) -> NDArray[Any]:
        """Vectors over torsion-rotation levels, by sector, as an array (functions, states)."""
        linear = self.levels.solved.linear
        first = next(iter(vectors.values()))
        solved = {
            factor: self.levels.solved.vectors(self.rotation.sectors[factor].labels["block"]) for factor in vectors
        }
        kinds = [np.result_type(part, solved[factor][1]) for factor, part in vectors.items()]
        written = np.zeros((len(linear.block), first.shape[1]), dtype=np.result_type(*kinds))
        for factor, part in vectors.items():
            functions, states = solved[factor]
            written[functions] += states[:, linear.rank[self.rotation.sectors[factor].labels["functions"]]] @ part
        return written


def _expectations(elements: Elements, vectors: NDArray[Any]) -> Floats:
    """⟨ψ|O|ψ⟩ (states, operators) of vectors (functions, states)."""
    present = elements.between(np.abs(vectors).max(axis=1) > 0)
    density = vectors[present.rows].conj() * vectors[present.columns]
    return np.asarray((present.values @ density).real.T)


def _over_products(step: CoupledNucleus, solved: int, vectors: NDArray[Any]) -> dict[int, NDArray[Any]]:
    """Vectors over the states of a solved sector expanded in the product functions, by their sector."""
    labels = step.space.sectors[solved].labels
    whole = labels["vectors"] @ vectors
    sizes = np.cumsum([0, *(len(step.product.sectors[product]) for product in labels["sectors"])])
    return {
        product: whole[start:stop] for product, start, stop in zip(labels["sectors"], sizes, sizes[1:], strict=False)
    }


def coupled_levels(
    levels: SpeciesLevels, nuclei: Nuclei, angle: float, has_plane: bool, twice_f: Ints | None = None
) -> CoupledLevels:
    """The states of torsion-rotation levels with nuclei.

    angle: of ρ from the axis a of the tensors, radians. has_plane: whether ab is a mirror. twice_f: values of 2F to compute, without dipole
    moments between them; by default all values, with dipole moments.
    """
    if has_plane:
        nuclei = nuclei.in_plane()
    space = rotation = _rotation_space(levels, nuclei, angle, has_plane, twice_f is None)
    quanta: Sequence[Mapping[str, Ints]] = _rotation_quanta(levels, space)
    steps: list[CoupledNucleus] = []
    for number, spin in enumerate(nuclei.spins):
        highest = max(sector.twice_j for sector in space.sectors) + spin.twice
        totals = np.arange(highest % 2, highest + 1, 2)
        if twice_f is not None:
            later = sum(further.twice for further in nuclei.spins[number + 1 :])
            totals = totals[np.abs(totals[:, None] - np.asarray(twice_f)).min(axis=1) <= later]
        steps.append(_with_nucleus(space, quanta, nuclei, number, totals.tolist()))
        space, quanta = steps[-1].space, steps[-1].quanta
    return CoupledLevels(levels, nuclei, angle, rotation, tuple(steps))


def _rotation_space(levels: SpeciesLevels, nuclei: Nuclei, angle: float, has_plane: bool, moments: bool) -> Space:
    """The named torsion-rotation levels with the tensors of each constant and unit vectors for the dipole."""
    functions, linear = levels.functions, levels.solved.linear
    tensors = {constant.name: (constant.rank, constant.elements(functions, angle)) for constant in nuclei.constants}
    for axis, unit in zip("abc", np.eye(3), strict=True):
        if moments and (axis != "c" or not has_plane):  # a mirror plane ab excludes a dipole along c
            parts = real_components(spherical_components(unit, 1, REPRESENTATION))
            tensors[f"mu {axis}"] = 1, functions.elements([[Product(body_tensor(parts))]], 1)
    block, rank = linear.block[levels.rows], linear.rank[levels.rows]
    retained = {number: np.sort(rank[block == number]) for number in levels.blocks}
    return contracted_elements(levels.solved, tensors, retained)


def _rotation_quanta(levels: SpeciesLevels, space: Space) -> list[dict[str, Ints]]:
    """Labels of the states of each sector, and their rows among the solved functions."""
    place = np.full(len(levels.solved.linear.block), -1)
    place[levels.rows] = np.arange(len(levels.rows))
    quanta = levels.quanta
    names = {"vt": "vt", "n": "j", "ka": "ka", "kc": "kc"}
    named = []
    for sector in space.sectors:
        rows = sector.labels["functions"]
        named.append({name: quanta[key][place[rows]] for name, key in names.items()} | {"row": rows})
    return named


def _with_nucleus(
    space: Space, quanta: Sequence[Mapping[str, Ints]], nuclei: Nuclei, number: int, totals: Sequence[int]
) -> CoupledNucleus:
    """Couple and solve one more nucleus; `totals` are the doubled sums of angular momenta."""
    nucleus_of = {constant.name: constant.nucleus for constant in nuclei.constants}
    scalars = {
        constant.name: (constant.name, constant.spin_tensor)
        for constant in nuclei.constants
        if constant.nucleus == number
    }
    carried = {
        key: (key, None, tensor.rank)
        for key, tensor in space.tensors.items()
        if nucleus_of.get(key, len(nuclei.spins)) > number
    }
    product = coupled(space, spin_space(nuclei.spins[number].twice), scalars, carried, totals)
    solved = product.solve({name: nuclei.values[name] for name in scalars})
    name = nuclei.sums[number]
    named = tuple(_names_of(sector, product.sectors, quanta, name) for sector in solved.sectors)
    return CoupledNucleus(product, solved, named)


def _names_of(
    sector: Sector, products: Sequence[Sector], quanta: Sequence[Mapping[str, Ints]], name: str
) -> dict[str, Ints]:
    """Label the states of a solved sector by their dominant product functions."""
    named = sector.labels["functions"]
    origin = [(products[product].labels["factors"][0], rank) for product, rank in named.tolist()]
    columns = {key: np.array([quanta[i][key][rank] for i, rank in origin]) for key in quanta[0]}
    return {**columns, name: np.full(len(origin), sector.twice_j)}
