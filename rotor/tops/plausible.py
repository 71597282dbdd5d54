"""What is said of constants and dipoles that hardly any molecule has: they are taken as given, with a note."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotor.tops.top import Top

LARGEST_DEFECT = 0.1  # of I_c; of the molecules of the library water has most, 0.028
LARGEST_DIPOLE_DEBYE = 20.0  # the largest of the library is 4.5 D
DEBYE_PER_ATOMIC_UNIT = 2.541746  # e a0, CODATA


def implausible(top: Top) -> tuple[str, ...]:
    """Notes on a top: I_c above I_a + I_b by more than vibration gives, and a dipole that is too large for a molecule.

    A rigid body has I_c <= I_a + I_b, with equality where it is flat.

    >>> from rotor.tops.top import Top
    >>> [text[:32] for text in implausible(Top.from_constants("A=9000 B=3000 C=1500"))]
    ['1/C is larger than 1/A + 1/B: I_']
    """
    notes = []
    defect, largest = top.inertial_defect_u_angstrom2, top.moments_u_angstrom2[2]
    if math.isfinite(defect) and defect > LARGEST_DEFECT * largest:
        notes.append(
            f"1/C is larger than 1/A + 1/B: I_c - I_a - I_b = {defect:.3g} u Å², {100 * defect / largest:.2g} % of I_c; no rigid body has "
            "that, and vibration gives a few per cent at most: check the constants and their units"
        )
    size = math.hypot(*(top.dipole_abc_debye or (0.0,)))
    if size > LARGEST_DIPOLE_DEBYE:
        notes.append(
            f"a dipole of {size:.4g} D is larger than that of a molecule: components are in debye (e a0 is {DEBYE_PER_ATOMIC_UNIT:.4g} D)"
        )
    return tuple(notes)
