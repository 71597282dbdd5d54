"""r_s: the substitution structure of a family, atom by atom, with bonds and angles between substituted atoms.

Each isotopologue with a single substituted atom gives the coordinates of that atom (`kraitchman`); equivalent atoms are copies of it.
Coordinates that vanish by site symmetry are exactly 0. Signs come from the start geometry, and so do directions across the axis of a
symmetric parent or from the centre of a spherical one. The errors of bonds and angles follow from those of the coordinates (Costain's
and those of the constants), taken as independent unless the atoms are equivalent.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import molecule_symmetry
from rotor.structures.coordinates import Named, bonds_and_angles
from rotor.structures.family import PLANAR_WITHIN_ANGSTROM, Family, Species
from rotor.structures.kraitchman import PAIRS, SHAPES, Substituted, kraitchman

ROUND_OFF = 1e-9  # component of a unit vector along an axis below which it is 0
ON_AXIS_ANGSTROM = 1e-3  # distance from the figure axis of a symmetric top below which an atom is on it


@dataclass(frozen=True)
class SubstitutedAtom:
    """An atom (from 1) with its isotopologue, the result of Kraitchman's equations, and the directions of these coordinates.

    directions : (3, 3), a row for each coordinate of `kraitchman` in the axes of the parent, with the signs of the start geometry.
        Unit vectors, or 0 for coordinates that are 0 by shape or site symmetry.
    """

    atom: int
    species: str
    kraitchman: Substituted
    directions: Floats

    @property
    def coordinates_angstrom(self) -> Floats:
        """a, b, c (3,) with signs."""
        return np.asarray(self.kraitchman.coordinates_angstrom @ self.directions) + 0.0

    @property
    def squares_angstrom2(self) -> Floats:
        """a², b², c² (3,); negative if imaginary."""
        return np.asarray(self.kraitchman.squares_angstrom2 @ self.directions**2)

    @property
    def costain_angstrom(self) -> Floats:
        """Costain's errors of a, b, c (3,)."""
        return self._along_axes(self.kraitchman.costain_angstrom)

    @property
    def measured_angstrom(self) -> Floats:
        """Errors of a, b, c (3,) from those of the moments."""
        return self._along_axes(self.kraitchman.measured_angstrom)

    @property
    def errors_angstrom(self) -> Floats:
        """Total errors of a, b, c (3,)."""
        return self._along_axes(self.kraitchman.errors_angstrom)

    @property
    def zero_by_symmetry(self) -> tuple[bool, bool, bool]:
        """Which of a, b, c vanish: no direction has a component along the axis."""
        a, b, c = (~np.any(self.directions, axis=0)).tolist()
        return a, b, c

    def _along_axes(self, errors: Floats) -> Floats:
        return np.asarray(np.sqrt(errors**2 @ self.directions**2))


@dataclass(frozen=True)
class Value:
    """A bond length or an angle: its name and atoms, value and error in the unit, Å or °."""

    name: str
    atoms: tuple[int, ...]
    value: float
    error: float
    unit: str


@dataclass(frozen=True)
class SubstitutionStructure:
    """Substituted atoms, bond lengths and angles between them, and notes.

    positions_angstrom : (n, 3) in the principal axes of the parent, nan for atoms without substitution
    errors_angstrom : (n, 3)
    """

    atoms: tuple[SubstitutedAtom, ...]
    positions_angstrom: Floats
    errors_angstrom: Floats
    values: tuple[Value, ...]
    notes: tuple[str, ...]


