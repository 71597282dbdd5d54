"""Inertia tensors of point masses, plates and solids, and a unique principal frame.

I = Σ m (r² 1 - r rᵀ) about the centre of mass; tensors of bodies add after a shift by Steiner's rule I' = I + m (d² 1 - d dᵀ)
(L. D. Landau and E. M. Lifshitz, Mechanics, § 32).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.frozen import dataclass

LINEAR_BELOW = 1e-6  # default of I_a / I_c below which a body is linear
EQUAL_MOMENTS = 1e-6  # default relative difference below which two moments count as equal
_SAME = 1e-5  # relative difference below which two odd moments of the masses do not decide a sign

# a^i b^j c^k whose sums over the masses distinguish frames that differ by the signs of two axes
_ODD_MOMENTS = (
    (3, 0, 0), (0, 3, 0), (0, 0, 3), (1, 2, 0), (1, 0, 2), (2, 1, 0), (0, 1, 2), (2, 0, 1), (0, 2, 1), (1, 1, 1),
    (3, 1, 0), (1, 3, 0), (3, 0, 1), (1, 0, 3), (0, 3, 1), (0, 1, 3), (2, 1, 1), (1, 2, 1), (1, 1, 2),
    (5, 0, 0), (0, 5, 0), (0, 0, 5),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body by its mass, centre of mass (3,) and inertia tensor (3, 3) about it; any coherent units.

    Bodies add: `cone + hemisphere` is the composite.
    """

    mass: float
    centre: Floats
    tensor: Floats

    def __add__(self, other: Body) -> Body:
        mass = self.mass + other.mass
        centre = (self.mass * self.centre + other.mass * other.centre) / mass
        return Body(mass, centre, self.about(centre) + other.about(centre))

    def about(self, point: ArrayLike) -> Floats:
        """The inertia tensor about another point, by Steiner's rule."""
        shift = np.asarray(point, dtype=float) - self.centre
        return self.tensor + self.mass * _steiner(shift)

    def moved(self, shift: ArrayLike) -> Body:
        """This body moved by a vector."""
        return Body(self.mass, self.centre + np.asarray(shift, dtype=float), self.tensor)

    def turned(self, rotation: ArrayLike) -> Body:
        """This body turned about the origin by a rotation matrix (3, 3)."""
        r = np.asarray(rotation, dtype=float)
        return Body(self.mass, r @ self.centre, r @ self.tensor @ r.T)


def kinetic_energy_by_axis(momentum: Floats, omega: Floats) -> Floats:
    """½ L_i ω_i, (..., 3), of angular momenta and angular velocities along any axes; their sum is the energy of rotation.

    >>> kinetic_energy_by_axis(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 0.5])).tolist()
    [0.5, 1.0, 0.75]
    """
    return 0.5 * momentum * omega


def _steiner(shift: Floats) -> Floats:
    return np.asarray(shift @ shift * np.eye(3) - np.outer(shift, shift))


def point_masses(masses: ArrayLike, positions: ArrayLike) -> Body:
    """Point masses (n,) at positions (n, 3) as one body.

    >>> point_masses([1, 1], [[0, 0, -1], [0, 0, 1]]).tensor.diagonal().tolist()
    [2.0, 2.0, 0.0]
    """
    m, r = np.asarray(masses, dtype=float), np.asarray(positions, dtype=float)
    if m.ndim != 1 or r.shape != (len(m), 3) or not len(m):
        raise ValueError(f"masses of shape {m.shape} and positions of shape {r.shape}: expected (n,) and (n, 3), n > 0")
    if not (np.isfinite(m).all() and (m > 0).all() and np.isfinite(r).all()):
        raise ValueError("masses must be finite and above 0, positions finite")
    centre = m @ r / m.sum()
    d = r - centre
    tensor = np.eye(3) * (m @ (d * d).sum(axis=1)) - (m[:, None] * d).T @ d
    return Body(float(m.sum()), centre, tensor)


def rod(mass: float, start: ArrayLike, end: ArrayLike) -> Body:
    """A uniform thin rod: m l²/12 across."""
    p, q = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    return Body(mass, (p + q) / 2, mass / 12 * _steiner(q - p))


def triangle(mass: float, corners: ArrayLike) -> Body:
    """A uniform triangular plate with corners (3, 3); it has the tensor of point masses m/3 at the middles of its sides."""
    r = np.asarray(corners, dtype=float)
    return point_masses([mass / 3] * 3, (r + np.roll(r, 1, axis=0)) / 2)


