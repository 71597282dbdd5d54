"""Rotations and reflections that bring labelled points back onto like points, within a stated mismatch.

Two points i, j that do not lie on one line with the centre fix an operation of known handedness by where they go. So
every operation sought is among those that carry (i, j) to a pair of like points at like distances; each candidate is
matched against all points and then fitted to its own matching.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints

MATCH_WITHIN = 0.45  # of the shortest distance of like points: below one half, so that no two match the same one
MOST_CANDIDATES = 400_000  # pairs of images tried; a minute's work for ten thousand points
FEW_POINTS = 60  # up to which all distances are as quick as a k-d tree
MOST_OPERATIONS = 480  # a ring of 120 like atoms has as many


@dataclass(frozen=True, eq=False)
class Operation:
    """One operation about the centre: x → matrix @ x takes point i to the place of point `permutation[i]`.

    matrix : (3, 3) orthogonal. permutation : (n,) whole numbers. mismatch_angstrom : the largest distance between an
    image and the point that it is matched to, Å.
    """

    matrix: Floats
    permutation: Ints
    mismatch_angstrom: float

    @property
    def proper(self) -> bool:
        """True for a rotation, False for a reflection, an inversion or a rotation-reflection."""
        return bool(np.linalg.det(self.matrix) > 0)

    @property
    def axis(self) -> Floats:
        """Unit vector (3,) of the rotation, or of the rotation part of an improper operation; z for none.

        The direction is chosen so that its last nonzero component is positive.
        """
        turn = self.matrix if self.proper else -self.matrix
        # turn + turnᵀ = 2 cos θ 1 + 2 (1 - cos θ) u uᵀ, so its largest eigenvalue belongs to u, also for θ = π
        axis = np.linalg.eigh(turn + turn.T)[1][:, -1] if np.trace(turn) < 3 - 1e-9 else np.array([0.0, 0.0, 1.0])
        last = axis[np.flatnonzero(np.abs(axis) > 1e-6)[-1]]
        return np.asarray(axis * np.sign(last))

    @property
    def angle(self) -> float:
        """Angle in radians, 0 to 2π, of the rotation about `axis` (of minus the matrix for an improper operation)."""
        turn = self.matrix if self.proper else -self.matrix
        vector = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        angle = float(np.arctan2(vector @ self.axis, np.trace(turn) - 1))
        return angle % (2 * np.pi) if abs(angle) > 1e-7 else 0.0

    @property
    def order(self) -> int:
        """The least n with (rotation by `angle`)ⁿ = 1."""
        turns = self.angle / (2 * np.pi)
        orders = np.arange(1, MOST_OPERATIONS + 1)
        whole = np.abs(orders * turns - np.rint(orders * turns)) < 1e-5
        return int(orders[whole][0])


def shortest_distance(points: Floats) -> float:
    """The shortest distance between two of the points (n, 3), n ≥ 2."""
    distances, _ = _neighbours(points).query(points, k=2)
    return float(distances[:, 1].min())


def _neighbours(points: Floats) -> Any:
    """What finds the nearest of the points (n, d): a k-d tree, or for few points all distances, which load no more."""
    if len(points) <= FEW_POINTS:
        return _AllDistances(points)

    from scipy.spatial import cKDTree

    return cKDTree(points)


class _AllDistances:
    """Nearest points by all distances, with the face of scipy's k-d tree."""

    def __init__(self, points: Floats) -> None:
        self.points = points

    def query(self, places: Floats, k: int = 1) -> tuple[Floats, Ints]:
        """Distances to the k nearest points, rising, and their indices."""
        distances = np.linalg.norm(places[:, None, :] - self.points, axis=2)
        nearest = np.argsort(distances, axis=1, kind="stable")[:, :k]
        rising = np.take_along_axis(distances, nearest, axis=1)
        return (rising[:, 0], nearest[:, 0]) if k == 1 else (rising, nearest)


def best_turn(points: Floats, images: Floats, proper: bool) -> Floats:
    """The orthogonal matrix R (3, 3), det R = ±1, that makes Σ |image - R point|² least.

    W. Kabsch, Acta Crystallogr. A 32, 922 (1976), eq. 9; the last singular direction takes the sign of the determinant,
    which leaves it free where all points lie in a plane.
    """
    left, _, right = np.linalg.svd(points.T @ images)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right)) * (1 if proper else -1)
    return np.asarray((left * np.array([1.0, 1.0, sign])) @ right).T


