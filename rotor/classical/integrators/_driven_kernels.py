"""Compiled kicks and drifts of bodies under the torques of `rotor.classical.torque_form`, from time to time.

The plain form is `KickDrift._advance` of `method.py` with the drift of `SymmetricTopSplitting`; the order of all operations is
the same, so that both give the same numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical.integrators._step_kernels import kick_body, symmetric_drift, turn_body
from rotor.classical.integrators._torque_kernels import torque_at
from rotor.kernels import kernel

NO_OMEGA = (np.nan, np.nan, np.nan)  # torques that depend on ω are refused before


@kernel(nogil=True)
def kicked(
    form: Any,
    inverse: Floats,
    axes: Any,
    fractions: Floats,
    times: Floats,
    counts: Any,
    path: Floats,
    state: Any,
    place: Any,
) -> None:
    """Steps of equal length, counts (t - 1,) between successive times, written to path (t, n, 7), for the range `place`.

    form: codes, parameters, inner momentum. inverse, axes (n, 3): inverse moments; (outer, inner, sphere) of `strang.py`.
    state: rows (n, 7), their rounding compensation (n, 7), torques (n, 3); changed in place, so that another call can continue.
    place: range of intervals, and range of steps in each, limited to the existing steps.
    """
    codes, parameters, inner = form
    rows, carry, torques = state
    turning = inner[0] != 0.0 or inner[1] != 0.0 or inner[2] != 0.0
    whole_step = np.ones(1)
    for body in range(rows.shape[0]):
        row, lost = rows[body], carry[body]
        i0, i1, i2 = inverse[body, 0], inverse[body, 1], inverse[body, 2]
        torque = (torques[body, 0], torques[body, 1], torques[body, 2])
        for k in range(place[0], place[1]):
            step = (times[k + 1] - times[k]) / counts[k]
            if place[2] == 0:
                torque = torque_at(codes, parameters, times[k], (row[3], row[4], row[5], row[6]), NO_OMEGA)
            for s in range(place[2], min(place[3], counts[k])):
                time = times[k] + s * step
                for fraction in fractions:
                    h = fraction * step
                    half = 0.5 * h
                    kick_body(row, lost, torque, half)
                    if turning:
                        turn_body(row, lost, -half * inner[0] * i0, -half * inner[1] * i1, -half * inner[2] * i2)
                    symmetric_drift(row, lost, inverse[body], axes[body], h, whole_step, whole_step.shape[0])
                    if turning:
                        turn_body(row, lost, -half * inner[0] * i0, -half * inner[1] * i1, -half * inner[2] * i2)
                    time += h
                    torque = torque_at(codes, parameters, time, (row[3], row[4], row[5], row[6]), NO_OMEGA)
                    kick_body(row, lost, torque, half)
            for i in range(7):  # by components: slice assignments take seconds to compile
                path[k + 1, body, i] = row[i]
        torques[body, 0], torques[body, 1], torques[body, 2] = torque
