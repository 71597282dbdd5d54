"""Compiled orbits and tangent vectors of quadratic flows, dy/dt = c + A y + Q(y, y), by DOP853.

Bodies with linear drag or feedback, constant body torques and internal rotors have such flows. Tangent vectors are the
columns of a matrix next to the state; the mean of the trace is integrated with them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.classical.exponents import STAGES
from rotor.kernels import kernel


@kernel()
def _slopes(form: Any, table: Floats, out: Floats) -> None:
    """d/dt of table (d, 1 + m) = (state, tangent vectors) and of the integral of the trace, in row d."""
    constant, linear, quadratic = form
    d, columns = linear.shape[0], table.shape[1]
    trace = 0.0
    for i in range(d):
        rate = constant[i]
        for c in range(1, columns):
            out[i, c] = 0.0
        for j in range(d):
            twice = 0.0
            for k in range(d):
                twice += quadratic[i, j, k] * table[k, 0]
            rate += (linear[i, j] + twice) * table[j, 0]
            slope = linear[i, j] + 2.0 * twice
            trace += slope if i == j else 0.0
            for c in range(1, columns):
                out[i, c] += slope * table[j, c]
        out[i, 0] = rate
    out[d, 0] = trace


@kernel()
def _stepped(form: Any, tableau: Any, table: Floats, h: float, k: Floats, work: Floats) -> float:
    """Try a step of length h; it is made in place if the returned error estimate is at most 1."""
    a, b, e3, e5, tolerance = tableau
    for stage in range(STAGES):
        work[:] = table
        for s in range(stage):
            if a[stage, s] != 0.0:
                work += h * a[stage, s] * k[s]
        _slopes(form, work, k[stage])
    work[:] = table
    fifth, third = 0.0, 0.0
    for i in range(table.shape[0] - 1):
        for c in range(table.shape[1]):
            five, three = 0.0, 0.0
            for s in range(STAGES):
                work[i, c] += h * b[s] * k[s, i, c]
                five += e5[s] * k[s, i, c]
                three += e3[s] * k[s, i, c]
            scale = tolerance * (1.0 + abs(table[i, c]))
            fifth += (five / scale) ** 2
            third += (three / scale) ** 2
    # DOP853's error: the estimate of order 5, damped by that of order 3 (Hairer, Nørsett and Wanner)
    both = math.sqrt(fifth + 0.01 * third)
    error = h * fifth / both if both > 0.0 else 0.0
    if error <= 1.0:
        for s in range(STAGES):
            work[-1, 0] += h * b[s] * k[s, -1, 0]
        table[:] = work
    return error


@kernel()
def _orthogonal(table: Floats, grown: Floats) -> None:
    """Gram-Schmidt of the tangent vectors, in place; logarithms of their lengths are added to `grown`."""
    d = table.shape[0] - 1
    for c in range(1, table.shape[1]):
        for b in range(1, c):
            overlap = 0.0
            for i in range(d):
                overlap += table[i, b] * table[i, c]
            for i in range(d):
                table[i, c] -= overlap * table[i, b]
        square = 0.0
        for i in range(d):
            square += table[i, c] ** 2
        grown[c - 1] += 0.5 * math.log(square)  # ln of the length: half of the ln of its square
        for i in range(d):
            table[i, c] /= math.sqrt(square)


@kernel(nogil=True)
def follow(
    form: Any, tableau: Any, table: Floats, interval: float, intervals: int, first: float, grown: Floats
) -> tuple[float, int]:
    """Advance by `intervals` intervals, orthogonalising after each; return the next step (0 if none suffices) and the number of steps."""
    k, work = np.zeros((STAGES, *table.shape)), np.empty_like(table)
    step, steps = first, 0
    for _ in range(intervals):
        left = interval
        while left > 0.0:
            h = min(step, left)
            error = _stepped(form, tableau, table, h, k, work)
            if error <= 1.0:
                left = left - h if h < left else 0.0
                steps += 1
            # the error grows with h⁸: h is scaled by error^(-1/8), with a margin of 0.9
            grow = 0.9 * max(error, 1e-8) ** (-0.125)
            if error > 1.0 or h == step:
                # grow is nan after an overflow: a much shorter step
                step = h * min(5.0, max(0.2, grow)) if grow == grow else 0.2 * h
            if step < 1e-12 * interval:  # the step no longer advances: the flow diverges
                return 0.0, steps
        _orthogonal(table, grown)
    return step, steps