def find_operations(labels: Ints, points: Floats, reach: float) -> tuple[list[Operation], tuple[int, int]]:
    """All operations about the origin whose mismatch is at most `reach` Å, and the two points that tell them apart.

    labels : (n,) whole numbers, alike for like points. points : (n, 3), Å, not all on one line with the origin.
    Raises ValueError where there are more candidates or operations than `MOST_CANDIDATES` and `MOST_OPERATIONS`.
    """
    base = _base_pair(labels, points, reach)
    turns = _candidates(labels, points, base, reach)
    matches = _Matcher(labels, points)
    operations: dict[tuple[int, int, bool], Operation] = {}
    for turn in matches.survivors(turns, base):
        permutation = matches.permutation(turn)
        if permutation is None:
            continue
        key = (int(permutation[base[0]]), int(permutation[base[1]]), bool(np.linalg.det(turn) > 0))
        if key not in operations:
            operations[key] = fitted(points, permutation, key[2])
        if len(operations) > MOST_OPERATIONS:
            raise ValueError(
                f"more than {MOST_OPERATIONS} symmetry operations within {reach:.3g} Å: not a molecule whose group can "
                "be named; give spin weights by hand"
            )
    return [operation for operation in operations.values() if operation.mismatch_angstrom <= reach], base


def fitted(points: Floats, permutation: Ints, proper: bool) -> Operation:
    """The operation of that handedness that fits a matching of the points best."""
    images = points[permutation]
    turn = best_turn(points, images, proper)
    mismatch = float(np.linalg.norm(images - points @ turn.T, axis=1).max())
    return Operation(turn, permutation, mismatch)


def _images(labels: Ints, radii: Floats, point: int, reach: float) -> Ints:
    """Points that point `one` can be carried to: like ones, as far from the centre."""
    return np.flatnonzero((labels == labels[point]) & (np.abs(radii - radii[point]) <= reach))


def _image_counts(labels: Ints, radii: Floats, reach: float) -> Ints:
    """How many points each point can be carried to."""
    counts = np.empty(len(labels), dtype=np.int64)
    for label in sorted(set(labels.tolist())):
        mine = np.flatnonzero(labels == label)
        ordered = np.sort(radii[mine])
        above = np.searchsorted(ordered, radii[mine] + reach, side="right")
        counts[mine] = above - np.searchsorted(ordered, radii[mine] - reach, side="left")
    return counts


def _base_pair(labels: Ints, points: Floats, reach: float) -> tuple[int, int]:
    """Two points with few images, far from the centre and well off one line with it."""
    radii = np.linalg.norm(points, axis=1)
    counts = _image_counts(labels, radii, reach)
    far = radii.max()
    first = int(np.argmax(radii / far / counts))
    across = np.linalg.norm(np.cross(points[first] / radii[first], points), axis=1)
    return first, int(np.argmax(across / far / counts))


def _candidates(labels: Ints, points: Floats, base: tuple[int, int], reach: float) -> Floats:
    """Operations (m, 3, 3), proper and improper, that carry the base pair to a pair of images at like distance."""
    radii = np.linalg.norm(points, axis=1)
    firsts, seconds = (_images(labels, radii, point, reach) for point in base)
    if len(firsts) * len(seconds) > 20 * MOST_CANDIDATES:
        raise ValueError(_too_many(len(firsts) * len(seconds), reach))
    apart = np.linalg.norm(points[firsts][:, None] - points[seconds][None], axis=2)
    expected = float(np.linalg.norm(points[base[0]] - points[base[1]]))
    pairs = np.argwhere(np.abs(apart - expected) <= 2 * reach)
    if len(pairs) > MOST_CANDIDATES:
        raise ValueError(_too_many(len(pairs), reach))

    base_triad = _triads(points[[base[0]]], points[[base[1]]])[0]
    others = _triads(points[firsts[pairs[:, 0]]], points[seconds[pairs[:, 1]]])
    mirror = np.array([1.0, 1.0, -1.0])
    return np.concatenate([others @ base_triad.T, (others * mirror) @ base_triad.T])


