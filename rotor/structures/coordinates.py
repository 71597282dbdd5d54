"""Named bonds and angles, and symmetry-preserving displacements of the atoms.

A structure is refined along totally symmetric displacements, x = x₀ + S u, so that it retains its point group. S is an orthonormal basis
of the Cartesian displacements that are invariant under all operations, without translations and rotations. Named coordinates q(x) are set
to targets by Newton's method, S δu = S (B S)⁺ (q_target - q(x)) with Wilson's matrix B; the pseudo-inverse gives the smallest displacement
if the named coordinates do not determine the structure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.molecules.internal_coordinates import Coordinate, bend, stretch, torsion, wilson_b
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.operations import symmetrised
from rotor.molecules.symmetry.point_group import molecule_symmetry

Atoms = tuple[int, ...]  # counted from 1

UNITS = {2: "Å", 3: "°", 4: "°"}
BOND_WITHIN = 1.25  # times the sum of covalent radii: atoms closer than this are bonded
_STRAIGHT = 1e-6  # radian from 180° within which an angle has no derivative


@dataclass(frozen=True)
class Named:
    """An internal coordinate: name, atoms counted from 1 (2: distance, 3: angle, 4: dihedral angle), and its equivalents.

    alike : the atoms of all coordinates equal by symmetry, itself first
    """

    name: str
    atoms: Atoms
    alike: tuple[Atoms, ...]

    @property
    def unit(self) -> str:
        """Å or °."""
        return UNITS[len(self.atoms)]

    @property
    def factor(self) -> float:
        """Conversion factor from Å or radian to the printed unit."""
        return 1.0 if len(self.atoms) == 2 else 180.0 / np.pi

    def value(self, positions: Floats) -> float:
        """Å or degrees."""
        return float(np.real(_function(self.atoms)(positions))) * self.factor

    def gradient(self, positions: Floats) -> Floats:
        """∂/∂x (3n,) of the coordinate, averaged over its equivalents, in Å or radian per Å."""
        return np.asarray(wilson_b([_function(atoms) for atoms in self.alike], positions).mean(axis=0))


def _function(atoms: Atoms) -> Coordinate:
    places = [atom - 1 for atom in atoms]
    if len(places) == 2:
        return stretch(*places)
    return bend(*places) if len(places) == 3 else torsion(*places)


def permutations(molecule: Molecule) -> list[NDArray[np.int64]]:
    """The permutations of atoms under all operations of the nuclear framework; isotopes are not distinguished."""
    symmetry = molecule_symmetry(_without_isotopes(molecule))
    return [operation.permutation for operation in (*symmetry.rotations, *symmetry.improper)]


def _without_isotopes(molecule: Molecule) -> Molecule:
    return Molecule(molecule.symbols, molecule.positions_angstrom, electronic=molecule.electronic)


def named(molecule: Molecule, name: str, atoms: Sequence[int]) -> Named:
    """A coordinate of a molecule, with its equivalents by symmetry.

    Raises ValueError unless there are 2, 3 or 4 different existing atoms, and for a straight angle, which has no derivative and is
    fixed by symmetry or the geometry.
    """
    chosen, count = tuple(int(atom) for atom in atoms), len(molecule.symbols)
    if len(chosen) not in UNITS or len(set(chosen)) < len(chosen):
        raise ValueError(
            f"{name} = {list(atoms)}: 2 (distance), 3 (angle) or 4 (dihedral angle) different atoms are needed"
        )
    if not all(1 <= atom <= count for atom in chosen):
        raise ValueError(f"{name} = {list(atoms)}: the molecule has atoms 1 to {count}")
    coordinate = Named(name, chosen, (chosen,))
    if len(chosen) == 3 and abs(coordinate.value(molecule.positions_angstrom) - 180.0) < np.degrees(_STRAIGHT):
        raise ValueError(
            f"{name} = {list(atoms)}: a straight angle cannot be fitted; leave it out, and it stays straight"
        )
    images = dict.fromkeys(
        _canonical_order(tuple(int(p[atom - 1]) + 1 for atom in chosen)) for p in permutations(molecule)
    )
    if len(chosen) == 4:  # a reflection reverses the sign of a dihedral angle: such images are not equivalent
        value = coordinate.value(molecule.positions_angstrom)
        images = {
            image: None
            for image in images
            if abs(Named("", image, (image,)).value(molecule.positions_angstrom) - value) < 1e-3
        }
    return Named(name, chosen, tuple(dict.fromkeys((_canonical_order(chosen), *images))))


def _canonical_order(atoms: Atoms) -> Atoms:
    """The atoms in a unique order: reading them backwards gives the same coordinate."""
    return min(atoms, atoms[::-1])


def symmetric_geometry(molecule: Molecule) -> Molecule:
    """The molecule with nuclei moved to exactly symmetric positions; isotopes, centre and frame do not change.

    >>> tilted = Molecule(("O", "C", "S"), [[0, 1e-4, 1.16], [0, 0, 0], [0, 0, -1.56]])
    >>> float(np.abs(symmetric_geometry(tilted).positions_angstrom[:, 0]).max())
    0.0
    """
    plain = _without_isotopes(molecule)
    symmetry, centre = molecule_symmetry(plain), plain.centre_of_mass_angstrom
    points = plain.positions_angstrom - centre
    if symmetry.linear:
        axis = symmetry.axes_abc[0]
        permutation = symmetry.rotations[-1].permutation
        along = points @ axis
        if (permutation != np.arange(len(along))).any():
            along = (along - along[permutation]) / 2
        ideal = np.outer(along, axis)
    else:
        ideal, _ = symmetrised(points, [*symmetry.rotations, *symmetry.improper])
    return replace(molecule, positions_angstrom=ideal + centre)


def symmetric_displacements(molecule: Molecule) -> Floats:
    """An orthonormal basis S (3n, k) of the totally symmetric displacements that change the shape.

    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    >>> symmetric_displacements(water).shape     # the two coordinates of C2v water: one bond, one angle
    (9, 2)
    """
    plain = _without_isotopes(molecule)
    symmetry = molecule_symmetry(plain)
    positions = plain.positions_angstrom - plain.centre_of_mass_angstrom
    n = len(positions)
    if symmetry.linear:
        project = _along_axis(positions, symmetry.rotations[-1].permutation)
    else:
        operations = (*symmetry.rotations, *symmetry.improper)
        project = np.mean([_acting(operation.matrix, operation.permutation) for operation in operations], axis=0)
    rigid = np.linalg.qr(_rigid_motions(positions))[0] if n > 1 else np.zeros((3 * n, 0))
    rigid = project @ rigid @ rigid.T
    values, vectors = np.linalg.eigh((project + project.T) / 2 - (rigid + rigid.T) / 2)
    return np.asarray(vectors[:, values > 0.5])


def _acting(matrix: Floats, permutation: NDArray[np.int64]) -> Floats:
    """The matrix (3n, 3n) of an operation on displacements: atom i moves to the position of atom permutation[i]."""
    n = len(permutation)
    out = np.zeros((3 * n, 3 * n))
    for i, image in enumerate(permutation.tolist()):
        out[3 * image : 3 * image + 3, 3 * i : 3 * i + 3] = matrix
    return out


def _along_axis(positions: Floats, reversal: NDArray[np.int64]) -> Floats:
    """The projector on displacements along the axis of a linear molecule, even under its half turn if it has one."""
    axis = np.linalg.svd(positions)[2][0]
    along = np.kron(np.eye(len(positions)), np.outer(axis, axis))
    turned = _acting(-np.outer(axis, axis), reversal)
    same = bool((reversal == np.arange(len(reversal))).all())
    return np.asarray(along if same else (along + turned) / 2, dtype=np.float64)


def _rigid_motions(positions: Floats) -> Floats:
    """Translations and rotations as columns (3n, 5 or 6)."""
    shifts = np.tile(np.eye(3), (len(positions), 1))
    turns = np.stack([np.cross(axis, positions).ravel() for axis in np.eye(3)], axis=1)
    both = np.column_stack([shifts, turns])
    u, s, _ = np.linalg.svd(both, full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s[0]])


def moved_to(positions: Floats, space: Floats, coordinates: Sequence[Named], targets: Floats) -> Floats:
    """Positions at which the coordinates have the target values, reached along totally symmetric displacements.

    Parameters
    ----------
    positions : (n, 3) array
        The start, Å.
    space : (3n, k) array
        Orthonormal basis of the allowed displacements.
    coordinates : sequence of Named
        c distances, angles and dihedral angles.
    targets : (c,) array
        Their values, Å and degrees.

    Returns
    -------
    (n, 3) array
        Å; the displacement is the smallest that reaches the targets.

    Raises
    ------
    ValueError
        For targets that cannot be reached together (contradictory coordinates, or no convergence).
    """
    x = positions.copy()
    factors = np.array([coordinate.factor for coordinate in coordinates])
    missing = np.inf
    for _ in range(50):
        off = (targets - np.array([coordinate.value(x) for coordinate in coordinates])) / factors
        missing = float(np.abs(off).max(initial=0.0))
        if missing < 1e-12:
            return x
        b = np.array([coordinate.gradient(x) for coordinate in coordinates]) @ space
        x = x + (space @ np.linalg.lstsq(b, off, rcond=1e-9)[0]).reshape(x.shape)
    if missing < 1e-9:
        return x
    names = ", ".join(coordinate.name for coordinate in coordinates)
    raise ValueError(f"{names}: no symmetric geometry has these values; {missing:.1e} Å or radian are left")


def bonded(molecule: Molecule) -> list[Atoms]:
    """Pairs of atoms (from 1) closer than 1.25 times the sum of their covalent radii (ASE's values, Cordero et al. 2008)."""
    from ase.data import atomic_numbers, covalent_radii

    radii = np.array([covalent_radii[atomic_numbers[symbol]] for symbol in molecule.symbols])
    x = molecule.positions_angstrom
    apart = np.linalg.norm(x[:, None] - x[None], axis=2)
    near = apart < BOND_WITHIN * (radii[:, None] + radii[None])
    return [(int(i) + 1, int(j) + 1) for i, j in np.argwhere(np.triu(near, 1))]


def bonds_and_angles(molecule: Molecule) -> list[Named]:
    """All bonds, and all angles between bonds that are not straight; one representative of each set of equivalents."""
    pairs = bonded(molecule)
    candidates = [(f"r({_label(molecule, pair)})", pair) for pair in pairs]
    near: dict[int, list[int]] = {}
    for i, j in pairs:
        near.setdefault(i, []).append(j)
        near.setdefault(j, []).append(i)
    for apex, ends in sorted(near.items()):
        for first, other in ((a, b) for k, a in enumerate(sorted(ends)) for b in sorted(ends)[k + 1 :]):
            candidates.append((f"a({_label(molecule, (first, apex, other))})", (first, apex, other)))
    return _distinct(molecule, candidates)


def _label(molecule: Molecule, atoms: Atoms) -> str:
    return "-".join(f"{molecule.symbols[atom - 1]}{atom}" for atom in atoms)


def _distinct(molecule: Molecule, candidates: Sequence[tuple[str, Atoms]]) -> list[Named]:
    seen: set[Atoms] = set()
    out = []
    for name, atoms in candidates:
        if _canonical_order(atoms) in seen:
            continue
        try:
            coordinate = named(molecule, name, atoms)
        except ValueError:  # a straight angle
            continue
        seen.update(coordinate.alike)
        out.append(coordinate)
    return out
