"""Request and answer for the free rotation of a rigid body: the exact motion, its table, its stability.

Moments and angular momentum are the exact data of the motion. For a given angular velocity use
`TumbleRequest.from_angular_velocity`, for a molecule `rotor.thermodynamics.gas.thermal_tumble`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.checks import Renamed
from rotor.classical.bodies import NamedBody
from rotor.classical.euler import checked_moments, checked_momentum, checked_velocity, energy
from rotor.classical.free.free_motion import FreeMotion, free_motion
from rotor.classical.free.stability import Stability, stability
from rotor.classical.motion import COHERENT, InvariantDrift, MotionTable, Units, invariant_drift, sampled
from rotor.requests.budget import ErrorBudget
from rotor.table import TextOf

PERIODS, STEADY_TURNS, SEPARATRIX_TURNS, POINTS = 2, 2, 10, 201
LARGEST = 1e100  # limit of moments, their inverses and angular momenta; avoids overflow of L²/I
Three = tuple[float, float, float]


@dataclass(frozen=True)
class TumbleRequest:
    """A free rotation to compute; all fields are checked when the request is made.

    moments: (3,), principal moments of inertia in any order. angular_momentum: (3,) at time 0 in the principal axes, in the
    unit that `units` names. times: (n,) in the unit that `units` names; None: two periods of the motion. axes: names of the
    principal axes. source: how the angular momentum was chosen. named: the ordinary body with these moments.
    """

    moments: Three
    angular_momentum: Three
    times: tuple[float, ...] | None = None
    units: Units = COHERENT
    axes: tuple[str, str, str] = ("1", "2", "3")
    source: str = "given"
    named: NamedBody | None = None

    def __post_init__(self) -> None:
        moments = checked_moments(self.moments)
        if moments.shape != (3,):
            raise ValueError(f"moments: {self.moments}: expected the three moments of one body")
        momentum = checked_momentum(self.angular_momentum, moments)
        _refuse_sizes(moments, momentum)
        if momentum.shape != (3,) or not momentum.any():
            raise ValueError(
                f"angular_momentum: {self.angular_momentum}: expected three components, not all 0; a body at rest "
                "does not tumble"
            )
        if self.times is not None and not (len(self.times) and np.isfinite(self.times).all()):
            raise ValueError("times: expected at least one finite time")

    @classmethod
    def from_angular_velocity(cls, moments: ArrayLike, omega: ArrayLike, **others: Any) -> TumbleRequest:
        """The request for a body with initial angular velocity ω in rad per unit of time: L_i = I_i ω_i.

        others: further fields of the request; moments and ω are in one coherent set, such as kg m² and rad/s.

        >>> from rotor.classical.motion import SI
        >>> TumbleRequest.from_angular_velocity([1.0, 2.0, 3.0], [0.0, 5.0, 0.1], units=SI).angular_momentum[1]
        10.0
        """
        body = np.asarray(moments, dtype=np.float64)
        a, b, c = (float(x) for x in body)
        p, q, r = (float(x) for x in body * checked_velocity(omega, body))
        return cls((a, b, c), (p, q, r), **others)

    of_angular_velocity = Renamed("from_angular_velocity")

    @property
    def body(self) -> Floats:
        """The moments as an array (3,)."""
        return np.array(self.moments)

    @property
    def momentum(self) -> Floats:
        """The angular momentum (3,) in the coherent set of the motion."""
        return np.array(self.angular_momentum) / self.units.momentum_factor

    @property
    def kind(self) -> str:
        """Kind of body from exact equality of the moments."""
        low, middle, high = sorted(self.moments)
        if low == 0.0:
            return "linear"
        equal = {(True, True): "spherical", (True, False): "oblate", (False, True): "prolate"}
        return equal.get((low == middle, middle == high), "asymmetric")

    def about(self) -> dict[str, Any]:
        """Kind and notes of the body, by the keys of docs/verbs."""
        return {"kind": self.kind, "notes": list(self.notes), "temperature_k": None}

    @property
    def relative_errors(self) -> Floats | None:
        """Relative errors of the moments (3,); None: not known."""
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on unusual properties of the body."""
        if self.named is not None:
            return ()
        low, middle, high = sorted(self.moments)
        if low + middle >= high * (1 - 1e-12):  # a plane body has I1 + I2 = I3; written moments round
            return ()
        return (
            f"no real body has these moments: {low:g} + {middle:g} is less than {high:g}; the motion is computed all the same",
        )


