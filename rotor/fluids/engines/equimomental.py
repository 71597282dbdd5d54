"""Point masses that represent a rigid molecule in an engine with distance constraints.

Constraints between all pairs of n points are independent only for two points on a line (1), three in a plane (3) and four in space (6),
but not for three points on a line or more than four. Other molecules are represented by points with the same mass, centre and moments
(equimomental points: E. J. Routh, Dynamics of a System of Rigid Bodies, elementary part, § 33), which carry the massless sites.
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
    """Points (c, 3) with masses (c,), in the axes of the model, that move like the molecule.

    are_atoms: whether they are the first c sites of the model, the real atoms. rank: 0 a point, 1 a line, 2 a plane, 3 space.
    """

    places: Floats
    masses: Floats
    are_atoms: bool
    rank: int

    def weights(self, place: Floats) -> Floats:
        """Weights of the points for a site: site = Σ weight · point with Σ weight = 1.

        The site must lie in the point, line or plane that the points span.
        """
        rows = np.vstack([self.places.T, np.ones(len(self.places))])
        weights, *_ = np.linalg.lstsq(rows, np.append(place, 1.0))
        if np.linalg.norm(rows @ weights - np.append(place, 1.0)) > 1e-9:
            raise ValueError("a site lies outside the line or plane of a molecule's masses")
        return np.asarray(weights)


def equimomental_points(model: RigidModel, masses: Floats) -> EquimomentalPoints:
    """The points that represent a model whose real atoms have these masses.

    These are its real atoms if their distances are independent (an atom, a diatomic, an isosceles triangle such as water),
    otherwise equal masses with the second moments Σ m x xᵀ of the molecule: two at ±√(J/M) on a line, three or four at the
    corners of a triangle or tetrahedron scaled along the principal axes.

    >>> from rotor.fluids.forces.models import find_model
    >>> equimomental_points(find_model("spce"), np.array([15.9949, 1.0078, 1.0078])).are_atoms
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
    """Whether the atoms can represent the molecule: a point, two atoms, or a triangle with two equal sides and masses."""
    if len(places) < 3:
        return True
    if len(places) > 3 or rank < 2:
        return False
    sides = [np.linalg.norm(places[0] - places[k]) for k in (1, 2)]
    return math.isclose(sides[0], sides[1], rel_tol=1e-6) and masses[1] == masses[2]


def _reached(model: RigidModel, atoms: int, centre: Floats, axes: Floats, rank: int) -> bool:
    """Whether all massless sites lie in the line or plane of the atoms."""
    beyond = (model.positions_angstrom[atoms:] - centre) @ axes[:, rank:]
    return bool(np.all(np.abs(beyond) < 1e-9))
