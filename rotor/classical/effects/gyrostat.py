"""A spinning rotor inside the body: the gyrostat, or dual-spin satellite."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import InnerMomentum, vector_field
from rotor.classical.effects.torques import checked_vector


@dataclass(frozen=True)
class SpinningRotor(InnerMomentum):
    """Constant angular momentum h (3,) in body axes, carried by symmetric rotors relative to the body.

    L is that of body and rotors together, and the moments are those of the whole with locked rotors, so that
    ω_i = (L_i - h_i)/I_i (Wittenburg, Dynamics of Multibody Systems: Kelvin's gyrostat). A motor holds h constant. A freely turning
    rotor conserves its absolute axial momentum instead: then give the moments without the rotor's axial moment, and this momentum as h.
    The energy does not include that of the rotor relative to the body.

    >>> SpinningRotor([0.0, 0.0, 0.7]).inner_momentum(0.0)
    array([0. , 0. , 0.7])
    """

    name: ClassVar[str] = "spinning rotor"
    conserves_energy: ClassVar[bool] = True
    conserves_momentum: ClassVar[bool] = True

    momentum: ArrayLike = vector_field("momentum", "of the rotor, in body axes")

    def __post_init__(self) -> None:
        object.__setattr__(self, "momentum", checked_vector(self.momentum, "the momentum of a rotor"))

    def inner_momentum(self, time: float) -> Floats:
        """Angular momentum h of the spinning rotor in body axes; constant in time."""
        return np.asarray(self.momentum)

    def compiled_form(self) -> Floats:
        """h, the only parameter of the compiled form."""
        return np.asarray(self.momentum)
