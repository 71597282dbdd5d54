"""Request and answer for the motion of a body under effects: torques, drag, drives, gyrostats, gravity, contact.

The equations are integrated by steps; free bodies have an exact motion (`rotor.classical.tumble`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.checks import require_between
from rotor.classical.bodies import NamedBody
from rotor.classical.effect import BODY_EFFECTS, DEFAULT_TOLERANCE, ClassicalEffect
from rotor.classical.euler import checked_moments, checked_momentum, checked_velocity
from rotor.classical.integrators.lie_runge_kutta import ORDER, LieRungeKutta
from rotor.classical.integrators.method import Method, Motion, integrate
from rotor.classical.motion import COHERENT, MotionTable, Units
from rotor.classical.step_errors import driven_budget, step_truncation
from rotor.classical.system import flatten_system, total_momentum
from rotor.classical.tumble import Three
from rotor.requests.budget import ErrorBudget

Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class DrivenRequest:
    """A motion under effects to compute; all fields are checked when the request is made.

    moments: (3,), principal moments. times: (n,), the start first. effects: that act. angular_velocity: (3,) in body axes at the
    start; angular_momentum: instead, with what the effects add to it. attitude: quaternion, body to space, at the start.
    tolerance: of a step of the adaptive Runge-Kutta method, relative to |L| and to one radian. step: of a splitting of
    `order` instead, which holds no torque of the angular velocity. units: any coherent ones. axes, named: as of a `TumbleRequest`.
    """

    moments: Three
    times: tuple[float, ...]
    effects: tuple[ClassicalEffect, ...] = ()
    angular_velocity: Three | None = None
    angular_momentum: Three | None = None
    attitude: Four = (1.0, 0.0, 0.0, 0.0)
    tolerance: float = DEFAULT_TOLERANCE
    step: float | None = None
    order: int = 4
    units: Units = COHERENT
    axes: tuple[str, str, str] = ("1", "2", "3")
    named: NamedBody | None = None

    def __post_init__(self) -> None:
        moments = checked_moments(self.moments)
        require_between("tolerance", self.tolerance, 0.0, 1.0)
        if (self.angular_velocity is None) == (self.angular_momentum is None):
            raise ValueError("angular_velocity, angular_momentum: give one of them")
        if len(self.times) < 2 or not np.isfinite(self.times).all():
            raise ValueError("times: expected at least two finite times, the start first")
        if not (np.all(np.diff(self.times) > 0.0) or np.all(np.diff(self.times) < 0.0)):
            raise ValueError("times: expected times that all increase, or all decrease, without repetition")
        if abs(float(np.linalg.norm(self.attitude)) - 1.0) > 1e-6:
            raise ValueError(f"attitude: {self.attitude}: expected a unit quaternion, scalar first")
        if not np.isfinite(self.angular_velocity or self.angular_momentum).all():  # type: ignore[arg-type]
            raise ValueError("angular_velocity, angular_momentum: expected three finite numbers")
        self._check_step()
        if self.angular_velocity is not None:
            checked_velocity(self.angular_velocity, moments)
        checked_momentum(self.momentum, moments)

    def _check_step(self) -> None:
        """Refuse effects that a splitting cannot treat, and invalid steps or orders."""
        system = flatten_system(self.moments, self.effects)
        if self.step is not None and (system.needs_velocity or system.added):
            raise ValueError(
                "step: a splitting holds no torque of the angular velocity (drag) and no rolling; leave the step out: the "
                "adaptive method handles them"
            )
        _ = self.method

    @property
    def method(self) -> Method:
        """The integrator of the motion."""
        if self.step is None:
            return LieRungeKutta(self.tolerance)
        from rotor.classical.integrators.splitting import SymmetricTopSplitting

        return SymmetricTopSplitting(self.step, self.order)

    @property
    def stepping(self) -> str:
        """The integrator in words."""
        if self.step is None:
            return f"Runge-Kutta of order {ORDER}, adaptive, tolerance {self.tolerance:g} of a step"
        return f"splitting of order {self.order}, step {self.step:g}"

    @property
    def momentum(self) -> Floats:
        """L (3,) in body axes at the start."""
        if self.angular_momentum is not None:
            return np.array(self.angular_momentum)
        assert self.angular_velocity is not None  # one of the two is given
        return np.asarray(total_momentum(self.angular_velocity, self.moments, self.effects, self.attitude))


@dataclass(frozen=True)
class DrivenAnswer:
    """The motion that a request asked for."""

    request: DrivenRequest
    motion: Motion

    @property
    def table(self) -> MotionTable:
        """The motion as a table."""
        return MotionTable.from_motion(self.motion, self.request.units, rates=True)

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the attitude, in rad, at the worst of the times; a short motion is repeated with finer steps for it."""
        request = self.request
        compiled = flatten_system(request.moments, request.effects).compiled is not None
        tolerance = None if request.step is not None else request.tolerance
        return driven_budget(self.motion, step_truncation(self.motion, compiled, tolerance, self._finer))

    def _finer(self, setting: float) -> Motion:
        """The motion with another tolerance, or with the fixed step divided by `setting`."""
        step = self.request.step
        if step is None:
            return driven_motion(replace(self.request, tolerance=setting))
        return driven_motion(replace(self.request, step=step / setting))

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table.

        energy_drift: largest change of the energy over the largest kinetic energy if all effects conserve energy, otherwise None.
        """
        energy = self.motion.energy
        conserved = all(effect.conserves_energy for effect in self.request.effects)
        names = self.request.units
        # ½ I ω² of the largest rotation
        size = 0.5 * float(np.max(np.sum(np.array(self.request.moments) * self.motion.omega**2, axis=-1)))
        return {
            "units": {"time": names.time, "angular_momentum": names.angular_momentum, "energy": names.energy},
            "axes": list(self.request.axes),
            "moments": list(self.request.moments),
            "effects": [BODY_EFFECTS.line(effect) for effect in self.request.effects],
            "method": self.request.stepping,
            "steps": self.motion.steps,
            "energy_first": float(energy[0]),
            "energy_last": float(energy[-1]),
            "energy_drift": float(np.ptp(energy)) / size if conserved and size else None,
            "last_time": float(self.motion.times[-1]),
            "errors": self.errors.as_json(),
        }


def answer_driven(request: DrivenRequest) -> DrivenAnswer:
    """The motion of a request.

    Raises ValueError for a method that cannot treat an effect, and for a motion that does not stay finite.

    >>> from rotor.classical.effects.drag import LinearDrag
    >>> request = DrivenRequest((1.0, 1.0, 1.0), (0.0, 1.0), (LinearDrag([1, 1, 1]),), angular_velocity=(0.0, 0.0, 1.0))
    >>> round(float(answer_driven(request).table.columns["w3"][-1]), 9)  # exp(-1)
    0.367879441
    """
    return DrivenAnswer(request, driven_motion(request))


def driven_motion(request: DrivenRequest) -> Motion:
    """The motion alone."""
    method, start = request.method, request.momentum
    return integrate(method, request.moments, start, request.times, request.attitude, request.effects)
