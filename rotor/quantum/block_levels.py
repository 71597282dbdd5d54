"""The model of labelled levels of states and spins, of a top or a file: blocks that are solved at any constants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.label_tracking import LabelledBlocks
from rotor.quantum.labelled import LevelModel

if TYPE_CHECKING:
    from rotor.quantum.estimates.contracted import ContractedLevels


class DiagonalElements(NamedTuple):
    """Diagonal elements of a Hamiltonian over fixed functions, linear in the parameters; slopes: (levels, parameters)."""

    slopes: Floats

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """Energies (levels,) and derivatives."""
        return self.slopes @ values_mhz, self.slopes


class AssignedLevels(NamedTuple):
    """Blocks of some labels and parameters: the places of both among all (rows, columns)."""

    rows: Ints
    columns: Ints
    blocks: LabelledBlocks | ContractedLevels | DiagonalElements

    @property
    def with_level(self) -> Ints:
        """Places of the labels that have a level."""
        return self.rows[self.blocks.with_level] if isinstance(self.blocks, LabelledBlocks) else self.rows


def without_level(parts: Sequence[AssignedLevels], count: int) -> NDArray[np.bool_]:
    """Which of `count` labels have no level in any of these blocks."""
    missing = np.ones(count, dtype=bool)
    for part in parts:
        missing[part.with_level] = False
    return missing


@dataclass(frozen=True)
class BlockLevels(LevelModel):
    """Labelled levels as functions of constants; others: parts of which each label is solved among the functions near it, or is one."""

    names: tuple[str, ...]
    labelled: LabelledBlocks
    others: tuple[AssignedLevels, ...]

    @classmethod
    def from_parts(cls, names: tuple[str, ...], parts: Sequence[AssignedLevels], count: int) -> BlockLevels:
        """The model of `count` labels; labelled blocks of all parts are one set, so that blocks of equal size are solved together."""
        tracked = [
            block
            for part in parts
            if isinstance(part.blocks, LabelledBlocks)
            for block in part.blocks.moved(part.rows, part.columns)
        ]
        others = tuple(part for part in parts if not isinstance(part.blocks, LabelledBlocks))
        return cls(names, LabelledBlocks(count, tuple(tracked)), others)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`."""
        energies, slopes = self.labelled.levels(values_mhz)
        for part in self.others:
            energies[part.rows], derived = part.blocks.levels(values_mhz[part.columns])
            slopes[part.rows[:, None], part.columns] = derived
        return energies, slopes

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """1 for all levels: labels follow the dominant function at any constants."""
        return np.ones(self.labelled.count)
