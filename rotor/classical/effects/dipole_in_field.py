"""A dipole in a uniform field: a permanent one, and one that the field induces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque
from rotor.classical.effects.torques import checked_vector, from_body, lever_torque


@dataclass(frozen=True)
class PermanentDipole(Torque):
    """Torque μ x E and energy -μ·E of a dipole (3,) in body axes in a uniform field (3,) in space, coherent units.

    >>> dipole = PermanentDipole([1.0, 0, 0], field=[0, 0, 2.0])
    >>> dipole.torque(0.0, np.array([1.0, 0, 0, 0]), np.zeros(3)).tolist()
    [0.0, -2.0, 0.0]
    """

    conserves_energy: ClassVar[bool] = True

    dipole: ArrayLike
    field: ArrayLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "dipole", checked_vector(self.dipole, "a dipole"))
        object.__setattr__(self, "field", checked_vector(self.field, "a field"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """μ x E in body axes."""
        return lever_torque(self.dipole, self.field, attitude)

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-μ·E."""
        return np.asarray(-from_body(self.field, attitude) @ np.asarray(self.dipole))


@dataclass(frozen=True)
class InducedDipole(Torque):
    """Torque (αE) x E and energy -½ E·αE of a polarizability α (3, 3), symmetric, in body axes, or its diagonal (3,).

    The field (3,) is uniform and constant in space. For a laser pulse give the field whose square is the mean of E²,
    the peak amplitude over √2: orientation follows the envelope, not the carrier.

    >>> rod = InducedDipole([0, 0, 2.0], field=[0, 0, 3.0])
    >>> float(rod.potential_energy(0.0, np.array([1.0, 0, 0, 0])))
    -9.0
    """

    conserves_energy: ClassVar[bool] = True

    polarizability: ArrayLike
    field: ArrayLike

    def __post_init__(self) -> None:
        array = np.array(self.polarizability, dtype=np.float64)
        matrix = np.diag(array) if array.shape == (3,) else array
        if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)) or not np.array_equal(matrix, matrix.T):
            raise ValueError(
                f"a polarizability is 3 numbers or a symmetric finite 3x3 matrix; got {np.asarray(array).tolist()}; "
                "for a nearly symmetric one give (α + αᵀ)/2"
            )
        matrix.setflags(write=False)
        object.__setattr__(self, "polarizability", matrix)
        object.__setattr__(self, "field", checked_vector(self.field, "a field"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """(αE) x E in body axes."""
        field = from_body(self.field, attitude)
        induced = field @ np.asarray(self.polarizability)
        return np.asarray(np.cross(induced, field))

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-½ E·αE."""
        field = from_body(self.field, attitude)
        return np.asarray(-0.5 * np.sum(field @ np.asarray(self.polarizability) * field, axis=-1))
