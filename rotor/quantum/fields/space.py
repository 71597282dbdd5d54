"""The states of a top that a field or a pulse connects, in the cheapest basis for the operators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotor.quantum.fields.axial import AxialSpace, axial_levels
from rotor.quantum.fields.blocks import FieldSpace
from rotor.quantum.fields.operators import FieldOperator
from rotor.quantum.fields.solved_space import solved_levels, solved_space
from rotor.quantum.fields.tilted_blocks import tilted_space

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
    if not all(operator.along_z for operator in operators):
        return tilted_space(top, jmax, operators, effects)
    if top.kind == "spherical":
        raise ValueError(
            f"{top.name or 'this top'} is a spherical top: it has neither a dipole nor an anisotropy, and no field of the first "
            "or second order turns it"
        )
    axis = 2 if top.kind == "oblate" else 0
    axial = top.kind != "asymmetric" and not effects and top.states is None
    if axial and all(operator.axial_about(axis) for operator in operators):
        oriented = any(operator.rank == 1 for operator in operators)
        magnetic = any(operator.time_odd for operator in operators)
        return AxialSpace(axial_levels(top, jmax), jmax, axis, oriented, magnetic)
    return solved_space(top, solved_levels(top, jmax, effects), jmax, operators)
