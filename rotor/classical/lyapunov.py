"""Chaos of driven and damped bodies: Lyapunov exponents, Kaplan-Yorke dimension, Poincaré sections.

Exponents are those of the linearised flow along an orbit: a tangent vector for each exponent is propagated and reorthogonalised at
short intervals, and the logarithms of the growth factors are averaged (G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn,
Meccanica 15, 9 (1980)). The sum of all exponents equals the mean divergence of the flow, which is integrated too and checks each result.

A free top has no positive exponent: its tumbling is periodic in the body. Its tangent vectors nevertheless grow in proportion to time,
because neighbouring orbits have different periods. A length that grows from t1 to t2 in proportion to t appears as an exponent
ln(t2/t1)/(t2 - t1), which vanishes as ln t/t. No finite calculation can distinguish this from a small exponent, so this bias is
included in all errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.effect import ClassicalEffect
from rotor.classical.euler import attitude_rate, checked_momentum
from rotor.classical.exponents import DIFFERENCE, STAGES, Exponents, Growth, Settings, mean_exponents
from rotor.classical.system import flatten_system
from rotor.geometry.rotations import IDENTITY, normalised

ALIGNING = 0.2  # of a segment
DOUBLINGS = 10  # of the time, for an accuracy


@dataclass(frozen=True)
class Flow:
    """dy/dt = rate(t, y) for states y (k, d), and its Jacobian (k, d, d), by default from central differences.

    `start`: initial state (d,); `timed`: whether the rate depends explicitly on time, as with a periodic drive.
    """

    rate: Callable[[float, Floats], Floats]
    start: Floats
    jacobian: Callable[[float, Floats], Floats] | None = None
    timed: bool = False

    def state_rate(self, time: float, y: Floats) -> Floats:
        """The rate (d,) of a single state."""
        return np.asarray(self.rate(time, y[None])[0])

    def slopes(self, time: float, y: Floats) -> Floats:
        """The Jacobian ∂rate_i/∂y_j at states (k, d)."""
        if self.jacobian is not None:
            return self.jacobian(time, y)
        k, d = y.shape
        # relative to the state, so that rounding and truncation balance
        step = DIFFERENCE * (1.0 + np.max(np.abs(y)))
        shifted = y[:, None, :] + step * np.eye(d)
        opposite = y[:, None, :] - step * np.eye(d)
        both = self.rate(time, np.concatenate([shifted, opposite]).reshape(2 * k * d, d)).reshape(2, k, d, d)
        return np.swapaxes((both[0] - both[1]) / (2.0 * step), -1, -2)


def body_flow(
    moments: ArrayLike,
    momentum0: ArrayLike,
    effects: Sequence[ClassicalEffect] = (),
    attitude0: ArrayLike = IDENTITY,
) -> Flow:
    """The flow of one body under effects.

    Parameters
    ----------
    moments : (3,) array
        Principal moments.
    momentum0 : (3,) array
        Angular momentum in body axes at the start.
    effects : sequence of ClassicalEffect
        As for `rotor.classical.integrators.method.integrate`.
    attitude0 : (4,) array
        Initial attitude, body to space.

    Returns
    -------
    Flow
        The flow of y = L (3,), or of (L, q) (7,) if a torque depends on the attitude; the length of the quaternion then adds a zero
        exponent.

    Examples
    --------
    >>> body_flow([1.0, 2.0, 4.0], [1.0, 1.0, 0.0]).rate(0.0, np.array([[1.0, 1.0, 0.0]])).tolist()
    [[0.0, 0.0, -0.5]]
    """
    system = flatten_system(moments, effects)
    if len(system.start_moments) != 1:
        raise ValueError("a flow is that of one body: give three moments")
    momentum0 = checked_momentum(momentum0, system.start_moments[0])
    still = np.asarray(IDENTITY)
    timed = any(effect.depends_on_time for effect in effects)

    def momentum_alone(time: float, y: Floats) -> Floats:
        return system.momentum_rate(time, y, np.broadcast_to(still, (len(y), 4)))

    def momentum_and_attitude(time: float, y: Floats) -> Floats:
        momentum, attitude = y[:, :3], y[:, 3:]
        turning = attitude_rate(attitude, system.omega(time, momentum, attitude))
        return np.concatenate([system.momentum_rate(time, momentum, attitude), turning], axis=-1)

    if system.needs_attitude:
        return Flow(momentum_and_attitude, np.concatenate([momentum0, normalised(attitude0)]), timed=timed)
    return Flow(momentum_alone, momentum0, timed=timed)


def lyapunov_exponents(
    flow: Flow,
    time: float,
    count: int | None = None,
    transient: float = 0.0,
    segments: int = 32,
    interval: float = 1.0,
    tolerance: float = 1e-10,
    accuracy: float | None = None,
) -> Exponents:
    """The largest Lyapunov exponents along the orbit of flow.start.

    Parameters
    ----------
    flow : Flow
        The flow. A quadratic flow (`quadratic_form`) is integrated by a compiled loop, about a hundred times faster; for others
        all segments are integrated together, which costs hardly more than one.
    time : float
        Length of the orbit that is averaged over, after `transient`.
    count : int, optional
        Number of exponents. Default: all.
    transient : float
        Initial time that is left out.
    segments : int
        Number of segments of equal length; the standard error is that of their mean.
    interval : float
        Time between two orthogonalisations.
    tolerance : float
        Of the integration (DOP853), relative and absolute.
    accuracy : float, optional
        `time` is doubled, up to 1024 times, until the numerical error of every exponent and twice its standard error are at most this.

    Returns
    -------
    Exponents
        Values with errors; a value within about two errors of zero is not distinguished from zero.

    Raises
    ------
    ValueError
        An invalid count, time or number of segments; an orbit that grows without bound; an accuracy that is not reached.

    Notes
    -----
    Neglected: incomplete alignment of the vectors after a fifth of a segment, exp(-gap x aligning time); the error of the orbit, which
    shadows a true orbit with the same exponents. If there are two attractors, the start decides.
    Included in the errors: the bias of vectors that grow in proportion to time.

    >>> saddle = Flow(lambda t, y: y * np.array([1.0, -2.0]), np.array([0.0, 0.0]))
    >>> lyapunov_exponents(saddle, time=40.0, segments=2).values.round(9).tolist()
    [1.0, -2.0]
    """
    d = flow.start.size
    count = d if count is None else count
    if not 1 <= count <= d:
        raise ValueError(f"the flow has {d} exponents; count={count} is not among 1 to {d}")
    if segments < 2 or not time > 0.0 or not interval > 0.0:
        raise ValueError("exponents need a positive time, a positive interval and at least two segments")
    form = None if flow.timed else quadratic_form(flow)
    for doubled in range(DOUBLINGS + 1):
        plan = _Plan(transient, 2.0**doubled * time / segments, segments, interval, tolerance)
        grown = _along(flow, form, count, plan) if form else _side_by_side(flow, count, plan)
        exponents = mean_exponents(grown, plan.settings(together=form is not None))
        if accuracy is None or exponents.reached <= accuracy:
            return exponents
    raise ValueError(
        f"accuracy: {accuracy:g} per time cannot be given: the error after a time of {exponents.time:g} is {exponents.reached:.2g} "
        f"({exponents.budget.line()}); choose a lower accuracy, a longer time or a smaller tolerance"
    )


def quadratic_form(flow: Flow) -> tuple[Floats, Floats, Floats] | None:
    """c (d,), A (d, d) and symmetric Q (d, d, d) with rate = c + A y + Q(y, y); None if the rate is not quadratic.

    Determined from values at 0, ±e_i and e_i + e_j, and compared with the rate at 16 random states within a relative error of 1e-12.

    >>> quadratic_form(Flow(lambda t, y: y * y - y, np.array([1.0])))[2].tolist()
    [[[1.0]]]
    >>> quadratic_form(Flow(lambda t, y: np.abs(y) * y, np.array([1.0]))) is None
    True
    """
    d = flow.start.size
    unit = np.eye(d)
    constant, plus, minus = flow.rate(0.0, np.zeros((1, d)))[0], flow.rate(0.0, unit), flow.rate(0.0, -unit)
    pairs = flow.rate(0.0, (unit[:, None] + unit).reshape(-1, d)).reshape(d, d, d)
    # of a quadratic flow the even and odd parts give constant, linear and square terms exactly
    linear, squares = 0.5 * (plus - minus), 0.5 * (plus + minus) - constant
    mixed = 0.5 * (pairs - plus[:, None] - plus + constant)
    mixed[np.arange(d), np.arange(d)] = squares
    quadratic = np.moveaxis(mixed, -1, 0)
    # a check at points that did not enter
    y = np.random.default_rng(0).normal(size=(16, d)) * (1.0 + np.max(np.abs(flow.start)))
    expected = flow.rate(0.0, y)
    predicted = constant + y @ linear + np.einsum("ijk,nj,nk->ni", quadratic, y, y)
    if np.max(np.abs(predicted - expected)) > 1e-12 * np.max(np.abs(expected)):  # not a quadratic flow
        return None
    return constant, np.ascontiguousarray(linear.T), np.ascontiguousarray(quadratic)


def orbit(flow: Flow, times: ArrayLike, tolerance: float = 1e-10) -> Floats:
    """States (t, d) of the flow at increasing `times`, from flow.start at time 0 (DOP853).

    >>> decay = Flow(lambda t, y: -y, np.array([1.0]))
    >>> orbit(decay, [0.0, 1.0])[:, 0].round(8).tolist()
    [1.0, 0.36787944]
    """
    times = np.asarray(times, dtype=np.float64)
    end = max(float(times[-1]), np.finfo(float).tiny)  # an interval of 0 is refused by solve_ivp
    return np.asarray(_solution(flow.state_rate, (0.0, end), flow.start, tolerance, t_eval=times).y.T)


def poincare_section(
    flow: Flow, surface: Callable[[float, Floats], float], time: float, transient: float = 0.0, tolerance: float = 1e-10
) -> tuple[Floats, Floats]:
    """Times and states at which an orbit crosses a surface upwards.

    Parameters
    ----------
    flow : Flow
        The orbit starts at flow.start, at time 0.
    surface : callable
        surface(t, y) = 0 is crossed from below. For a periodic drive, sin(angular_frequency t / 2 + phase) gives the
        stroboscopic map of every second period.
    time : float
        Length of the orbit.
    transient : float
        Crossings before this time are left out.
    tolerance : float
        Of the integration (DOP853), relative and absolute.

    Returns
    -------
    (p,) array, (p, d) array
        Times and states of the crossings.

    Examples
    --------
    >>> circle = Flow(lambda t, y: np.stack([y[:, 1], -y[:, 0]], axis=-1), np.array([1.0, 0.0]))
    >>> times, states = poincare_section(circle, lambda t, y: y[0], time=12.0)
    >>> (times / np.pi).round(6).tolist(), states[:, 1].round(6).tolist()
    ([1.5, 3.5], [1.0, 1.0])
    """

    def crossing(t: float, y: Floats) -> float:
        return surface(t, y)

    crossing.direction = 1.0  # type: ignore[attr-defined]
    solution = _solution(flow.state_rate, (0.0, time), flow.start, tolerance, events=crossing)
    times, states = solution.t_events[0], np.reshape(solution.y_events[0], (-1, flow.start.size))
    return times[times >= transient], states[times >= transient]


@dataclass(frozen=True)
class _Plan:
    """Transient, length and number of segments, interval of orthogonalisation, tolerance."""

    transient: float
    length: float
    segments: int
    interval: float
    tolerance: float

    @property
    def aligning(self) -> float:
        """Time given to the tangent vectors before anything is measured."""
        return ALIGNING * self.length

    def settings(self, together: bool) -> Settings:
        """Settings for the errors. together: whether the segments are consecutive, with continued tangent vectors."""
        before = self.aligning + (self.transient if together else 0.0)
        measured = self.length * (self.segments if together else 1)
        return Settings(before, measured, self.length * self.segments, self.intervals(self.length)[1], self.tolerance)

    def intervals(self, part: float) -> tuple[int, float]:
        """Number and length of the intervals in `part`."""
        number = max(1, round(part / self.interval))  # at least one interval, of equal length
        return number, part / number


def _along(flow: Flow, form: tuple[Floats, Floats, Floats], count: int, plan: _Plan) -> Growth:
    """Growth in consecutive segments, by the compiled loop."""
    from scipy.integrate import DOP853

    from rotor.classical._chaos_kernels import follow

    d = flow.start.size
    coefficients = (DOP853.A[:STAGES, :STAGES], DOP853.B, DOP853.E3[:STAGES], DOP853.E5[:STAGES])
    tableau = (*(np.ascontiguousarray(part) for part in coefficients), plan.tolerance)
    table = np.zeros((d + 1, 1 + count))
    table[:d, 0], table[:d, 1:] = flow.start, np.eye(d)[:, :count]
    grown, divergence = np.zeros((plan.segments, count)), np.zeros(plan.segments)
    # a short first step; the controller lengthens it
    step, before, steps = 1e-3 * plan.interval, plan.transient + plan.aligning, 0
    number, length = plan.intervals(before)
    step = _checked_step(follow(form, tableau, table, length, number, step, np.zeros(count))[0])
    number, length = plan.intervals(plan.length)
    for segment in range(plan.segments):
        table[d, 0] = 0.0
        step, taken = follow(form, tableau, table, length, number, step, grown[segment])
        steps += taken
        _checked_step(step)
        divergence[segment] = table[d, 0]
    return Growth(
        grown / plan.length, divergence / plan.length, steps / (plan.segments * plan.length), True, whole=count == d
    )


def _side_by_side(flow: Flow, count: int, plan: _Plan) -> Growth:
    """Growth in segments that are integrated together, from different points of an orbit."""
    d = flow.start.size
    starts = plan.transient + plan.length * np.arange(plan.segments)
    points = orbit(flow, starts, plan.tolerance)
    tracker = _Tracker(flow, starts - starts[0], plan.tolerance)
    y = (points, np.broadcast_to(np.eye(d)[:, :count], (plan.segments, d, count)))
    clock, y, _ = tracker.follow(float(starts[0]), y, *plan.intervals(plan.aligning))
    return tracker.follow(clock, y, *plan.intervals(plan.length))[2]


def _checked_step(step: float) -> float:
    if step == 0.0:
        raise ValueError("the orbit could not be followed: no step is short enough; the flow grows without bound")
    return step


@dataclass(frozen=True)
class _Tracker:
    """States (k, d) with tangent vectors (k, d, m); each state is at the time clock + offset."""

    flow: Flow
    offsets: Floats
    tolerance: float

    def follow(
        self, clock: float, y: tuple[Floats, Floats], intervals: int, length: float
    ) -> tuple[float, tuple[Floats, Floats], Growth]:
        """After `intervals`: the clock, states, and their growth."""
        states, tangent = y
        k, d, m = tangent.shape
        grown, divergence, steps, span = np.zeros((k, m)), np.zeros(k), 0, intervals * length
        for _ in range(intervals):
            states, tangent, traces, taken = self._interval(clock, states, tangent, length)
            tangent, upper = np.linalg.qr(tangent)
            grown += np.log(np.abs(np.diagonal(upper, axis1=-2, axis2=-1)))
            divergence += traces
            steps += taken
            clock += length
        exact = self.flow.jacobian is not None
        return clock, (states, tangent), Growth(grown / span, divergence / span, steps / span, exact, d == m)

    def _interval(
        self, clock: float, states: Floats, tangent: Floats, length: float
    ) -> tuple[Floats, Floats, Floats, int]:
        (k, d), m = states.shape, tangent.shape[2]

        def rates(time: float, flat: Floats) -> Floats:
            y, v = flat[: k * d].reshape(k, d), flat[k * d : k * d * (1 + m)].reshape(k, d, m)
            rate, slopes = self._rate_and_slopes(time, y)
            traces = np.trace(slopes, axis1=-2, axis2=-1)
            return np.concatenate([rate.reshape(-1), (slopes @ v).reshape(-1), traces])

        start = np.concatenate([states.reshape(-1), tangent.reshape(-1), np.zeros(k)])
        solution = _solution(rates, (clock, clock + length), start, self.tolerance, t_eval=[clock + length])
        end = solution.y[:, -1]
        return end[: k * d].reshape(k, d), end[k * d : -k].reshape(k, d, m), end[-k:], solution.nfev // STAGES

    def _rate_and_slopes(self, time: float, y: Floats) -> tuple[Floats, Floats]:
        """Rates and Jacobians of all states, each at its time if the flow depends on time."""
        if not self.flow.timed:
            return self.flow.rate(time, y), self.flow.slopes(time, y)
        pairs = [(t, row[None]) for t, row in zip(time + self.offsets, y, strict=True)]
        return (
            np.concatenate([self.flow.rate(t, row) for t, row in pairs]),
            np.concatenate([self.flow.slopes(t, row) for t, row in pairs]),
        )


def _solution(
    rate: Callable[[float, Floats], Floats], span: tuple[float, float], start: Floats, tolerance: float, **options: Any
) -> Any:
    """The solution of DOP853 (`solve_ivp`); ValueError for an orbit that could not be followed to its end."""
    from scipy.integrate import solve_ivp

    solution = solve_ivp(rate, span, start, method="DOP853", rtol=tolerance, atol=tolerance, **options)
    if solution.status < 0:
        raise ValueError(f"the orbit could not be followed: {solution.message}")
    return solution
