"""r_s: the substitution structure of a family, atom by atom, and the bonds and angles between the atoms it has.

Every isotopologue with one atom replaced gives that atom's coordinates (`kraitchman`); atoms that symmetry makes equal are
copied from it. Signs come from the start geometry. Bonds and angles carry the errors of the coordinates, Costain's and
those of the constants, taken as independent from atom to atom.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import symmetry_of
from rotor.structures.coordinates import Named, bonds_and_angles
from rotor.structures.family import PLANAR_WITHIN_ANGSTROM, Family, Species
from rotor.structures.kraitchman import PAIRS, Substituted, kraitchman

ON_AXIS_ANGSTROM = 1e-3  # of the figure axis of a symmetric top: an atom so near is on it


@dataclass(frozen=True)
class SubstitutedAtom:
    """An atom, from 1, the isotopologue it is from, what Kraitchman's equations say, and signs (3,) from the geometry."""

    atom: int
    species: str
    found: Substituted
    signs: Floats

    @property
    def coordinates_angstrom(self) -> Floats:
        """a, b, c (3,) with signs."""
        return np.asarray(self.signs * self.found.coordinates_angstrom)


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

    positions, errors = _with_equal_atoms(family, atoms, ours)
    asked = tuple(coordinates) or bonds_and_angles(_in_frame(family.molecule, ours))
    values = tuple(_value(one, positions, errors) for one in asked if _known(one, positions))
    return SubstitutionStructure(tuple(atoms), positions, errors, values, tuple(notes))


def replaced_atom(parent: Molecule, other: Molecule) -> int | None:
    """The one atom, from 0, whose isotope differs; None where more differ."""
    changed = np.flatnonzero(np.array(parent.mass_numbers) != np.array(other.mass_numbers))
    return int(changed[0]) if len(changed) == 1 else None


def _substituted(family: Family, species: Species, atom: int, ours: Floats, pair: str) -> SubstitutedAtom:
    shape = _shape(family, ours[atom])
    parent, other = family.parent, species
    found = kraitchman(
        parent.moments,
        other.moments,
        mass_u=parent.molecule.mass_u,
        change_u=float(other.molecule.masses_u[atom] - parent.molecule.masses_u[atom]),
        shape=shape,
        pair=pair,
        parent_errors=parent.moment_errors,
        substituted_errors=other.moment_errors,
    )
    if shape == "symmetric":
        found = _split_across(found, family, ours[atom])
    return SubstitutedAtom(atom + 1, species.name, found, np.where(ours[atom] < 0, -1.0, 1.0))


def _shape(family: Family, place: Floats) -> str:
    if family.linear:
        return "linear"
    if family.top.kind in ("prolate", "oblate"):
        return "symmetric"
    return "planar" if family.planar and abs(place[2]) < PLANAR_WITHIN_ANGSTROM else "asymmetric"


def _split_across(found: Substituted, family: Family, place: Floats) -> Substituted:
    """z² and ρ² put onto a, b, c: across the axis in the direction that the atom has in the start geometry."""
    along = 0 if family.top.kind == "prolate" else 2
    across = [i for i in range(3) if i != along]
    rho2 = float((place[across] ** 2).sum())
    share = np.zeros(3)
    share[across] = place[across] ** 2 / rho2 if rho2 > ON_AXIS_ANGSTROM**2 else 0.0
    squares, errors = found.squares_angstrom2[1] * share, found.errors_of_squares[1] * share
    squares[along], errors[along] = found.squares_angstrom2[0], found.errors_of_squares[0]
    return Substituted(squares, errors, "asymmetric")


def _doubts(one: SubstitutedAtom) -> list[str]:
    letters = [axis for axis, bad in zip("abc", one.found.imaginary, strict=True) if bad]
    small = [
        axis
        for axis, size, bad in zip("abc", one.found.coordinates_angstrom, one.found.imaginary, strict=True)
        if 0 < size < 0.15 and not bad
    ]
    out = []
    if letters:
        squares = ", ".join(f"{axis}² = {one.found.squares_angstrom2['abc'.index(axis)]:.5f}" for axis in letters)
        out.append(f"atom {one.atom} ({one.species}): imaginary coordinate, {squares} Å²; taken as 0")
    if small:
        out.append(f"atom {one.atom} ({one.species}): |{'|, |'.join(small)}| below 0.15 Å is not trustworthy")
    return out


def _with_equal_atoms(family: Family, atoms: list[SubstitutedAtom], ours: Floats) -> tuple[Floats, Floats]:
    """Positions and errors (n, 3), atoms that symmetry makes equal to a substituted one copied from it."""
    positions, errors = np.full(ours.shape, np.nan), np.full(ours.shape, np.nan)
    for one in atoms:
        positions[one.atom - 1], errors[one.atom - 1] = one.coordinates_angstrom, one.found.errors_angstrom
    symmetry = symmetry_of(_in_frame(family.molecule, ours))
    for operation in (*symmetry.rotations, *symmetry.improper):
        for one in atoms:
            image = int(operation.permutation[one.atom - 1])
            if np.isnan(positions[image, 0]):
                positions[image] = operation.matrix @ positions[one.atom - 1]
                errors[image] = np.sqrt(operation.matrix**2 @ errors[one.atom - 1] ** 2)
    return positions, errors


def _in_frame(molecule: Molecule, positions: Floats) -> Molecule:
    return Molecule(molecule.symbols, positions, molecule.mass_numbers)


def _known(one: Named, positions: Floats) -> bool:
    return bool(np.isfinite(positions[[atom - 1 for atom in one.atoms]]).all())


def _value(one: Named, positions: Floats, errors: Floats) -> Value:
    """A coordinate between substituted atoms, with the errors of its own atoms."""
    alone = Named(one.name, one.atoms, (one.atoms,))
    filled = np.where(np.isnan(positions), np.arange(positions.size).reshape(positions.shape) + 100.0, positions)
    gradient = alone.gradient(filled).reshape(positions.shape)
    spread = np.sqrt(np.sum((gradient * np.nan_to_num(errors)) ** 2))
    return Value(one.name, one.atoms, alone.value(filled), float(spread) * one.factor, one.unit)
