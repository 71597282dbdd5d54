"""Harmonic force fields of bent triatomic molecules, for the tests of vibration and distortion.

Those of 1954 and 1965 are quoted from memory: their wavenumbers are as published, and other force fields agree (see
`test_force_field_oracle.py`).
"""

from __future__ import annotations

import numpy as np

from rotor.molecules.force_field import ForceField, force_field_from_internal
from rotor.molecules.internal_coordinates import bend, stretch
from rotor.molecules.molecule import Molecule


def bent_field(symbols, r, degrees, f_r, f_rr, f_ra, f_a, source) -> ForceField:
    """XY2 with force constants in mdyn/Å, those of the angle divided by r and r² as published."""
    half = np.radians(degrees) / 2
    atoms = [[0, 0, 0], [r * np.sin(half), 0, r * np.cos(half)], [-r * np.sin(half), 0, r * np.cos(half)]]
    constants = [[f_r, f_rr, f_ra * r], [f_rr, f_r, f_ra * r], [f_ra * r, f_ra * r, f_a * r**2]]
    coordinates = [stretch(0, 1), stretch(0, 2), bend(1, 0, 2)]
    return force_field_from_internal(Molecule(symbols, atoms), coordinates, constants, source=source)


def water() -> ForceField:
    """K. Kuchitsu and Y. Morino, Bull. Chem. Soc. Jpn. 38, 814 (1965); ω 1648.5, 3832.2, 3942.5 cm⁻¹; memory."""
    return bent_field(("O", "H", "H"), 0.9572, 104.52, 8.454, -0.101, 0.227, 0.761, "Kuchitsu and Morino 1965")


def sulfur_dioxide() -> ForceField:
    """S. R. Polo and M. K. Wilson, J. Chem. Phys. 22, 900 (1954), from the fundamentals 1151, 518, 1362 cm⁻¹; memory."""
    return bent_field(("S", "O", "O"), 1.4308, 119.32, 10.006, 0.024, 0.189, 0.793, "Polo and Wilson 1954")


def sulfur_dioxide_ab_initio() -> ForceField:
    """Computed for these tests: CCSD(T), frozen core, cc-pVTZ on O and cc-pV(T+d)Z on S, with PySCF 2.14.

    Second differences of 14 energies about the minimum, 1.4395 Å and 119.55°; here at the experimental one. PySCF: Q. Sun
    et al., J. Chem. Phys. 153, 024109 (2020).
    """
    r = 1.4308
    return bent_field(("S", "O", "O"), r, 119.32, 10.310, -0.010, 0.2335 / r, 1.672 / r**2, "CCSD(T)/cc-pV(T+d)Z")
