"""An adaptive Runge-Kutta method on the rotation group, for drag, feedback and anything else that is not Hamiltonian.

Order: 8, with the step chosen from embedded results of order 5 and 3 (the tableau of DOP853). Keeps: the unit
quaternion, and L in space exactly where there is no torque (it is L in space that is integrated); the energy only to
the tolerance, with a linear drift. Cost: 12 evaluations a step in numpy, about 1 ms a step for one body and little more
for a hundred; all bodies of one call share the step. Sources: H. Munthe-Kaas, BIT 38, 92 (1998); the tableau,
E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotor.classical.integrators import Method
from rotor.classical.system import System, acting_inverse
from rotor.rotations import Array, conjugate, exp, multiply, rotate

SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
SMALLEST_STEP = 1e-13  # of the interval between two times asked for
SERIES_BELOW = 1e-2  # rad: below this angle (1 - (θ/2) cot(θ/2))/θ² is summed as a series


@dataclass(frozen=True)
class LieRungeKutta(Method):
    """Steps of order 8 with the local error per step held below tolerance x (|L| of the body, one radian).

    `fixed_step` turns the control off and takes steps of that length (the last of an interval shorter): for measuring
    the order.

    >>> from rotor.classical.drag import LinearDrag
    >>> from rotor.classical.integrators import integrate
    >>> motion = integrate(LieRungeKutta(), [1, 1, 1], [0, 0, 1], [0.0, 1.0], effects=[LinearDrag([1, 1, 1])])
    >>> float(motion.momentum[-1, 2].round(10))  # exp(-1)
    0.3678794412
    """

    tolerance: float = 1e-11
    fixed_step: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"the tolerance is a number between 0 and 1; got {self.tolerance!r}")
        if self.fixed_step is not None and not self.fixed_step > 0.0:
            raise ValueError(f"a fixed step is a positive time; got {self.fixed_step!r}")

    def states(self, system: System, momentum: Array, attitude: Array, times: Array) -> tuple[Array, Array, int]:
        """Steps that end at each of the times."""
        space, q = rotate(attitude, momentum), attitude
        out, attitudes, taken = [momentum], [attitude], 0
        step = self.fixed_step or abs(self._first_step(system, float(times[0]), momentum))
        for start, stop in pairwise(times):
            space, q, step, steps = self._to(system, (float(start), float(stop)), space, q, step)
            taken += steps
            out.append(rotate(conjugate(q), space))
            attitudes.append(q)
        return np.stack(out), np.stack(attitudes), taken

    def _first_step(self, system: System, time: float, momentum: Array) -> float:
        """A tenth of a radian of the fastest body, or a time unit for bodies at rest; the control corrects it."""
        fastest = float(np.max(np.linalg.norm(system.omega(time, momentum), axis=-1)))
        return 0.1 / fastest if fastest > 0.0 else 1.0

    def _to(
        self, system: System, span: tuple[float, float], space: Array, q: Array, step: float
    ) -> tuple[Array, Array, float, int]:
        """The state at the end of `span`, the next step and the count of steps."""
        time, end = span
        forward, smallest, steps = np.sign(end - time), SMALLEST_STEP * abs(end - time), 0
        while (end - time) * forward > smallest:
            last = step >= abs(end - time) * (1.0 - 1e-12)
            h = end - time if last else forward * step
            new_space, new_q, error = self._step(system, time, space, q, h)
            steps += 1
            if self.fixed_step is None:
                if not last or error > 1.0:
                    step = abs(h) * _factor(error)
                if not error <= 1.0:
                    _check_step(step, smallest, time)
                    continue
            time, space, q = (end if last else time + h), new_space, new_q
        return space, q, step, steps

    def _step(self, system: System, time: float, space: Array, q: Array, h: float) -> tuple[Array, Array, float]:
        """L in space and attitude after one step, and the error estimate in units of the tolerance."""
        from scipy.integrate import DOP853

        slopes_l, slopes_u = np.empty((12, *space.shape)), np.empty((12, *space.shape))
        for stage in range(12):
            row = DOP853.A[stage, :stage]
            u = h * np.tensordot(row, slopes_u[:stage], axes=1)
            momentum = space + h * np.tensordot(row, slopes_l[:stage], axes=1)
            rates = _rates(system, time + DOP853.C[stage] * h, momentum, multiply(q, exp(u)), u)
            slopes_l[stage], slopes_u[stage] = rates
        change = h * np.tensordot(DOP853.B, slopes_l, axes=1)
        turn = h * np.tensordot(DOP853.B, slopes_u, axes=1)
        size = np.linalg.norm(space, axis=-1, keepdims=True) + np.linalg.norm(change, axis=-1, keepdims=True)
        scaled = np.concatenate([slopes_l / np.where(size > 0.0, size, 1.0), slopes_u], axis=-1)
        error = _error(scaled, h, DOP853.E3[:12], DOP853.E5[:12]) / self.tolerance
        return space + change, multiply(q, exp(turn)), error


def _rates(system: System, time: float, space: Array, q: Array, u: Array) -> tuple[Array, Array]:
    """dL/dt in space and du/dt for q = q_n exp(u)."""
    momentum = rotate(conjugate(q), space)
    omega = np.asarray((momentum - system.inner_momentum(time)) * acting_inverse(system.moments(time)))
    torque = rotate(q, system.torque(time, q, omega)) if system.torques else np.zeros_like(space)
    return torque, _turning(u, omega)


def _turning(u: Array, omega: Array) -> Array:
    """du/dt = ω + ½ u x ω + (1 - (θ/2) cot(θ/2))/θ² u x (u x ω), θ = |u|: the inverse of the derivative of exp."""
    theta2 = np.sum(u * u, axis=-1, keepdims=True)
    theta = np.sqrt(theta2)
    large = theta > SERIES_BELOW
    half = 0.5 * np.where(large, theta, 1.0)
    closed = (1.0 - half / np.tan(half)) / np.where(large, theta2, 1.0)
    series = 1.0 / 12.0 + theta2 / 720.0 + theta2**2 / 30240.0
    once = np.cross(u, omega)
    return np.asarray(omega + 0.5 * once + np.where(large, closed, series) * np.cross(u, once))


def _error(slopes: Array, h: float, third: Array, fifth: Array) -> float:
    """The estimate of Hairer, Nørsett and Wanner, |e5|²/√(|e5|² + 0.01 |e3|²), of the worst body."""
    e5 = np.sum(np.tensordot(fifth, slopes, axes=1) ** 2, axis=-1)
    e3 = np.sum(np.tensordot(third, slopes, axes=1) ** 2, axis=-1)
    both = np.sqrt(e5 + 0.01 * e3)
    return float(np.max(abs(h) * np.divide(e5, both, out=np.zeros_like(both), where=both > 0.0)))


def _factor(error: float) -> float:
    """By how much to change the step for an error estimate, of order 8, in units of the tolerance."""
    if error == 0.0:
        return GROW
    return float(np.clip(SAFETY * error ** (-1.0 / 8.0), SHRINK, GROW)) if np.isfinite(error) else SHRINK


def _check_step(step: float, smallest: float, time: float) -> None:
    if step < smallest:
        raise ValueError(
            f"no step is short enough at time {time:g}: an effect is discontinuous or grows without bound there; "
            "end the motion before it, or loosen the tolerance"
        )
