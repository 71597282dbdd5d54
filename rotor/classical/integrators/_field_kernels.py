"""Compiled steps of very many bodies under torques of attitude and time, in blocks of 128 as in `_kernels.py`.

A block is `RUNS` runs of 128 numbers in one array: L and the quaternion, in a frame whose axes are (outer, inner, sphere) of
`strang.py`; the rates of the three flows; the torque; and the square of half the largest rotation so far. In a field L is not
constant in space, so that the sphere's flow, a rotation about L, is applied in each step; its sine and cosine are polynomials of the
squared angle.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical._kernels import symmetric_steps
from rotor.classical.integrators._kernels import FINITE, LANES, WHOLE_STEP, sine_cosine, sine_series
from rotor.classical.integrators._torque_kernels import swing, times_matrix, turning_axis
from rotor.classical.torque_form import BODY_FIXED, LEVER, SPACE_FIXED, TURNING
from rotor.geometry._kernels import conjugate, cross, exponential, product, quaternion_at, turned, vector_at
from rotor.kernels import kernel

RUNS = 14
Q, OUTER, INNER, SPHERE, TORQUE, WIDEST = 3 * LANES, 7 * LANES, 8 * LANES, 9 * LANES, 10 * LANES, 13 * LANES


@kernel(inline="always")
def _quaternion(row: Any, i: int) -> Any:
    return row[Q + i], row[Q + LANES + i], row[Q + 2 * LANES + i], row[Q + 3 * LANES + i]


@kernel(inline="always")
def _place(row: Any, i: int, q: Any) -> None:
    row[Q + i], row[Q + LANES + i], row[Q + 2 * LANES + i], row[Q + 3 * LANES + i] = q


@kernel(inline="always")
def _seen_turned(row: Any, a: int, b: int, s: float, c: float) -> None:
    """Components a, b of L from a body that turned by the angle of half-angle sine s, cosine c about the third axis."""
    x, y, sine, versed = row[a], row[b], 2.0 * s * c, 2.0 * s * s
    row[a], row[b] = x + (sine * y - versed * x), y - (sine * x + versed * y)


@kernel(fastmath=FINITE, error_model="numpy")
def _inner_turn(row: Floats, time: float) -> None:
    """Each body turns about the second axis of its frame by rate L2 time."""
    for i in range(LANES):
        half = 0.5 * time * row[INNER + i] * row[LANES + i]
        s, c = sine_cosine(half)
        _place(row, i, product(_quaternion(row, i), (c, 0.0, s, 0.0)))
        _seen_turned(row, 2 * LANES + i, i, s, c)
        # the largest half angle, squared: checked against the reach of the polynomials
        row[WIDEST + i] = max(row[WIDEST + i], half * half)


@kernel(fastmath=FINITE, error_model="numpy")
def _outer_turn(row: Floats, time: float) -> None:
    """Turns of all bodies about the first axis."""
    for i in range(LANES):
        half = 0.5 * time * row[OUTER + i] * row[i]
        s, c = sine_cosine(half)
        _place(row, i, product(_quaternion(row, i), (c, s, 0.0, 0.0)))
        _seen_turned(row, LANES + i, 2 * LANES + i, s, c)
        row[WIDEST + i] = max(row[WIDEST + i], half * half)


@kernel()
def field_turns(row: Floats, inner: float, outer: float) -> None:
    """The inner turn of a block for a time, then the outer one."""
    if inner != 0.0:
        _inner_turn(row, inner)
    _outer_turn(row, outer)


@kernel(fastmath=FINITE, error_model="numpy")
def _sphere(row: Floats, step: float) -> None:
    """The sphere's flow: each body turns about L by |L| step / I."""
    for i in range(LANES):
        half = 0.5 * step * row[SPHERE + i]
        x, y, z = half * row[i], half * row[LANES + i], half * row[2 * LANES + i]
        square = x * x + y * y + z * z
        s, c = sine_series(square)
        _place(row, i, product(_quaternion(row, i), exponential(1.0 - square * c, 1.0 - square * s, (x, y, z))))
        row[WIDEST + i] = max(row[WIDEST + i], square)