def substitution_structure(
    family: Family, *, pair: str = "ab", coordinates: Iterable[Named] = ()
) -> SubstitutionStructure:
    """The r_s structure of a family.

    pair : the two moments used for a planar molecule. coordinates : bonds and angles to report; default: those of the start
    geometry. Raises ValueError if no isotopologue has a single substituted atom.
    """
    if pair not in PAIRS:
        raise ValueError(f"pair {pair!r}: one of {', '.join(PAIRS)} says which two moments of a planar molecule count")
    ours = family.frame_positions(family.parent)
    atoms, notes = [], list[str]()
    for species in family.species[1:]:
        atom = replaced_atom(family.molecule, species.molecule)
        if atom is None:
            notes.append(f"{species.name}: more than one atom is replaced; it takes no part in r_s")
            continue
        try:
            atoms.append(_substituted(family, species, atom, ours, pair))
        except ValueError as error:
            raise ValueError(f"{family.name}, {species.name}: {error}") from None
        notes += _doubts(atoms[-1])
    if not atoms:
        raise ValueError(f"{family.name}: r_s needs isotopologues with one atom replaced, and there is none")

    placed = _with_equal_atoms(family, atoms, ours)
    reported = tuple(coordinates) or bonds_and_angles(_in_frame(family.molecule, ours))
    values = tuple(_value(coordinate, placed) for coordinate in reported if _is_known(coordinate, placed.positions))
    return SubstitutionStructure(tuple(atoms), placed.positions, placed.errors, values, tuple(notes))


def replaced_atom(parent: Molecule, other: Molecule) -> int | None:
    """The only atom (from 0) whose isotope differs; None if several differ."""
    changed = np.flatnonzero(np.array(parent.mass_numbers) != np.array(other.mass_numbers))
    return int(changed[0]) if len(changed) == 1 else None


def _substituted(family: Family, species: Species, atom: int, ours: Floats, pair: str) -> SubstitutedAtom:
    shape = _shape(family, ours[atom])
    parent, other = family.parent, species
    solution = kraitchman(
        parent.moments,
        other.moments,
        mass_u=parent.molecule.mass_u,
        change_u=float(other.molecule.masses_u[atom] - parent.molecule.masses_u[atom]),
        shape=shape,
        pair=pair,
        parent_errors=parent.moment_errors,
        substituted_errors=other.moment_errors,
    )
    directions = _directions(family.top.kind, ours[atom])
    allowed = np.linalg.norm(directions @ _site_projector(family, ours, atom), axis=1) > 0.5  # 1 or 0 within round-off
    allowed &= np.isin(np.arange(3), SHAPES[shape])
    directions = np.where(allowed[:, None], directions, 0.0)
    return SubstitutedAtom(atom + 1, species.name, solution, directions)


def _shape(family: Family, place: Floats) -> str:
    if family.linear:
        return "linear"
    if family.top.kind in ("prolate", "oblate"):
        return "symmetric"
    if family.top.kind == "spherical":
        return "spherical"
    return "planar" if family.planar and abs(place[2]) < PLANAR_WITHIN_ANGSTROM else "asymmetric"


def _directions(kind: str, place: Floats) -> Floats:
    """Directions (3, 3) of the coordinates of Kraitchman's equations, as rows, for an atom at `place` in the start geometry.

    Asymmetric top: a, b, c; symmetric top: along and across the axis; spherical top: from the centre to the atom.
    """
    signs = np.diag(np.where(place < 0, -1.0, 1.0))
    if kind not in ("prolate", "oblate", "spherical"):
        return signs
    out = np.zeros((3, 3))
    across = place.copy()
    if kind != "spherical":
        along = 0 if kind == "prolate" else 2
        out[0] = signs[along]
        across[along] = 0.0
    distance = np.linalg.norm(across)
    if distance > ON_AXIS_ANGSTROM:
        out[0 if kind == "spherical" else 1] = across / distance
    return np.where(np.abs(out) < ROUND_OFF, 0.0, out)


