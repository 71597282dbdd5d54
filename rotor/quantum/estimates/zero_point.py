"""Estimated difference between constants of the vibrational ground state and of an equilibrium geometry.

For a diatomic molecule B_e - B_0 = α_e/2, and with α_e = 6 F B²/ω (Pekeris' relation, in which F = a r - 1 for
a Morse potential)

    δB/B = 3 F B/ω,    that is  δr/r = (3/2) F ħ/(2πc · 2μω r²),

as if the bond were longer by δr. ω follows from the bond length (AIP Advances 13 (2023) 115323, abstract; atomic units,
ζ = 2 Z Z'/(Z + Z') the reduced nuclear charge, with the factor 2 that H2, CO and N2 require):

    k = ζ²/r³ of bonds with hydrogen,    k = 10 √ζ/r⁴ of others,

F = 1.2 and 2.2 are the medians over every second of 45 diatomic molecules; the other half gives 1.2 and 2.2 again, with no molecule beyond
a factor of 2 (tests/molecules/test_zero_point.py). In a polyatomic molecule each bond is lengthened by its δr at fixed angles, with the
smallest displacements of atoms (in a ring, by least squares). Bending, which makes A of water larger in the ground state, and Coriolis
terms are neglected: the quadratic mean over the axes is reliable, signs and single axes are not. docs/validation/estimates.md compares with
measured constants.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.geometry.inertia import LINEAR_BELOW, point_masses, principal_frame

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule

F_HYDROGEN, F_OTHER = 1.2, 2.2
LARGE = 60  # with more atoms, the mean over bonds without hydrogen is used
MANY_BONDS = 1000  # most bonds of a large molecule that are sampled
_STEP = 1e-3  # fraction of the displacement for its derivative


def relative_elongation(charges: Floats, masses_u: Floats, length_angstrom: float) -> float:
    """δr/r of a bond between two atoms of nuclear charges (2,) and masses (2,), for the constants of the ground state.

    >>> carbon_monoxide = relative_elongation(np.array([6.0, 8.0]), np.array([12.0, 15.995]), 1.1283)
    >>> f"{2 * carbon_monoxide:.4f}"  # δB/B; α/2B is 0.0045
    '0.0058'
    """
    zeta, r = 2 * charges.prod() / charges.sum(), length_angstrom / units.BOHR_RADIUS_ANGSTROM
    hydrogen = charges.min() == 1
    k = zeta**2 / r**3 if hydrogen else 10 * zeta**0.5 / r**4
    mass = masses_u.prod() / masses_u.sum() * units.ATOMIC_MASS_KG / units.ELECTRON_MASS_KG
    return float(1.5 * (F_HYDROGEN if hydrogen else F_OTHER) / (2 * np.sqrt(k * mass) * r**2))


def relative_difference(molecule: Molecule, bonds: Sequence[Ints]) -> float:
    """The quadratic mean over the axes of (B_e - B_0)/B, from the bonded neighbours of each atom; 0 without bonds.

    >>> from rotor.molecules.molecule import Molecule
    >>> water = Molecule(["O", "H", "H"], [[0, 0, 0], [0.757, 0.586, 0], [-0.757, 0.586, 0]])
    >>> f"{relative_difference(water, [np.array([1, 2]), np.array([0]), np.array([0])]):.4f}"  # measured 0.018
    '0.0181'
    """
    pairs = [(i, k) for i, near in enumerate(bonds) for k in near.tolist() if i < k]
    if not pairs:
        return 0.0
    if len(molecule.symbols) > LARGE:
        heavy = [pair for pair in pairs if "H" not in (molecule.symbols[pair[0]], molecule.symbols[pair[1]])] or pairs
        return 2 * float(np.mean(list(_elongations(molecule, heavy[:: 1 + len(heavy) // MANY_BONDS]).values())))
    longer = _elongations(molecule, pairs)
    x, mass = molecule.positions_angstrom, molecule.masses_u
    moved = x + _STEP * _displacement(x, bonds, longer)
    before, after = (principal_frame(point_masses(mass, positions)).moments for positions in (x, moved))
    turning = before > LINEAR_BELOW * before.max()
    return float(np.sqrt(np.mean(((after[turning] / before[turning] - 1) / _STEP) ** 2)))


def _elongations(molecule: Molecule, pairs: Sequence[tuple[int, int]]) -> dict[tuple[int, int], float]:
    """δr/r of bonds, by their atoms in rising order."""
    x, mass = molecule.positions_angstrom, molecule.masses_u
    charges = np.array([float(nucleus.element_number) for nucleus in molecule.nuclei])
    return {
        (i, k): relative_elongation(charges[[i, k]], mass[[i, k]], float(np.linalg.norm(x[i] - x[k]))) for i, k in pairs
    }


def _displacement(x: Floats, bonds: Sequence[Ints], longer: dict[tuple[int, int], float]) -> Floats:
    """The smallest displacements (n, 3) in Å that lengthen bonds at fixed angles, by least squares.

    For atoms i and k beside j, with u = x_i - x_j and v = x_k - x_j, d|u - v|² = 2 (ε_u u - ε_v v)·(u - v) at a fixed angle.
    """
    relative_change = dict(longer)
    for j, near in enumerate(bonds):
        for i, k in ((i, k) for i in near.tolist() for k in near.tolist() if i < k and (i, k) not in longer):
            u, v = x[i] - x[j], x[k] - x[j]
            change = longer[min(i, j), max(i, j)] * u - longer[min(j, k), max(j, k)] * v
            relative_change[i, k] = float(change @ (u - v) / ((u - v) @ (u - v)))
    matrix, target = np.zeros((len(relative_change), *x.shape)), np.zeros(len(relative_change))
    for row, ((i, k), relative) in enumerate(relative_change.items()):
        apart = x[i] - x[k]
        length = float(np.linalg.norm(apart))
        matrix[row, i], matrix[row, k] = apart / length, -apart / length
        target[row] = relative * length
    displacement = np.linalg.lstsq(matrix.reshape(len(target), -1), target, rcond=1e-9)[0]
    return np.asarray(displacement.reshape(x.shape))
