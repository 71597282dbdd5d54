"""The exact torque-free motion of any rigid body: momentum and attitude at any time, without stepping.

The formulas stand at the head of `theta.py`. Here: input, output and accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.classical.euler import checked_moments, checked_momentum
from rotor.classical.free.theta import SEPARATRIX, STEADY, Rows, moving_rows, steady_rows
from rotor.geometry.rotations import IDENTITY, conjugate, multiply, normalised

# of the largest moment: phases about the axis of a smaller nonzero moment would not fit into two doubles
SMALLEST_MOMENT = 1e-100
SMALLEST_PART = 1e-120  # of |L|: a smaller component, not zero, would underflow when squared


@dataclass(frozen=True, eq=False, repr=False)
class FreeMotion:
    """The torque-free motion of one or many bodies, to be evaluated at any time.

    moments, momentum0, attitude0: (..., 3), (..., 3), (..., 4), body axes in the order given; the state at t = 0.
    period: (...), of the momentum in the body; infinite if it is constant, and on the separatrix.
    turning_rate: (...), mean rate, rad per time, of the rotation of the body about L in space. After one period the body
    has turned about L by this rate times the period, up to whole turns.
    steady, separatrix: (...), whether the momentum is constant in the body, or approaches the unstable axis.
    rows: the constants for the compiled evaluation.
    """

    moments: Floats
    momentum0: Floats
    attitude0: Floats
    period: Floats
    turning_rate: Floats
    steady: NDArray[np.bool_]
    separatrix: NDArray[np.bool_]
    rows: Rows

    def __repr__(self) -> str:
        if self.period.ndim:
            return f"FreeMotion({self.period.size} bodies)"
        moments, momentum = (
            ", ".join(f"{x:.6g}" for x in vector.tolist()) for vector in (self.moments, self.momentum0)
        )
        period = f"period {float(self.period):.6g}" if np.isfinite(self.period) else "no period"
        return f"FreeMotion(moments {moments}; momentum {momentum}; {period})"

    @property
    def centre_axis(self) -> NDArray[np.int64]:
        """The axis (0, 1 or 2, in the order of the moments) that L circles in the body; without meaning if steady.

        >>> int(free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]).centre_axis)
        0
        """
        return np.asarray(self.rows.axes[:, 2]).reshape(self.period.shape)

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Momentum (*bodies, *times, 3) in the body and attitude (*bodies, *times, 4), body to space, at `times`.

        Error of the attitude: about 1e-15 rad at any time until the body has turned 1e15 times. The phases are held in
        double-double, always: rates rounded to double, 1e-16 of the angle turned, would cost 2e-13 rad in one period near
        the unstable axis, and would save no time.
        Signs of q may jump between neighbouring times; `rotor.geometry.rotations.continuous` joins them.

        >>> motion = free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9])
        >>> momentum, attitude = motion.at(10.0)
        >>> momentum.round(12).tolist()
        [1.765962508518, -0.695464197033, 0.779554981482]
        """
        from rotor.classical.free._kernels import evaluate

        times = np.asarray(times, dtype=np.float64)
        if not np.all(np.isfinite(times)):
            raise ValueError("a time is not finite")
        n, flat = len(self.rows.kind), times.flatten()
        momentum, attitude = np.empty((n, flat.size, 3)), np.empty((n, flat.size, 4))
        evaluate(self.rows, flat, momentum, attitude)
        shape = (*self.period.shape, *times.shape)
        return momentum.reshape(*shape, 3), attitude.reshape(*shape, 4)


def free_motion(moments: ArrayLike, momentum0: ArrayLike, attitude0: ArrayLike = IDENTITY) -> FreeMotion:
    """The torque-free motion from principal moments (..., 3), body momentum (..., 3) and attitude (..., 4) at t = 0.

    Moments and momentum are the exact data of the motion (not ω: rounding of I ω costs 1e-16 of the angle turned). Any coherent
    units, axes in any order; shapes broadcast. Spherical, symmetric, asymmetric and linear bodies, rest, rotation about an axis and the
    separatrix are all treated exactly. The constants take some 9 ms for a single body and 8 to 18 µs per body for many, an evaluation
    about 0.12 µs.

    >>> float(free_motion([0.6, 0.8, 1.0], [1.8, 0.4, -0.9]).period)  # 4K/λ
    6.862616178058115
    """
    moments, momentum0 = checked_moments(moments), np.asarray(momentum0, dtype=np.float64)
    momentum0 = checked_momentum(momentum0, moments)
    attitude0 = normalised(attitude0)
    shape = np.broadcast_shapes(moments.shape[:-1], momentum0.shape[:-1], attitude0.shape[:-1])
    moments, momentum0 = (np.ascontiguousarray(np.broadcast_to(a, (*shape, 3))) for a in (moments, momentum0))
    attitude0 = np.ascontiguousarray(np.broadcast_to(attitude0, (*shape, 4)))
    rows = _rows(moments.reshape(-1, 3), momentum0.reshape(-1, 3))
    rows = _starting_at(rows, attitude0.reshape(-1, 4))
    steady, separatrix = rows.kind == STEADY, rows.kind == SEPARATRIX
    pace = np.abs(rows.rates[:, 0])
    # two half turns make a period; a motion without one has an infinite period
    period = np.divide(2.0, pace, out=np.full_like(pace, np.inf), where=~(steady | separatrix))
    turning = rows.rates[:, 4] * (4.0 * np.pi)
    period, turning = period.reshape(shape), turning.reshape(shape)
    return FreeMotion(
        moments, momentum0, attitude0, period, turning, steady.reshape(shape), separatrix.reshape(shape), rows
    )


