"""The states of a top that a field or a pulse connects, in the cheapest basis for the operators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.fields.axial import AxialSpace, axial_levels
from rotor.quantum.fields.blocks import FieldSpace, FreeLevels
from rotor.quantum.fields.operators import Contraction, FieldOperator
from rotor.quantum.fields.reduced_elements import ReducedElements
from rotor.quantum.fields.solved_space import SPACE_AXES, FieldSector, SolvedSpace, solved_levels, solved_space
from rotor.quantum.wang.basis import wang_blocks

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


def field_space(
    top: Top, jmax: int, operators: Sequence[FieldOperator], effects: Sequence[QuantumEffect] = ()
) -> FieldSpace:
    """The states of a top up to `jmax` (of N with spins) and the blocks that the operators, all that will act, do not connect.

    effects: the Hamiltonian without the field; by default all effects of the top except spins. Raises ValueError for a spherical top, and
    for a field at an angle with Z beside spins or internal rotation.
    """
    if top.kind == "spherical":
        raise ValueError(
            f"{top.name or 'this top'} is a spherical top: it has neither a dipole nor an anisotropy, and no field of the first "
            "or second order turns it"
        )
    if not all(operator.along_z for operator in operators):
        return tilted_space(top, jmax, operators, effects)
    axis = 2 if top.kind == "oblate" else 0
    axial = top.kind != "asymmetric" and not effects and top.states is None
    if axial and all(operator.axial_about(axis) for operator in operators):
        oriented = any(operator.rank == 1 for operator in operators)
        magnetic = any(operator.time_odd for operator in operators)
        return AxialSpace(axial_levels(top, jmax), jmax, axis, oriented, magnetic)
    return solved_space(top, solved_levels(top, jmax, effects), jmax, operators)


def tilted_space(
    top: Top, jmax: int, operators: Sequence[FieldOperator], effects: Sequence[QuantumEffect] = ()
) -> SolvedSpace:
    """The space of a top for fields of any direction; ValueError for spins, internal rotation and magnetic fields."""
    if any(effect.spins(top) for effect in effects):
        raise ValueError("a top with spins is solved in fields along Z alone; leave out the angle")
    if top.internal_rotation is not None:
        raise ValueError("a top with internal rotation is solved in fields along Z alone; leave out the angle")
    if not all(isinstance(operator, Contraction) for operator in operators):
        raise ValueError("a magnetic field is solved along Z only")
    levels = solved_levels(top, jmax, effects)
    elements = ReducedElements(levels)
    projections = {j: wang_blocks(j, SPACE_AXES) for j in range(jmax + 1)}
    sectors = tuple(
        FieldSector(
            number, None, np.tile(block.start + np.arange(len(block.energies_mhz)), wang.size), block.twice_total, wang
        )
        for number, block in enumerate(elements.blocks)
        for wang in projections[block.twice_total // 2]
    )
    return SolvedSpace(FreeLevels.from_levels(levels), jmax, sectors, elements, tuple(operators))
