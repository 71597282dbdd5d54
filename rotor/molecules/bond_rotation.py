"""Internal rotation about a bond: the atoms that turn, the symmetry, and the reduced moment of inertia.

Let α be the torsional angle, ω the angular velocity of the molecule, and v_i = n × (x_i - x_0) the velocities of the atoms of one part
(0 for the other part) relative to the centre of mass. The kinetic energy is ½ (ω, α') K (ω, α')ᵀ with the 4 x 4 matrix

    K = | I   c |     I the inertia tensor,   c = Σ m_i r_i × v_i,   I_α = Σ m_i v_i².
        | cᵀ I_α |

For zero total angular momentum, ω = -I⁻¹ c α', and the kinetic energy is ½ I_r α'² with

    I_r = I_α - cᵀ I⁻¹ c = det K / det I = 1 / (K⁻¹)_αα.

Derived here. For one group on a rigid frame it is the reduced moment of K. S. Pitzer, J. Chem. Phys. 14 (1946) 239, as later authors
cite it; for a symmetric group it is r I_α with r = 1 - Σ λ_g² I_α/I_g (`rotor.quantum.estimates.methyl_groups`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.molecules.bonds import bonded_atoms
from rotor.molecules.molecule import Molecule

ON_AXIS_ANGSTROM = 0.1  # Å: atoms closer to the line of the bond count as on it; a group of such atoms is linear
SYMMETRIC_ANGSTROM = 0.25  # Å: tolerance of an n-fold axis along the bond; hydrogens of a methyl group deviate by 0.05
MOST_FOLD = 6
PLANAR = 0.4  # determinant of three unit vectors: 0 in a plane, 0.77 for a tetrahedron; slightly pyramidal amides count as planar


@dataclass(frozen=True, eq=False)
class BondRotation:
    """Rotation about the bond between two atoms (counted from 0); top: the atoms on the side of `last`, which turn.

    Parameters
    ----------
    molecule : Molecule
    first, last : int
        The atoms of the bond, counted from 0.
    top, frame : (n,) array of int
        Atoms on the side of `last` and of `first`, inclusive.

    Examples
    --------
    >>> from rotor.molecules.readers.read import read_molecule
    >>> ethane = bond_rotation(read_molecule("C2H6"), "1-2")
    >>> len(ethane.top), len(ethane.frame), ethane.symmetry_number()
    (4, 4, 3)
    """

    molecule: Molecule
    first: int
    last: int
    top: Ints
    frame: Ints

    def turned(self, angle: float) -> Molecule:
        """The molecule with the top turned rigidly by an angle, radian."""
        return replace(self.molecule, positions_angstrom=self.turned_positions(self.molecule.positions_angstrom, angle))

    def turned_positions(self, positions: Floats, angle: float) -> Floats:
        """Positions (n, 3) with the top turned about the bond, right-handed seen from first to last."""
        axis = _axis(positions, self.first, self.last)
        moved, arms = positions.copy(), positions[self.top] - positions[self.last]
        across = np.cross(axis, arms)
        along = np.outer(arms @ axis, axis)
        moved[self.top] = positions[self.last] + along + (arms - along) * math.cos(angle) + across * math.sin(angle)
        return moved

    def kinetic_matrix(self, positions: Floats | None = None) -> Floats:
        """K (4, 4) in u Å² over ω_x, ω_y, ω_z and α', in the frame of the positions; see the head of this module."""
        x = self.molecule.positions_angstrom if positions is None else positions
        mass = self.molecule.masses_u
        velocity = np.zeros_like(x)
        velocity[self.top] = np.cross(_axis(x, self.first, self.last), x[self.top] - x[self.last])
        velocity -= mass @ velocity / mass.sum()
        arms = x - mass @ x / mass.sum()
        matrix = np.empty((4, 4))
        matrix[:3, :3] = np.eye(3) * (mass @ np.sum(arms**2, axis=1)) - np.einsum("i,ij,ik->jk", mass, arms, arms)
        matrix[:3, 3] = matrix[3, :3] = mass @ np.cross(arms, velocity)
        matrix[3, 3] = mass @ np.sum(velocity**2, axis=1)
        return matrix

    def reduced_moment(self, positions: Floats | None = None) -> float:
        """I_r in u Å² at the geometry of the molecule, or at other positions (n, 3)."""
        return float(1 / np.linalg.inv(self.kinetic_matrix(positions))[3, 3])

    def symmetry_number(self, isotopes: bool = True) -> int:
        """Number of equivalent positions per turn: least common multiple of the axes of both parts along the bond.

        isotopes: whether isotopes are distinguished; the potential does not depend on them, the kinetic energy does.
        """
        return math.lcm(*(self._fold(atoms, isotopes) for atoms in (self.top, self.frame)))

    def _fold(self, atoms: Ints, isotopes: bool) -> int:
        """Largest n for which a rotation by 2π/n brings all atoms of a part onto like atoms."""
        x, axis = self.molecule.positions_angstrom, _axis(self.molecule.positions_angstrom, self.first, self.last)
        arms = x[atoms] - x[self.last]
        kinds = [(self.molecule.symbols[i], self.molecule.mass_numbers[i] if isotopes else 0) for i in atoms.tolist()]
        alike = np.array([[kind == other for other in kinds] for kind in kinds])
        along = np.outer(arms @ axis, axis)
        for n in range(MOST_FOLD, 1, -1):  # from the highest: a sixfold group is threefold and twofold too
            angle = 2 * math.pi / n
            moved = along + (arms - along) * math.cos(angle) + np.cross(axis, arms) * math.sin(angle)
            apart = np.where(alike, np.linalg.norm(moved[:, None] - arms[None], axis=-1), np.inf)
            if apart.min(axis=1).max() < SYMMETRIC_ANGSTROM:
                return n
        return 1

    def mirror_angle(self, isotopes: bool = True) -> float | None:
        """An angle α_0 about which energy and moments are even: there the symmetry planes of both parts coincide.

        None if a part has no plane of symmetry that contains the bond. isotopes: as for `symmetry_number`.
        """
        planes = [self._plane(atoms, isotopes) for atoms in (self.top, self.frame)]
        if planes[0] is None or planes[1] is None:
            return None
        return float((planes[1] - planes[0] + math.pi / 2) % math.pi - math.pi / 2)

    def _plane(self, atoms: Ints, isotopes: bool) -> float | None:
        """The angle φ of a symmetry plane of a part that contains the bond; None without one."""
        x, axis = self.molecule.positions_angstrom, _axis(self.molecule.positions_angstrom, self.first, self.last)
        across = _across(x, self, atoms.tolist(), unit=False)
        along = (x[atoms] - x[self.last]) @ axis
        kinds = [(self.molecule.symbols[i], self.molecule.mass_numbers[i] if isotopes else 0) for i in atoms.tolist()]
        alike = np.array([[kind == other for other in kinds] for kind in kinds])
        outermost = int(np.argmax(np.abs(across)))
        planes = []
        for other in np.flatnonzero(alike[outermost]).tolist():
            turn = across[outermost] * across[other]  # exp 2iφ
            reflected = turn / abs(turn) * across.conj() if turn else across
            apart = np.hypot(np.abs(reflected[:, None] - across), along[:, None] - along)
            apart = np.where(alike, apart, np.inf)
            if apart.min(axis=1).max() < SYMMETRIC_ANGSTROM:
                mean = np.sum(across * across[apart.argmin(axis=1)])
                planes.append((float(apart.min(axis=1).max()), float(np.angle(mean)) / 2))
        return min(planes)[1] if planes else None

    def angle(self, positions: Floats) -> float:
        """Mean angle of rotation of the inner atoms of the top relative to those of the frame, radian from -π to π.

        A single dihedral angle would count the tilt of one bond as rotation; the mean over a methyl group does not.
        """
        turns = [
            self._mean_turn(positions, end, other) for end, other in ((self.last, self.first), (self.first, self.last))
        ]
        return float(np.angle(turns[0] * np.conj(turns[1])))

    def _mean_turn(self, positions: Floats, end: int, other: int) -> complex:
        """Σ exp i(φ - φ_0) of the atoms bonded to one end of the bond; φ about the bond, φ_0 that of the molecule itself."""
        start = self.molecule.positions_angstrom
        near = bonded_atoms(self.molecule)[end]
        off = [i for i in near.tolist() if i != other and _off_axis(start, i, self.first, self.last) > ON_AXIS_ANGSTROM]
        atoms = off or [self.dihedral_atoms()[3 if end == self.last else 0]]
        return complex(np.sum(_across(positions, self, atoms) * np.conj(_across(start, self, atoms))))

    def dihedral_atoms(self) -> tuple[int, int, int, int]:
        """Four atoms (from 0) that define the dihedral angle of the bond: the nearest atoms off the axis on both sides."""
        x = self.molecule.positions_angstrom
        ends = []
        for atoms, end in ((self.frame, self.first), (self.top, self.last)):
            off = [i for i in atoms.tolist() if _off_axis(x, i, self.first, self.last) > ON_AXIS_ANGSTROM]
            ends.append(min(off, key=lambda i: (float(np.linalg.norm(x[i] - x[end])), i)))
        return ends[0], self.first, self.last, ends[1]

    def opposite_atoms(self) -> tuple[int, int, int, int] | None:
        """Four atoms of the other substituents if both ends of the bond are planar with two substituents (a peptide bond); else None.

        With only one dihedral angle fixed, such a group would bend out of its plane instead of turning.
        """
        x = self.molecule.positions_angstrom
        nearest = self.dihedral_atoms()
        bonds, others = bonded_atoms(self.molecule), []
        for end, beyond, taken in ((self.first, self.last, nearest[0]), (self.last, self.first, nearest[3])):
            beside = [i for i in bonds[end].tolist() if i != beyond]
            if len(beside) != 2 or taken not in beside:
                return None
            arms = [x[i] - x[end] for i in (*beside, beyond)]
            if abs(np.linalg.det([arm / np.linalg.norm(arm) for arm in arms])) > PLANAR:
                return None
            others.append(next(i for i in beside if i != taken))
        return others[0], self.first, self.last, others[1]


