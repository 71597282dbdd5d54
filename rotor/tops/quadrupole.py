"""Nuclear quadrupole coupling constants of a top along its principal axes, from the tensors of its molecule.

χ_abc = A χ Aᵀ       A: rows are the principal axes (W. Gordy and R. L. Cook, Microwave Molecular Spectra, 3rd ed., chapter IX)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.tops.spins.spin_constants import SpinConstants

if TYPE_CHECKING:
    from rotor.geometry.inertia import PrincipalFrame
    from rotor.molecules.molecule import Molecule

NOISE = 1e-3  # relative to the largest element, and in MHz: programs print four decimals and meet symmetry that well


def computed_couplings(molecule: Molecule, frame: PrincipalFrame) -> SpinConstants | None:
    """χ of all nuclei with spin 1 or more; None without tensors.

    Off-diagonal elements and χ_bb - χ_cc below 1 kHz, or below 1e-3 of the largest element, count as 0.

    >>> from rotor.geometry.inertia import point_masses, principal_frame
    >>> from rotor.molecules.molecule import Molecule
    >>> chi = np.diag([2.4, 2.4, -4.8])
    >>> hcn = Molecule(("H", "C", "N"), [[0, 0, -1.06], [0, 0, 0], [0, 0, 1.15]], quadrupole_mhz={3: chi})
    >>> frame = principal_frame(point_masses(hcn.masses_u, hcn.positions_angstrom))
    >>> dict(computed_couplings(hcn, frame).values)
    {'chi_aa(14N)': -4.8}
    """
    with_spin = {atom: chi for atom, chi in molecule.quadrupole_mhz.items() if molecule.nuclei[atom - 1].spin >= 1}
    if not with_spin:
        return None
    values: dict[str, float] = {}
    twice, atoms = {}, {}
    for atom, chi in sorted(with_spin.items()):
        nucleus = molecule.nuclei[atom - 1]
        equal_nuclei = [other for other in sorted(with_spin) if molecule.nuclei[other - 1] == nucleus]
        # numbers distinguish equal isotopes
        name = nucleus.label + (f"_{equal_nuclei.index(atom) + 1}" if len(equal_nuclei) > 1 else "")
        twice[name], atoms[name] = round(2 * nucleus.spin), atom
        values |= {f"{symbol}({name})": value for symbol, value in _named(frame.axes @ chi @ frame.axes.T).items()}
    return SpinConstants(values, twice, f"computed: {molecule.quadrupole_source or molecule.source}", atoms=atoms)


def _named(chi: Floats) -> dict[str, float]:
    least = NOISE * max(1.0, float(np.abs(chi).max()))
    rest = {"bb-cc": chi[1, 1] - chi[2, 2], "ab": chi[0, 1], "ac": chi[0, 2], "bc": chi[1, 2]}
    return {"chi_aa": float(chi[0, 0])} | {f"chi_{k}": float(value) for k, value in rest.items() if abs(value) > least}
