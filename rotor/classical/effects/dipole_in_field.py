"""Permanent and induced dipoles in a uniform field, constant or pulsed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque, matrix_field, vector_field
from rotor.classical.effects.torques import checked_matrix, checked_vector, from_body, lever_torque
from rotor.classical.torque_form import INDUCED, LEVER, TorqueForm, torque_form


@dataclass(frozen=True)
class PermanentDipole(Torque):
    """Torque μ x E and energy -μ·E of a dipole (3,) in body axes in a uniform field (3,) in space, coherent units.

    >>> dipole = PermanentDipole([1.0, 0, 0], field=[0, 0, 2.0])
    >>> dipole.torque(0.0, np.array([1.0, 0, 0, 0]), np.zeros(3)).tolist()
    [0.0, -2.0, 0.0]
    """

    name: ClassVar[str] = "permanent dipole"
    conserves_energy: ClassVar[bool] = True

    dipole: ArrayLike = vector_field("dipole", "in body axes")
    field: ArrayLike = vector_field("field", "in space")

    def __post_init__(self) -> None:
        object.__setattr__(self, "dipole", checked_vector(self.dipole, "a dipole"))
        object.__setattr__(self, "field", checked_vector(self.field, "a field"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """μ x E in body axes."""
        return lever_torque(self.dipole, self.field, attitude)

    def compiled_form(self) -> TorqueForm:
        """μ x E."""
        return torque_form(LEVER, self.dipole, self.field)

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-μ·E."""
        return np.asarray(-from_body(self.field, attitude) @ np.asarray(self.dipole))


@dataclass(frozen=True)
class InducedDipole(Torque):
    """Torque (αE) x E and energy -½ E·αE of a polarizability α (3, 3), symmetric, in body axes, or its diagonal (3,).

    The field (3,) is uniform and constant in space. For a laser pulse give the rms field, the peak amplitude over √2: the
    orientation follows the envelope, not the carrier.

    >>> rod = InducedDipole([0, 0, 2.0], field=[0, 0, 3.0])
    >>> float(rod.potential_energy(0.0, np.array([1.0, 0, 0, 0])))
    -9.0
    """

    name: ClassVar[str] = "induced dipole"
    conserves_energy: ClassVar[bool] = True

    polarizability: ArrayLike = matrix_field("polarizability", "diagonal (3,) or matrix (3, 3), in body axes")
    field: ArrayLike = vector_field("field", "in space")

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "polarizability", checked_matrix(self.polarizability, "a polarizability", symmetric=True)
        )
        object.__setattr__(self, "field", checked_vector(self.field, "a field"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """(αE) x E in body axes."""
        field = from_body(self.field, attitude)
        induced = field @ np.asarray(self.polarizability)
        return np.asarray(np.cross(induced, field))

    def compiled_form(self) -> TorqueForm:
        """(αE) x E."""
        return torque_form(INDUCED, self.polarizability, self.field)

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-½ E·αE."""
        field = from_body(self.field, attitude)
        return np.asarray(-0.5 * np.sum(field @ np.asarray(self.polarizability) * field, axis=-1))


@dataclass(frozen=True)
class PulsedPolarizability(Torque):
    """Energy -u(t) Σ S_FG α_FG of a polarizability α (3, 3) in body axes and light with the tensor S (3, 3) in space.

    `history(time)` is u; S = e eᵀ of light polarized along e, Re(e* eᵀ) of elliptical light. The mean over the optical cycle is
    in u: for a peak amplitude E0 it is E0²/4.

    >>> rod = PulsedPolarizability([0, 0, 2.0], np.diag([0, 0, 1.0]), lambda time: 3.0)
    >>> float(rod.potential_energy(0.0, np.array([1.0, 0, 0, 0])))
    -6.0
    """

    depends_on_time: ClassVar[bool] = True

    polarizability: ArrayLike
    light: ArrayLike
    history: Callable[[float], float]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "polarizability", checked_matrix(self.polarizability, "a polarizability", symmetric=True)
        )
        light = np.array(self.light, dtype=np.float64)
        if light.shape != (3, 3) or not np.all(np.isfinite(light)) or not np.array_equal(light, light.T):
            raise ValueError(f"the tensor of light is a symmetric finite 3x3 matrix; got {light.tolist()}")
        values, axes = np.linalg.eigh(light)
        object.__setattr__(self, "light", light)
        object.__setattr__(self, "_beams", [(v, axis) for v, axis in zip(values.tolist(), axes.T, strict=True) if v])

    def _in_body(self, attitude: Floats) -> list[tuple[float, Floats, Floats]]:
        """(share, e, α e) in body axes for each principal axis of the light."""
        fields = [(share, from_body(axis, attitude)) for share, axis in self._beams]  # type: ignore[attr-defined]
        return [(share, field, field @ np.asarray(self.polarizability)) for share, field in fields]

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """2u Σ share (αe) x e in body axes."""
        turning = [share * np.cross(induced, field) for share, field, induced in self._in_body(attitude)]
        return np.asarray(2.0 * self.history(time) * np.sum(turning, axis=0))

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-u Σ S_FG α_FG."""
        energies = [share * np.sum(field * induced, axis=-1) for share, field, induced in self._in_body(attitude)]
        return np.asarray(-self.history(time) * np.sum(energies, axis=0))


@dataclass(frozen=True)
class PulsedDipole(Torque):
    """Energy -u(t) μ·e of a dipole (3,) in body axes in a field along e (3,) whose strength is `history(time)`."""

    depends_on_time: ClassVar[bool] = True

    dipole: ArrayLike
    direction: ArrayLike
    history: Callable[[float], float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "dipole", checked_vector(self.dipole, "a dipole"))
        object.__setattr__(self, "direction", checked_vector(self.direction, "the direction of a field"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """u μ x e in body axes."""
        return np.asarray(self.history(time) * lever_torque(self.dipole, self.direction, attitude))

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-u μ·e."""
        return np.asarray(-self.history(time) * (from_body(self.direction, attitude) @ np.asarray(self.dipole)))