@dataclass(frozen=True, repr=False)
class TumbleAnswer(TextOf):
    """The exact motion of a request.

    motion: in the coherent set of the moments. table: the motion at the requested times, in the units of the request.
    drift: drift of the conserved quantities over the table.
    """

    shown = "table"

    request: TumbleRequest
    motion: FreeMotion
    table: MotionTable
    drift: InvariantDrift
    times_source: str = field(default="given")

    @cached_property
    def stability(self) -> Stability:
        """Closed-form stability: kinds of the axes, and growth rate of deviations."""
        return stability(self.request.body, self.request.momentum)

    @property
    def motion_kind(self) -> str:
        """steady, separatrix, or the axis that L circles."""
        if self.motion.steady:
            return "steady"
        if self.motion.separatrix:
            return "separatrix"
        return f"about axis {self.request.axes[self.motion.centre_axis]}"

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the attitude, in rad at the last time, for exact moments and momentum."""
        from rotor.classical.free.budget import attitude_budget

        factors = (self.request.units.time_factor, self.request.units.momentum_factor)
        last = float(np.abs(self.table.times).max()) / self.request.units.time_factor
        growth, converted = self.stability.growth_rate, factors != (1.0, 1.0)
        return attitude_budget(self.motion, last, growth, converted, self.request.relative_errors)

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table, by the keys of docs/verbs."""
        request, units = self.request, self.request.units
        return {
            **request.about(),
            "units": {"time": units.time, "angular_momentum": units.angular_momentum, "energy": units.energy},
            "moments": request.body,
            "axes": list(request.axes),
            "angular_momentum": request.momentum * units.momentum_factor,
            "angular_momentum_size": float(math.hypot(*request.momentum)) * units.momentum_factor,
            "angular_momentum_source": request.source,
            **self._motion_facts(),
            "times_source": self.times_source,
            "invariant_drift": asdict(self.drift),
            "errors": self.errors.as_json(),
        }

    def _motion_facts(self) -> dict[str, Any]:
        request, units, closed = self.request, self.request.units, self.stability
        distinct = len(set(request.moments)) == 3
        return {
            "energy": float(energy(request.momentum, request.body)) * units.energy_factor,
            "motion_kind": self.motion_kind,
            "period": float(self.motion.period) * units.time_factor,
            "turning_rate": float(self.motion.turning_rate) / units.time_factor,
            "fixed_axes": [
                {"axis": name, "moment": moment, "kind": fixed.kind, "rate": fixed.rate / units.time_factor}
                for name, moment, fixed in zip(request.axes, request.moments, closed.axes, strict=True)
            ],
            "separatrix_ratio": closed.separatrix_ratio if distinct else None,
            "growth_rate": closed.growth_rate / units.time_factor,
            "asymptotic_period": closed.asymptotic_period * units.time_factor,
            "chaos": closed.chaos,
        }


def answer_tumble(request: TumbleRequest) -> TumbleAnswer:
    """The exact free rotation of a request, at its times or at suitable default times.

    >>> answer = answer_tumble(TumbleRequest((0.6, 0.8, 1.0), (1.8, 0.4, -0.9)))
    >>> answer.motion_kind, round(float(answer.table.times[-1]), 6), answer.times_source
    ('about axis 1', 13.725232, '2 periods, 201 points')
    """
    units = request.units
    motion = free_motion(request.body, request.momentum)
    times, source = (np.array(request.times), "given") if request.times is not None else _chosen_times(motion, units)
    inner = sampled(motion, times / units.time_factor)
    table = MotionTable(
        times, inner.momentum * units.momentum_factor, inner.attitude, inner.energy * units.energy_factor, units=units
    )
    return TumbleAnswer(request, motion, table, invariant_drift(inner, motion), source)


def _chosen_times(motion: FreeMotion, units: Units) -> tuple[Floats, str]:
    """Default times of a motion in the unit of the answer, and a sentence that describes them."""
    if math.isfinite(motion.period):
        span, source = PERIODS * float(motion.period), f"{PERIODS} periods, {POINTS} points"
    else:
        turns = STEADY_TURNS if motion.steady else SEPARATRIX_TURNS
        span = turns * 2.0 * math.pi / float(motion.turning_rate)
        source = f"{turns} turns about L, {POINTS} points, as the motion in the body has no period"
    return np.linspace(0.0, span * units.time_factor, POINTS), source


def _refuse_sizes(moments: Floats, momentum: Floats) -> None:
    if np.any((moments != 0.0) & ((moments < 1 / LARGEST) | (moments > LARGEST))):
        raise ValueError(
            f"principal moments lie between {1 / LARGEST:g} and {LARGEST:g}, or are 0; got {moments.tolist()}; take other units"
        )
    if np.any(np.abs(momentum) > LARGEST):
        raise ValueError(f"components of an angular momentum are up to {LARGEST:g} in size; take other units")
