"""The states of a top that a field or a pulse connects: the cheapest basis for what acts on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.quantum.fields.blocks import AxialSpace, Contraction, FieldSpace, FreeLevels
from rotor.quantum.fields.tilted_blocks import tilted_space
from rotor.quantum.fields.wang_blocks import wang_space
from rotor.quantum.solve import solve_levels
from rotor.tops.top import one_state

if TYPE_CHECKING:
    from rotor.tops.top import Top


def field_space(top: Top, jmax: int, contractions: Sequence[Contraction]) -> FieldSpace:
    """The states of a top up to `jmax` and the blocks that contractions leave apart.

    Raises ValueError for a spherical top.
    """
    if not all(one.along_z for one in contractions):
        return tilted_space(top, jmax, contractions)
    if top.kind == "spherical":
        raise ValueError(
            f"{top.name or 'this top'} is a spherical top: it has neither a dipole nor an anisotropy, and no field of the first "
            "or second order turns it"
        )
    axis = 2 if top.kind == "oblate" else 0
    if top.kind != "asymmetric" and all(one.axial_about(axis) for one in contractions):
        return AxialSpace(axial_levels(top, jmax), jmax, axis, any(one.rank == 1 for one in contractions))
    return wang_space(top, jmax, contractions)


def axial_levels(top: Top, jmax: int) -> FreeLevels:
    """Levels of a linear or symmetric top, K and -K apart, by K and then by J."""
    solved = solve_levels(one_state(top, "levels in a field"), jmax)
    j, each = solved.rotational, solved.weight_per_component
    if top.kind == "linear":
        return FreeLevels(j, solved.energy_mhz, {}, each)
    k = np.concatenate([solved.quanta["k"], -solved.quanta["k"][solved.quanta["k"] > 0]])
    row = np.concatenate([np.arange(len(solved)), np.flatnonzero(solved.quanta["k"] > 0)])
    order = np.lexsort((j[row], k))
    return FreeLevels(j[row][order], solved.energy_mhz[row][order], {"k": k[order]}, each[row][order])
