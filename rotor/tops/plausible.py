"""Notes on constants, dipoles and geometries that hardly any molecule has; they are accepted all the same."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotor import units

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.top import Top

LARGEST_DEFECT = 0.1  # relative to I_c; the largest in the library is 0.028, of water
LARGEST_DIPOLE_DEBYE = 20.0  # the largest in the library is 4.5 D
BOND_UP_TO = 1.3  # longest bond, relative to the sum of covalent radii (Cordero et al. 2008, as in ASE)
SHORTEST_BOND_TWICE = 1.3  # Å; H2 has 0.74 Å = 1.40 bohr: smaller numbers are not coordinates in bohr
FEW_PARTS = 4  # of a complex, whose numbers of atoms a note lists
DEBYE_PER_ATOMIC_UNIT = 2.541746  # e a0, CODATA


def implausible(top: Top) -> tuple[str, ...]:
    """Notes on a top: I_c above I_a + I_b by more than vibration explains, too large a dipole, coordinates that look like bohr.

    A rigid body has I_c <= I_a + I_b, with equality if it is flat.

    >>> from rotor.tops.top import Top
    >>> [text[:32] for text in implausible(Top.from_constants("A=9000 B=3000 C=1500"))]
    ['1/C is larger than 1/A + 1/B: I_']
    """
    notes = []
    defect, largest = top.inertial_defect_u_angstrom2, top.moments_u_angstrom2[2]
    if defect > LARGEST_DEFECT * largest:
        notes.append(
            f"1/C is larger than 1/A + 1/B: I_c - I_a - I_b = {defect:.3g} u Å², {100 * defect / largest:.2g} % of I_c; no rigid body has "
            "that, and vibration gives a few per cent at most: check the constants and their units"
        )
    size = math.hypot(*(top.dipole_abc_debye or (0.0,)))
    if size > LARGEST_DIPOLE_DEBYE:
        notes.append(
            f"a dipole of {size:.4g} D is too large for a molecule: components are in debye (e a0 is {DEBYE_PER_ATOMIC_UNIT:.4g} D)"
        )
    if top.molecule is not None and len(top.molecule.symbols) > 1:
        notes += _far_apart(top.molecule)
    return tuple(notes)


def _far_apart(molecule: Molecule) -> list[str]:
    """A note if the atoms form several parts that no bond joins; on bohr if that would bond every atom."""
    from rotor.molecules.bonds import bonded_atoms, bonded_parts

    if len(bonded_parts(bonded_atoms(molecule))) == 1:
        return []
    from ase.data import atomic_numbers, covalent_radii

    radii = {symbol: float(covalent_radii[atomic_numbers[symbol]]) for symbol in molecule.symbols}
    parts = bonded_parts(bonded_atoms(molecule, radii, BOND_UP_TO))
    if len(parts) == 1:
        return []
    in_bohr = bonded_atoms(molecule, radii, BOND_UP_TO / units.BOHR_RADIUS_ANGSTROM)
    too_short = bonded_atoms(molecule, dict.fromkeys(radii, SHORTEST_BOND_TWICE), 0.5)
    if len(parts) == len(molecule.symbols) and all(map(len, in_bohr)) and not any(map(len, too_short)):
        return ["no two atoms are close enough for a bond: coordinates are read in ångström; if they are in bohr, "
                f"multiply them by {units.BOHR_RADIUS_ANGSTROM:.6f}"]  # fmt: skip
    sizes = " + ".join(str(len(part)) for part in parts[:FEW_PARTS]) + (" + ..." if len(parts) > FEW_PARTS else "")
    return [f"{len(parts)} parts ({sizes} atoms) without a bond between them: they are taken as a single rigid complex"]
