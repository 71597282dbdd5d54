"""Constants of an internal rotor from a geometry: its moments, and the barrier of a similar molecule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor import units
from rotor.molecules.bonds import bonded_atoms
from rotor.quantum.estimates.methyl_groups import MethylGroup, methyl_groups
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.top import Top

IN_PLANE = 1e-3  # share of the top's axis along c up to which a molecule counts as symmetric about its plane ab


def with_internal_rotation(top: Top) -> Top:
    """The top with its methyl group turning: F0 and the angle of its axis from the geometry, V3 from the table of similar molecules.

    Parameters
    ----------
    top : Top
        With a geometry; its constants, dipole and distortion stay those of the principal axes.

    Returns
    -------
    Top
        With constants in the frame PAM, and notes that say where the barrier is from and how safe it is.

    Raises
    ------
    ValueError
        Without a geometry, for none or several groups, a barrier that is not known, and an axis out of the plane ab.

    Notes
    -----
    F0 follows from the geometry within about 2 %, V3 within what the note says; splittings go about as exp(-1.3 √(V3/F)).
    """
    group = _group_of(top)
    assert group.barrier is not None
    cosines = np.array(group.rotor.rho) * np.array(top.moments_u_angstrom2)  # λ_g I_α
    own = float(np.linalg.norm(cosines))
    direction = cosines / own
    if abs(direction[2]) > IN_PLANE:
        raise ValueError(
            f"internal rotation of {top.name or 'this top'}: the axis of the methyl group is {direction[2]:.3g} out of the plane ab; give "
            "constants in the rho-axis frame (RAM)"
        )
    values = {
        "F0": units.ROTATIONAL_MHZ_U_ANGSTROM2 / own,
        "delta": float(np.arctan2(direction[1], direction[0])),
        "V3": group.rotor.barrier_mhz,
    }
    spread = "within some 10 %" if group.barrier.safe else "within a factor of about 2"
    source = f"F0 and delta from the geometry; V3 = {group.barrier.v3_cm:g} cm-1 is that of {group.barrier.molecule}, {spread} here"
    internal = InternalRotationConstants(values, "PAM", spin_states=_spin_states(top), source=source)
    return replace(top, internal_rotation=internal, notes=(*top.notes, f"internal rotation: {source}"))


def _group_of(top: Top) -> MethylGroup:
    """The one group that turns; ValueError for none, several, or one whose barrier is not known."""
    name = top.name or "this top"
    if top.molecule is None:
        raise ValueError(
            f"internal rotation of {name}: there is no geometry; give its constants, such as RAM F=... rho=... V3=..."
        )
    groups = methyl_groups(top.molecule, bonded_atoms(top.molecule))
    if len(groups) != 1:
        raise ValueError(f"internal rotation of {name}: {len(groups)} methyl groups turn; computed is that of one")
    if groups[0].barrier is None or not groups[0].rotor.barrier_mhz:
        raise ValueError(f"internal rotation of {name}: no similar molecule with a threefold barrier is known; give V3")
    return groups[0]


def _spin_states(top: Top) -> int:
    """2I + 1 of the nuclei that turn: 3 where every hydrogen of the molecule is deuterium of a CD3 group, else 2."""
    assert top.molecule is not None
    hydrogens = [nucleus for nucleus in top.molecule.nuclei if nucleus.element_number == 1]
    turning = [nucleus.label for nucleus in hydrogens]
    return 3 if turning.count("D") + turning.count("2H") == 3 else 2
