"""The symmetry of a molecule: point group, rotations and their permutations of nuclei, symmetry number.

It is determined from the nuclei, isotopes distinguished, within a tolerance that is part of the result. A higher approximate group is
reported with the displacement that would make it exact, but not used.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.molecules.molecule import CLOSEST_ANGSTROM, Molecule
from rotor.molecules.symmetry.operations import (
    Operation,
    closed_group,
    find_operations,
    shortest_distance,
    symmetrised,
)
from rotor.molecules.symmetry.schoenflies import point_group_name, rotation_axes, rotation_group_name

TOLERANCE = 5e-3  # of the shortest distance between nuclei, unless the caller says otherwise
NEAR = 0.2  # the same, up to which a group is called near
NEAR_UP_TO = 300  # most nuclei for which near groups are searched


@dataclass(frozen=True)
class NearSymmetry:
    """An approximate higher group: its name, and the largest displacement of a nucleus that would make it exact."""

    point_group: str
    displacement_angstrom: float


@dataclass(frozen=True, eq=False)
class Symmetry:
    """The symmetry operations of a molecule, with its point group.

    point_group, rotation_group : Schoenflies names, such as `"C3v"` and `"C3"`; `"Kh"` and `"K"` for an atom
    rotations : the proper rotations, identity first, with their permutations of the nuclei; for a linear molecule only the
        identity and, for D∞h, one half turn across the axis
    improper : the other operations; none are listed for a linear molecule
    axes_abc : (3, 3) rows: unit vectors of the principal axes a, b, c, right-handed; along symmetry axes if moments are equal
    moments_u_angstrom2 : (3,) moments of inertia about them, I_a ≤ I_b ≤ I_c
    equivalent : sets of equivalent nuclei, by index from 0
    tolerance : relative to the shortest distance; tolerance_angstrom : in Å
    deviation_angstrom : the largest distance of a nucleus from its exactly symmetric position
    near : an approximate higher group, or None. near_sought : False if the molecule is too large for this search
    """

    point_group: str
    rotation_group: str
    rotations: tuple[Operation, ...]
    improper: tuple[Operation, ...]
    axes_abc: Floats
    moments_u_angstrom2: Floats
    equivalent: tuple[tuple[int, ...], ...]
    tolerance: float
    tolerance_angstrom: float
    deviation_angstrom: float
    near: NearSymmetry | None
    near_sought: bool

    @property
    def linear(self) -> bool:
        """True where all nuclei lie on a line."""
        return self.rotation_group in ("C∞", "D∞")

    @property
    def symmetry_number(self) -> int:
        """The number of proper rotations in the group; 1 or 2 for a linear molecule."""
        return len(self.rotations)

    @property
    def axes(self) -> list[tuple[int, Floats]]:
        """Order and unit vector of each axis of finite order, highest first."""
        return rotation_axes(self.rotations)

    def describe(self) -> str:
        """A sentence with group, symmetry number, tolerance, and approximate higher group."""
        parts = [f"{self.point_group}, symmetry number {self.symmetry_number}, within {self.tolerance_angstrom:.2g} Å"]
        if self.deviation_angstrom > 1e-6:
            parts.append(f"nuclei are up to {self.deviation_angstrom:.2g} Å off exact symmetry")
        if self.near:
            parts.append(f"near {self.near.point_group}, {self.near.displacement_angstrom:.2g} Å away: not used")
        if not self.near_sought:
            parts.append(f"near groups are not looked for above {NEAR_UP_TO} nuclei")
        return "; ".join(parts)


def molecule_symmetry(molecule: Molecule, tolerance: float = TOLERANCE) -> Symmetry:
    """The symmetry of a molecule's nuclei, isotopes distinguished; see `find_symmetry`.

    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    >>> molecule_symmetry(water).point_group, molecule_symmetry(water.with_isotopes("2=2H")).point_group
    ('C2v', 'Cs')
    """
    kinds = list(zip(molecule.symbols, molecule.mass_numbers, strict=True))
    return find_symmetry(kinds, molecule.masses_u, molecule.positions_angstrom, tolerance)


def find_symmetry(
    kinds: Sequence[Hashable], masses_u: ArrayLike, positions_angstrom: ArrayLike, tolerance: float = TOLERANCE
) -> Symmetry:
    """Point group, rotations and permutations of labelled nuclei.

    An operation about the centre of mass is accepted if it maps each nucleus onto a like one (same kind and mass) within `tolerance`
    times the shortest distance between nuclei. A molecule is linear if all nuclei are within this distance of a line. The accepted
    operations form a group: a limit that would cut through a group is lowered.

    Parameters
    ----------
    kinds : n labels, equal for like nuclei; isotopes of an element must differ in label or in mass.
    masses_u : (n,) array, u.
    positions_angstrom : (n, 3) array, Å.
    tolerance : relative to the shortest distance between nuclei, above 0 and up to 0.2.

    Returns
    -------
    Symmetry

    Raises
    ------
    ValueError
        No nuclei, arrays of different length, numbers that are not finite, masses not above 0, nuclei closer than 0.1 Å,
        a tolerance out of range, or too many operations.

    Examples
    --------
    >>> square = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    >>> symmetry = find_symmetry("FFFF", [19] * 4, square)
    >>> symmetry.point_group, symmetry.rotation_group, symmetry.symmetry_number, symmetry.equivalent
    ('D4h', 'D4', 8, ((0, 1, 2, 3),))
    """
    labels, masses, points = _checked(kinds, masses_u, positions_angstrom)
    if not 0 < tolerance <= NEAR:
        raise ValueError(
            f"tolerance {tolerance}: expected a fraction of the shortest distance, above 0 and up to {NEAR}"
        )
    if len(points) == 1:
        return _atom_symmetry(tolerance)

    shortest = shortest_distance(points)
    if shortest < CLOSEST_ANGSTROM:
        raise ValueError(f"two nuclei are {shortest:.3g} Å apart, nearer than {CLOSEST_ANGSTROM} Å; remove one of them")
    reach, near_reach = tolerance * shortest, NEAR * shortest
    line, off_line = _best_line(points)
    if off_line <= reach:
        return _linear_symmetry(labels, masses, points, line, tolerance, shortest)

    near_sought = len(points) <= NEAR_UP_TO
    operations, base = find_operations(labels, points, near_reach if near_sought else reach)
    group = closed_group(operations, base, reach)
    ideal, group = symmetrised(points, group)
    near = None
    if off_line <= near_reach:
        near = NearSymmetry(_linear_name(labels, points, line, near_reach), off_line)
    elif near_sought:
        near = _near_symmetry(points, closed_group(operations, base, near_reach), len(group))
    return _described(masses, points, ideal, group, near, tolerance, shortest)


def _checked(kinds: Sequence[Hashable], masses_u: ArrayLike, positions: ArrayLike) -> tuple[Ints, Floats, Floats]:
    """Integer labels, masses, and positions relative to the centre of mass."""
    masses, points = np.asarray(masses_u, dtype=float), np.asarray(positions, dtype=float)
    n = len(kinds)
    if not n or masses.shape != (n,) or points.shape != (n, 3):
        raise ValueError(
            f"{n} kinds, masses of shape {masses.shape}, positions of shape {points.shape}: expected n, (n,) and "
            "(n, 3), n of 1 or more"
        )
    if not (np.isfinite(masses).all() and (masses > 0).all() and np.isfinite(points).all()):
        raise ValueError("masses must be finite and above 0, positions finite")
    number: dict[Hashable, int] = {}
    pairs = zip(kinds, masses.tolist(), strict=True)
    labels = np.array([number.setdefault(pair, len(number)) for pair in pairs], dtype=np.int64)
    return labels, masses, points - masses @ points / masses.sum()


def _best_line(points: Floats) -> tuple[Floats, float]:
    """The direction (3,) of the best line through the centre, and the largest distance of a point from it."""
    direction = np.linalg.svd(points, full_matrices=False)[2][0]
    off = np.linalg.norm(points - np.outer(points @ direction, direction), axis=1)
    return direction, float(off.max())


def _reversal(labels: Ints, points: Floats, line: Floats) -> tuple[Ints, float]:
    """The permutation that reverses a linear molecule, and the largest mismatch; infinite if kinds do not match."""
    along = points @ line
    order = np.argsort(along)
    permutation = np.empty(len(order), dtype=np.int64)
    permutation[order] = order[::-1]
    if (labels[permutation] != labels).any():
        return permutation, np.inf
    return permutation, float(np.abs(along[permutation] + along).max())


def _linear_name(labels: Ints, points: Floats, line: Floats, reach: float) -> str:
    return "D∞h" if _reversal(labels, points, line)[1] <= reach else "C∞v"


def _linear_symmetry(
    labels: Ints, masses: Floats, points: Floats, line: Floats, tolerance: float, shortest: float
) -> Symmetry:
    """C∞v or D∞h; one half turn across the axis represents all."""
    permutation, mismatch = _reversal(labels, points, line)
    axes = _completed([line])
    operations = [Operation(np.eye(3), np.arange(len(points)), 0.0)]
    name = _linear_name(labels, points, line, tolerance * shortest)
    if name == "D∞h":
        half_turn = 2 * np.outer(axes[1], axes[1]) - np.eye(3)
        operations.append(Operation(half_turn, permutation, mismatch))
    near = NearSymmetry("D∞h", mismatch / 2) if name == "C∞v" and mismatch <= NEAR * shortest else None
    along = points @ line
    ideal = along if name == "C∞v" else (along - along[permutation]) / 2
    moment = float(masses @ along**2)
    return Symmetry(
        point_group=name,
        rotation_group=name[:2],
        rotations=tuple(operations),
        improper=(),
        axes_abc=axes,
        moments_u_angstrom2=np.array([0.0, moment, moment]),
        equivalent=_orbits(operations),
        tolerance=tolerance,
        tolerance_angstrom=tolerance * shortest,
        deviation_angstrom=float(np.linalg.norm(points - np.outer(ideal, line), axis=1).max()),
        near=near,
        near_sought=True,
    )


def _atom_symmetry(tolerance: float) -> Symmetry:
    identity = Operation(np.eye(3), np.zeros(1, dtype=np.int64), 0.0)
    return Symmetry("Kh", "K", (identity,), (), np.eye(3), np.zeros(3), ((0,),), tolerance, 0.0, 0.0, None, True)


def _near_symmetry(points: Floats, group: list[Operation], order: int) -> NearSymmetry | None:
    """The approximate group, if it has more operations than `order`."""
    if len(group) <= order:
        return None
    ideal, group = symmetrised(points, group)
    rotations, improper = _sorted(group)
    displacement = float(np.linalg.norm(ideal - points, axis=1).max())
    return NearSymmetry(point_group_name(rotations, improper), displacement)


def _described(
    masses: Floats,
    points: Floats,
    ideal: Floats,
    group: list[Operation],
    near: NearSymmetry | None,
    tolerance: float,
    shortest: float,
) -> Symmetry:
    rotations, improper = _sorted(group)
    axes, moments = _principal_axes(masses, points, ideal, rotations)
    return Symmetry(
        point_group=point_group_name(rotations, improper),
        rotation_group=rotation_group_name(rotations),
        rotations=tuple(rotations),
        improper=tuple(improper),
        axes_abc=axes,
        moments_u_angstrom2=moments,
        equivalent=_orbits(group),
        tolerance=tolerance,
        tolerance_angstrom=tolerance * shortest,
        deviation_angstrom=float(np.linalg.norm(ideal - points, axis=1).max()),
        near=near,
        near_sought=len(points) <= NEAR_UP_TO,
    )


def _sorted(group: list[Operation]) -> tuple[list[Operation], list[Operation]]:
    """Rotations and improper operations, the identity first, then by order and angle."""
    ordered = sorted(group, key=lambda o: (o.order, o.angle))
    return [o for o in ordered if o.proper], [o for o in ordered if not o.proper]


def _orbits(group: list[Operation]) -> tuple[tuple[int, ...], ...]:
    """Sets of nuclei that are equivalent under the operations, by their lowest index."""
    images = np.sort(np.array([o.permutation for o in group]), axis=0)
    sets: dict[int, list[int]] = {}
    for atom, lowest in enumerate(images[0].tolist()):
        sets.setdefault(lowest, []).append(atom)
    return tuple(tuple(atoms) for atoms in sets.values())


def _principal_axes(masses: Floats, points: Floats, ideal: Floats, rotations: list[Operation]) -> tuple[Floats, Floats]:
    """Right-handed principal axes (3, 3) of the exact geometry, as rows, and the moments of the given geometry about them.

    Perpendicular rotation axes are principal axes; a twofold axis fixes the choice if moments are equal.
    """
    settled: list[Floats] = []
    for _, axis in rotation_axes(rotations):
        if all(abs(axis @ other) < 1e-6 for other in settled):
            settled.append(axis)
    exact, measured = _inertia(masses, ideal), _inertia(masses, points)
    axes = _completed(settled, exact)
    moments = np.einsum("ij,jk,ik->i", axes, measured, axes)
    order = np.argsort(moments, kind="stable")
    axes = axes[order]
    return axes * [[1.0], [1.0], [np.sign(np.linalg.det(axes))]], moments[order]


def _inertia(masses: Floats, points: Floats) -> Floats:
    """I = Σ m (r² 1 - r rᵀ) about the origin."""
    squares = np.einsum("ni,nj,n->ij", points, points, masses)
    return np.asarray(np.trace(squares) * np.eye(3) - squares)


def _completed(settled: list[Floats], tensor: Floats | None = None) -> Floats:
    """Three orthogonal axes as rows: the given ones, then principal axes of the tensor perpendicular to them."""
    rows = np.array(settled[:3]).reshape(-1, 3)
    across = np.linalg.svd(rows, full_matrices=True)[2][len(rows) :]
    if tensor is not None and len(across):
        across = np.linalg.eigh(across @ tensor @ across.T)[1].T @ across
    return np.concatenate([rows, across])
