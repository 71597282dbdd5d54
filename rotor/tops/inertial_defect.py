"""Zero-point corrections of moments of inertia in a harmonic force field: Coriolis coupling and the inertial defect.

The moments of the ground state are those of the minimum plus a correction. Its harmonic part along the principal axis g, with the
Coriolis constants ζ, the derivative a = ∂I/∂Q of the inertia tensor, and f = h/8π²c, is

    δI_g = -f { Σ_k Σ_x 3 (a_k^gx)² / (4 I_x ω_k) - Σ_k<l (ζ_kl^g)² (ω_k - ω_l)² / [ω_k ω_l (ω_k + ω_l)] }

which is the sum of α_k/2 by I. M. Mills, in Molecular Spectroscopy: Modern Research 1 (1972), eq. 50; the poles at ω_k = ω_l of two modes
cancel. The anharmonic part is proportional to a_k^gg. Since a^cc = a^aa + a^bb for a planar molecule, it cancels in the
inertial defect I_c - I_a - I_b, which is a harmonic quantity (T. Oka and Y. Morino, J. Mol. Spectrosc. 6, 472
(1961)).
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.force_field import ForceField
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

PLANAR_WITHIN = 1e-6  # largest Σ m c² of a planar molecule, relative to I_c


def inertia_by_modes(field: ForceField, top: Top) -> Floats:
    """∂I_αβ/∂Q_k (m, 3, 3) in √u Å along the principal axes of the field's molecule."""
    assert top.frame is not None  # from_molecule sets it
    positions = (field.molecule.positions_angstrom - top.frame.centre) @ top.frame.axes.T
    modes = field.vibrations().modes.reshape(len(positions), 3, -1)
    rotated = np.einsum("ab,nbk->nak", top.frame.axes, modes)
    cross = np.einsum("n,na,nbk->kab", np.sqrt(field.molecule.masses_u), positions, rotated)
    trace = np.einsum("kaa->k", cross)
    return np.asarray(2 * trace[:, None, None] * np.eye(3) - cross - cross.transpose(0, 2, 1))


def is_planar(top: Top) -> bool:
    """Whether the nuclei lie in a plane but not on a line: Σ m c² vanishes, I_a does not."""
    return top.kind != "linear" and top.planar_moments_u_angstrom2[2] < PLANAR_WITHIN * top.moments_u_angstrom2[2]


def coriolis_zeta(field: ForceField) -> Floats:
    """ζ^g_kl = Σ (l_k × l_l)_g over the atoms (3, m, m), along a, b, c; antisymmetric in the modes.

    Source: J. H. Meal and S. R. Polo, J. Chem. Phys. 24, 1119 (1956).
    """
    top = Top.from_molecule(field.molecule)
    assert top.frame is not None  # from_molecule sets it
    modes = field.vibrations().modes.reshape(len(field.molecule.symbols), 3, -1)
    rotated = np.einsum("ab,nbk->nak", top.frame.axes, modes)
    levi_civita = np.cross(np.eye(3)[:, None], np.eye(3)[None, :])  # cross products of unit vectors
    return np.asarray(np.einsum("abg,nak,nbl->gkl", levi_civita, rotated, rotated))


def harmonic_correction_u_angstrom2(field: ForceField) -> Floats:
    """Harmonic zero-point correction δI (3,) along a, b, c in u Å² to the moments of the minimum.

    Neglected: the anharmonic part, which is as large, electrons and distortion. Raises ValueError for a linear
    molecule, whose bending vibrations carry angular momentum.
    """
    top = Top.from_molecule(field.molecule)
    if top.kind == "linear":
        raise ValueError(f"{field.molecule.formula} is linear: its moments have another correction, with l-doubling")
    wavenumbers, moments = field.vibrations().wavenumbers_cm, np.array(top.moments_u_angstrom2)
    squares = inertia_by_modes(field, top) ** 2
    stretched = 3 / 4 * np.einsum("kgx,x,k->g", squares, 1 / moments, 1 / wavenumbers)

    first, other = wavenumbers[:, None], wavenumbers[None, :]
    coupled = (first - other) ** 2 / (first * other * (first + other))
    coriolis = np.einsum("gkl,kl->g", coriolis_zeta(field) ** 2, coupled) / 2  # each pair once
    return np.asarray(-ROTATIONAL_MHZ_U_ANGSTROM2 / MHZ_PER_CM * (stretched - coriolis))


def inertial_defect_u_angstrom2(field: ForceField) -> float:
    """Inertial defect I_c - I_a - I_b of a planar molecule in its vibrational ground state, in u Å², from its harmonic force field.

    Neglected: contributions of electrons and centrifugal distortion, some per cent. Raises ValueError for a molecule that is
    not planar, since anharmonic terms do not cancel then.

    >>> from rotor.molecules.force_field import force_field_from_internal
    >>> from rotor.molecules.internal_coordinates import bend, stretch
    >>> from rotor.molecules.molecule import Molecule
    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0], [0, 0.7569, 0.5859], [0, -0.7569, 0.5859]])
    >>> coordinates = [stretch(0, 1), stretch(0, 2), bend(1, 0, 2)]
    >>> constants = [[8.454, -0.101, 0.22], [-0.101, 8.454, 0.22], [0.22, 0.22, 0.697]]
    >>> round(inertial_defect_u_angstrom2(force_field_from_internal(water, coordinates, constants)), 3)  # measured 0.048
    0.046
    """
    if not is_planar(Top.from_molecule(field.molecule)):
        raise ValueError(f"{field.molecule.formula} is not planar: its inertial defect is not a harmonic quantity")
    a, b, c = harmonic_correction_u_angstrom2(field)
    return float(c - a - b)
