"""The interface of a classical effect: a torque, an inner angular momentum, added inertia, or moments that change in time.

An effect is one object in one file of `rotor.classical.effects`. Integrators take a list of effects and compute only
what is in it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from rotor.arrays import Floats
from rotor.classical.torque_form import TorqueForm


class ClassicalEffect:
    """A change of Euler's equations, which with all effects present read, in the body's principal axes,

        dL/dt = L x ω + Σ torques,   L = (I(t) + A) ω + h,   h = Σ inner momenta,   A = Σ added inertia.

    An effect is one or more of the four kinds below; this base only names what each says of itself: `conserves_energy`
    means ½ (L - h)·ω + potential energy, `conserves_momentum` means L seen from space; `depends_on_time` says whether the
    time itself enters, as in a drive.
    """

    conserves_energy: ClassVar[bool] = False
    conserves_momentum: ClassVar[bool] = False
    depends_on_time: ClassVar[bool] = False


class Torque(ClassicalEffect, ABC):
    """A torque. `needs_velocity` says that it depends on ω: then no splitting into drifts and kicks serves."""

    needs_velocity: ClassVar[bool] = False

    @property
    def needs_attitude(self) -> bool:
        """Whether the torque in body axes depends on the attitude."""
        return True

    @abstractmethod
    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """Torque on the body in body axes (..., 3) from attitude (..., 4) and angular velocity in body axes (..., 3).

        Where `needs_velocity` is False, `omega` is not looked at.
        """

    def potential_energy(self, time: float, attitude: Floats) -> Floats | float:
        """Energy (...,) whose change with attitude is the torque; zero for a torque that has none."""
        return 0.0

    def compiled_form(self) -> TorqueForm | None:
        """The same torque for compiled integrators; None: they call `torque` at every step."""
        return None


class InnerMomentum(ClassicalEffect, ABC):
    """Angular momentum that parts carry relative to the body."""

    @abstractmethod
    def inner_momentum(self, time: float) -> Floats:
        """h in body axes (3,) at `time`."""

    def compiled_form(self) -> Floats | None:
        """h (3,) where it never changes, for compiled integrators; else None."""
        return None


class AddedInertia(ClassicalEffect, ABC):
    """Inertia that comes with the motion from outside: a contact that the body rolls on, a fluid that is pushed aside.

    L then includes A ω. No splitting into drifts and kicks serves; `LieRungeKutta` does. Constant inertia along the principal
    axes needs no effect: add it to the moments.
    """

    @property
    def needs_attitude(self) -> bool:
        """Whether A depends on the attitude."""
        return True

    @abstractmethod
    def inertia(self, time: float, attitude: Floats) -> Floats:
        """A in body axes, symmetric (..., 3, 3), at attitudes (..., 4)."""


class InertiaChange(ClassicalEffect, ABC):
    """Moments that change in time while the principal axes stay."""

    @abstractmethod
    def moments(self, time: float) -> Floats:
        """Principal moments (..., 3) at `time`, in place of those the motion was started with."""
