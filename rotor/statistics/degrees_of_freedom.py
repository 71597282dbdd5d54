"""The number of degrees of freedom for temperatures, thermostats and tests of equipartition.

A rigid body has 3 translations and 3 rotations; a linear body has 2 rotations, an atom none. Conserved totals that are removed from
the motion (3 for the total momentum) are subtracted. A molecule of N atoms bound by forces has 3N - 6 vibrations, 3N - 5 if linear
(G. Herzberg, Molecular Spectra and Molecular Structure II, chapter II, 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.geometry.inertia import LINEAR_BELOW

NEARLY = 1e3  # bodies within this factor of the limit between linear and bent are noted


@dataclass(frozen=True)
class Degrees:
    """The degrees of freedom of a box of rigid bodies.

    bodies: their number. translation, rotation: degrees of freedom after subtraction of `removed`. removed: conserved totals.
    notes: bodies near the limit between linear and bent, with the ratio that decided.
    """

    bodies: int
    translation: int
    rotation: int
    removed: int = 0
    notes: tuple[str, ...] = ()

    @property
    def total(self) -> int:
        """All degrees of freedom."""
        return self.translation + self.rotation

    def kt(self, kinetic_energy: float) -> float:
        """kT = 2E/f from the kinetic energy in all f degrees, in the unit of the energy; ValueError if f is 0."""
        if self.total == 0:
            raise ValueError(f"{self.bodies} bodies with no degree of freedom left have no temperature")
        return 2.0 * kinetic_energy / self.total


def rotating_axes(moments: ArrayLike, linear_below: float = LINEAR_BELOW) -> NDArray[np.bool_]:
    """Which principal axes a body can turn about, (..., 3), from its moments (..., 3); an atom has three moments of 0.

    An axis counts if its moment is at least `linear_below` times the largest moment of the body; a ratio does not depend on the
    unit. A triatomic bent by 1e-3 rad (a ratio of 5e-8 to 8e-8) is linear by this rule.

    >>> rotating_axes([[0.0, 2.0, 2.0], [1e-30, 2e-30, 3e-30], [0.0, 0.0, 0.0]]).sum(axis=-1)
    array([2, 3, 0])
    """
    array = np.asarray(moments, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 3 or not np.isfinite(array).all() or (array < 0.0).any():
        raise ValueError(
            f"principal moments: expected finite numbers of 0 or more, of shape (..., 3); got {array.tolist()}"
        )
    if not 0.0 < linear_below < 1.0:
        raise ValueError(f"linear_below = {linear_below}: expected a ratio between 0 and 1")
    largest = array.max(axis=-1, keepdims=True)
    turns = (array >= linear_below * largest) & (largest > 0.0)
    if np.any(turns.sum(axis=-1) == 1):
        raise ValueError(
            "a body with a single moment above 0 is impossible: a linear body has two equal moments, (0, I, I)"
        )
    return np.asarray(turns)


def count_degrees(moments: ArrayLike, *, removed: int = 0, linear_below: float = LINEAR_BELOW) -> Degrees:
    """The degrees of freedom of N rigid bodies with moments (N, 3), including linear bodies and atoms.

    removed: conserved totals, 3 if the total momentum is held at zero; subtracted from the translations. Raises ValueError if
    `removed` exceeds the number of translations.

    >>> box = count_degrees([[0.6, 1.3, 1.9]] * 10 + [[0, 80, 80]] * 5 + [[0, 0, 0]], removed=3)
    >>> box.translation, box.rotation, box.total
    (45, 40, 85)
    """
    array = np.asarray(moments, dtype=np.float64)
    if array.ndim != 2:
        raise ValueError(f"the moments of N bodies have shape (N, 3); got {array.shape}")
    turns = rotating_axes(array, linear_below).sum(axis=-1)
    if not 0 <= removed <= 3 * len(array):
        raise ValueError(f"{removed} totals removed from {len(array)} bodies with {3 * len(array)} translations")
    return Degrees(len(array), 3 * len(array) - removed, int(turns.sum()), removed, _doubts(array, linear_below))


def _doubts(moments: NDArray[np.float64], linear_below: float) -> tuple[str, ...]:
    """A note for each kind of body within a factor `NEARLY` of the limit between linear and bent."""
    if not len(moments):
        return ()
    notes = []
    for body in np.unique(np.sort(moments, axis=-1), axis=0):
        ratio = body[0] / body[2] if body[2] > 0.0 else 0.0
        if linear_below / NEARLY < ratio < linear_below * NEARLY:
            rule = "below" if ratio < linear_below else "not below"
            count = 2 if ratio < linear_below else 3
            notes.append(f"I_a/I_c = {ratio:.2e} is {rule} {linear_below:g}: {count} rotational degrees are counted")
    return tuple(notes)


def vibrational_degrees(atoms: int, linear: bool) -> int:
    """3N - 6 vibrations of a molecule of N atoms, 3N - 5 of a linear one, 0 of an atom.

    >>> vibrational_degrees(3, False), vibrational_degrees(3, True), vibrational_degrees(1, False)
    (3, 4, 0)
    """
    if atoms < 1 or (atoms == 2 and not linear):
        raise ValueError(
            f"{atoms} atoms{'' if linear else ', not linear'}: two atoms are always linear, and a molecule has at least one"
        )
    return 0 if atoms == 1 else 3 * atoms - (5 if linear else 6)


def atomic_degrees(atoms: int, constraints: int = 0, removed: int = 0) -> int:
    """Degrees of freedom of N atoms: 3N minus independent constraints minus removed totals.

    A rigid body of n atoms needs 3n - 6 constraints, a linear one 3n - 5. This is not the number n(n-1)/2 of distances: a linear
    triatomic has 3 distances but 4 constraints. Rigid bodies are better counted by `count_degrees`.

    >>> atomic_degrees(3 * 216, 3 * 216, 3), count_degrees([[0.6, 1.3, 1.9]] * 216, removed=3).total
    (1293, 1293)
    """
    left = 3 * atoms - constraints - removed
    if min(atoms, constraints, removed) < 0 or left < 0:
        raise ValueError(
            f"{atoms} atoms less {constraints} constraints and {removed} removed totals leave {left} degrees"
        )
    return left