@kernel(inline="always")
def _gain(row: Any, i: int, t: Any) -> None:
    row[TORQUE + i] += t[0]
    row[TORQUE + LANES + i] += t[1]
    row[TORQUE + 2 * LANES + i] += t[2]


@kernel(fastmath=FINITE, error_model="numpy")
def _torque(codes: Any, p: Floats, time: float, row: Floats) -> None:
    """Sum of the torques of `torque_form.py` on a block."""
    for i in range(3 * LANES):
        row[TORQUE + i] = 0.0
    for k in range(codes.shape[0]):
        code = codes[k]
        if code == LEVER:
            arm, force = (p[k, 0], p[k, 1], p[k, 2]), (p[k, 3], p[k, 4], p[k, 5])
            for i in range(LANES):
                _gain(row, i, cross(arm, turned(conjugate(_quaternion(row, i)), force)))
        elif code == BODY_FIXED:
            now = swing(p, k, time)
            for i in range(LANES):
                _gain(row, i, (now * p[k, 0], now * p[k, 1], now * p[k, 2]))
        elif code == SPACE_FIXED:
            now = swing(p, k, time)
            vector = (now * p[k, 0], now * p[k, 1], now * p[k, 2])
            for i in range(LANES):
                _gain(row, i, turned(conjugate(_quaternion(row, i)), vector))
        else:
            vector = turning_axis(p, k, time) if code == TURNING else (p[k, 9], p[k, 10], p[k, 11])
            for i in range(LANES):
                field = turned(conjugate(_quaternion(row, i)), vector)
                _gain(row, i, cross(times_matrix(p, k, field), field))


@kernel(fastmath=FINITE, error_model="numpy")
def _kick(row: Floats, time: float) -> None:
    for i in range(3 * LANES):
        row[i] += time * row[TORQUE + i]


@kernel(nogil=True, fastmath={"contract"}, error_model="numpy")
def advance_in_field(
    blocks: Any, form: Any, clock: Any, rates: Floats, axes: Floats, state: Any, widest: Floats
) -> None:
    """Steps of the bodies in blocks first to last - 1, in place; widest (n,): half of the widest turn of each body.

    form: codes and parameters in the frame. clock: time, step, count of steps. rates (n, 3): of the inner and the outer turn
    and of the sphere, per L. axes (n, 4): quaternions from body axes to the frame. state: momentum (n, 3), attitude (n, 4).
    """
    (first, last), (codes, parameters), (start, step, steps), (momentum, attitude) = blocks, form, clock, state
    row = np.zeros(RUNS * LANES)
    for block in range(first, last):
        begin, count = block * LANES, min(LANES, len(momentum) - block * LANES)
        for i in range(count):
            body, frame = begin + i, quaternion_at(axes, begin + i)
            row[i], row[LANES + i], row[2 * LANES + i] = turned(frame, vector_at(momentum, body))
            _place(row, i, product(quaternion_at(attitude, body), conjugate(frame)))
            row[INNER + i], row[OUTER + i], row[SPHERE + i] = vector_at(rates, body)
            row[WIDEST + i] = 0.0
        _torque(codes, parameters, start, row)
        _kick(row, 0.5 * step)  # half a kick at both ends, whole kicks between: each pair of halves is one
        for k in range(1, steps + 1):
            symmetric_steps(field_turns, row, WHOLE_STEP, step, 1)
            _sphere(row, step)
            _torque(codes, parameters, start + k * step, row)
            _kick(row, step if k < steps else 0.5 * step)
        for i in range(count):
            body, frame = begin + i, quaternion_at(axes, begin + i)
            m = turned(conjugate(frame), (row[i], row[LANES + i], row[2 * LANES + i]))
            q = product(_quaternion(row, i), frame)
            for k in range(3):
                momentum[body, k] = m[k]
            for k in range(4):
                attitude[body, k] = q[k]
            widest[body] = math.sqrt(row[WIDEST + i])
