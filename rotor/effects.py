"""The face that every effect shows, nothing else.

An effect is one object in one file. Levels and integrators take a list of effects and pay only for those they
are given; registering one is naming it in that list.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from rotor.rotations import Array
    from rotor.top import Top


class QuantumEffect(ABC):
    """A term of the rotational Hamiltonian.

    A term is a sum of operators ½[Jz^2q, J₊^2n + J₋^2n]₊ J^2p (n = 0: Jz^2q J^2p), which is what any effective
    Hamiltonian of a semi-rigid top in one vibrational state consists of. Effects that need a larger basis
    (nuclear spin, fields) will extend the face by the basis they ask for.
    """

    @abstractmethod
    def operators(self, top: Top) -> dict[tuple[int, int, int], float]:
        """Coefficients in MHz, keyed by the powers (p, q, n) above."""

    @abstractmethod
    def estimate_mhz(self, top: Top, j: int) -> float:
        """How large the effect is for levels of angular momentum `j`, in MHz; rough, never an underestimate by 10."""


class ClassicalEffect:
    """A change of Euler's equations, which with all effects present read, in the body's principal axes,

        dL/dt = L x ω + Σ torques,   ω_i = (L_i - h_i) / I_i(t),   h = Σ inner momenta.

    An effect is one of the three kinds below; this base only names what each says of itself: `conserves_energy`
    means ½ Σ (L_i - h_i)²/I_i + potential energy, `conserves_momentum` means L seen from space;
    `depends_on_time` says whether the time itself enters, as in a drive.
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
    def torque(self, time: float, attitude: Array, omega: Array) -> Array:
        """Torque on the body in body axes (..., 3) from attitude (..., 4) and angular velocity in body axes (..., 3).

        Where `needs_velocity` is False, `omega` is not looked at.
        """

    def potential_energy(self, time: float, attitude: Array) -> Array | float:
        """Energy (...,) whose change with attitude is the torque; zero for a torque that has none."""
        return 0.0


class InnerMomentum(ClassicalEffect, ABC):
    """Angular momentum that parts carry relative to the body."""

    @abstractmethod
    def inner_momentum(self, time: float) -> Array:
        """h in body axes (3,) at `time`."""


class InertiaChange(ClassicalEffect, ABC):
    """Moments that change in time while the principal axes stay."""

    @abstractmethod
    def moments(self, time: float) -> Array:
        """Principal moments (..., 3) at `time`, in place of those the motion was started with."""
