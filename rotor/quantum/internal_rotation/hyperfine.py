"""Levels of a molecule with an internal rotor and nuclear spins, and dipole moments between their blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.internal_rotation.coupled_spins import CoupledLevels, coupled_levels
from rotor.quantum.internal_rotation.levels import (
    REPRESENTATION,
    Columns,
    Degeneracies,
    TurningTops,
    refuse_axes,
    species_blocks,
    table_of_pieces,
    turned_by,
    turning_tops,
)
from rotor.quantum.internal_rotation.nuclei import Nuclei
from rotor.quantum.levels import Levels, SolvedBlock, SpeciesFunctions, SpeciesMoments, placed
from rotor.quantum.tensors import BodyTensor, Tensors, cartesian_of
from rotor.quantum.wang.basis import Part
from rotor.tops.internal_rotation import InternalRotationConstants

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True, eq=False)
class HyperfineMoments(SpeciesMoments):
    """Dipole moments of one species with spins; its blocks have the numbers of sectors."""

    model: TurningTops
    levels: CoupledLevels

    @property
    def combined(self) -> bool:
        """Whether functions of K and -K are combined."""
        return self.levels.levels.functions.folded

    def connect(self, up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> bool:
        """Whether a dipole has elements between the states of two blocks."""
        return any(True for _ in self._pieces(up, low, tensors))

    def reduced(self, up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> NDArray[Any]:
        """Reduced elements (n_up, n_low) of a dipole."""
        places = np.ix_(up.basis.states, low.basis.states)
        total = np.zeros((len(up.energies_mhz), len(low.energies_mhz)))
        return sum((value * block[places] for value, block in self._pieces(up, low, tensors)), total)

    def _pieces(self, up: SolvedBlock, low: SolvedBlock, tensors: Tensors) -> Iterator[tuple[float, NDArray[Any]]]:
        """Components of a dipole along the axes of the rho-axis frame, each with the elements of its unit vector."""
        for axis, value in _along_axes(tensors[0, 0], self.model.angle, self.model.has_plane):
            block = self.levels.space.tensors[f"mu {axis}"].blocks.get((up.basis.number, low.basis.number))
            if block is not None:
                yield value, block

    def slopes(self, block: SolvedBlock, names: Sequence[str]) -> Floats:
        """∂E/∂c (n, names) of the states of a block, by the constants of the top, of the internal rotor and of the nuclei."""
        rotation, spins = self.levels.slopes(self.levels.space.starts()[block.basis.number] + block.basis.states)
        constants = [*self.model.values, *self.levels.nuclei.values]
        slopes = np.hstack([rotation @ self.model.jacobian, spins])
        none = np.zeros(len(slopes))
        return np.column_stack([slopes[:, constants.index(name)] if name in constants else none for name in names])


@lru_cache(maxsize=16)
def _along_axes(body: BodyTensor, angle: float, has_plane: bool) -> tuple[tuple[str, float], ...]:
    """The components of a vector that are not zero, by axis of the rho-axis frame at this angle; ValueError for what is not computed."""
    if body.rank != 1:
        raise ValueError("spins beside internal rotation: only dipole moments are computed, no tensors of rank 2")
    vector = turned_by(cartesian_of(body.components, REPRESENTATION), angle)
    if has_plane and abs(vector[2]) > 0:
        raise ValueError("a dipole along c beside internal rotation: the molecule has the plane ab as a mirror")
    return tuple((axis, value) for axis, value in zip("abc", vector.tolist(), strict=True) if value)


def hyperfine_levels(
    top: Top, constants: InternalRotationConstants, effects: tuple[QuantumEffect, ...], nmin: int, nmax: int
) -> Levels:
    """Levels with nuclear spins whose N is from `nmin` to `nmax`, labelled by species, vt, n, ka, kc, f1, ... f (half-integers doubled).

    Raises ValueError for electron spins, total spins of like nuclei, and constants with powers of N.
    """
    refuse_axes(top)
    model = turning_tops(top, constants)
    degeneracies = Degeneracies.from_model(model, constants)
    nuclei = Nuclei.of(top, effects)
    if degeneracies.equivalent and len(nuclei.spins) > 1:
        raise ValueError(
            "spins of several nuclei beside equivalent tops: their exchange is not computed; leave one of them"
        )
    blocks, pieces = list[SolvedBlock](), list[Columns]()
    whole = [name for name in nuclei.sums if name not in nuclei.halves]
    for name in model.species:
        species = species_with_spins(model, constants, name, nuclei, nmin, nmax)
        moments = HyperfineMoments(model, species)
        for number, quanta in enumerate(species.sectors):
            here = np.flatnonzero((quanta["n"] >= nmin) & (quanta["n"] <= nmax))
            if not len(here):
                continue
            sector, components = species.space.sectors[number], degeneracies.components(name)
            columns = {key: column[here] for key, column in quanta.items()}
            vectors = sector.labels["vectors"][:, here]
            parts = (Part(0, SpeciesFunctions(sector.twice_j, number, here), 0),)
            blocks.append(SolvedBlock(parts, sector.energies[here], vectors, moments=moments, components=components))
            pieces.append(
                {
                    "species": np.full(len(here), name),
                    "components": np.full(len(here), components),
                    "weight": degeneracies.weights(name, species.levels.functions, columns.pop("row")),
                    **columns,
                }
            )
    energies = np.concatenate([block.energies_mhz for block in blocks])
    levels = table_of_pieces(top, effects, nmax, pieces, energies, tuple(placed(blocks)), nuclei.halves)
    return replace(levels, quanta=levels.quanta | {name: levels.quanta[name] // 2 for name in whole})


def species_with_spins(
    model: TurningTops,
    constants: InternalRotationConstants,
    species: str,
    nuclei: Nuclei,
    nmin: int,
    nmax: int,
) -> CoupledLevels:
    """Levels of one species whose labels have N in a range; neighbouring N are solved too, since spins mix them in."""
    total = nuclei.twice_total
    blocks = species_blocks(model, species, max(0, nmin - total), nmax + total, constants.functions)
    levels = blocks.solve_once(model.coefficients, constants.vt_max, constants.names == "energy")
    return coupled_levels(levels, nuclei, model.angle, model.has_plane)
