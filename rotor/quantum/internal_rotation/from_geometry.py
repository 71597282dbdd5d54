"""Constants of an internal rotor from a geometry and the barrier of a similar molecule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Ints
from rotor.molecules.bond_rotation import bond_rotation
from rotor.molecules.bond_scan import relaxed_scan
from rotor.molecules.bonds import bonded_atoms
from rotor.molecules.molecule import Molecule
from rotor.quantum.estimates.methyl_groups import MethylGroup, methyl_groups
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.top import Top

IN_PLANE = 1e-3  # share of the top's axis along c up to which a molecule counts as symmetric about its plane ab


def with_internal_rotation(top: Top, calculator: Any = None) -> Top:
    """Add the internal rotation of the methyl group: F0 and the angle of its axis from the geometry, V3 from a similar molecule.

    Parameters
    ----------
    top : Top
        Top with a geometry. Its constants, dipole and distortion remain in principal axes.
    calculator : optional
        ASE calculator, its name, or "mmff" for MMFF94. V3 and V6 then come from a relaxed scan instead of the table.

    Returns
    -------
    Top
        Top with constants of the internal rotor in the frame PAM, and notes on source and uncertainty of the barrier.

    Raises
    ------
    ValueError
        If there is no geometry, not exactly one methyl group, no known barrier, or an axis out of the plane ab.

    Notes
    -----
    F0 from a geometry is good to about 2 %; the note states the uncertainty of V3. Splittings scale about as exp(-1.3 √(V3/F)).
    """
    group = _group_of(top, with_barrier=calculator is None)
    cosines = np.array(group.rotor.rho) * np.array(top.moments_u_angstrom2)  # λ_g I_α
    norm = float(np.linalg.norm(cosines))
    direction = cosines / norm
    if abs(direction[2]) > IN_PLANE:
        raise ValueError(
            f"internal rotation of {top.name or 'this top'}: the axis of the methyl group is {direction[2]:.3g} out of the plane ab; give "
            "constants in the rho-axis frame (RAM)"
        )
    values = {
        "F0": units.ROTATIONAL_MHZ_U_ANGSTROM2 / norm,
        "delta": float(np.arctan2(direction[1], direction[0])),
    }
    if calculator is None:
        assert group.barrier is not None
        values["V3"] = group.rotor.barrier_mhz
        spread = "within some 10 %" if group.barrier.safe else "within a factor of about 2"
        origin = f"is that of {group.barrier.molecule}, {spread} here"
    else:
        barriers, scan = _scanned(top, group, calculator)
        values |= barriers
        origin = f"of a {scan}, whose error is not known"
    source = f"F0 and delta from the geometry; V3 = {values['V3'] / units.MHZ_PER_CM:.4g} cm-1 {origin}"
    internal = InternalRotationConstants(values, "PAM", spin_states=_spin_states(top, group), source=source)
    return replace(top, internal_rotation=internal, notes=(*top.notes, f"internal rotation: {source}"))


def _scanned(top: Top, group: MethylGroup, calculator: Any) -> tuple[dict[str, float], str]:
    """V3 and V6 (MHz) of a relaxed scan about the bond of the group, α = 0 at the minimum of the threefold term; and its source."""
    assert top.molecule is not None
    carbon = next(i for i in bonded_atoms(top.molecule)[group.hydrogens[0]].tolist())
    bearer = next(i for i in bonded_atoms(top.molecule)[carbon].tolist() if i not in group.hydrogens)
    scan = relaxed_scan(bond_rotation(top.molecule, f"{bearer + 1}-{carbon + 1}"), calculator, points=36)
    terms = np.array([np.mean(scan.energies_cm * np.exp(-1j * n * scan.angles)) for n in (3, 6)]) * 2 * units.MHZ_PER_CM
    start = np.angle(-terms[0]) / -3  # angle of the minimum: the threefold term is -|t| cos 3(α - start)
    turned = terms * np.exp(1j * np.array([3, 6]) * start)
    return {"V3": float(-2 * turned[0].real), "V6": float(-2 * turned[1].real)}, scan.source


def _group_of(top: Top, with_barrier: bool) -> MethylGroup:
    """The only methyl group; ValueError for none, several, or an unknown barrier that is needed."""
    name = top.name or "this top"
    if top.molecule is None:
        raise ValueError(
            f"internal rotation of {name}: there is no geometry; give its constants, such as RAM F=... rho=... V3=..."
        )
    bonds = bonded_atoms(top.molecule)
    groups = methyl_groups(top.molecule, bonds)
    if not groups and (carbon := _carbon_of_unlike_hydrogens(top.molecule, bonds)):
        raise ValueError(
            f"internal rotation of {name}: the hydrogens of carbon {carbon} are not all alike (CH2D, CHD2); their potential is threefold, "
            "their moments of inertia are not, so that there are no species A and E: such a group is not computed"
        )
    if len(groups) != 1:
        several = f"{len(groups)} methyl groups turn; a geometry gives constants of a single one: write those of all, F0_1=... V3_1=..."
        raise ValueError(f"internal rotation of {name}: {several if groups else 'no methyl group turns'}")
    if with_barrier and (groups[0].barrier is None or not groups[0].rotor.barrier_mhz):
        raise ValueError(
            f"internal rotation of {name}: no similar molecule with a threefold barrier is known; give V3, or scan it"
        )
    return groups[0]


def _carbon_of_unlike_hydrogens(molecule: Molecule, bonds: Sequence[Ints]) -> int:
    """The number, from 1, of a carbon with three hydrogens of different isotopes; 0 for none."""
    for carbon, near in enumerate(bonds):
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        if (
            molecule.symbols[carbon] == "C"
            and len(hydrogens) == 3
            and np.ptp([molecule.mass_numbers[i] for i in hydrogens])
        ):
            return carbon + 1
    return 0


def _spin_states(top: Top, group: MethylGroup) -> int:
    """2I + 1 of the nuclei that turn: 3 of CD3, else 2."""
    assert top.molecule is not None
    return 3 if all(top.molecule.mass_numbers[i] == 2 for i in group.hydrogens) else 2
