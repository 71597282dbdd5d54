"""Compiled steps of the Lie-group Runge-Kutta method for bodies under the torques of `rotor.classical.torque_form`.

The plain form is `lie_runge_kutta.py`; the order of operations within sums differs, so that both agree to round-off. All bodies of
a call share the step. The stages are inlined: function calls took a third longer.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical.integrators._attitude_kernels import ahead, half_angle_terms, rotation_vector_rate
from rotor.classical.integrators._rolling_kernels import rolling_omega, rolling_torque
from rotor.classical.integrators._torque_kernels import torque_at
from rotor.geometry._kernels import conjugate, exponential, product, turned
from rotor.kernels import kernel

STAGES = 12


@kernel(inline="always")
def _carried(slopes: Floats, weights: Floats, row: int, stages: int, h: float, out: Floats) -> None:
    """out (n, 6) = h Σ weights[row] slopes over the first `stages`."""
    for i in range(out.shape[0]):
        a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for s in range(stages):
            w = weights[row, s]
            if w != 0.0:
                a += w * slopes[s, i, 0]
                b += w * slopes[s, i, 1]
                c += w * slopes[s, i, 2]
                d += w * slopes[s, i, 3]
                e += w * slopes[s, i, 4]
                f += w * slopes[s, i, 5]
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = h * a, h * b, h * c, h * d, h * e, h * f


@kernel(inline="always")
def _rate(form: Any, inverse: Floats, time: float, state: Any, change: Any, out: Any, stage: int, i: int) -> None:
    """dL/dt in space and du/dt of body i into out[stage, i]; state: L in space and attitude before the step."""
    codes, parameters, inner = form
    u = (change[i, 3], change[i, 4], change[i, 5])
    cosine, half_sinc, factor = half_angle_terms(u)
    q = product((state[i, 3], state[i, 4], state[i, 5], state[i, 6]), exponential(cosine, half_sinc, u))
    m = turned(conjugate(q), (state[i, 0] + change[i, 0], state[i, 1] + change[i, 1], state[i, 2] + change[i, 2]))
    omega = (
        (m[0] - inner[0]) * inverse[i, 0],
        (m[1] - inner[1]) * inverse[i, 1],
        (m[2] - inner[2]) * inverse[i, 2],
    )
    torque = turned(q, torque_at(codes, parameters, time, q, omega))
    rate = rotation_vector_rate(u, omega, factor)
    for k in range(3):
        out[stage, i, k], out[stage, i, 3 + k] = torque[k], rate[k]


@kernel()
def _rolling_rate(
    forms: Any, inverse: Floats, time: float, state: Any, change: Any, out: Any, stage: int, i: int
) -> None:
    """Rates of a body that rolls; forms: the parameters of its contacts beside those of `_rate`."""
    rolling, (codes, parameters, inner) = forms
    u = (change[i, 3], change[i, 4], change[i, 5])
    cosine, half_sinc, factor = half_angle_terms(u)
    q = product((state[i, 3], state[i, 4], state[i, 5], state[i, 6]), exponential(cosine, half_sinc, u))
    m = turned(conjugate(q), (state[i, 0] + change[i, 0], state[i, 1] + change[i, 1], state[i, 2] + change[i, 2]))
    relative = m[0] - inner[0], m[1] - inner[1], m[2] - inner[2]
    omega = rolling_omega(rolling, q, relative, (inverse[i, 0], inverse[i, 1], inverse[i, 2]))
    rolling_part, others = rolling_torque(rolling, q, omega), torque_at(codes, parameters, time, q, omega)
    torque = turned(q, (rolling_part[0] + others[0], rolling_part[1] + others[1], rolling_part[2] + others[2]))
    rate = rotation_vector_rate(u, omega, factor)
    for k in range(3):
        out[stage, i, k], out[stage, i, 3 + k] = torque[k], rate[k]


@kernel(fastmath={"contract"})
def _error(slopes: Floats, h: float, third: Floats, fifth: Floats, state: Floats, change: Floats) -> float:
    """The estimate |h| |e5|²/√(|e5|² + 0.01 |e3|²) of the worst body, momenta over |L| + |change of L|."""
    worst = 0.0
    for i in range(state.shape[0]):
        size = math.sqrt(state[i, 0] ** 2 + state[i, 1] ** 2 + state[i, 2] ** 2)
        size += math.sqrt(change[i, 0] ** 2 + change[i, 1] ** 2 + change[i, 2] ** 2)
        five, three = 0.0, 0.0
        for k in range(6):
            e5, e3 = 0.0, 0.0
            for s in range(STAGES):
                e5 += fifth[s] * slopes[s, i, k]
                e3 += third[s] * slopes[s, i, k]
            scale = 1.0 / size if k < 3 and size > 0.0 else 1.0
            five += (scale * e5) ** 2
            three += (scale * e3) ** 2
        both = math.sqrt(five + 0.01 * three)  # DOP853's error: the estimate of order 5, damped by that of order 3
        error = abs(h) * five / both if both > 0.0 else 0.0 * both  # 0 of no slopes stays 0, nan stays nan
        if not error <= worst:  # nan counts as the worst
            worst = error
    return worst


@kernel(fastmath={"contract"})
def _stepped(
    form: Any, rolling: Any, inverse: Floats, tableau: Any, time: float, h: float, state: Floats, work: Any
) -> float:
    """One step: work[1] (n, 6) is then the change of L in space and u, and the error estimate is returned.

    rolling: None without rolling; the branch is chosen at compile time.
    """
    a, b, c, third, fifth = tableau
    slopes, change = work
    for stage in range(STAGES):
        _carried(slopes, a, stage, stage, h, change)
        if rolling is None:
            for i in range(state.shape[0]):
                _rate(form, inverse, time + c[stage] * h, state, change, slopes, stage, i)
        else:
            for i in range(state.shape[0]):
                _rolling_rate((rolling, form), inverse, time + c[stage] * h, state, change, slopes, stage, i)
    _carried(slopes, b, 0, STAGES, h, change)
    return _error(slopes, h, third, fifth, state, change)


@kernel(fastmath={"contract"})
def _accept(state: Floats, change: Floats) -> None:
    for i in range(state.shape[0]):
        q = ahead((state[i, 3], state[i, 4], state[i, 5], state[i, 6]), (change[i, 3], change[i, 4], change[i, 5]))
        for k in range(3):
            state[i, k] += change[i, k]
        state[i, 3], state[i, 4], state[i, 5], state[i, 6] = q


@kernel(fastmath={"contract"})
def _next_factor(error: float, control: Any) -> Any:
    """Factor for the next step; control: tolerance, SHRINK, GROW, SAFETY, order."""
    _, shrink, grow, safety, order = control
    if error == 0.0:
        return grow
    # an infinite error: the step shrinks as far as it may
    factor = safety * error ** (-1.0 / order) if math.isfinite(error) else shrink
    return min(grow, max(shrink, factor))


@kernel(nogil=True)
def to_time(
    form: Any, rolling: Any, inverse: Floats, tableau: Any, control: Any, span: Any, state: Floats, step: float
) -> Any:
    """Propagate state (n, 7), L in space and attitude, from span[0] to span[1]; return next step, step count, time reached, success.

    span[2]: the smallest step; success is False if no step is short enough. span[3]: the largest number of steps, after which the time
    may be less than span[1]. control[0]: tolerance, 0 for a fixed step.
    """
    time, end, smallest, most = span
    work = np.zeros((STAGES, state.shape[0], 6)), np.zeros((state.shape[0], 6))
    forward, steps = (1.0 if end > time else -1.0), 0
    while (end - time) * forward > smallest and steps < most:
        # a step that nearly reaches the end ends there, so that no sliver is left
        last = step >= abs(end - time) * (1.0 - 1e-12)
        h = end - time if last else forward * step
        error = _stepped(form, rolling, inverse, tableau, time, h, state, work)
        steps += 1
        if control[0] > 0.0:
            error /= control[0]
            if not last or not error <= 1.0:
                step = abs(h) * _next_factor(error, control)
            if not error <= 1.0:
                if step < smallest:
                    return step, steps, time, False
                continue
        _accept(state, work[1])
        time = end if last else time + h
    return step, steps, (end if (end - time) * forward <= smallest else time), True


@kernel(nogil=True)
def to_times(
    form: Any,
    rolling: Any,
    inverse: Floats,
    tableau: Any,
    control: Any,
    times: Any,
    path: Floats,
    state: Floats,
    place: Any,
) -> Any:
    """Fill rows of path (t, n, 7), L in body axes and attitude, while steps are left; state (n, 7): L in space and attitude.

    times: (times (t,), the smallest step of each interval (t - 1,)). place: (interval, time in it, next step, most steps). Returns
    `place` without its last entry, the count of steps, and False if no step is short enough.
    """
    grid, smallest = times
    row, time, step, most = place
    total = 0
    while row < grid.shape[0] - 1 and total < most:
        step, steps, time, good = to_time(
            form, rolling, inverse, tableau, control, (time, grid[row + 1], smallest[row], most - total), state, step
        )
        total += steps
        if not good:
            return row, time, step, total, False
        if time != grid[row + 1]:
            break
        row += 1
        for i in range(state.shape[0]):
            q = (state[i, 3], state[i, 4], state[i, 5], state[i, 6])
            m = turned(conjugate(q), (state[i, 0], state[i, 1], state[i, 2]))
            path[row, i, 0], path[row, i, 1], path[row, i, 2] = m
            for k in range(3, 7):
                path[row, i, k] = state[i, k]
    return row, time, step, total, True
