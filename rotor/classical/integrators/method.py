"""Motions of rigid bodies under effects, step by step: the interface of every integrator, and how to choose one.

| method | order | conserves | for |
|---|---|---|---|
| `ExactDrift` | free: exact; with torques 2 to 8 | symplectic, L in space | free motion at any time; weak torques |
| `MoserVeselov` | free: 2 to 8, or exact; with torques 2 to 8 | L in space, free energy | free motion by steps |
| `SymmetricTopSplitting` | 2, 4, 6, 8 | symplectic, L in space | torques, on any body |
| `RotationSplitting` | 2, 4, 6, 8 | symplectic, L in space | the usual splitting, to compare with; not linear rotors |
| `LieRungeKutta` | 8, adaptive step | unit quaternion, free L in space | drag, feedback, driven chaos; references |

Each has its page (module) with cost and source. What accuracy costs with each of them is drawn by
`benchmarks/bench_work_precision.py`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats, writable
from rotor.classical.effect import ClassicalEffect
from rotor.classical.euler import checked_moments, checked_momentum
from rotor.classical.integrators.compositions import fractions
from rotor.classical.system import System, flatten_system
from rotor.geometry.rotations import IDENTITY, normalised

STEPS_OF_A_CALL = 1_000_000  # of order 2 of one body: some tenths of a second, in which a compiled call obeys no signal


def steps_per_call(work: int) -> int:
    """Number of steps in a compiled call, if each is `work` steps of order 2 of a single body."""
    return max(1, STEPS_OF_A_CALL // max(work, 1))


def pieces(steps: int, work: int) -> Iterator[int]:
    """Numbers of steps of the compiled calls that make up `steps`; the calls between which a signal is obeyed."""
    most = steps_per_call(work)
    for first in range(0, steps, most):
        yield min(most, steps - first)


@dataclass(frozen=True)
class Motion:
    """A motion at the times asked for, axes in the order of the moments given.

    times: (t,).  momentum: (..., t, 3), L in body axes.  attitude: (..., t, 4), body to space.
    omega: (..., t, 3), angular velocity in body axes.  energy: (..., t), kinetic and potential.
    steps: how many steps of the method were taken.
    """

    times: Floats
    momentum: Floats
    attitude: Floats
    omega: Floats
    energy: Floats
    steps: int


class Method(ABC):
    """A way to carry a state from time to time."""

    @abstractmethod
    def states(self, system: System, momentum: Floats, attitude: Floats, times: Floats) -> tuple[Floats, Floats, int]:
        """The states of n bodies at all times.

        Parameters
        ----------
        system : System
            Moments and effects.
        momentum, attitude : (n, 3) array, (n, 4) array
            The start, at times[0].
        times : (t,) array
            Increasing or decreasing.

        Returns
        -------
        (t, n, 3) array, (t, n, 4) array, int
            Momentum, attitude, and how many steps were taken.
        """


def integrate(
    method: Method,
    moments: ArrayLike,
    momentum0: ArrayLike,
    times: ArrayLike,
    attitude0: ArrayLike = IDENTITY,
    effects: Sequence[ClassicalEffect] = (),
) -> Motion:
    """The motion of bodies under a list of effects.

    Parameters
    ----------
    method : Method
        How to step; the table at the head of this module says which serves what.
    moments : (..., 3) array
        Principal moments.
    momentum0 : (..., 3) array
        Angular momentum in body axes at times[0].
    times : (t,) array
        At which the motion is returned; they may run forward or back. Any coherent units.
    attitude0 : (..., 4) array
        Body to space, at times[0].
    effects : sequence of ClassicalEffect
        They act on every body. An effect is added by naming it in the list; the empty list is free motion and costs what
        free motion costs.

    Returns
    -------
    Motion
        Momentum, attitude, angular velocity and energy at the times.

    Raises
    ------
    ValueError
        A method that cannot serve an effect, with the one that can; a motion that does not stay finite.

    Examples
    --------
    >>> from rotor.classical.integrators.splitting import RotationSplitting
    >>> motion = integrate(RotationSplitting(step=0.01, order=4), [0.6, 0.8, 1.0], [1.8, 0.4, -0.9], [0.0, 10.0])
    >>> motion.momentum[-1].round(6).tolist()  # exact: 1.765963, -0.695464, 0.77955498
    [1.765963, -0.695464, 0.779555]
    """
    times = _checked_times(times)
    moments = checked_moments(moments)
    momentum0 = checked_momentum(momentum0, moments)
    attitude0 = normalised(attitude0)
    shape = np.broadcast_shapes(moments.shape[:-1], momentum0.shape[:-1], attitude0.shape[:-1])
    system = flatten_system(np.broadcast_to(moments, (*shape, 3)), effects)
    m0 = np.broadcast_to(momentum0, (*shape, 3)).reshape(-1, 3)
    q0 = np.broadcast_to(attitude0, (*shape, 4)).reshape(-1, 4)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
        momentum, attitude, steps = method.states(system, m0, q0, times)
    _check_finite(momentum, times, method)
    omega, energy = _omega_and_energy(system, times, momentum, attitude)
    momentum, attitude, omega, energy = (_bodies_first(a, shape) for a in (momentum, attitude, omega, energy))
    return Motion(times, momentum, attitude, omega, energy, steps)


@dataclass(frozen=True)
class KickDrift(Method):
    """Drifts of the free body between kicks of the torques: half a kick, a drift, half a kick, composed.

    If the moments change in time, a drift uses those at its middle; inner momenta rotate the body by -h/I dt before and
    after a drift. All parts are symmetric in time, so that compositions raise the order. The torque is evaluated once per drift.
    """

    step: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"step: expected a positive time; got {self.step!r} (decreasing times go back)")

    @property
    @abstractmethod
    def kick_fractions(self) -> Floats:
        """Fractions of the composition of kicks and drifts."""

    @abstractmethod
    def drift(self, moments: Floats, state: Floats, carry: Floats, step: float, steps: int, whole: bool) -> None:
        """Free motion of rows (n, 7), in place.

        Parameters
        ----------
        moments : (n, 3) array
            Principal moments during the drift.
        state, carry : (n, 7) array
            Momentum and attitude, and their rounding compensation.
        step : float
            Length of a step.
        steps : int
            Number of steps.
        whole : bool
            Whether the steps are of the full order of the method; otherwise base steps, for the parts of a composition.
        """

    def states(self, system: System, momentum: Floats, attitude: Floats, times: Floats) -> tuple[Floats, Floats, int]:
        """As `Method.states`, by steps of equal length from each time to the next, the longest that do not exceed `step`.

        Raises ValueError for torques that depend on angular velocity, and for added inertia: they need `LieRungeKutta`.
        """
        from rotor.classical.integrators._step_kernels import rows

        if system.needs_velocity:
            raise ValueError(
                f"{type(self).__name__} kicks with torques of attitude and time; a torque that depends on angular "
                "velocity (drag, feedback) needs LieRungeKutta"
            )
        if system.added:
            raise ValueError(
                f"{type(self).__name__} drifts with moments along fixed axes; added inertia (rolling) needs LieRungeKutta"
            )
        state = rows(momentum, attitude)
        # a quotient that is whole but for round-off makes no further step
        counts = np.maximum(1, np.ceil(np.abs(np.diff(times)) / self.step - 1e-9)).astype(np.int64)
        path = np.empty((len(times), *state.shape))
        path[0] = state
        if not self.follow_compiled(system, times, counts, path):
            carry = np.zeros_like(state)
            for k, ((start, stop), steps) in enumerate(zip(pairwise(times.tolist()), counts.tolist(), strict=True)):
                self._advance(system, state, carry, start, (stop - start) / steps, steps)
                path[k + 1] = state
        return path[..., :3], path[..., 3:], int(counts.sum())

    def follow_compiled(self, system: System, times: Floats, counts: NDArray[np.int64], path: Floats) -> bool:
        """Fill path (t, n, 7) from path[0] with one compiled call, where the method and the effects have it; whether it was.

        Parameters
        ----------
        system : System
            Moments and effects.
        times : (t,) array
            Increasing or decreasing.
        counts : (t - 1,) array
            Steps between neighbouring times.
        path : (t, n, 7) array
            Momentum and attitude; changed in place.

        Returns
        -------
        bool
            False where nothing was done: the steps are to be made one by one.
        """
        return False

    def _advance(self, system: System, state: Floats, carry: Floats, start: float, step: float, steps: int) -> None:
        if system.free:
            self.drift(system.start_moments, state, carry, step, steps, whole=True)
            return
        # nan until it is computed, so that a missing kick would show
        kicker = _Kicker(system, state, carry, np.full((len(state), 3), np.nan))
        torque = kicker.torque(start)
        for k in range(steps):
            time = start + k * step
            for fraction in self.kick_fractions:
                h = fraction * step
                kicker.kick(torque, 0.5 * h)  # half kicks around the drift: order 2, and reversible
                moments = system.moments(time + 0.5 * h)
                kicker.turn(time + 0.5 * h, 0.5 * h)
                self.drift(moments, state, carry, h, 1, whole=False)
                kicker.turn(time + 0.5 * h, 0.5 * h)
                time += h
                torque = kicker.torque(time)
                kicker.kick(torque, 0.5 * h)


@dataclass(frozen=True)
class Composed(KickDrift):
    """Kicks and drifts of order 2 composed to `order` 2, 4, 6 or 8 (`compositions.py`), free steps likewise."""

    order: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        fractions(self.order)

    @property
    def kick_fractions(self) -> Floats:
        """Fractions of the composition, the same for the free steps."""
        return fractions(self.order)


@dataclass(frozen=True)
class _Kicker:
    """Kicks and turns of rows (n, 7), in place; each does nothing where its effects are absent."""

    system: System
    state: Floats
    carry: Floats
    no_omega: Floats

    def torque(self, time: float) -> Floats | None:
        """Torques (n, 3) here and now, None where there are none."""
        if not self.system.torques:
            return None
        torque = self.system.torque(time, self.state[:, 3:], self.no_omega)
        return writable(np.broadcast_to(torque, self.no_omega.shape))

    def kick(self, torque: Floats | None, time: float) -> None:
        """L gains torque times time."""
        from rotor.classical.integrators._step_kernels import kick

        if torque is not None:
            kick(self.state, self.carry, torque, time)

    def turn(self, time: float, duration: float) -> None:
        """The inner momenta's share -h/I of the angular velocity, for a duration."""
        from rotor.classical.integrators._step_kernels import turn_uniformly

        if self.system.inner:
            rate = self.system.inner_momentum(time) * self.system.acting(time)
            turn_uniformly(self.state, self.carry, -duration * rate)


