"""Drag: torques that oppose the body's rotation, in proportion to ω or to its square."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque, matrix_field, vector_field
from rotor.classical.effects.torques import checked_matrix, checked_vector
from rotor.classical.torque_form import LINEAR, QUADRATIC, TorqueForm, torque_form


@dataclass(frozen=True)
class LinearDrag(Torque):
    """Torque -C ω with a matrix C (3, 3), or its diagonal (3,), in body axes.

    A rigid body in a viscous fluid at low Reynolds number has a symmetric positive C (Happel and Brenner, Low Reynolds
    Number Hydrodynamics, chapter 5); a sphere of radius a has 8π η a³. A matrix that is neither is linear feedback,
    such as that of Leipnik and Newton (Phys. Lett. A 86, 63 (1981)); it is taken as given.

    >>> LinearDrag([1.0, 2.0, 3.0]).torque(0.0, np.array([1.0, 0, 0, 0]), np.ones(3)).tolist()
    [-1.0, -2.0, -3.0]
    """

    name: ClassVar[str] = "linear drag"
    needs_velocity: ClassVar[bool] = True

    coefficients: ArrayLike = matrix_field("coefficients", "diagonal (3,) or matrix (3, 3)")

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", checked_matrix(self.coefficients, "linear drag"))

    @property
    def needs_attitude(self) -> bool:
        """False: drag depends on ω alone."""
        return False

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """-C ω."""
        return np.asarray(-omega @ np.asarray(self.coefficients).T)

    def compiled_form(self) -> TorqueForm:
        """-C ω."""
        return torque_form(LINEAR, self.coefficients)


@dataclass(frozen=True)
class QuadraticDrag(Torque):
    """Torque -c_i |ω| ω_i with coefficients (3,) in body axes, the law of drag at high Reynolds number.

    >>> QuadraticDrag([1.0, 1.0, 1.0]).torque(0.0, np.array([1.0, 0, 0, 0]), np.array([0.0, 3.0, 4.0])).tolist()
    [-0.0, -15.0, -20.0]
    """

    name: ClassVar[str] = "quadratic drag"
    needs_velocity: ClassVar[bool] = True

    coefficients: ArrayLike = vector_field("coefficients", "three, not negative")

    def __post_init__(self) -> None:
        coefficients = checked_vector(self.coefficients, "quadratic drag")
        if np.any(coefficients < 0.0):
            raise ValueError(f"coefficients of quadratic drag are not negative; got {coefficients.tolist()}")
        object.__setattr__(self, "coefficients", coefficients)

    @property
    def needs_attitude(self) -> bool:
        """False: drag depends on ω alone."""
        return False

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """-c |ω| ω."""
        speed = np.linalg.norm(omega, axis=-1, keepdims=True)
        return np.asarray(-np.asarray(self.coefficients) * speed * omega)

    def compiled_form(self) -> TorqueForm:
        """-c |ω| ω."""
        return torque_form(QUADRATIC, self.coefficients)
