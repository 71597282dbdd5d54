"""An adaptive Runge-Kutta method on the rotation group, for drag, feedback and anything else that is not Hamiltonian.

Order: 8, with the step chosen from embedded results of order 5 and 3 (the tableau of DOP853). Conserves: the unit
quaternion, and L in space exactly where there is no torque (it is L in space that is integrated); the energy only to
the tolerance, with a linear drift. Cost: 12 evaluations a step in numpy, about 0.25 ms a step for one body and little
more for a hundred; all bodies of one call share the step. Sources: H. Munthe-Kaas, BIT 38, 92 (1998); the tableau,
E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, section II.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotor.arrays import Floats, writable
from rotor.classical.integrators.method import Method
from rotor.classical.system import System
from rotor.classical.torque_form import kernels_are_compiled
from rotor.geometry.rotations import conjugate, rotate

SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
SMALLEST_STEP = 1e-13  # of the interval between two times asked for
STAGES, ORDER = 12, 8
PLAIN_STEPS = 400  # a tenth of a second in numpy, as long as loading the compiled form of all further ones
STEPS_OF_A_CALL = 20_000  # of one body: a compiled call obeys no signal
MOST_STEPS = 3e9  # left at the present step: more than an hour of one body
ROLLING_COST = 8  # of a plain step with added inertia, 1.7 ms, beside one with torques
_TOO_SHORT = (
    "no step is short enough at time {time:g}: an effect is discontinuous or grows without bound there; "
    "end the motion before it, or loosen the tolerance"
)


_TOO_LONG = (
    "at time {time:g} about {steps:.0e} more steps are needed: an effect adds energy without bound, or the time is too long; "
    "end the motion earlier, or loosen the tolerance"
)


@dataclass(frozen=True)
class LieRungeKutta(Method):
    """Steps of order 8 with the local error per step held below tolerance x (|L| of the body, one radian).

    `fixed_step` turns the control off and takes steps of that length (the last of an interval shorter): for measuring
    the order.

    >>> from rotor.classical.effects.drag import LinearDrag
    >>> from rotor.classical.integrators.method import integrate
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

    def states(self, system: System, momentum: Floats, attitude: Floats, times: Floats) -> tuple[Floats, Floats, int]:
        """As `Method.states`, by steps that end at each of the times."""
        space, q, taken = rotate(attitude, momentum), np.array(attitude), 0
        path = np.empty((len(times), len(q), 7))
        path[0, :, :3], path[0, :, 3:] = momentum, attitude
        step = self.fixed_step or self._first_step(system, float(times[0]), momentum, attitude)
        plain_steps = PLAIN_STEPS / ROLLING_COST if system.added else PLAIN_STEPS
        most = plain_steps if system.compiled is not None and kernels_are_compiled() else np.inf
        for k, (start, stop) in enumerate(pairwise(times.tolist())):
            space, q, step, steps, reached = self._to(system, (start, stop, most - taken), space, q, step)
            taken += steps
            if reached != stop:
                rest = np.array([reached, *times[k + 1 :]])
                path[k + 1 :], steps = self._rest(system, rest, np.concatenate([space, q], axis=-1), step)
                taken += steps
                break
            path[k + 1, :, :3], path[k + 1, :, 3:] = rotate(conjugate(q), space), q
        return path[..., :3], path[..., 3:], taken

    def _rest(self, system: System, times: Floats, state: Floats, step: float) -> tuple[Floats, int]:
        """The states (t - 1, n, 7) at all times but the first, and the count of steps, by compiled calls.

        Between them, every tenth of a second or so, Python sees signals. state: (n, 7), L in space and attitude at times[0].
        """
        from scipy.integrate import DOP853

        from rotor.classical.integrators._lie_kernels import to_times

        path = np.empty((len(times), *state.shape))
        state = np.array(state)
        tableau = DOP853.A[:STAGES, :STAGES], DOP853.B[None], DOP853.C[:STAGES], DOP853.E3[:STAGES], DOP853.E5[:STAGES]
        control = (0.0 if self.fixed_step else self.tolerance, SHRINK, GROW, SAFETY, float(ORDER))
        smallest = SMALLEST_STEP * np.abs(np.diff(times))
        arrays = tuple(np.ascontiguousarray(part) for part in tableau)
        forms = system.compiled, system.rolling
        row, time, taken, most = 0, float(times[0]), 0, max(1, STEPS_OF_A_CALL // len(state))
        while row < len(times) - 1:
            place = row, time, float(step), most
            row, time, step, steps, good = to_times(
                *forms, system.start_acting, arrays, control, (times, smallest), path, state, place
            )
            taken += steps
            if not good:
                raise ValueError(_TOO_SHORT.format(time=time))
            if (left := abs(times[-1] - time) / abs(step)) > MOST_STEPS:
                raise ValueError(_TOO_LONG.format(time=time, steps=left))
        return path[1:], taken

    def _first_step(self, system: System, time: float, momentum: Floats, attitude: Floats) -> float:
        """A tenth of a radian of the fastest body, or a time unit for bodies at rest; the control corrects it."""
        fastest = float(np.max(np.linalg.norm(system.omega(time, momentum, attitude), axis=-1)))
        # a tenth of a radian: the controller finds its step within some trials
        return 0.1 / fastest if fastest > 0.0 else 1.0

    def _to(
        self, system: System, span: tuple[float, float, float], space: Floats, q: Floats, step: float
    ) -> tuple[Floats, Floats, float, int, float]:
        """The state at the end of `span` or after its number of steps, the next step, the count of steps, the time reached."""
        time, end, most = span
        forward, smallest, steps = np.sign(end - time), SMALLEST_STEP * abs(end - time), 0
        while (end - time) * forward > smallest and steps < most:
            # a step that nearly reaches the end ends there, so that no sliver is left
            last = step >= abs(end - time) * (1.0 - 1e-12)
            h = end - time if last else forward * step
            new_space, new_q, error = self._step(system, time, space, q, h)
            steps += 1
            if self.fixed_step is None:
                if not last or not error <= 1.0:
                    step = abs(h) * _factor(error)
                if not error <= 1.0:  # nan fails too: the step is repeated shorter
                    _check_step(step, smallest, time)
                    continue
            time, space, q = (end if last else time + h), new_space, new_q
        return space, q, step, steps, end if (end - time) * forward <= smallest else time

    def _step(self, system: System, time: float, space: Floats, q: Floats, h: float) -> tuple[Floats, Floats, float]:
        """L in space and attitude after one step, and the error estimate in units of the tolerance."""
        from scipy.integrate import DOP853

        from rotor.classical.integrators._attitude_kernels import placed

        slopes = np.zeros((STAGES, len(space), 6))
        flat = slopes.reshape(STAGES, -1)
        here, momentum = np.empty_like(q), np.empty_like(space)
        for stage in range(STAGES):
            change = (h * DOP853.A[stage, :stage] @ flat[:stage]).reshape(-1, 6)
            placed(q, change, space, here, momentum)
            _rates(system, time + DOP853.C[stage] * h, momentum, here, change, slopes[stage])
        change = (h * DOP853.B @ flat).reshape(-1, 6)
        placed(q, change, space, here, momentum)
        size = np.linalg.norm(space, axis=-1) + np.linalg.norm(change[:, :3], axis=-1)
        # slopes relative to L, without the error of a body at rest
        slopes[:, :, :3] /= np.where(size > 0.0, size, 1.0)[:, None]
        error = _error(slopes, h, DOP853.E3[:STAGES], DOP853.E5[:STAGES]) / self.tolerance
        return space + change[:, :3], here, error


def _rates(system: System, time: float, momentum: Floats, q: Floats, change: Floats, out: Floats) -> None:
    """dL/dt in space and du/dt, q = q_n exp(u), into out (n, 6); change (n, 6) is that of L and u since the start."""
    from rotor.classical.integrators._attitude_kernels import to_space, turning

    omega = system.stepping_omega(time, momentum, q)
    turning(change, omega, out)
    if system.torques:
        to_space(q, writable(system.torque(time, q, omega)), out)


def _error(slopes: Floats, h: float, third: Floats, fifth: Floats) -> float:
    """The estimate of Hairer, Nørsett and Wanner, |e5|²/√(|e5|² + 0.01 |e3|²), of the worst body."""
    e5 = np.sum(np.tensordot(fifth, slopes, axes=1) ** 2, axis=-1)
    e3 = np.sum(np.tensordot(third, slopes, axes=1) ** 2, axis=-1)
    both = np.sqrt(e5 + 0.01 * e3)  # DOP853's error: the estimate of order 5, damped by that of order 3
    return float(np.max(abs(h) * np.divide(e5, both, out=np.zeros_like(both), where=both != 0.0)))  # NaN stays NaN


def _factor(error: float) -> float:
    """Factor of the next step for an error estimate, of order 8, in units of the tolerance."""
    if error == 0.0:
        return GROW
    return float(np.clip(SAFETY * error ** (-1.0 / ORDER), SHRINK, GROW)) if np.isfinite(error) else SHRINK


def _check_step(step: float, smallest: float, time: float) -> None:
    if step < smallest:
        raise ValueError(_TOO_SHORT.format(time=time))