def bond_rotation(molecule: Molecule, bond: str | Sequence[int]) -> BondRotation:
    """The rotation about a bond, named by its atoms (from 1), such as "1-2" or (1, 2).

    Parameters
    ----------
    molecule : Molecule
    bond : str or two int
        The atom of the frame and the atom of the group that turns, with a hyphen between them in a text.

    Returns
    -------
    BondRotation

    Raises
    ------
    ValueError
        For missing or unbonded atoms, a bond in a ring, a terminal atom, and a linear group.
    """
    first, last = _numbers(molecule, bond)
    neighbours = bonded_atoms(molecule)
    x, name = molecule.positions_angstrom, _named(molecule, first, last)
    if last not in neighbours[first]:
        apart = float(np.linalg.norm(x[last] - x[first]))
        others = ", ".join(str(i + 1) for i in neighbours[first].tolist()) or "none"
        raise ValueError(f"{name} are not bonded: {apart:.3g} Å apart; atom {first + 1} is bonded to {others}")
    top, frame = _side(neighbours, last, first), _side(neighbours, first, last)
    if first in top:
        raise ValueError(f"{name}: the bond is part of a ring, about which nothing can turn; name a bond outside rings")
    for atoms, end in ((frame, first), (top, last)):
        if len(atoms) == 1:
            raise ValueError(
                f"{name}: atom {end + 1} ({molecule.symbols[end]}) is bonded to no other atom, so that nothing turns; "
                "name a bond with atoms on both sides"
            )
        if max(_off_axis(x, i, first, last) for i in atoms) <= ON_AXIS_ANGSTROM:
            raise ValueError(
                f"{name}: all atoms behind atom {end + 1} lie on the line of the bond (a linear group), so that nothing turns; "
                "name a bond with atoms off its line on both sides"
            )
    return BondRotation(molecule, first, last, np.array(sorted(top)), np.array(sorted(frame)))


