"""Chosen levels of a molecule with an internal rotor, and their derivatives by its constants.

Blocks are those of `rotor.quantum.internal_rotation`, made once for the J in which a line has a level; each iteration solves them at other
values. F and ρ enter the coefficients F, -2Fρ and Fρ² of linear blocks, so that ∂E/∂F and ∂E/∂ρ follow by the chain rule. The torsional
functions that are the basis belong to the constants of the start; they are made anew where F, ρ or V3 move by more than a hundredth.

Constants of principal axes (PAM) become F, ρ and the angle of ρ, by which everything else turns: blocks are made anew at each point, and

    dE/dc = ∂E/∂c + ∂E/∂F ∂F/∂c + ∂E/∂ρ ∂ρ/∂c + ⟨∂H/∂angle⟩ ∂angle/∂c,        c = A, B, C, F0, delta.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.internal_rotation.model import RamModel, jacobian_of_principal_axes, model_of_principal_axes
from rotor.quantum.internal_rotation.species import SpeciesBlocks, SpeciesLevels
from rotor.quantum.labelled import LevelModel, MissingLevelsError

MOVED = 0.01  # relative change of a torsional constant from which the torsional functions are made anew
TORSIONAL = ("F", "rho", "V3", "V6")


@dataclass(frozen=True)
class LabelledSpecies:
    """The labels of one species: their places among all, and columns J, v_t, Ka, Kc."""

    sigma: int
    places: Ints
    keys: Ints

    @property
    def vt_max(self) -> int:
        """The highest v_t of a label."""
        return int(self.keys[:, 1].max())


@dataclass(frozen=True, eq=False)
class TorsionLevels(LevelModel):
    """Levels of all species by label, for any values of the constants."""

    names: tuple[str, ...]
    count: int
    functions: int
    by_energy: bool
    species: tuple[LabelledSpecies, ...]
    _blocks: dict[int, tuple[Floats, SpeciesBlocks]] = field(default_factory=dict)

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`. Raises MissingLevelsError for labels that no level has."""
        named = dict(zip(self.names, np.asarray(values_mhz).tolist(), strict=True))
        if "F0" in named:
            return self._of_principal_axes(named)
        model = RamModel(named)
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(self.names)))
        for part in self.species:
            found = self._blocks_of(part, model).solve(model.coefficients, part.vt_max, self.by_energy)
            rows = _rows_of(found, part)
            energies[part.places] = found.energies[rows]
            slopes[part.places] = found.solved.slopes(found.rows[rows]) @ model.jacobian
        return energies, slopes

    def _of_principal_axes(self, named: dict[str, float]) -> tuple[Floats, Floats]:
        """Energies and derivatives of constants in principal axes."""
        model = model_of_principal_axes(named)
        known = list(model.values)
        turned = jacobian_of_principal_axes(named)
        energies, slopes = np.empty(self.count), np.zeros((self.count, len(self.names)))
        for part in self.species:
            blocks = self._new_blocks(part, model)
            found = blocks.solve_once(model.coefficients, part.vt_max, self.by_energy)
            rows = _rows_of(found, part)
            energies[part.places] = found.energies[rows]
            direct = found.slopes(found.rows[rows]) @ model.jacobian
            by_angle = found.solved.slopes_of(
                blocks.functions.elements([model.slope_by_angle(part.sigma)]), found.rows[rows]
            )
            total = np.zeros((len(rows), len(self.names)))
            for i, name in enumerate(self.names):
                if name in known:
                    total[:, i] = direct[:, known.index(name)]
            derived = np.column_stack([direct[:, known.index("F")], direct[:, known.index("rho")], by_angle[:, 0]])
            chained = [self.names.index(name) for name in (*"ABC", "F0", "delta")]
            total[:, chained] += derived @ turned
            slopes[part.places] = total
        return energies, slopes

    def overlaps(self, before_mhz: Floats, after_mhz: Floats) -> Floats:
        """1: levels are called by what they mostly are, whatever the constants are."""
        return np.ones(self.count)

    def _blocks_of(self, part: LabelledSpecies, model: RamModel) -> SpeciesBlocks:
        """The blocks of a species, made anew where the torsion has moved."""
        torsion = np.array([model.values.get(name, 0.0) for name in TORSIONAL])
        known = self._blocks.get(part.sigma)
        if known is None or (np.abs(torsion - known[0]) > MOVED * np.abs(known[0])).any():
            self._blocks[part.sigma] = torsion, self._new_blocks(part, model)
        return self._blocks[part.sigma][1]

    def _new_blocks(self, part: LabelledSpecies, model: RamModel) -> SpeciesBlocks:
        """The blocks of the J in which a label lies."""
        j = part.keys[:, 0]
        return model.blocks(part.sigma, int(j.max()), jmin=int(j.min()), count=self.functions, needed=np.unique(j))


def torsion_levels(constants: TopConstants, labels: Ints) -> LevelModel:
    """The model for labels (levels, k) by `constants.quanta`, A standing as 0 and E as 1.

    Raises MissingLevelsError for labels that no level has.
    """
    internal = constants.top.internal_rotation
    assert internal is not None
    if internal.tops == 2:
        raise ValueError("fits with internal rotation of two tops are not computed")
    columns = dict(zip(constants.quanta, labels.T, strict=True))
    keys = np.column_stack([columns[name] for name in ("j", "vt", "ka", "kc")])
    sigma = columns["species"]
    wrong = ~np.isin(sigma, list(RamModel.species.values())) | ~_exist(keys) | (keys[:, 1] > internal.functions - 2)
    if wrong.any():
        places = np.flatnonzero(wrong)
        text = ", ".join(f"{name} = {columns[name][places[0]]}" for name in constants.quanta)
        raise MissingLevelsError(f"there is no level with {text} (species 0 is A, 1 is E) in this model", places)
    parts = [
        LabelledSpecies(value, np.flatnonzero(sigma == value), keys[sigma == value])
        for value in RamModel.species.values()
    ]
    names = tuple(constants.values)
    return TorsionLevels(
        names,
        len(labels),
        internal.functions,
        internal.names == "energy",
        tuple(part for part in parts if len(part.places)),
    )


def _rows_of(found: SpeciesLevels, part: LabelledSpecies) -> Ints:
    """Places of the labelled levels among those of a species; MissingLevelsError for labels that no level has."""
    quanta = found.quanta
    rows = _rows(np.column_stack([quanta[name] for name in ("j", "vt", "ka", "kc")]), part.keys)
    if (rows < 0).any():
        missing = rows < 0
        raise MissingLevelsError(
            f"there is no level of J = {part.keys[missing][0, 0]} with this label", part.places[missing]
        )
    return rows


def _exist(keys: Ints) -> NDArray[np.bool_]:
    """Whether (J, v_t, Ka, Kc) is a label: Ka + Kc is J or J + 1."""
    j, vt, ka, kc = keys.T
    return np.asarray((keys >= 0).all(axis=1) & (ka <= j) & (kc <= j) & np.isin(ka + kc - j, (0, 1)) & (vt >= 0))


def _rows(table: Ints, keys: Ints) -> Ints:
    """Rows of a table (n, k) of whole numbers of at least 0 that equal keys (m, k), -1 where none does."""
    spans = np.maximum(table.max(axis=0), keys.max(axis=0)) + 1
    codes, needed = (np.ravel_multi_index(tuple(array.T), tuple(spans.tolist())) for array in (table, keys))
    order = np.argsort(codes)
    place = np.minimum(np.searchsorted(codes[order], needed), len(codes) - 1)
    rows = order[place]
    return np.asarray(np.where(codes[rows] == needed, rows, -1))
