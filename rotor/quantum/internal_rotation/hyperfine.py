"""Levels of a molecule with an internal rotor and nuclear spins, and dipole moments between their blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.internal_rotation.coupled_spins import CoupledLevels, coupled_levels
from rotor.quantum.internal_rotation.levels import (
    REPRESENTATION,
    Degeneracies,
    TurningTops,
    refuse_axes,
    species_blocks,
    turned_by,
    turning_tops,
)
from rotor.quantum.internal_rotation.nuclei import Nuclei
from rotor.quantum.levels import Levels, MomentBlock
from rotor.quantum.tensors import Tensors, cartesian_of
from rotor.tops.internal_rotation import InternalRotationConstants

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True, eq=False)
class HyperfineBlock(MomentBlock):
    """States of one F in one connected block of a species, in order of energy."""

    model: TurningTops
    species: CoupledLevels
    sector: int
    states: Ints
    energies_mhz: Floats
    start: int
    components: int

    @property
    def twice_total(self) -> int:
        """Twice the total angular momentum."""
        return self.species.space.sectors[self.sector].twice_j

    def connects(self, low: MomentBlock, tensors: Tensors) -> bool:
        """Whether a dipole has elements between the states of both blocks."""
        if not isinstance(low, HyperfineBlock) or low.species is not self.species:
            return False
        dipoles = self.species.space.tensors
        pair = self.sector, low.sector
        return any(pair in dipoles[f"mu {axis}"].blocks for axis, value in self._vector(tensors).items() if value)

    @property
    def combined(self) -> bool:
        """Whether functions of K and -K are combined."""
        return self.species.levels.functions.folded

    def reduced(self, low: MomentBlock, tensors: Tensors) -> NDArray[np.generic]:
        """Reduced elements (n_up, n_low) of a tensor."""
        assert isinstance(low, HyperfineBlock)
        pieces = [
            value * block[np.ix_(self.states, low.states)]
            for axis, value in self._vector(tensors).items()
            if value
            and (block := self.species.space.tensors[f"mu {axis}"].blocks.get((self.sector, low.sector))) is not None
        ]
        return np.asarray(sum(pieces)) if pieces else np.zeros((len(self.states), len(low.states)))

    def _vector(self, tensors: Tensors) -> dict[str, float]:
        """Components of a vector along the axes of the rho-axis frame, by letter."""
        body = tensors[0, 0]
        if body.rank != 1:
            raise ValueError("spins beside internal rotation: only dipole moments are computed, no tensors of rank 2")
        vector = turned_by(cartesian_of(body.components, REPRESENTATION), self.model.angle)
        if self.model.has_plane and abs(vector[2]) > 0:
            raise ValueError("a dipole along c beside internal rotation: the molecule has the plane ab as a mirror")
        return dict(zip("abc", vector.tolist(), strict=True))

    def slopes(self, names: Sequence[str]) -> Floats:
        """∂E/∂c (n, names) of the states, by the constants of the top, of the internal rotor and of the nuclei."""
        rotation, spins = self.species.slopes(self.species.space.starts()[self.sector] + self.states)
        constants = [*self.model.values, *self.species.nuclei.values]
        slopes = np.hstack([rotation @ self.model.jacobian, spins])
        none = np.zeros(len(slopes))
        return np.column_stack([slopes[:, constants.index(name)] if name in constants else none for name in names])


def hyperfine_levels(
    top: Top, constants: InternalRotationConstants, effects: tuple[QuantumEffect, ...], nmin: int, nmax: int
) -> Levels:
    """Levels with nuclear spins whose N is from `nmin` to `nmax`, labelled by species, vt, n, ka, kc, f1, ... f (half-integers doubled).

    Raises ValueError for electron spins, total spins of like nuclei, and constants with powers of N.
    """
    refuse_axes(top)
    model = turning_tops(top, constants)
    degeneracies = Degeneracies.of(model, constants)
    nuclei = Nuclei.of(top, effects)
    if degeneracies.equivalent and len(nuclei.spins) > 1:
        raise ValueError(
            "spins of several nuclei beside equivalent tops: their exchange is not computed; leave one of them"
        )
    blocks: list[HyperfineBlock] = []
    weights: list[Ints] = []
    columns: dict[str, list[NDArray[np.generic]]] = {}
    for name in model.species:
        species = species_with_spins(model, constants, name, nuclei, nmin, nmax)
        for block, quanta in _blocks_of(model, species, degeneracies.components(name), nmin, nmax, _count(blocks)):
            weights.append(degeneracies.weights(name, species.levels.functions, quanta.pop("row")))
            blocks.append(block)
            for key, column in ({"species": np.full(len(block.states), name)} | quanta).items():
                columns.setdefault(key, []).append(column)
    quanta = {key: np.concatenate(pieces) for key, pieces in columns.items()}
    whole = [name for name in nuclei.sums if name not in nuclei.halves]
    return Levels(
        kind=top.kind,
        representation=REPRESENTATION,
        jmax=nmax,
        energy_mhz=np.concatenate([block.energies_mhz for block in blocks]),
        quanta=quanta | {name: quanta[name] // 2 for name in whole},
        multiplicity=quanta["f"] + 1,
        components=np.concatenate([np.full(len(block.states), block.components) for block in blocks]),
        weight=np.concatenate(weights),
        halves=nuclei.halves,
        effects=effects,
        blocks=tuple(blocks),
    )


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


def _count(blocks: Sequence[HyperfineBlock]) -> int:
    """Number of levels in these blocks."""
    return blocks[-1].start + len(blocks[-1].states) if blocks else 0


def _blocks_of(
    model: TurningTops, species: CoupledLevels, components: int, nmin: int, nmax: int, start: int
) -> list[tuple[HyperfineBlock, dict[str, Ints]]]:
    """Blocks of a species with N in a range, each with the labels of its levels."""
    blocks = []
    for sector, quanta in enumerate(species.sectors):
        here = np.flatnonzero((quanta["n"] >= nmin) & (quanta["n"] <= nmax))
        if len(here):
            energies = species.space.sectors[sector].energies[here]
            block = HyperfineBlock(model, species, sector, here, energies, start, components)
            blocks.append((block, {key: column[here] for key, column in quanta.items()}))
            start += len(here)
    return blocks
