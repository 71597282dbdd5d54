"""Rotations and reflections that map labelled points onto like points within a tolerance.

The images of two points i, j that are not collinear with the centre determine a proper or improper operation. All operations are
therefore among those that map (i, j) to a pair of like points at equal distances. Each candidate is matched against all points and
then fitted to this matching.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass

# of the shortest distance of like points: below one half, so that two points cannot match the same image
MATCH_WITHIN = 0.45
MOST_CANDIDATES = 400_000  # pairs of images tried; a minute's work for ten thousand points
FEW_POINTS = 60  # up to which all distances are as quick as a k-d tree
MOST_OPERATIONS = 480  # a ring of 120 like atoms has as many


@dataclass(frozen=True, eq=False)
class Operation:
    """A symmetry operation about the centre: x → matrix @ x maps point i to point `permutation[i]`.

    matrix : (3, 3) orthogonal. permutation : (n,) integers. mismatch_angstrom : the largest distance between an
    image and its matched point, Å.
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
        """Unit vector (3,) of the rotation, or of the rotation part of an improper operation; z for the identity or inversion.

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
        """The smallest n with (rotation by `angle`)ⁿ = 1."""
        turns = self.angle / (2 * np.pi)
        orders = np.arange(1, MOST_OPERATIONS + 1)
        whole = np.abs(orders * turns - np.rint(orders * turns)) < 1e-5
        return int(orders[whole][0])


def shortest_distance(points: Floats) -> float:
    """The shortest distance between two of the points (n, 3), n ≥ 2."""
    distances, _ = _neighbours(points).query(points, k=2)
    return float(distances[:, 1].min())


def _neighbours(points: Floats) -> Any:
    """A nearest-neighbour search for points (n, d): a k-d tree, or all distances for few points, which avoids loading scipy."""
    if len(points) <= FEW_POINTS:
        return _AllDistances(points)

    from scipy.spatial import cKDTree

    return cKDTree(points)


class _AllDistances:
    """Nearest points from all distances, with the interface of scipy's k-d tree."""

    def __init__(self, points: Floats) -> None:
        self.points = points

    def query(self, places: Floats, k: int = 1) -> tuple[Floats, Ints]:
        """Distances to the k nearest points, in increasing order, and their indices."""
        distances = np.linalg.norm(places[:, None, :] - self.points, axis=2)
        nearest = np.argsort(distances, axis=1, kind="stable")[:, :k]
        rising = np.take_along_axis(distances, nearest, axis=1)
        return (rising[:, 0], nearest[:, 0]) if k == 1 else (rising, nearest)


def best_turn(points: Floats, images: Floats, proper: bool) -> Floats:
    """The orthogonal matrix R (3, 3), det R = ±1, that minimises Σ |image - R point|².

    W. Kabsch, Acta Crystallogr. A 32, 922 (1976), eq. 9. The sign of the last singular direction sets the determinant; for points in
    a plane this direction is otherwise undetermined.
    """
    left, _, right = np.linalg.svd(points.T @ images)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right)) * (1 if proper else -1)
    return np.asarray((left * np.array([1.0, 1.0, sign])) @ right).T


