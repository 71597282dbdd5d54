"""A body that rolls on a plane without slipping: the rattleback, a rolling egg.

With x from the mass centre to the point of contact, the mass centre moves at x x ω and the angular momentum about the contact
is L = [I + m (x² - x xᵀ)] ω. The contact moves through the body at the rate x', and so (torque about a moving point:
E. J. Routh, Dynamics of a System of Rigid Bodies, elementary part, chapter IV)

    dL/dt = L x ω + m g μ x x - m x' x (x x ω)      in body axes, μ the direction of gravity there, μ' = μ x ω ,

Euler's equations with an added inertia and a torque. For an ellipsoid of semi-axes S about its centre c,
x = c + S²μ/√(μᵀS²μ). These are the equations of T. R. Kane and D. A. Levinson, Int. J. Non-Linear Mech. 17, 175 (1982),
written for L. The energy ½ L·ω + m g (x·μ) is conserved. Neglected: slipping, spinning friction, loss of contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import AddedInertia, Torque, number_field, vector_field
from rotor.classical.effects.torques import checked_vector, from_body
from rotor.classical.torque_form import ROLLING, TorqueForm, torque_form
from rotor.geometry.rotations import IDENTITY, to_matrix, vector_product


@dataclass(frozen=True)
class RollingEllipsoid(Torque, AddedInertia):
    """An ellipsoidal body on a plane normal to gravity; L is that about the point of contact (`total_momentum` makes it).

    semiaxes: (3,). gravity: (3,), acceleration in space, towards the plane. centre: (3,), of the ellipsoid, from the centre
    of mass in body axes. axes: (4,), quaternion from the ellipsoid's axes to the body's principal axes.

    >>> ball = RollingEllipsoid(2.0, [0.5, 0.5, 0.5], gravity=[0.0, 0.0, -10.0])
    >>> ball.inertia(0.0, np.array([1.0, 0, 0, 0])).diagonal().tolist()  # m r² about the horizontal axes
    [0.5, 0.5, 0.0]
    """

    name: ClassVar[str] = "rolling ellipsoid"
    conserves_energy: ClassVar[bool] = True
    needs_velocity: ClassVar[bool] = True

    mass: float = number_field("mass", "of the body")
    semiaxes: ArrayLike = vector_field("semiaxes", "of the ellipsoid")
    gravity: ArrayLike = vector_field("gravity", "acceleration in space, towards the plane")
    centre: ArrayLike = vector_field(
        "centre", "of the ellipsoid, from the centre of mass, in body axes", (0.0, 0.0, 0.0)
    )
    axes: ArrayLike = vector_field(
        "axes", "quaternion from the ellipsoid's axes to the body's", tuple(IDENTITY.tolist())
    )

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"the mass of a body is positive and finite; got {self.mass!r}")
        semiaxes = checked_vector(self.semiaxes, "an ellipsoid's semi-axes")
        if np.any(semiaxes <= 0.0):
            raise ValueError(f"the semi-axes of an ellipsoid are positive; got {semiaxes.tolist()}")
        gravity = checked_vector(self.gravity, "the acceleration of gravity")
        if not np.any(gravity):
            raise ValueError("a body rolls on a plane normal to gravity: expected an acceleration other than zero")
        object.__setattr__(self, "gravity", gravity)
        object.__setattr__(self, "_weight", self.mass * float(np.linalg.norm(gravity)))
        object.__setattr__(self, "_vertical", gravity / np.linalg.norm(gravity))
        object.__setattr__(self, "centre", checked_vector(self.centre, "the centre of the ellipsoid"))
        turn = to_matrix(self.axes)
        object.__setattr__(self, "_squares", turn @ np.diag(semiaxes**2) @ turn.T)

    def contact(self, attitude: Floats) -> tuple[Floats, Floats]:
        """x and μ in body axes, (..., 3) each."""
        x, down, *_ = self._support(attitude)
        return x, down

    def inertia(self, time: float, attitude: Floats) -> Floats:
        """m (x² - x xᵀ)."""
        x, *_ = self._support(attitude)
        square = np.sum(x * x, axis=-1)[..., None, None]
        return np.asarray(self.mass * (square * np.eye(3) - x[..., :, None] * x[..., None, :]))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """m [g μ x x - x' x (x x ω)]."""
        x, down, stretched, height = self._support(attitude)
        down_rate = vector_product(down, omega)
        stretched_rate = down_rate @ self.__dict__["_squares"]
        height_rate = np.sum(stretched * down_rate, axis=-1, keepdims=True) / height
        x_rate = (stretched_rate - stretched * height_rate / height) / height
        bend = vector_product(x_rate, vector_product(x, omega))
        return np.asarray(self.__dict__["_weight"] * vector_product(down, x) - self.mass * bend)

    def compiled_form(self) -> TorqueForm:
        """The torque and the inertia."""
        attributes = self.__dict__
        return torque_form(
            ROLLING, self.mass, attributes["_weight"], attributes["_vertical"], self.centre, attributes["_squares"]
        )

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """m g x·μ, of the height of the mass centre above the plane."""
        x, down, *_ = self._support(attitude)
        return np.asarray(self.__dict__["_weight"] * np.sum(x * down, axis=-1))

    def _support(self, attitude: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """x, μ, S²μ and √(μᵀS²μ), the height of the ellipsoid's centre above the plane."""
        down = from_body(self.__dict__["_vertical"], attitude)
        stretched = down @ self.__dict__["_squares"]
        height = np.sqrt(np.sum(down * stretched, axis=-1, keepdims=True))
        return np.asarray(self.centre) + stretched / height, down, stretched, height
