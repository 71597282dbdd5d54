"""r_s: the substitution structure of a family, atom by atom, and the bonds and angles between the atoms it has.

Every isotopologue with one atom replaced gives that atom's coordinates (`kraitchman`); atoms that symmetry makes equal are
copied from it, and coordinates that the symmetry of an atom's site makes 0 are 0 without an error. Signs come from the start
geometry, and of symmetric and spherical parents the direction across the axis or from the centre. Bonds and angles carry the errors
of the coordinates, Costain's and those of the constants, taken as independent between atoms that are not copies of each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import symmetry_of
from rotor.structures.coordinates import Named, bonds_and_angles
from rotor.structures.family import PLANAR_WITHIN_ANGSTROM, Family, Species
from rotor.structures.kraitchman import PAIRS, SHAPES, Substituted, kraitchman

ROUND_OFF = 1e-9  # of a unit vector: a component along an axis
ON_AXIS_ANGSTROM = 1e-3  # of the figure axis of a symmetric top: an atom so near is on it


@dataclass(frozen=True)
class SubstitutedAtom:
    """An atom, from 1, the isotopologue it is from, what Kraitchman's equations say, and the directions of their coordinates.

    directions : (3, 3) rows, one for each coordinate of `kraitchman`, with the signs of the start geometry, in the axes of the parent.
        Unit vectors, but 0 where the shape or the symmetry of the atom's site makes the coordinate 0.
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
        """a², b², c² (3,), below zero where imaginary."""
        return np.asarray(self.kraitchman.squares_angstrom2 @ self.directions**2)

    @property
    def costain_angstrom(self) -> Floats:
        """What vibration may do to a, b, c (3,)."""
        return self._along_axes(self.kraitchman.costain_angstrom)

    @property
    def measured_angstrom(self) -> Floats:
        """Errors of a, b, c (3,) that those of the moments make."""
        return self._along_axes(self.kraitchman.measured_angstrom)

    @property
    def errors_angstrom(self) -> Floats:
        """Both together (3,)."""
        return self._along_axes(self.kraitchman.errors_angstrom)

    @property
    def zero_by_symmetry(self) -> tuple[bool, bool, bool]:
        """Which of a, b, c vanish because no direction has a part along the axis."""
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
    """Atoms by substitution, the values between them, and what must be known of it.

    positions_angstrom : (n, 3) in the principal axes of the parent, nan for atoms that were not substituted
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

    pair : which two moments serve for a planar molecule. coordinates : bonds and angles to give; those of the start geometry
    if there are none. Raises ValueError where no isotopologue has one atom replaced.
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
    values = tuple(_value(coordinate, placed) for coordinate in reported if _known(coordinate, placed.positions))
    return SubstitutionStructure(tuple(atoms), placed.positions, placed.errors, values, tuple(notes))


def replaced_atom(parent: Molecule, other: Molecule) -> int | None:
    """The one atom, from 0, whose isotope differs; None where more differ."""
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
    allowed = np.linalg.norm(directions @ _site_projector(family, ours, atom), axis=1) > 0.5  # 1 or 0 but for round-off
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
    """Rows (3, 3): where each coordinate of Kraitchman's equations points from the centre, at the place in the start geometry.

    a, b, c; of a symmetric top along the axis and across it, of a spherical one from the centre to the atom.
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
    """The projector (3, 3) on displacements that the operations which leave an atom in its place preserve.

    Where the geometry says that an atom lies on an axis or in a plane, its coordinate across is 0 without an error.
    """
    symmetry = symmetry_of(_in_frame(family.molecule, ours))
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
        out.append(f"atom {atom.atom} ({atom.species}): |{'|, |'.join(small)}| below 0.15 Å is not trustworthy")
    return out


class _Placed(NamedTuple):
    """Positions (n, 3), nan where unknown; how each coordinate of Kraitchman's equations moves them (c, n, 3), and its error (c,)."""

    positions: Floats
    moves: Floats
    sigmas: Floats

    @property
    def errors(self) -> Floats:
        """Errors (n, 3) along the axes, nan where the position is unknown."""
        spread = np.sqrt(np.tensordot(self.sigmas**2, self.moves**2, axes=1))
        return np.where(np.isnan(self.positions), np.nan, spread)


def _with_equal_atoms(family: Family, atoms: list[SubstitutedAtom], ours: Floats) -> _Placed:
    """The substituted atoms and those that symmetry makes equal to one, which move with it."""
    positions, moves = np.full(ours.shape, np.nan), np.zeros((3 * len(atoms), *ours.shape))
    for place, atom in enumerate(atoms):
        positions[atom.atom - 1] = atom.coordinates_angstrom
        moves[3 * place : 3 * place + 3, atom.atom - 1] = atom.directions
    symmetry = symmetry_of(_in_frame(family.molecule, ours))
    for operation in (*symmetry.rotations, *symmetry.improper):
        for place, atom in enumerate(atoms):
            image = int(operation.permutation[atom.atom - 1])
            if np.isnan(positions[image, 0]):
                positions[image] = operation.matrix @ positions[atom.atom - 1]
                moves[3 * place : 3 * place + 3, image] = atom.directions @ operation.matrix.T
    return _Placed(positions, moves, np.concatenate([atom.kraitchman.errors_angstrom for atom in atoms]))


def _in_frame(molecule: Molecule, positions: Floats) -> Molecule:
    return Molecule(molecule.symbols, positions, molecule.mass_numbers)


def _known(coordinate: Named, positions: Floats) -> bool:
    return bool(np.isfinite(positions[[atom - 1 for atom in coordinate.atoms]]).all())


def _value(coordinate: Named, placed: _Placed) -> Value:
    """A coordinate between known atoms; atoms that symmetry makes equal have one error, not several."""
    positions = placed.positions
    alone = Named(coordinate.name, coordinate.atoms, (coordinate.atoms,))
    filled = np.where(np.isnan(positions), np.arange(positions.size).reshape(positions.shape) + 100.0, positions)
    slopes = np.tensordot(placed.moves, alone.gradient(filled).reshape(positions.shape), axes=2)
    spread = float(np.linalg.norm(slopes * placed.sigmas))
    return Value(coordinate.name, coordinate.atoms, alone.value(filled), spread * coordinate.factor, coordinate.unit)
