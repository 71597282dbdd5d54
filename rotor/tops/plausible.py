"""Notes on constants, dipoles and geometries that hardly any molecule has; they are accepted all the same."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rotor import units

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.top import Top

LARGEST_DEFECT = 0.1  # relative to I_c; the largest in the library is 0.028, of water
LARGEST_DIPOLE_DEBYE = 20.0  # the largest in the library is 4.5 D
SHORTEST_BOND_TWICE = 1.3  # Å; H2 has 0.74 Å = 1.40 bohr: smaller numbers are not coordinates in bohr
BOND_UP_TO = 1.3  # longest bond, relative to the sum of covalent radii (Cordero et al. 2008, as in ASE)
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
    """A note if no two atoms are close enough for a bond, but all would be if the coordinates were in bohr."""
    distances = np.linalg.norm(molecule.positions_angstrom[:, None] - molecule.positions_angstrom, axis=2)
    np.fill_diagonal(distances, np.inf)  # an atom has no bond with itself
    if distances.min() < SHORTEST_BOND_TWICE:
        return []
    from ase.data import atomic_numbers, covalent_radii

    radii = covalent_radii[[atomic_numbers[symbol] for symbol in molecule.symbols]]
    longest = BOND_UP_TO * (radii[:, None] + radii)
    # with coordinates in bohr every atom comes within the length of a bond
    if (distances < longest).any() or not (units.BOHR_RADIUS_ANGSTROM * distances < longest).any(axis=1).all():
        return []
    return [f"no two atoms are close enough for a bond, the closest are {distances.min():.3g} Å apart: coordinates are read in ångström; "
            f"if they are in bohr, multiply them by {units.BOHR_RADIUS_ANGSTROM:.6f}"]  # fmt: skip