def rectangle(mass: float, width: float, height: float) -> Body:
    """A uniform plate in the xy plane, centred on the origin: m h²/12, m w²/12 and their sum."""
    return Body(mass, np.zeros(3), mass / 12 * np.diag([height**2, width**2, width**2 + height**2]))


def box(mass: float, edges: ArrayLike) -> Body:
    """A uniform box, its edges along x, y, z, centred on the origin: m/12 (b² + c²), ...

    >>> box(12.0, [1.0, 2.0, 3.0]).tensor.diagonal().tolist()
    [13.0, 10.0, 5.0]
    """
    squares = np.asarray(edges, dtype=float) ** 2
    return Body(mass, np.zeros(3), mass / 12 * np.diag(squares.sum() - squares))


def cylinder(mass: float, radius: float, height: float) -> Body:
    """A solid cylinder along z, centred on the origin: m/12 (3 r² + h²) across, m r²/2 along."""
    across = mass / 12 * (3 * radius**2 + height**2)
    return Body(mass, np.zeros(3), np.diag([across, across, mass * radius**2 / 2]))


def hoop(mass: float, radius: float) -> Body:
    """A thin hoop in the xy plane, centred on the origin: m r²/2 across, m r² along z."""
    return Body(mass, np.zeros(3), mass * radius**2 * np.diag([0.5, 0.5, 1.0]))


def cone(mass: float, radius: float, height: float) -> Body:
    """A solid cone, base in the plane z = 0, apex at z = height: 3/10 m r² and 3/80 m (4 r² + h²)."""
    across = 3 / 80 * mass * (4 * radius**2 + height**2)
    return Body(mass, np.array([0, 0, height / 4]), np.diag([across, across, 0.3 * mass * radius**2]))


def hemisphere(mass: float, radius: float) -> Body:
    """A solid hemisphere below the plane z = 0: 2/5 m r² along, (2/5 - 9/64) m r² across its centre of mass."""
    across = (2 / 5 - 9 / 64) * mass * radius**2
    return Body(mass, np.array([0, 0, -3 * radius / 8]), np.diag([across, across, 0.4 * mass * radius**2]))


@dataclass(frozen=True, eq=False)
class PrincipalFrame:
    """Moments (3,) in increasing order, and the axes a, b, c as rows (3, 3), right-handed, in the frame of the input."""

    moments: Floats
    axes: Floats
    centre: Floats


def principal_frame(
    body: Body, masses: ArrayLike | None = None, positions: ArrayLike | None = None, equal: float = EQUAL_MOMENTS
) -> PrincipalFrame:
    """Principal moments and the right-handed axes a, b, c with I_a ≤ I_b ≤ I_c.

    Parameters
    ----------
    body : Body
        Mass, centre and tensor.
    masses, positions : (n,) array, (n, 3) array, optional
        The point masses of the body; with them the frame is unique.
    equal : float
        Relative difference below which two moments count as equal.

    Returns
    -------
    PrincipalFrame
        Moments below round-off are 0, never negative.

    Notes
    -----
    Among the frames that the tensor allows, that with the largest odd moments Σ m a³, Σ m b³, Σ m c³, Σ m a b², ... (compared in this
    order) is chosen. Frames with the same odd moments are equivalent by symmetry. If moments are equal within `equal`, the candidate
    axes in the degenerate space point at the masses with the largest m ρ².

    >>> frame = principal_frame(Body(1.0, np.zeros(3), np.array([[5.0, -2, 0], [-2, 8, 0], [0, 0, 13]])))
    >>> [round(float(m), 12) for m in frame.moments], np.round(frame.axes[0] * 5**0.5, 12).tolist()
    ([4.0, 9.0, 13.0], [2.0, 1.0, 0.0])
    """
    if not isinstance(body, Body):
        raise ValueError(f"body: {type(body).__name__}: expected a Body; of a tensor alone, Body(mass, centre, tensor)")
    tensor = np.asarray(body.tensor, dtype=float)
    if (
        tensor.shape != (3, 3)
        or not np.isfinite(tensor).all()
        or not np.allclose(tensor, tensor.T, atol=1e-9 * np.abs(tensor).max())
    ):
        raise ValueError("an inertia tensor is a symmetric (3, 3) array of finite numbers")
    moments, columns = np.linalg.eigh(tensor)
    if moments[0] < -1e-9 * abs(moments[2]) or moments[0] + moments[1] < moments[2] * (1 - 1e-9):
        raise ValueError(f"moments {moments.tolist()} are impossible: each moment is at most the sum of the other two")

    moments = np.where(moments < 1e-12 * moments[2], 0.0, moments)
    axes = columns.T
    if masses is None or positions is None:
        return PrincipalFrame(moments, _signed_by_components(axes), body.centre)

    m, r = np.asarray(masses, dtype=float), np.asarray(positions, dtype=float) - body.centre
    return PrincipalFrame(moments, _unique(axes, moments, m, r, equal), body.centre)


