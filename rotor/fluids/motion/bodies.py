"""Rigid molecules of a box: their atoms, shapes in principal axes, centres and attitudes.

Molecules of a species (the same elements and masses in the same order) share one shape, so that they are exactly rigid.
Molecules broken by the edge of the cell are made whole first.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, Ints
from rotor.geometry import inertia
from rotor.geometry.superposition import superpose
from rotor.statistics.degrees_of_freedom import Degrees, count_degrees, rotating_axes

if TYPE_CHECKING:
    from ase import Atoms

SHAPE_TOLERANCE_ANGSTROM = 0.01


@dataclass(frozen=True)
class Pose:
    """Poses of bodies: centres of mass (n, 3) in Å, unwrapped, and attitudes (n, 4), body to space."""

    centres: Floats
    attitude: Floats


@dataclass(frozen=True)
class Bodies:
    """n rigid molecules over the atoms of a box.

    order (atoms,), starts (n + 1,): atoms of body b are order[starts[b]:starts[b + 1]]. sites: (atoms, 3), places in
    principal axes of the body, Å. masses: (atoms,) u. mass: (n,) u. moments: (n, 3) u Å², 0 about the axis of a linear
    molecule, all 0 for an atom. species: (n,) index into names. notes: molecules near the limit between linear and bent.
    """

    order: Ints
    starts: Ints
    sites: Floats
    masses: Floats
    mass: Floats
    moments: Floats
    species: Ints
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.mass)

    @property
    def inverse_moments(self) -> Floats:
        """1/I_i, (n, 3); 0 for axes without rotation."""
        return np.divide(1.0, self.moments, out=np.zeros_like(self.moments), where=self.moments > 0.0)

    def degrees(self, removed: int = 0) -> Degrees:
        """The degrees of freedom, minus `removed` (3 if the total momentum is held at 0)."""
        return replace(count_degrees(self.moments, removed=removed), notes=self.notes)

    def name_of(self, body: int) -> str:
        """A body's name for error messages."""
        atoms = self.order[self.starts[body] : self.starts[body + 1]]
        return f"molecule {body} ({self.names[self.species[body]]}, atoms {_listed(atoms)})"

    def positions(self, pose: Pose) -> Floats:
        """Positions of all atoms, (atoms, 3), Å."""
        from rotor.fluids.motion._body_kernels import place

        out = np.empty_like(self.sites)
        place(pose.centres, pose.attitude, self.sites, self.order, self.starts, out)
        return out

    def pose(
        self, atoms: Atoms, tolerance_angstrom: float = SHAPE_TOLERANCE_ANGSTROM, of_models: Container[str] = ()
    ) -> Pose:
        """The pose of the bodies in a box of the same atoms; of_models: names of the species that have the shape of a model."""
        centres, attitude = np.zeros((len(self), 3)), np.zeros((len(self), 4))
        for number, name in enumerate(self.names):
            members = np.flatnonzero(self.species == number)
            rows = np.stack([self.order[self.starts[b] : self.starts[b + 1]] for b in members])
            places, masses = whole(atoms.positions[rows], atoms), self.masses[rows[0]]
            centres[members] = np.einsum("m,kmi->ki", masses / masses.sum(), places)
            if not self.moments[members[0]].any():
                attitude[members, 0] = 1.0
                continue
            shape = np.broadcast_to(self.sites[rows[0]], places.shape)
            fit = superpose(shape, places, masses)
            attitude[members] = fit.quaternion
            off = np.linalg.norm(fit.apply(shape) - places, axis=-1).max(axis=-1)
            self._refuse_other_shapes(members, off, tolerance_angstrom, name in of_models)
        return Pose(centres, attitude)

    def _refuse_other_shapes(self, members: Ints, off: Floats, tolerance_angstrom: float, is_model: bool) -> None:
        """Refuse bodies of a species whose atoms are too far off their places in its shape."""
        worst = int(np.argmax(off))
        if off[worst] > tolerance_angstrom:
            raise ValueError(
                f"{self.name_of(members[worst])}: an atom is {off[worst]:.3g} Å off its place "
                f"in the shape of its {'model' if is_model else 'species'}, more than {tolerance_angstrom:g} Å; rigid molecules of "
                f"one species have one shape{', and another model another one' if is_model else ''}"
            )

    def wrench(self, vectors: Floats, attitude: Floats) -> tuple[Floats, Floats]:
        """Sum (n, 3) in space, and sum of s x v (n, 3) in body axes, of vectors (atoms, 3) on the atoms.

        For forces these are force and torque; for momenta of a rigid motion, momentum and angular momentum.
        """
        from rotor.fluids.motion._body_kernels import wrench

        total, turning = np.empty((len(self), 3)), np.empty((len(self), 3))
        vectors = np.ascontiguousarray(vectors, dtype=np.float64)
        wrench(vectors, attitude, self.sites, self.order, self.starts, total, turning)
        return total, turning

    def momenta(self, momentum: Floats, angular: Floats, attitude: Floats) -> Floats:
        """Momenta of the atoms (atoms, 3) from those of the bodies: momentum (n, 3), L (n, 3) in body axes."""
        from rotor.fluids.motion._body_kernels import momenta

        out = np.empty_like(self.sites)
        velocity, omega = momentum / self.mass[:, None], angular * self.inverse_moments
        momenta(velocity, omega, attitude, self.sites, self.masses, self.order, self.starts, out)
        return out