def bond_text(bond: str | Sequence[int]) -> str:
    """The text of a bond given as a text or as two numbers; ValueError for anything else.

    >>> bond_text((1, 2))
    '1-2'
    """
    if isinstance(bond, str):
        return bond
    numbers = tuple(bond) if isinstance(bond, Sequence | np.ndarray) else ()
    if len(numbers) != 2 or not all(isinstance(n, Integral) and not isinstance(n, bool) for n in numbers):
        raise ValueError(f"{bond!r}: expected two atom numbers, such as 1-2")
    return f"{numbers[0]}-{numbers[1]}"


def turning_bonds(molecule: Molecule) -> Iterator[tuple[int, int]]:
    """The bonds about which `bond_rotation` turns a group, by the numbers of their atoms from 1.

    >>> import rotor
    >>> list(turning_bonds(rotor.read("CH3CHO").molecule))
    [(2, 4)]
    """
    for first, neighbours in enumerate(bonded_atoms(molecule)):
        for last in neighbours[neighbours > first].tolist():
            with suppress(ValueError):
                bond_rotation(molecule, (first + 1, last + 1))
                yield first + 1, last + 1


def _numbers(molecule: Molecule, bond: str | Sequence[int]) -> tuple[int, int]:
    """Two atoms from 0; ValueError for anything else than two different atoms of the molecule."""
    count = len(molecule.symbols)
    match = re.fullmatch(r"\s*(\d+)\s*-\s*(\d+)\s*", bond_text(bond))
    if match is None:
        raise ValueError(f"{bond!r}: expected two atom numbers, such as 1-2")
    first, last = int(match[1]), int(match[2])
    if first == last or not (1 <= first <= count and 1 <= last <= count):
        raise ValueError(f"{bond!r}: expected two different atoms of {molecule.formula}, which has atoms 1 to {count}")
    return first - 1, last - 1