def _site_projector(family: Family, ours: Floats, atom: int) -> Floats:
    """The projector (3, 3) on displacements of an atom that are invariant under its site symmetry.

    For an atom on an axis or in a plane of symmetry, the coordinates across it are exactly 0.
    """
    symmetry = molecule_symmetry(_in_frame(family.molecule, ours))
    if family.linear:  # the half turn of a centrosymmetric molecule is the last rotation
        turned = symmetry.rotations[-1].permutation
        return np.eye(3) * float(len(symmetry.rotations) == 1 or turned[atom] != atom)
    staying = [
        operation.matrix
        for operation in (*symmetry.rotations, *symmetry.improper)
        if operation.permutation[atom] == atom
    ]
    return np.asarray(np.mean(staying, axis=0))


def _doubts(atom: SubstitutedAtom) -> list[str]:
    out = []
    sizes, squares = atom.coordinates_angstrom, atom.squares_angstrom2
    imaginary = [axis for axis, square in zip("abc", squares.tolist(), strict=True) if square < 0]
    small = [axis for axis, size in zip("abc", np.abs(sizes).tolist(), strict=True) if 0 < size < 0.15]
    if imaginary:
        texts = ", ".join(f"{axis}² = {squares['abc'.index(axis)]:.2g}" for axis in imaginary)
        out.append(f"atom {atom.atom} ({atom.species}): imaginary coordinate, {texts} Å²; taken as 0")
    if small:
        out.append(f"atom {atom.atom} ({atom.species}): |{'|, |'.join(small)}| below 0.15 Å is unreliable")
    return out


class _Placed(NamedTuple):
    """Positions (n, 3), nan if unknown; their derivatives by each coordinate of Kraitchman's equations (c, n, 3); its error (c,)."""

    positions: Floats
    moves: Floats
    sigmas: Floats

    @property
    def errors(self) -> Floats:
        """Errors (n, 3) along the axes; nan for unknown positions."""
        spread = np.sqrt(np.tensordot(self.sigmas**2, self.moves**2, axes=1))
        return np.where(np.isnan(self.positions), np.nan, spread)


def _with_equal_atoms(family: Family, atoms: list[SubstitutedAtom], ours: Floats) -> _Placed:
    """The substituted atoms and their equivalents by symmetry, which move with them."""
    positions, moves = np.full(ours.shape, np.nan), np.zeros((3 * len(atoms), *ours.shape))
    for place, atom in enumerate(atoms):
        positions[atom.atom - 1] = atom.coordinates_angstrom
        moves[3 * place : 3 * place + 3, atom.atom - 1] = atom.directions
    symmetry = molecule_symmetry(_in_frame(family.molecule, ours))
    for operation in (*symmetry.rotations, *symmetry.improper):
        for place, atom in enumerate(atoms):
            image = int(operation.permutation[atom.atom - 1])
            if np.isnan(positions[image, 0]):
                positions[image] = operation.matrix @ positions[atom.atom - 1]
                moves[3 * place : 3 * place + 3, image] = atom.directions @ operation.matrix.T
    return _Placed(positions, moves, np.concatenate([atom.kraitchman.errors_angstrom for atom in atoms]))


def _in_frame(molecule: Molecule, positions: Floats) -> Molecule:
    return Molecule(molecule.symbols, positions, molecule.mass_numbers)


def _is_known(coordinate: Named, positions: Floats) -> bool:
    return bool(np.isfinite(positions[[atom - 1 for atom in coordinate.atoms]]).all())


def _value(coordinate: Named, placed: _Placed) -> Value:
    """A coordinate between known atoms; equivalent atoms share one error."""
    positions = placed.positions
    alone = Named(coordinate.name, coordinate.atoms, (coordinate.atoms,))
    filled = np.where(np.isnan(positions), np.arange(positions.size).reshape(positions.shape) + 100.0, positions)
    slopes = np.tensordot(placed.moves, alone.gradient(filled).reshape(positions.shape), axes=2)
    spread = float(np.linalg.norm(slopes * placed.sigmas))
    return Value(coordinate.name, coordinate.atoms, alone.value(filled), spread * coordinate.factor, coordinate.unit)
