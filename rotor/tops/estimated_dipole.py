"""A dipole for a top that has none: estimated from its geometry, and noted as an estimate."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotor.tops.top import Top


def with_dipole_estimate(top: Top) -> Top:
    """The top itself where its dipole is known or a spherical top needs none, else with an estimate and a note that says so.

    The estimate is that of `rotor.molecules.mmff_dipole`, without what symmetry forbids. Raises ValueError where there is
    no geometry, or none that MMFF94 has charges for.
    """
    if top.dipole_abc_debye is not None or top.kind == "spherical":
        return top
    if top.molecule is None:
        raise ValueError("the dipole is not known")

    from rotor.molecules.mmff_dipole import CHARGES_SOURCE, estimate_dipole

    dipole, note = estimate_dipole(top.molecule)
    if dipole is None:
        raise ValueError(note)
    return replace(top.with_estimated_dipole(dipole, CHARGES_SOURCE), notes=(*top.notes, note))
