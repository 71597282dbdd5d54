"""Point masses that carry a rigid molecule through an engine which holds distances: as many constraints as there are rigid modes.

A body has 6 - 3 n + (number of constraints) = 0 only if no constraint follows from others. Between all pairs of n points that
holds for two points of a line (1), three of a plane (3) and four of space (6), never for three points on a line or more
than four. A molecule of another kind is moved by points with the same mass, centre and moments (equimomental points:
E. J. Routh, Dynamics of a System of Rigid Bodies, elementary part, § 33), and its sites follow them without mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces.models import RigidModel
from rotor.geometry.inertia import point_masses

_LINE = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
_PLANE = math.sqrt(2.0) * np.array([[0.0, 1, 0], [math.sqrt(0.75), -0.5, 0], [-math.sqrt(0.75), -0.5, 0]])
_SPACE = np.array([[1.0, 1, 1], [1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1]])


@dataclass(frozen=True)
class EquimomentalPoints:
    """Points (c, 3) with masses (c,), in the model's own axes, that move as the molecule does.

    own: whether they are the first c sites of the model themselves, the real atoms. rank: 0 a point, 1 a line, 2 a plane,
    3 space.
    """

    places: Floats
    masses: Floats
    own: bool
    rank: int

    def weights(self, place: Floats) -> Floats:
        """How a site follows them: the sum of weights times points is the site, the sum of weights is 1.

        Where the points span a point, line or plane, the site must lie in it.
        """
        rows = np.vstack([self.places.T, np.ones(len(self.places))])
        weights, *_ = np.linalg.lstsq(rows, np.append(place, 1.0))
        if np.linalg.norm(rows @ weights - np.append(place, 1.0)) > 1e-9:
            raise ValueError("a site lies outside the line or plane of a molecule's masses")
        return np.asarray(weights)


def equimomental_points(model: RigidModel, masses: Floats) -> EquimomentalPoints:
    """The points that carry a model whose real atoms have these masses.

    Its own atoms where their distances are independent (an atom, a diatomic, an isosceles triangle such as water),
    else equal masses with the second moments Σ m x xᵀ of the molecule: two at ±√(J/M) on a line, three or four at the
    corners of a triangle or tetrahedron stretched along the principal axes.

    >>> from rotor.fluids.forces.models import model_of
    >>> equimomental_points(model_of("spce"), np.array([15.9949, 1.0078, 1.0078])).own
    True
    """
    places = model.positions_angstrom[: len(masses)]
    body = point_masses(masses, places)
    away = places - body.centre
    values, axes = np.linalg.eigh((masses[:, None] * away).T @ away / body.mass)
    radii, axes = np.sqrt(np.maximum(values[::-1], 0.0)), axes[:, ::-1]
    rank = int(np.sum(radii > 1e-6 * max(radii[0], 1e-300))) if radii[0] > 1e-9 else 0
    if _independent(places, masses, rank) and _reached(model, len(masses), body.centre, axes, rank):
        return EquimomentalPoints(places, masses, True, rank)
    corners = {0: np.zeros((1, 3)), 1: _LINE, 2: _PLANE, 3: _SPACE}[rank]
    stretched = body.centre + (corners * radii) @ axes.T
    return EquimomentalPoints(stretched, np.full(len(corners), body.mass / len(corners)), False, rank)


def _independent(places: Floats, masses: Floats, rank: int) -> bool:
    """Whether the atoms can carry the molecule: a point, two atoms, or a triangle with two equal sides and masses."""
    if len(places) < 3:
        return True
    if len(places) > 3 or rank < 2:
        return False
    sides = [np.linalg.norm(places[0] - places[k]) for k in (1, 2)]
    return math.isclose(sides[0], sides[1], rel_tol=1e-6) and masses[1] == masses[2]


def _reached(model: RigidModel, atoms: int, centre: Floats, axes: Floats, rank: int) -> bool:
    """Whether all sites without mass lie in the line or plane of the atoms."""
    beyond = (model.positions_angstrom[atoms:] - centre) @ axes[:, rank:]
    return bool(np.all(np.abs(beyond) < 1e-9))
