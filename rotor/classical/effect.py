"""The interface of a classical effect: a torque, an inner angular momentum, added inertia, or moments that change in time.

Each effect is a class in its own file of `rotor.classical.effects`. Integrators accept a list of effects and compute only
these.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from rotor.arrays import Floats
from rotor.classical.torque_form import TorqueForm
from rotor.requests.choices import Choices
from rotor.requests.field import REQUIRED, declared
from rotor.requests.lists import Array
from rotor.requests.readers import Quantity, Text

DEFAULT_TOLERANCE = 1e-10  # of an adaptive step


class ClassicalEffect:
    """A change of Euler's equations, which with all effects present read, in the body's principal axes,

        dL/dt = L x ω + Σ torques,   L = (I(t) + A) ω + h,   h = Σ inner momenta,   A = Σ added inertia.

    An effect belongs to one or more of the four kinds below. Attributes of this base: `conserves_energy` refers to
    ½ (L - h)·ω + potential energy, `conserves_momentum` to L in space; `depends_on_time` is an explicit time dependence, as in a drive.
    """

    name: ClassVar[str] = ""  # in scenes and on the command line; its declared fields are its parameters there
    conserves_energy: ClassVar[bool] = False
    conserves_momentum: ClassVar[bool] = False
    depends_on_time: ClassVar[bool] = False


class Torque(ClassicalEffect, ABC):
    """A torque. `needs_velocity`: it depends on ω, which excludes splittings into drifts and kicks."""

    needs_velocity: ClassVar[bool] = False

    @property
    def needs_attitude(self) -> bool:
        """Whether the torque in body axes depends on the attitude."""
        return True

    @abstractmethod
    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """Torque on the body in body axes (..., 3) from attitude (..., 4) and angular velocity in body axes (..., 3).

        `omega` is ignored unless `needs_velocity` is True.
        """

    def potential_energy(self, time: float, attitude: Floats) -> Floats | float:
        """Potential energy (...,) of the torque as a function of the attitude; zero for a torque without potential."""
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
        """h (3,) for compiled integrators if it is constant, otherwise None."""
        return None


class AddedInertia(ClassicalEffect, ABC):
    """Added inertia from outside: a rolling contact, or displaced fluid.

    L then includes A ω. Splittings into drifts and kicks do not apply; use `LieRungeKutta`. Constant inertia along the principal
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
    """Moments that change in time about fixed principal axes."""

    @abstractmethod
    def moments(self, time: float) -> Floats:
        """Principal moments (..., 3) at `time`; they replace the initial ones."""


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
    """All named effects: those of `rotor.classical.effects`, and those of modules imported so far.

    A subclass that only inherits a name, such as a user's variant of an effect, does not replace that effect.
    """
    for path in sorted((Path(__file__).parent / "effects").glob("[a-z]*.py")):
        import_module(f"rotor.classical.effects.{path.stem}")
    return {kind.name: kind for kind in _subclasses(ClassicalEffect) if vars(kind).get("name")}


def _subclasses(base: type[ClassicalEffect]) -> Iterator[type[ClassicalEffect]]:
    for subclass in base.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


BODY_EFFECTS = Choices("effect", named_effects, "EFFECT")
