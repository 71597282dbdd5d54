"""Prescribed torques: constant, or a function of time, fixed in the body or in space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, writable
from rotor.classical.effect import Torque, frame_field, vector_field
from rotor.classical.torque_form import BODY_FIXED, SPACE_FIXED, TorqueForm, torque_form

Frame = Literal["body", "space"]


def from_body(vector: ArrayLike, attitude: Floats) -> Floats:
    """A vector (3,) of space in body axes, (..., 3) for unit attitudes (..., 4)."""
    from rotor.classical.integrators._attitude_kernels import seen_from_body

    return np.asarray(seen_from_body(_rows(attitude), writable(vector)).reshape(*attitude.shape[:-1], 3))


def lever_torque(arm: ArrayLike, force: ArrayLike, attitude: Floats) -> Floats:
    """arm x force in body axes, (..., 3), for an arm (3,) of the body and a force (3,) of space."""
    from rotor.classical.integrators._attitude_kernels import lever

    return np.asarray(lever(_rows(attitude), writable(arm), writable(force)).reshape(*attitude.shape[:-1], 3))


def in_body(vector: ArrayLike, frame: str, attitude: Floats) -> Floats:
    """A vector (3,) of the body or of space in body axes, (..., 3) for attitudes (..., 4)."""
    if frame == "space":
        return from_body(vector, attitude)
    return np.broadcast_to(np.asarray(vector, dtype=np.float64), (*attitude.shape[:-1], 3))


def fixed_form(vector: ArrayLike, frame: str, swing: tuple[float, float] = (0.0, 0.0)) -> TorqueForm:
    """vector cos(Ω t + φ), swing = (Ω, φ), fixed in the body or in space, for compiled integrators."""
    return torque_form(SPACE_FIXED if frame == "space" else BODY_FIXED, vector, swing)


def checked_frame(frame: str) -> None:
    """Refuse a frame that is neither "body" nor "space"."""
    if frame not in ("body", "space"):
        raise ValueError(f'a torque is fixed in the "body" or in "space"; got frame={frame!r}')


def checked_vector(vector: ArrayLike, what: str) -> Floats:
    """Three finite components, read-only, or a ValueError that names `what`."""
    array = np.array(vector, dtype=np.float64)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{what} has three finite components; got {array.tolist()}")
    array.setflags(write=False)
    return array


def checked_matrix(entries: ArrayLike, what: str, symmetric: bool = False) -> Floats:
    """A finite matrix (3, 3), read-only, from its rows or its diagonal (3,), or a ValueError that names `what`."""
    array = np.array(entries, dtype=np.float64)
    matrix = np.diag(array) if array.shape == (3,) else array
    if (
        matrix.shape != (3, 3)
        or not np.all(np.isfinite(matrix))
        or (symmetric and not np.array_equal(matrix, matrix.T))
    ):
        kind, remedy = ("symmetric, ", "; for a nearly symmetric one give (α + αᵀ)/2") if symmetric else ("", "")
        raise ValueError(f"{what}: expected 3 numbers or a {kind}finite 3x3 matrix; got {array.tolist()}{remedy}")
    matrix.setflags(write=False)
    return matrix


class FramedTorque(Torque):
    """A torque along a vector that is fixed in the body or in space."""

    frame: Frame

    @property
    def needs_attitude(self) -> bool:
        """Only where the torque is fixed in space."""
        return self.frame == "space"


@dataclass(frozen=True)
class ConstantTorque(FramedTorque):
    """A torque (3,) that is constant in body axes (a thruster) or in space.

    A constant torque in space has no potential: a rotation about it by 2π does work.

    >>> ConstantTorque([0.0, 0.0, 0.5]).torque(0.0, np.array([1.0, 0, 0, 0]), np.zeros(3))
    array([0. , 0. , 0.5])
    """

    name: ClassVar[str] = "constant torque"
    vector: ArrayLike = vector_field("vector", "the torque")
    frame: Frame = frame_field()

    def __post_init__(self) -> None:
        checked_frame(self.frame)
        object.__setattr__(self, "vector", checked_vector(self.vector, "a constant torque"))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """The constant vector in body axes."""
        return in_body(self.vector, self.frame, attitude)

    def compiled_form(self) -> TorqueForm:
        """A vector of frequency 0."""
        return fixed_form(self.vector, self.frame)


@dataclass(frozen=True)
class TimedTorque(FramedTorque):
    """A torque that is a given function of time, `history(time)` -> (3,), in body axes or in space.

    >>> ramp = TimedTorque(lambda time: [time, 0.0, 0.0])
    >>> ramp.torque(2.0, np.array([1.0, 0, 0, 0]), np.zeros(3))
    array([2., 0., 0.])
    """

    depends_on_time: ClassVar[bool] = True

    history: Callable[[float], ArrayLike]
    frame: Frame = "body"

    def __post_init__(self) -> None:
        checked_frame(self.frame)
        if not callable(self.history):
            raise ValueError("a timed torque needs a function of time that returns three components")

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """The vector at `time`, in body axes."""
        return in_body(checked_vector(self.history(time), f"the torque at time {time:g}"), self.frame, attitude)


def _rows(attitude: Floats) -> Floats:
    return writable(attitude).reshape(-1, 4)