def _omega_and_energy(system: System, times: Floats, momentum: Floats, attitude: Floats) -> tuple[Floats, Floats]:
    """ω (t, n, 3) and energy (t, n); at once where neither depends on time itself."""
    if system.compiled is not None and not system.potential_depends_on_time:
        row = float(times[0]), momentum, attitude
        return system.omega(*row), system.energy(*row)
    rows = [(float(t), m, q) for t, m, q in zip(times, momentum, attitude, strict=True)]
    return np.stack([system.omega(*row) for row in rows]), np.stack([system.energy(*row) for row in rows])


def _checked_times(times: ArrayLike) -> Floats:
    array = np.asarray(times, dtype=np.float64)
    if array.ndim != 1 or array.size < 1 or not np.all(np.isfinite(array)):
        raise ValueError(f"times: expected a list of finite numbers that begins with the start; got {times!r}")
    steps = np.diff(array)
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError("times must all increase, or all decrease, without repetition")
    return array


def _check_finite(momentum: Floats, times: Floats, method: Method) -> None:
    lost = ~np.all(np.isfinite(momentum), axis=(1, 2))
    if np.any(lost):
        raise ValueError(
            f"the motion is no longer finite at time {times[np.argmax(lost)]:g} with {type(method).__name__}: the step "
            "is too long, or an effect feeds energy in without bound"
        )


def _bodies_first(array: Floats, shape: tuple[int, ...]) -> Floats:
    """(t, n, ...) as (*shape, t, ...)."""
    moved = np.moveaxis(array, 0, 1)
    return np.ascontiguousarray(moved.reshape(*shape, *moved.shape[1:]))