def rigid_bodies(
    atoms: Atoms,
    molecules: ArrayLike | Sequence[Sequence[int]] | None = None,
    shapes: Mapping[tuple[str, ...], ArrayLike] | None = None,
    tolerance_angstrom: float = SHAPE_TOLERANCE_ANGSTROM,
) -> tuple[Bodies, Pose]:
    """The rigid molecules of a box, and their poses.

    Parameters
    ----------
    atoms : ase.Atoms
        Masses set by the user are used; others are those of the most abundant isotopes (`rotor.molecules.nuclei`).
    molecules : array or list, optional
        A label for each atom, or the atoms of each molecule. Default: `atoms.arrays["molecule"]`, or without it the bonds, also across
        the edges of the cell.
    shapes : mapping, optional
        Positions (sites, 3) of the atoms of a species by their elements, such as those of a model. Default: the shape of the first
        molecule of a species.
    tolerance_angstrom : float
        Largest deviation of an atom from the shape; the shape is used.

    Returns
    -------
    bodies : Bodies
        Masses in u, moments in u Å², shapes in Å.
    pose : Pose
        Centres in Å and attitudes, unit quaternions.

    Raises
    ------
    ValueError
        An atom in no molecule or in two; a molecule that deviates from the shape of its species; a constraint on the atoms.

    Examples
    --------
    >>> from ase.build import molecule
    >>> bodies, pose = rigid_bodies(molecule("H2O"))
    >>> bodies.moments.round(2).tolist(), bodies.degrees().total
    ([[0.64, 1.17, 1.81]], 6)
    """
    if atoms.constraints:
        raise ValueError(
            "the atoms carry constraints; rigid molecules need none, so remove them: atoms.set_constraint()"
        )
    if not np.isfinite(atoms.positions).all():
        atom = int(np.argmin(np.isfinite(atoms.positions).all(axis=1)))
        raise ValueError(f"the position of atom {atom} is not finite")
    order, starts = _ordered(atoms, molecules)
    masses = atom_masses(atoms)
    n = len(starts) - 1
    groups = _species(atoms, masses, order, starts)
    sites, moments, notes = np.zeros((len(atoms), 3)), np.zeros((n, 3)), list[str]()
    species = np.zeros(n, dtype=np.int64)
    for number, (elements, members) in enumerate(groups):
        rows = np.stack([order[starts[b] : starts[b + 1]] for b in members])
        places = (shapes or {}).get(elements)
        if places is None:
            places = whole(atoms.positions[rows[:1]], atoms)[0]
        sites[rows], moments[members], remarks = _principal(masses[rows[0]], np.asarray(places, dtype=np.float64))
        species[members] = number
        notes += [f"{_formula(elements)}: {note}" for note in remarks]
    mass = np.add.reduceat(masses[order], starts[:-1])
    names = tuple(_formula(elements) for elements, _ in groups)
    bodies = Bodies(order, starts, sites, masses, mass, moments, species, names, tuple(notes))
    return bodies, bodies.pose(atoms, tolerance_angstrom, {_formula(elements) for elements in shapes or {}})


def atom_masses(atoms: Atoms) -> Floats:
    """Masses (atoms,) in u: those set by the user, or of the most abundant isotopes.

    >>> from ase.build import molecule
    >>> atom_masses(molecule("OH")).round(4).tolist()
    [15.9949, 1.0078]
    """
    from rotor.molecules.nuclei import masses

    if atoms.has("masses"):
        user_masses = np.asarray(atoms.get_masses(), dtype=np.float64)
        if not (np.isfinite(user_masses).all() and (user_masses >= 0.0).all()):
            raise ValueError(f"masses must be finite and not negative; got {user_masses.min()}")
        return user_masses
    symbols = atoms.get_chemical_symbols()
    kinds = sorted(set(symbols))
    table = dict(zip(kinds, masses(kinds), strict=True))
    return np.array([table[symbol] for symbol in symbols])


def whole(places: Floats, atoms: Atoms) -> Floats:
    """Molecules of a species (k, m, 3) made whole across the edges of the cell, each about its first atom.

    Each atom is placed in the image nearest to a neighbour already placed; neighbours are those of the first
    molecule. Molecules that were whole do not move.
    """
    from ase.geometry import find_mic

    out = places.copy()
    if not atoms.pbc.any() or places.shape[1] == 1:
        return out
    for parent, child in _tree(places[0], atoms):
        step, _ = find_mic(places[:, child] - places[:, parent], atoms.cell, atoms.pbc)
        out[:, child] = out[:, parent] + step
    return out