def _too_many(count: int, reach: float) -> str:
    return (
        f"{count} candidates for a symmetry operation within {reach:.3g} Å, more than {MOST_CANDIDATES}: "
        "too many like atoms as far from the centre; use a smaller tolerance, or give spin weights by hand"
    )


def _triads(first: Floats, second: Floats) -> Floats:
    """Orthonormal frames (m, 3, 3), axes in columns: along the first vector, towards the second, across both."""
    along = first / np.linalg.norm(first, axis=1, keepdims=True)
    across = np.cross(along, second)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    return np.stack([along, np.cross(across, along), across], axis=2)


class _Matcher:
    """Which like point each point falls on under an operation.

    The k-d tree has the label for a fourth coordinate, wide enough apart that the nearest point is a like one. A match
    counts within a little less than half of the shortest distance between like points, which makes it one to one.
    """

    def __init__(self, labels: Ints, points: Floats) -> None:
        self.points = points
        self.layers = labels * (4 * np.linalg.norm(points, axis=1).max())
        self.tree = _neighbours(np.column_stack([points, self.layers]))
        self.within = np.full(len(points), np.inf)
        for label in sorted(set(labels.tolist())):
            mine = labels == label
            if mine.sum() > 1:
                self.within[mine] = MATCH_WITHIN * shortest_distance(points[mine])

    def survivors(self, turns: Floats, base: tuple[int, int]) -> Floats:
        """The candidates that bring a few points, the base pair and others spread over the order, onto like points."""
        n = len(self.points)
        for probe in dict.fromkeys([*base, *np.linspace(0, n - 1, min(n, 40)).astype(int).tolist()]):
            images = turns @ self.points[probe]
            distance, _ = self.tree.query(np.column_stack([images, np.full(len(images), self.layers[probe])]))
            turns = turns[distance <= self.within[probe]]
        return turns

    def permutation(self, turn: Floats) -> Ints | None:
        """Where each point goes; None where one meets no like point."""
        distance, near = self.tree.query(np.column_stack([self.points @ turn.T, self.layers]))
        if (distance > self.within).any():
            return None
        return np.asarray(near, dtype=np.int64)


def closed_group(operations: Iterable[Operation], base: tuple[int, int], reach: float) -> list[Operation]:
    """The largest set of operations with mismatch up to some limit ≤ `reach` that is closed under multiplication.

    Where a limit cuts through a group (one element just within, its product just without) the limit is lowered
    until the set closes; the identity alone always does.
    """
    remaining = sorted((o for o in operations if o.mismatch_angstrom <= reach), key=lambda o: o.mismatch_angstrom)
    while not _is_closed(remaining, base):
        worst = remaining[-1].mismatch_angstrom
        remaining = [o for o in remaining if o.mismatch_angstrom < worst]
    return remaining


def _is_closed(operations: list[Operation], base: tuple[int, int]) -> bool:
    proper = [o.proper for o in operations]
    known = {(*o.permutation[list(base)].tolist(), p) for o, p in zip(operations, proper, strict=True)}
    for second, turns in zip(operations, proper, strict=True):
        for first, also in zip(operations, proper, strict=True):
            images = second.permutation[first.permutation[list(base)]]
            if (*images.tolist(), turns == also) not in known:
                return False
    return True


def symmetrised(points: Floats, operations: list[Operation]) -> tuple[Floats, list[Operation]]:
    """The nearest points that the group leaves exactly alike, and its operations, exact, on them.

    Each point becomes the mean of what all operations bring back to it, and the matrices are fitted to the new points,
    in turn until nothing moves.
    """
    proper = [o.proper for o in operations]
    for _ in range(100):
        operations = [fitted(points, o.permutation, p) for o, p in zip(operations, proper, strict=True)]
        mean = np.mean([points[o.permutation] @ o.matrix for o in operations], axis=0)
        moved = float(np.abs(mean - points).max())
        points = mean
        if moved <= 1e-12 * float(np.abs(points).max()):
            return points, [fitted(points, o.permutation, p) for o, p in zip(operations, proper, strict=True)]
    raise ValueError(f"made symmetric, the geometry still moves by {moved:.2g} Å after 100 rounds; lower the tolerance")
