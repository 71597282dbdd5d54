"""Gravity on a body with a fixed point: pendulum, heavy top."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque, number_field, vector_field
from rotor.classical.effects.torques import checked_vector, from_body, lever_torque
from rotor.classical.torque_form import LEVER, TorqueForm, torque_form


@dataclass(frozen=True)
class GravityAboutPivot(Torque):
    """Torque r x (m g) about the pivot and energy -m g·r, r (3,) from pivot to centre of mass in body axes.

    The moments of the motion are those about the pivot (parallel axes), along the axes in which `centre` is given.
    `gravity` (3,) is the acceleration in space.

    >>> hanging = GravityAboutPivot(mass=2.0, centre=[0, 0, -0.5], gravity=[0, 0, -10.0])
    >>> float(hanging.potential_energy(0.0, np.array([1.0, 0, 0, 0])))
    -10.0
    """

    name: ClassVar[str] = "gravity about pivot"
    conserves_energy: ClassVar[bool] = True

    mass: float = number_field("mass", "of the body")
    centre: ArrayLike = vector_field("centre", "from pivot to centre of mass, in body axes")
    gravity: ArrayLike = vector_field("gravity", "acceleration in space")

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"the mass of a body is positive and finite; got {self.mass!r}")
        object.__setattr__(self, "centre", checked_vector(self.centre, "the centre of mass"))
        object.__setattr__(self, "gravity", checked_vector(self.gravity, "the acceleration of gravity"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """r x m g in body axes."""
        return lever_torque(self.centre, self.mass * np.asarray(self.gravity), attitude)

    def compiled_form(self) -> TorqueForm:
        """r x m g."""
        return torque_form(LEVER, self.centre, self.mass * np.asarray(self.gravity))

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-m g·r."""
        return np.asarray(-self.mass * (from_body(self.gravity, attitude) @ np.asarray(self.centre)))
