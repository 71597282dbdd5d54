"""Labelled levels in a static electric field, with derivatives by the constants and the dipole, for fits of Stark shifts.

A label consists of the free level, M, and the field. States of one exact block are labelled in order of energy (adiabatic labels),
as in `rotor stark`. For a state |ψ⟩ = Σ v_n |n⟩ of solved free states n, the Hellmann-Feynman theorem gives

    ∂E/∂μ_k = -E ⟨ψ|Φ_Zk|ψ⟩,        ∂E/∂c = ⟨ψ|∂H/∂c|ψ⟩ = Σ_b ⟨V_b v_b|O_c,b|V_b v_b⟩,

V_b the eigenvectors of a block b of the free molecule, O_c,b its linear blocks, that of levels without a field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats, Ints, rows_of_keys
from rotor.fitting.top_constants import DIPOLES, TopConstants
from rotor.quantum.basis.state_elements import linear_blocks_of
from rotor.quantum.effects.stark import StarkRequest, dipole_derivative
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.fields.block_states import BlockStates, basis_order, solve_block
from rotor.quantum.fields.blocks import FieldBlock, FreeLevels
from rotor.quantum.fields.field_map import smallest_jmax
from rotor.quantum.fields.map_request import MapRequest
from rotor.quantum.fields.solved_space import SolvedSpace
from rotor.quantum.labels.labelled import AT_ZERO_MHZ, LevelModel, MissingLevelsError
from rotor.quantum.labels.quanta import FIELD_STEP_KV_PER_CM, label_value
from rotor.quantum.solve import solve_levels
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM

TOLERANCE_MHZ = 1e-6  # tolerance of the energies for the choice of J max


class Labelled(NamedTuple):
    """Labels whose states are in one block: their indices among all labels, ranks of the states, and fields (kV/cm)."""

    block: FieldBlock
    places: Ints
    ranks: Ints
    fields: Floats


@dataclass(frozen=True, eq=False)
class StarkLevels(LevelModel):
    """Levels in fields by label, for any constants and dipole; jmax : that of the basis at the constants `start`."""

    names: tuple[str, ...]
    start: TopConstants
    labels: Ints
    jmax: int

    def levels(self, values_mhz: Floats) -> tuple[Floats, Floats]:
        """See `LevelModel`; dipole in D, its derivatives in MHz/D. Raises MissingLevelsError for labels without a level."""
        values = [value or AT_ZERO_MHZ for value in np.asarray(values_mhz).tolist()]
        constants = self.start.replace(**dict(zip(self.names, values, strict=True)))
        request, jmax = _request(constants, self.labels), self.jmax
        energies, slopes = np.empty(len(self.labels)), np.zeros((len(self.labels), len(self.names)))
        while True:
            error = 0.0
            for group in self.groups(request, jmax):
                fields, number = np.unique(group.fields, return_inverse=True)
                states = solve_block(request, group.block, fields, jmax)
                error = max(error, float(states.error[number, group.ranks].max()))
                energies[group.places] = states.energies[number, group.ranks]
                slopes[group.places] = self._slopes(constants, group, states, number)
            if error <= 10 * request.tolerance_mhz:
                return energies, slopes
            jmax += 1

    def groups(self, request: MapRequest, jmax: int) -> list[Labelled]:
        """The labels grouped by block. Raises MissingLevelsError for labels without a level."""
        space = request.space(jmax + request.margin)
        rows, m = self._rows(space.levels)
        groups, matched = [], np.zeros(len(rows), dtype=bool)
        for value in np.unique(np.abs(m)).tolist():
            for block in space.blocks(value):
                order = basis_order(block, jmax)
                rank = np.full(len(space.levels), -1)
                rank[block.rows[order]] = np.arange(len(order))
                here = np.flatnonzero((rank[rows] >= 0) & (rows >= 0) & (m == block.m))
                if len(here):
                    matched[here] = True
                    fields = self.labels[here, -1] * FIELD_STEP_KV_PER_CM
                    groups.append(Labelled(block, here, rank[rows[here]], fields))
        if not matched.all():
            places = np.flatnonzero(~matched)
            label = zip(self.start.quanta, self.labels[places[0]].tolist(), strict=True)
            text = ", ".join(f"{name} = {label_value(name, value)}" for name, value in label)
            raise MissingLevelsError(f"there is no level with {text} in this model", places)
        return groups

    def _rows(self, levels: FreeLevels) -> tuple[Ints, Ints]:
        """Rows of the labels among the free levels (-1 without a level), and |M| of their blocks."""
        columns = dict(zip(self.start.quanta, self.labels.T.copy(), strict=True))
        columns.pop("field")
        m = columns.pop("m")
        if "k" in columns:  # (K, M) is like (-K, -M)
            if "k" not in levels.quanta:
                raise ValueError(
                    "lines in a field of a symmetric top whose dipole is not along its axis are not fitted"
                )
            # the energy depends on the sign of K M alone: M is made positive
            turned = (m < 0) | ((m == 0) & (columns["k"] < 0))
            columns["k"] = np.where(turned, -columns["k"], columns["k"])
        m = np.abs(m)
        columns_of_levels = {"j": levels.j, **levels.quanta}
        keys = np.column_stack([columns_of_levels[name] for name in columns])
        return rows_of_keys(keys, np.column_stack(list(columns.values()))), m

    def _slopes(self, constants: TopConstants, group: Labelled, states: BlockStates, number: Ints) -> Floats:
        """∂E/∂c (labels, names)."""
        block, top = group.block, constants.top
        vectors = np.zeros((len(group.ranks), len(block)), dtype=states.vectors.dtype)
        vectors[:, states.places] = states.vectors[number, :, group.ranks]
        slopes = np.zeros((len(vectors), len(self.names)))
        columns = [i for i, name in enumerate(self.names) if name not in DIPOLES]
        for i, name in enumerate(self.names):
            if name in DIPOLES:
                derivative = dipole_derivative(top, DIPOLES.index(name), constants.effects)
                cosine = block.dense(derivative)
                mean = np.einsum("ln,ln->l", vectors.conj(), vectors @ cosine.T).real
                slopes[:, i] = -MHZ_PER_DEBYE_KV_PER_CM * group.fields * mean
        slopes[:, columns] = self._constant_slopes(constants, block, vectors, [self.names[i] for i in columns])
        return slopes

    def _constant_slopes(
        self, constants: TopConstants, block: FieldBlock, vectors: Floats, names: Sequence[str]
    ) -> Floats:
        top, space = constants.top, block.space
        if not isinstance(space, SolvedSpace):  # free levels in closed form: no constant mixes them
            levels = solve_levels(top, int(block.j.max()), effects=constants.effects)
            quanta = {"k": np.abs(block.levels.quanta["k"][block.rows])} if "k" in levels.quanta else {}
            rows = levels.rows_of(j=block.j, **quanta)
            return np.asarray(vectors**2 @ level_derivatives(top, levels, names, rows))
        elements, total = space.elements, np.zeros((len(vectors), len(names)))
        blocks = [elements.blocks[space.sectors[i].block] for i in block.members]
        linear = linear_blocks_of(top, elements.levels, names, blocks)
        places = pairwise(space.starts(block).tolist())
        for solved, derivatives, (start, stop) in zip(blocks, linear, places, strict=True):
            total[:, derivatives.parameters] += derivatives.slopes(solved.vectors @ vectors[:, start:stop].T)
        return total


def _request(constants: TopConstants, labels: Ints) -> MapRequest:
    """A Stark map at the fields of the labels."""
    fields = np.unique(labels[:, -1]) * FIELD_STEP_KV_PER_CM
    highest = int(labels[:, 0].max())
    return StarkRequest(constants.top, tuple(fields.tolist()), j_highest=highest, tolerance_mhz=TOLERANCE_MHZ).map


def stark_levels(constants: TopConstants, labels: Ints) -> StarkLevels:
    """The model for labels (levels, k) by `constants.quanta`.

    Raises MissingLevelsError for labels without a level, and ValueError for spins and internal rotation: their lines in a field
    cannot be fitted.
    """
    if constants.top.internal_rotation is not None or constants.hyperfine:
        what = "internal rotation" if constants.top.internal_rotation is not None else "spins"
        raise ValueError(f"lines in a field with {what} are not fitted; take those of the rotation alone")
    numbers = np.asarray(labels, dtype=np.int64)
    request = _request(constants, numbers)
    model = StarkLevels(tuple(constants.values), constants, numbers, smallest_jmax(request))
    model.groups(request, model.jmax)  # refuses labels without a level
    return model