def _rows(moments: Floats, momentum: Floats) -> Rows:
    """Rows of all bodies, scaled exactly (by powers of two) so that the largest moment and momentum are about 1."""
    unit_i = _power_of_two(np.max(moments, axis=-1))
    unit_m = _power_of_two(np.max(np.abs(momentum), axis=-1))  # powers of two scale without rounding
    moments, momentum = moments / unit_i[:, None], momentum / unit_m[:, None]
    steady = _stands_still(moments, momentum)
    _check_moments(moments[~steady], unit_i[~steady])
    both = _merged(
        steady, steady_rows(moments[steady], momentum[steady]), moving_rows(moments[~steady], momentum[~steady])
    )
    rates = both.rates * np.stack(
        [u for u in (unit_m / unit_i, np.ones_like(unit_m), unit_m / unit_i) for _ in "hl"], -1
    )
    if not np.all(np.abs(rates) < 1e300):
        raise ValueError(
            "a body rotates faster than double precision can represent; choose units in which |L|/I is moderate"
        )
    series = both.series.copy()
    series[:, :3] *= unit_m[:, None]
    return both._replace(rates=rates, series=series, momentum0=momentum * unit_m[:, None])


def _merged(first: NDArray[np.bool_], yes: Rows, no: Rows) -> Rows:
    """A table with rows of `yes` where `first` holds, otherwise of `no`."""
    columns = []
    for a, b in zip(yes, no, strict=True):
        column = np.empty((len(first), *a.shape[1:]), dtype=b.dtype)
        column[first], column[~first] = a, b
        columns.append(column)
    return Rows(*columns)


def _stands_still(moments: Floats, momentum: Floats) -> NDArray[np.bool_]:
    """Whether L x ω is exactly zero: spin about an axis, a sphere, a linear body, the equator of a symmetric top."""
    size = np.max(np.abs(momentum), axis=-1, keepdims=True)
    if np.any((momentum != 0.0) & (np.abs(momentum) < SMALLEST_PART * size)):
        raise ValueError(
            f"a component of the angular momentum is below {SMALLEST_PART:g} of |L|, beyond what double precision can "
            "follow; set it to 0"
        )
    pairs = ((0, 1), (1, 2), (2, 0))
    still = [(momentum[:, i] == 0.0) | (momentum[:, j] == 0.0) | (moments[:, i] == moments[:, j]) for i, j in pairs]
    linear = np.any(moments == 0.0, axis=-1)
    return np.asarray(linear | np.all(still, axis=0))


def _check_moments(moments: Floats, unit: Floats) -> None:
    """Refuse moments so far apart that the constants of a motion underflow."""
    apart = np.min(moments, axis=-1) < SMALLEST_MOMENT * np.max(moments, axis=-1)
    if np.any(apart):
        worst = int(np.argmax(apart))
        raise ValueError(
            f"moments {(moments[worst] * unit[worst]).tolist()}: expected the smallest above {SMALLEST_MOMENT:g} of the "
            "largest; for a linear rotor give (0, I, I), with no angular momentum along its axis"
        )


def _starting_at(rows: Rows, attitude0: Floats) -> Rows:
    """The rows with the constant left quaternion for the given attitude at t = 0."""
    from rotor.classical.free._kernels import evaluate

    n = len(rows.kind)
    momentum, attitude = np.empty((n, 1, 3)), np.empty((n, 1, 4))
    evaluate(rows, np.zeros(1), momentum, attitude)
    return rows._replace(left=np.ascontiguousarray(multiply(attitude0, conjugate(attitude[:, 0]))))


def _power_of_two(size: Floats) -> Floats:
    # frexp: the power of two above the size, so that the scaled value is below 1
    return np.asarray(np.where(size > 0.0, np.ldexp(1.0, np.frexp(size)[1]), 1.0))