def _named(molecule: Molecule, first: int, last: int) -> str:
    return f"atoms {first + 1} ({molecule.symbols[first]}) and {last + 1} ({molecule.symbols[last]})"


def _side(neighbours: list[Ints], start: int, without: int) -> set[int]:
    """Atoms connected to `start` without the bond to `without`."""
    reached, front = {start}, [start]
    while front:
        atom = front.pop()
        for other in neighbours[atom].tolist():
            if other not in reached and not (atom == start and other == without):
                reached.add(other)
                front.append(other)
    return reached


def _axis(positions: Floats, first: int, last: int) -> Floats:
    """Unit vector of the bond."""
    bond = positions[last] - positions[first]
    return np.asarray(bond / np.linalg.norm(bond))


def _off_axis(positions: Floats, atom: int, first: int, last: int) -> float:
    """Distance of an atom from the line of the bond, Å."""
    return float(np.linalg.norm(np.cross(positions[atom] - positions[last], _axis(positions, first, last))))


def _across(positions: Floats, rotation: BondRotation, atoms: list[int], unit: bool = True) -> NDArray[np.complex128]:
    """exp iφ of atoms about the bond, φ from the plane of the bond and the first atom of the dihedral angle; times r if not `unit`."""
    axis = _axis(positions, rotation.first, rotation.last)
    side = positions[rotation.dihedral_atoms()[0]] - positions[rotation.first]
    side = side - (side @ axis) * axis
    side /= np.linalg.norm(side)
    arms = positions[atoms] - positions[rotation.last]
    waves = arms @ side + 1j * (arms @ np.cross(axis, side))
    return np.asarray(waves / np.abs(waves) if unit else waves)
