"""A torque that oscillates at one frequency, fixed in the body or in space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import frame_field, number_field, vector_field
from rotor.classical.effects.torques import Frame, FramedTorque, checked_frame, checked_vector, fixed_form, in_body
from rotor.classical.torque_form import TorqueForm


@dataclass(frozen=True)
class PeriodicDrive(FramedTorque):
    """Torque amplitude cos(angular_frequency time + phase), amplitude (3,), angular_frequency in radians per time.

    >>> PeriodicDrive([2.0, 0, 0], angular_frequency=np.pi).torque(1.0, np.array([1.0, 0, 0, 0]), np.zeros(3)).tolist()
    [-2.0, -0.0, -0.0]
    """

    name: ClassVar[str] = "periodic drive"
    depends_on_time: ClassVar[bool] = True

    amplitude: ArrayLike = vector_field("amplitude", "the torque at its largest")
    angular_frequency: float = number_field("angular_frequency", "rad per time")
    phase: float = number_field("phase", "rad", 0.0)
    frame: Frame = frame_field()

    def __post_init__(self) -> None:
        checked_frame(self.frame)
        object.__setattr__(self, "amplitude", checked_vector(self.amplitude, "the amplitude of a drive"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """The amplitude times the cosine at `time`, in body axes."""
        now = np.asarray(self.amplitude) * math.cos(self.angular_frequency * time + self.phase)
        return in_body(now, self.frame, attitude)

    def compiled_form(self) -> TorqueForm:
        """The amplitude with its frequency and phase."""
        return fixed_form(self.amplitude, self.frame, (self.angular_frequency, self.phase))