def find_operations(labels: Ints, points: Floats, reach: float) -> tuple[list[Operation], tuple[int, int]]:
    """All operations about the origin with a mismatch of at most `reach` Å, and two points whose images distinguish them.

    labels : (n,) integers, equal for like points. points : (n, 3), Å, not all on a line through the origin.
    Raises ValueError for more candidates or operations than `MOST_CANDIDATES` and `MOST_OPERATIONS`.
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
                f"more than {MOST_OPERATIONS} symmetry operations within {reach:.3g} Å: its point group cannot be "
                "named; give spin weights by hand"
            )
    return [operation for operation in operations.values() if operation.mismatch_angstrom <= reach], base


def fitted(points: Floats, permutation: Ints, proper: bool) -> Operation:
    """The proper or improper operation that best fits a matching of the points."""
    images = points[permutation]
    turn = best_turn(points, images, proper)
    mismatch = float(np.linalg.norm(images - points @ turn.T, axis=1).max())
    return Operation(turn, permutation, mismatch)


def _images(labels: Ints, radii: Floats, point: int, reach: float) -> Ints:
    """Possible images of a point: like points at the same distance from the centre."""
    return np.flatnonzero((labels == labels[point]) & (np.abs(radii - radii[point]) <= reach))


def _image_counts(labels: Ints, radii: Floats, reach: float) -> Ints:
    """Number of possible images of each point."""
    counts = np.empty(len(labels), dtype=np.int64)
    for label in sorted(set(labels.tolist())):
        mine = np.flatnonzero(labels == label)
        ordered = np.sort(radii[mine])
        above = np.searchsorted(ordered, radii[mine] + reach, side="right")
        counts[mine] = above - np.searchsorted(ordered, radii[mine] - reach, side="left")
    return counts


def _base_pair(labels: Ints, points: Floats, reach: float) -> tuple[int, int]:
    """Two points with few images, far from the centre and not collinear with it."""
    radii = np.linalg.norm(points, axis=1)
    counts = _image_counts(labels, radii, reach)
    far = radii.max()
    first = int(np.argmax(radii / far / counts))
    across = np.linalg.norm(np.cross(points[first] / radii[first], points), axis=1)
    return first, int(np.argmax(across / far / counts))


def _candidates(labels: Ints, points: Floats, base: tuple[int, int], reach: float) -> Floats:
    """Operations (m, 3, 3), proper and improper, that map the base pair to a pair of images at equal distance."""
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
    """Matches the images of points under an operation to like points.

    The k-d tree has the label as fourth coordinate, spaced so that the nearest point is a like one. The tolerance is slightly less
    than half of the shortest distance between like points, which makes matches unique.
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
        """The candidates that map a sample of points, including the base pair, onto like points."""
        n = len(self.points)
        for probe in dict.fromkeys([*base, *np.linspace(0, n - 1, min(n, 40)).astype(int).tolist()]):
            images = turns @ self.points[probe]
            distance, _ = self.tree.query(np.column_stack([images, np.full(len(images), self.layers[probe])]))
            turns = turns[distance <= self.within[probe]]
        return turns

    def permutation(self, turn: Floats) -> Ints | None:
        """The index of the image of each point; None if an image meets no like point."""
        distance, near = self.tree.query(np.column_stack([self.points @ turn.T, self.layers]))
        if (distance > self.within).any():
            return None
        return np.asarray(near, dtype=np.int64)


def closed_group(operations: Iterable[Operation], base: tuple[int, int], reach: float) -> list[Operation]:
    """The largest set of operations, with mismatch up to a limit of at most `reach`, that is closed under multiplication.

    If a limit cuts through a group (an element just within, a product just beyond), it is lowered until the set is closed; the
    identity alone always is.
    """
    remaining = sorted((o for o in operations if o.mismatch_angstrom <= reach), key=lambda o: o.mismatch_angstrom)
    while not _is_closed(remaining, base):
        worst = remaining[-1].mismatch_angstrom
        remaining = [o for o in remaining if o.mismatch_angstrom < worst]
    return remaining


def _is_closed(operations: list[Operation], base: tuple[int, int]) -> bool:
    proper = [o.proper for o in operations]
    base_images = {(*o.permutation[list(base)].tolist(), p) for o, p in zip(operations, proper, strict=True)}
    for second, turns in zip(operations, proper, strict=True):
        for first, also in zip(operations, proper, strict=True):
            images = second.permutation[first.permutation[list(base)]]
            if (*images.tolist(), turns == also) not in base_images:
                return False
    return True


def symmetrised(points: Floats, operations: list[Operation]) -> tuple[Floats, list[Operation]]:
    """The nearest points with exact symmetry, and the exact operations of the group.

    Each point is replaced by the mean over all operations mapped back to it, and the matrices are fitted to the new points; both
    steps are repeated until nothing moves.
    """
    proper = [o.proper for o in operations]
    for _ in range(100):
        operations = [fitted(points, o.permutation, p) for o, p in zip(operations, proper, strict=True)]
        mean = np.mean([points[o.permutation] @ o.matrix for o in operations], axis=0)
        moved = float(np.abs(mean - points).max())
        points = mean
        if moved <= 1e-12 * float(np.abs(points).max()):
            return points, [fitted(points, o.permutation, p) for o, p in zip(operations, proper, strict=True)]
    raise ValueError(f"the symmetrised geometry still moves by {moved:.2g} Å after 100 rounds; lower the tolerance")
