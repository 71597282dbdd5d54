"""A classical effect in one file, outside the package: a torque along one axis that grows with the time.

Run as a program it is a command `rotor` that knows the effect.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rotor.classical.effect import Torque, number_field


@dataclass(frozen=True)
class RisingTorque(Torque):
    """Torque (0, 0, rate t) in body axes."""

    name: ClassVar[str] = "rising torque"
    depends_on_time: ClassVar[bool] = True

    rate: float = number_field("rate", "torque per time")

    def torque(self, time, attitude, omega):
        """Along axis 3."""
        return np.broadcast_to([0.0, 0.0, self.rate * time], omega.shape)


if __name__ == "__main__":
    from rotor.cli import run

    sys.exit(run(sys.argv[1:]))
