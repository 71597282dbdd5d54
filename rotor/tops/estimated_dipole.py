"""Estimate of the dipole of a top from its geometry, noted as an estimate."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotor.tops.top import Top


def with_dipole_estimate(top: Top) -> Top:
    """The top if its dipole is known or not needed (spherical tops); else the top with an estimated dipole and a note.

    The estimate is that of `rotor.molecules.mmff_dipole`, without components that symmetry forbids. Raises ValueError without
    a geometry, or if MMFF94 has no charges for it.
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
