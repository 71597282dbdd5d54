"""An optical centrifuge: light of linear polarization that turns faster and faster, and carries polarizable molecules along.

The field follows e = (cos φ, sin φ, 0) with φ(t) = φ0 + Ω0 t + β t²/2. A rod with moment I in the plane, at an angle δ behind the
field, obeys I δ'' = I β - U0 sin 2δ with U0 = ½ Δα F² (rms field F): it is carried along for I β < U0, at rest at
sin 2δ = I β/U0 (J. Karczmarek, J. Wright, P. Corkum and M. Ivanov, Phys. Rev. Lett. 82, 3420 (1999)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import Torque, matrix_field, number_field
from rotor.classical.effects.dipole_in_field import InducedDipole
from rotor.classical.effects.torques import checked_matrix
from rotor.classical.torque_form import TURNING, TorqueForm, torque_form


@dataclass(frozen=True)
class OpticalCentrifuge(Torque):
    """Torque (αE) x E and energy -½ E·αE of a polarizability α in a field of constant size that turns about Z of space.

    polarizability: (3, 3), symmetric, in body axes, or its diagonal (3,). field: rms size, the peak amplitude over √2.

    >>> light = OpticalCentrifuge([2.0, 0, 0], field=3.0, acceleration=0.1, angular_frequency=0.5)
    >>> float(light.potential_energy(0.0, np.array([1.0, 0, 0, 0]))), light.angle(2.0)
    (-9.0, 1.2)
    """

    name: ClassVar[str] = "optical centrifuge"
    depends_on_time: ClassVar[bool] = True

    polarizability: ArrayLike = matrix_field("polarizability", "diagonal (3,) or matrix (3, 3), in body axes")
    field: float = number_field("field", "rms size of the field in the XY plane of space")
    acceleration: float = number_field("acceleration", "of the polarization, rad per time²")
    angular_frequency: float = number_field("angular_frequency", "of the polarization at time 0, rad per time", 0.0)
    phase: float = number_field("phase", "angle of the polarization from X at time 0, rad", 0.0)

    def __post_init__(self) -> None:
        if not np.isfinite([self.field, self.acceleration, self.angular_frequency, self.phase]).all():
            raise ValueError("an optical centrifuge: expected finite field, acceleration, angular_frequency and phase")
        object.__setattr__(
            self, "polarizability", checked_matrix(self.polarizability, "a polarizability", symmetric=True)
        )

    def angle(self, time: float) -> float:
        """φ(t) from X towards Y, rad."""
        return self.phase + (self.angular_frequency + 0.5 * self.acceleration * time) * time

    def _field_now(self, time: float) -> InducedDipole:
        angle = self.angle(time)
        return InducedDipole(self.polarizability, [self.field * math.cos(angle), self.field * math.sin(angle), 0.0])

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """(αE) x E in body axes."""
        return self._field_now(time).torque(time, attitude, omega)

    def potential_energy(self, time: float, attitude: Floats) -> Floats:
        """-½ E·αE."""
        return self._field_now(time).potential_energy(time, attitude)

    def compiled_form(self) -> TorqueForm:
        """F² α, and the three coefficients of φ."""
        matrix = self.field**2 * np.asarray(self.polarizability)
        return torque_form(TURNING, matrix, [self.phase, self.angular_frequency, self.acceleration])
