"""Euler's equations with the effects they are given: what every integrator steps.

The list of effects is sorted once, by kind; a kind that is absent is an empty tuple and costs nothing later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import ClassicalEffect, InertiaChange, InnerMomentum, Torque
from rotor.classical.euler import checked_moments, gyroscopic_term, inverse_moments


@dataclass(frozen=True)
class System:
    """Moments (n, 3) of n bodies and the effects that act on all of them, by kind; see `rotor.classical.effect`."""

    start_moments: Floats
    start_inverse: Floats
    start_acting: Floats
    torques: tuple[Torque, ...]
    inner: tuple[InnerMomentum, ...]
    inertia: InertiaChange | None

    @property
    def free(self) -> bool:
        """Whether no effect is present."""
        return not (self.torques or self.inner or self.inertia)

    @property
    def needs_velocity(self) -> bool:
        """Whether a torque depends on ω, so that no splitting into drifts and kicks exists."""
        return any(effect.needs_velocity for effect in self.torques)

    @property
    def needs_attitude(self) -> bool:
        """Whether a torque depends on the attitude; otherwise dL/dt follows from L and time alone."""
        return any(effect.needs_attitude for effect in self.torques)

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
        """Sum h (3,) of the inner momenta, 0.0 where there is none."""
        return sum((effect.inner_momentum(time) for effect in self.inner), start=0.0)

    def omega(self, time: float, momentum: Floats) -> Floats:
        """ω = (L - h)/I(t) in body axes, (n, 3)."""
        relative = momentum - self.inner_momentum(time) if self.inner else momentum
        return np.asarray(relative * self.inverse(time))

    def torque(self, time: float, attitude: Floats, omega: Floats) -> Floats:
        """Sum of the torques in body axes, (n, 3)."""
        total = self.torques[0].torque(time, attitude, omega)
        for effect in self.torques[1:]:
            total = total + effect.torque(time, attitude, omega)
        return total

    def momentum_rate(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """dL/dt = L x ω + Σ torques in body axes, (n, 3)."""
        omega = self.omega(time, momentum)
        rate = np.stack(gyroscopic_term(*np.moveaxis(momentum, -1, 0), *np.moveaxis(omega, -1, 0)), axis=-1)
        return rate + self.torque(time, attitude, omega) if self.torques else rate

    def energy(self, time: float, momentum: Floats, attitude: Floats) -> Floats:
        """½ Σ (L_i - h_i)²/I_i + potential energies, (n,)."""
        relative = momentum - self.inner_momentum(time)
        total = 0.5 * np.sum(relative * self.omega(time, momentum), axis=-1)
        for effect in self.torques:
            total = total + effect.potential_energy(time, attitude)
        return np.asarray(total)


def system_of(moments: ArrayLike, effects: Sequence[ClassicalEffect] = ()) -> System:
    """The system of bodies with principal moments (..., 3), flattened to (n, 3), under a list of effects.

    >>> from rotor.classical.effects.gyrostat import SpinningRotor
    >>> system = system_of([1.0, 2.0, 4.0], [SpinningRotor([0, 0, 1.0])])
    >>> system.omega(0.0, np.array([[1.0, 2.0, 3.0]])).tolist()
    [[1.0, 1.0, 0.5]]
    """
    kinds = (Torque, InnerMomentum, InertiaChange)
    for effect in effects:
        if not isinstance(effect, kinds):
            raise ValueError(f"{effect!r} is no classical effect; give torques, inner momenta or a change of inertia")
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
        inertia=changes[0] if changes else None,
    )


def acting_inverse(moments: Floats) -> Floats:
    """1/I_i for stepping; a linear rotor's zero moment is replaced by the other one.

    Without momentum about its own axis a linear rotor moves exactly as a sphere of that moment: L stands still in the
    body, and the body turns about it.
    """
    largest = np.max(moments, axis=-1, keepdims=True)
    return np.ascontiguousarray(1.0 / np.where(moments == 0.0, largest, moments))