def _tree(places: Floats, atoms: Atoms) -> list[tuple[int, int]]:
    """Shortest links (parent, child) that reach all atoms of a molecule from its first (Prim), by nearest images."""
    from ase.geometry import get_distances

    _, distances = get_distances(places, cell=atoms.cell, pbc=atoms.pbc)
    reached, links = [0], []
    while len(reached) < len(places):
        left = [i for i in range(len(places)) if i not in reached]
        near = distances[np.ix_(reached, left)]
        parent, child = np.unravel_index(np.argmin(near), near.shape)
        links.append((reached[parent], left[child]))
        reached.append(left[child])
    return links


def _ordered(atoms: Atoms, molecules: ArrayLike | Sequence[Sequence[int]] | None) -> tuple[Ints, Ints]:
    """Atoms by molecule, and where each molecule begins; molecules in order of their first atoms."""
    if len(atoms) == 0:
        raise ValueError("the box holds no atoms")
    labels = _labels(atoms, molecules)
    _, first, label = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))[label]
    order = np.argsort(rank, kind="stable")
    counts = np.bincount(rank)
    return order.astype(np.int64), np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _labels(atoms: Atoms, molecules: ArrayLike | Sequence[Sequence[int]] | None) -> Ints:
    if molecules is None:
        return np.asarray(atoms.arrays["molecule"]) if "molecule" in atoms.arrays else _bonded(atoms)
    items = list(molecules)  # type: ignore[arg-type]
    if all(np.ndim(item) == 0 for item in items):
        if len(items) != len(atoms):
            raise ValueError(f"{len(items)} labels of molecules for {len(atoms)} atoms; expected one for each atom")
        return np.asarray(items)
    labels = np.full(len(atoms), -1)
    for number, members in enumerate(items):
        chosen = np.asarray(members, dtype=np.int64)
        if (chosen < 0).any() or (chosen >= len(atoms)).any():
            raise ValueError(f"molecule {number} lists an atom that is not one of 0 to {len(atoms) - 1}")
        if (labels[chosen] >= 0).any() or len(set(chosen.tolist())) < len(chosen):
            raise ValueError(f"molecule {number} lists an atom twice, or one of another molecule")
        labels[chosen] = number
    if (labels < 0).any():
        raise ValueError(f"atom {int(np.argmin(labels))} is in none of the molecules given")
    return labels


def _bonded(atoms: Atoms) -> Ints:
    """Labels by bonds: atoms closer than 1.2 times the sum of their covalent radii, also across edges."""
    from ase.neighborlist import natural_cutoffs, neighbor_list
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = neighbor_list("ij", atoms, natural_cutoffs(atoms, mult=1.2))
    bonds = coo_array((np.ones(len(first)), (first, second)), shape=(len(atoms), len(atoms)))
    _, labels = connected_components(bonds, directed=False)
    return np.asarray(labels)


def _species(atoms: Atoms, masses: Floats, order: Ints, starts: Ints) -> list[tuple[tuple[str, ...], Ints]]:
    """Elements and bodies of each species, in order of appearance."""
    symbols = np.array(atoms.get_chemical_symbols())
    groups: dict[tuple[tuple[str, ...], tuple[float, ...]], list[int]] = {}
    for body in range(len(starts) - 1):
        rows = order[starts[body] : starts[body + 1]]
        groups.setdefault((tuple(symbols[rows].tolist()), tuple(masses[rows].tolist())), []).append(body)
    return [(elements, np.array(members)) for (elements, _), members in groups.items()]


def _principal(masses: Floats, places: Floats) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Sites (m, 3) of a molecule in principal axes, moments (3,) and notes on these.

    The sites of a linear molecule are on the axis, and its moments are (0, I, I).
    """
    if places.shape != (len(masses), 3):
        raise ValueError(f"a shape of {places.shape} for a molecule of {len(masses)} atoms")
    heavy = masses > 0.0
    if not heavy.any():
        raise ValueError("a molecule without mass cannot move: every molecule has an atom with a mass")
    body = inertia.point_masses(masses[heavy], places[heavy])
    centred = places - body.centre
    if heavy.sum() == 1:
        if np.abs(centred).max() > 0.0:
            raise ValueError(
                "a molecule with a single massive site and massless sites elsewhere has no moments of inertia: give these sites a mass"
            )
        return centred, np.zeros(3), ()
    frame = inertia.principal_frame(body)
    sites, moments = centred @ frame.axes.T, frame.moments
    notes = count_degrees(moments[None]).notes
    if rotating_axes(moments).sum() == 2:
        sites[:, 1:] = 0.0
        moments = np.array([0.0, 1.0, 1.0]) * float(masses @ sites[:, 0] ** 2)
    return sites, moments, notes


def _formula(elements: Sequence[str]) -> str:
    """Elements with their counts, in order of appearance.

    >>> _formula(["O", "H", "H"])
    'OH2'
    """
    counts = {element: elements.count(element) for element in elements}
    return "".join(f"{element}{count if count > 1 else ''}" for element, count in counts.items())


def _listed(atoms: Ints) -> str:
    numbers = atoms.tolist()
    if numbers == list(range(numbers[0], numbers[0] + len(numbers))) and len(numbers) > 2:
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(map(str, numbers))