def _signed_by_components(axes: Floats) -> Floats:
    """Signs without point masses: the largest component of a and of b is positive, c = a × b."""
    a, b = (axis * np.sign(axis[np.argmax(np.round(np.abs(axis), 9))]) for axis in axes[:2])
    return np.array([a, b, np.cross(a, b)])


def _unique(axes: Floats, moments: Floats, masses: Floats, positions: Floats, equal: float) -> Floats:
    candidates = np.array([_right_handed(frame) for frame in _frames(axes, moments, masses, positions, equal)])
    size = float(np.sqrt(masses @ (positions**2).sum(axis=1) / masses.sum())) or 1.0
    tensors = _moment_tensors(masses / masses.sum(), positions / size)

    for powers in _ODD_MOMENTS:
        values = _moments_along(tensors[sum(powers)], candidates, powers)
        candidates = candidates[values > values.max() - _SAME]
        if len(candidates) == 1:
            break
    return np.asarray(candidates[0])


def _moment_tensors(masses: Floats, x: Floats) -> dict[int, Floats]:
    """Σ m x_i x_j x_k ... of third, fourth and fifth order, (3, 3, 3) and so on, computed once for all frames."""
    pairs = np.einsum("ni,nj->nij", x, x).reshape(len(x), 9)
    triples = np.einsum("ni,nj->nij", pairs, masses[:, None] * x).reshape(len(x), 27)
    return {k: (rest.T @ triples).reshape((3,) * k) for k, rest in ((3, np.ones((len(x), 1))), (4, x), (5, pairs))}


def _moments_along(tensor: Floats, frames: Floats, powers: tuple[int, ...]) -> Floats:
    """Σ m a^i b^j c^k (f,) along the axes of each frame (f, 3, 3)."""
    values = np.broadcast_to(tensor, (len(frames), *tensor.shape))
    for axis, power in enumerate(powers):
        for _ in range(power):
            values = np.einsum("f...i,fi->f...", values, frames[:, axis])
    return values


def _right_handed(frame: Floats) -> Floats:
    return frame if np.linalg.det(frame) > 0 else frame * np.array([[1.0], [1.0], [-1.0]])


def _frames(axes: Floats, moments: Floats, masses: Floats, positions: Floats, equal: float) -> Iterator[Floats]:
    """The candidate frames: both signs of two axes, and directions to far masses in degenerate spaces."""
    ab, bc = _close(moments[0], moments[1], equal), _close(moments[1], moments[2], equal)
    if ab and bc:
        bases = [
            np.array([a, b, np.cross(a, b)]) for a in _far(positions, masses) for b in _across(a, positions, masses)
        ]
    elif ab:
        bases = [np.array([a, np.cross(axes[2], a), axes[2]]) for a in _across(axes[2], positions, masses)]
    elif bc:
        bases = [np.array([axes[0], b, np.cross(axes[0], b)]) for b in _across(axes[0], positions, masses)]
    else:
        bases = [axes]
    for base, signs in itertools.product(bases or [axes], itertools.product((1, -1), repeat=2)):
        yield base * np.array([[signs[0]], [signs[1]], [1.0]])


def _close(low: float, high: float, equal: float) -> bool:
    return bool(high - low < equal * high)


def _far(vectors: Floats, masses: Floats) -> list[Floats]:
    """Unit vectors to the masses with the largest m ρ² (ties included), at most 60."""
    weight = masses * (vectors**2).sum(axis=1)
    if weight.max() < 1e-12:
        return []
    far = vectors[weight > weight.max() * (1 - 1e-4)][:60]
    return [v / np.linalg.norm(v) for v in far]


def _across(axis: Floats, positions: Floats, masses: Floats) -> list[Floats]:
    """Principal directions of the positions projected onto the plane across an axis; any direction if all lie on it."""
    across = positions - np.outer(positions @ axis, axis)
    spread = float((positions**2).sum(axis=1).max())
    if (across**2).sum(axis=1).max() > 1e-10 * spread:
        return _far(across, masses)
    other = np.eye(3)[np.argmin(np.abs(axis))]
    b = other - axis * (axis @ other)
    return [b / np.linalg.norm(b)]
