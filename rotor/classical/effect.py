"""The interface of a classical effect: a torque, an inner angular momentum, added inertia, or moments that change in time.

An effect is one object in one file of `rotor.classical.effects`. Integrators take a list of effects and compute only
what is in it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from rotor.arrays import Floats
from rotor.classical.torque_form import TorqueForm
from rotor.requests.field import REQUIRED, declared
from rotor.requests.readers import Array, Quantity, Text


class ClassicalEffect:
    """A change of Euler's equations, which with all effects present read, in the body's principal axes,

        dL/dt = L x ω + Σ torques,   L = (I(t) + A) ω + h,   h = Σ inner momenta,   A = Σ added inertia.

    An effect is one or more of the four kinds below; this base only names what each says of itself: `conserves_energy`
    means ½ (L - h)·ω + potential energy, `conserves_momentum` means L seen from space; `depends_on_time` says whether the
    time itself enters, as in a drive.
    """

    name: ClassVar[str] = ""  # in scenes and on the command line; its declared fields are its parameters there
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
        """This torque for compiled integrators; with None they call `torque` at every step."""
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


def vector_field(name: str, help: str, default: Any = REQUIRED) -> Any:
    """The field of a parameter with three components or more, in coherent units."""
    return declared(default, Array(), help, name, example=[0.0, 0.0, 1.0])


def matrix_field(name: str, help: str) -> Any:
    """The field of a matrix (3, 3) in body axes, or of its diagonal (3,)."""
    return declared(REQUIRED, Array(list[float | list[float]]), help, name, example=[1.0, 1.0, 2.0])


def number_field(name: str, help: str, default: Any = REQUIRED) -> Any:
    """The field of a number in coherent units."""
    return declared(default, Quantity(), help, name, example=1.0)


def frame_field() -> Any:
    """The field that says in which axes a vector is fixed."""
    return declared("body", Text(), '"body" or "space"', "frame")


def named_effects() -> dict[str, type[ClassicalEffect]]:
    """Every effect that has a name, by it: those of `rotor.classical.effects`, and those of modules that are imported already.

    A class without a name in its own body, such as a user's variant of a named effect, does not take the place of that effect.
    """
    for path in sorted((Path(__file__).parent / "effects").glob("[a-z]*.py")):
        import_module(f"rotor.classical.effects.{path.stem}")
    return {kind.name: kind for kind in _subclasses(ClassicalEffect) if vars(kind).get("name")}


def _subclasses(base: type[ClassicalEffect]) -> Iterator[type[ClassicalEffect]]:
    for subclass in base.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)
