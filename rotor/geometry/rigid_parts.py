"""Rigid parts of a body found from two positions of its points: the domains of a protein, and the screw of each.

Each point with its neighbours gives a trial motion (the best superposition). The motion that most points follow within a tolerance
defines a part; it is refitted to its points until these no longer change. The remaining points are searched in the same way.
Clustering the motions of short pieces is the idea of S. Hayward and H. J. C. Berendsen, Proteins 30, 144 (1998); here points that
follow a motion are counted instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.geometry.rigid_motions import Screw, chasles_screw, compose
from rotor.geometry.rotations import conjugate, rotate
from rotor.geometry.superposition import superpose

ROUNDS = 50  # most rounds of refitting a motion and recounting its points; a few suffice


@dataclass(frozen=True, eq=False)
class RigidPart:
    """Points that moved as one body. members: indices. q, position: the motion, x -> q x q* + position. rmsd: of the fit."""

    members: NDArray[np.int64]
    q: Floats
    position: Floats
    rmsd: float

    def screw_against(self, fixed: RigidPart) -> Screw:
        """The screw motion of this part relative to another part, in the coordinates before the motion."""
        back = conjugate(fixed.q)
        return chasles_screw(*compose(back, -rotate(back, fixed.position), self.q, self.position))


def rigid_parts(
    before: ArrayLike, after: ArrayLike, tolerance: float, smallest: int = 8, neighbours: int = 8
) -> list[RigidPart]:
    """The rigid parts of n points, largest first; some points may belong to no part.

    Parameters
    ----------
    before, after : (n, 3) array
        Positions of the same points.
    tolerance : float
        Largest distance of a point from its position predicted by the motion of its part.
    smallest : int
        Smallest number of points in a part.
    neighbours : int
        Number of points for a trial motion.

    Returns
    -------
    list of RigidPart
        Disjoint parts.

    Raises
    ------
    ValueError
        For clouds of different size, fewer than `neighbours` points, and a tolerance that is not positive.

    Notes
    -----
    Time and memory grow with n². Neglected: parts that bend.
    """
    x, y = np.asarray(before, dtype=np.float64), np.asarray(after, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 2 or x.shape[1:] != (3,):
        raise ValueError(f"positions before and after have the same shape (n, 3); got {x.shape} and {y.shape}")
    if not tolerance > 0.0 or not 4 <= neighbours <= len(x) or smallest < 4:
        raise ValueError(
            f"expected a tolerance above 0, from 4 to {len(x)} neighbours and 4 points or more in a part; got "
            f"{tolerance!r}, {neighbours}, {smallest}"
        )
    left, parts = np.arange(len(x)), []
    while len(left) >= max(smallest, neighbours):
        members = left[_largest(x[left], y[left], tolerance, neighbours)]
        if len(members) < smallest:
            break
        fit = superpose(x[members], y[members])
        parts.append(RigidPart(members, fit.quaternion, fit.translation, float(fit.rmsd)))
        left = np.setdiff1d(left, members)
    return sorted(parts, key=lambda part: -len(part.members))


def _largest(x: Floats, y: Floats, tolerance: float, neighbours: int) -> NDArray[np.bool_]:
    """Which points (n,) follow the motion with the most followers."""
    apart = np.linalg.norm(x[:, None] - x[None], axis=-1)
    near = np.argsort(apart, axis=-1, kind="stable")[:, :neighbours]
    seeds = superpose(x[near], y[near])
    carried = np.einsum("sij,nj->sni", seeds.rotation, x) + seeds.translation[:, None]
    follows = np.linalg.norm(carried - y, axis=-1) < tolerance
    best: NDArray[np.bool_] = follows[np.argmax(follows.sum(axis=-1))]
    for _ in range(ROUNDS):
        if best.sum() < neighbours:
            break
        fit = superpose(x[best], y[best])
        again = np.linalg.norm(x @ fit.rotation.T + fit.translation - y, axis=-1) < tolerance
        if np.array_equal(again, best):
            break
        best = again
    return best
