"""Euler's equations with effects, as used by all integrators.

The effects are sorted by kind once; an absent kind is an empty tuple and costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import AddedInertia, ClassicalEffect, InertiaChange, InnerMomentum, Torque
from rotor.classical.euler import checked_moments, gyroscopic_rate, inverse_moments, kinetic_energy
from rotor.classical.torque_form import SystemForm, rolling_forms, system_form
from rotor.geometry.rotations import IDENTITY


@dataclass(frozen=True)
class System:
    """Moments (n, 3) of n bodies and the effects that act on all of them, by kind; see `rotor.classical.effect`."""

    start_moments: Floats
    start_inverse: Floats
    start_acting: Floats
    torques: tuple[Torque, ...]
    inner: tuple[InnerMomentum, ...]
    added: tuple[AddedInertia, ...]
    inertia: InertiaChange | None

    @property
    def free(self) -> bool:
        """Whether no effect is present."""
        return not (self.torques or self.inner or self.added or self.inertia)

    @property
    def needs_velocity(self) -> bool:
        """Whether a torque depends on ω, which excludes splittings into drifts and kicks."""
        return any(effect.needs_velocity for effect in self.torques)

    @property
    def needs_attitude(self) -> bool:
        """Whether a torque or an added inertia depends on the attitude; else dL/dt follows from L and time alone."""
        return any(torque.needs_attitude for torque in self.torques) or any(a.needs_attitude for a in self.added)

    @property
    def potential_depends_on_time(self) -> bool:
        """Whether a potential energy changes in time at a fixed attitude; a drive has none."""
        with_potential = (t for t in self.torques if type(t).potential_energy is not Torque.potential_energy)
        return any(effect.depends_on_time for effect in with_potential)

    @cached_property
    def compiled(self) -> SystemForm | None:
        """All effects except added inertia, for compiled integrators; None if an effect has no compiled form."""
        if self.inertia or (self.added and self.rolling is None):
            return None
        return system_form([torque for torque in self.torques if not isinstance(torque, AddedInertia)], self.inner)

    @cached_property
    def rolling(self) -> Floats | None:
        """Parameters of rolling contacts, for compiled integrators; None without rolling, or if another effect adds inertia."""
        return rolling_forms(self.added) if self.added else None

    def inverse(self, time: float) -> Floats:
        """1/I_i (n, 3) at `time`, 0 for the axis of a linear rotor."""
        return self.start_inverse if self.inertia is None else np.asarray(1.0 / self.moments(time))

    def acting(self, time: float) -> Floats:
        """`acting_inverse` of the moments (n, 3) at `time`."""
        return self.start_acting if self.inertia is None else np.asarray(1.0 / self.moments(time))

    def moments(self, time: float) -> Floats:
        """Principal moments (n, 3) at `time`."""
        if self.inertia is None:
            return self.start_moments
        return np.ascontiguousarray(np.broadcast_to(self.inertia.moments(time), self.start_moments.shape))

    def inner_momentum(self, time: float) -> Floats | float:
        """Sum h (3,) of the inner momenta; 0.0 without any."""
        return sum((effect.inner_momentum(time) for effect in self.inner), start=0.0)

    def omega(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """ω in body axes, (n, 3), from L = (I(t) + A) ω + h with the added inertia A."""
        if self.added:
            return self.stepping_omega(time, momentum, attitude)
        return np.asarray(self._relative(time, momentum) * self.inverse(time))

    def stepping_omega(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """Angular velocity by `acting_inverse`, which removes rounding about the axis of a linear rotor."""
        relative = self._relative(time, momentum)
        if not self.added:
            return np.asarray(relative * self.acting(time))
        total = sum((effect.inertia(time, attitude) for effect in self.added), start=_diagonal(1.0 / self.acting(time)))
        return np.asarray(np.linalg.solve(total, relative[..., None])[..., 0])

    def _relative(self, time: float, momentum: Floats) -> Floats:
        return momentum - self.inner_momentum(time) if self.inner else momentum

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """Sum of the torques in body axes, (n, 3)."""
        total = self.torques[0].torque(time, attitude, omega)
        for effect in self.torques[1:]:
            total = total + effect.torque(time, attitude, omega)
        return total

    def momentum_rate(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """dL/dt = L x ω + Σ torques in body axes, (n, 3)."""
        omega = self.omega(time, momentum, attitude)
        rate = gyroscopic_rate(momentum, omega)
        return rate + self.torque(time, attitude, omega) if self.torques else rate

    def energy(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """½ (L - h)·ω + potential energies, (n,)."""
        total = kinetic_energy(self._relative(time, momentum), self.omega(time, momentum, attitude))
        for effect in self.torques:
            total = total + effect.potential_energy(time, attitude)
        return np.asarray(total)


def flatten_system(moments: ArrayLike, effects: Sequence[ClassicalEffect] = ()) -> System:
    """The system of bodies with principal moments (..., 3), flattened to (n, 3), under a list of effects.

    >>> from rotor.classical.effects.gyrostat import SpinningRotor
    >>> system = flatten_system([1.0, 2.0, 4.0], [SpinningRotor([0, 0, 1.0])])
    >>> system.omega(0.0, np.array([[1.0, 2.0, 3.0]]), np.array([[1.0, 0.0, 0.0, 0.0]])).tolist()
    [[1.0, 1.0, 0.5]]
    """
    kinds = (Torque, InnerMomentum, AddedInertia, InertiaChange)
    for effect in effects:
        if not isinstance(effect, kinds):
            raise ValueError(
                f"expected classical effects (torques, inner momenta, added inertia, a change of inertia); got {effect!r}"
            )
    changes = [effect for effect in effects if isinstance(effect, InertiaChange)]
    if len(changes) > 1:
        raise ValueError(f"{len(changes)} effects set the moments of inertia; give one function with all the changes")
    checked = np.ascontiguousarray(checked_moments(moments).reshape(-1, 3))
    return System(
        start_moments=checked,
        start_inverse=inverse_moments(checked),
        start_acting=acting_inverse(checked),
        torques=tuple(effect for effect in effects if isinstance(effect, Torque)),
        inner=tuple(effect for effect in effects if isinstance(effect, InnerMomentum)),
        added=tuple(effect for effect in effects if isinstance(effect, AddedInertia)),
        inertia=changes[0] if changes else None,
    )


def total_momentum(
    omega: ArrayLike,
    moments: ArrayLike,
    effects: Sequence[ClassicalEffect] = (),
    attitude: ArrayLike = IDENTITY,
    time: float = 0.0,
) -> Floats:
    """The angular momentum L = (I + A) ω + h (..., 3) of a body under effects with angular velocity ω.

    Parameters
    ----------
    omega : (..., 3) array
        Angular velocity in body axes.
    moments : (..., 3) array
        Principal moments, those of `integrate`.
    effects : sequence of ClassicalEffect
        As for `integrate`; inner momenta h, added inertia A and a change of inertia enter.
    attitude : (..., 4) array
        Body to space.
    time : float
        Time at which effects are evaluated.

    Returns
    -------
    (..., 3) array
        L in body axes.

    Examples
    --------
    >>> from rotor.classical.effects.gyrostat import SpinningRotor
    >>> total_momentum([1.0, 1.0, 0.5], [1.0, 2.0, 4.0], [SpinningRotor([0, 0, 1.0])]).tolist()
    [1.0, 2.0, 3.0]
    """
    system = flatten_system(moments, effects)
    w, q = np.asarray(omega, dtype=np.float64), np.asarray(attitude, dtype=np.float64)
    shape = np.broadcast_shapes(w.shape[:-1], q.shape[:-1], np.shape(moments)[:-1])
    w, q = np.broadcast_to(w, (*shape, 3)).reshape(-1, 3), np.broadcast_to(q, (*shape, 4)).reshape(-1, 4)
    total = system.moments(time) * w + system.inner_momentum(time)
    for effect in system.added:
        total = total + (effect.inertia(time, q) @ w[..., None])[..., 0]
    return np.asarray(total).reshape(*shape, 3)


def _diagonal(values: Floats) -> Floats:
    """Diagonal matrices (n, 3, 3) of values (n, 3)."""
    return values[..., None] * np.eye(3)


def acting_inverse(moments: Floats) -> Floats:
    """1/I_i for integrators; the zero moment of a linear rotor is replaced by the other one; 0 for an atom.

    Without momentum about its axis a linear rotor moves exactly like a sphere of that moment: L is constant in the body, and the body
    rotates about it.
    """
    largest = np.max(moments, axis=-1, keepdims=True)
    # an axis without inertia: any finite number, as its momentum is 0
    acting = np.where(moments == 0.0, largest, moments)
    return np.ascontiguousarray(np.divide(1.0, acting, out=np.zeros_like(acting), where=acting > 0.0))
