"""Estimate of the number of steps of a driven motion, from its first part.

If the second half of that part takes clearly more steps than the first, as for a body that is spun up, the rate is extrapolated linearly
in time. Motions with few steps are computed and counted.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotor.classical.system import flatten_system

if TYPE_CHECKING:
    from rotor.classical.driven import DrivenRequest

BEGINNINGS = 20  # of a motion, one of which is made to count its steps, and searched where the motion is long
SHORTEST_SHARE = 1e-6  # of the time, for a body at rest
MOST_STEPS = 10**10  # that a motion can take, hours of compiled steps
TIMED_STEPS = 1000  # beyond those that are made one by one
MORE_COMPILED, MORE_PLAIN = 50, 2  # times as many for a second part that is timed: compiled steps are so much cheaper
# of half a first part, and times as many in the other half, from which a trend is read
ENOUGH_STEPS, CLEARLY = 200, 1.5


def beginning(request: DrivenRequest, share: float, *more: float) -> DrivenRequest:
    """The request for the first part of its time; its output times are retained, because steps end there. more: further shares."""
    first, last = request.times[0], request.times[-1]
    end = first + share * (last - first)
    inner = {t for t in request.times if abs(t - first) < abs(end - first)}
    inner |= {first + part * (end - first) for part in more}
    return replace(request, times=(*sorted(inner, reverse=last < first), end))


def is_compiled(request: DrivenRequest) -> bool:
    """Whether the steps of a motion run compiled: all of its effects state a compiled form."""
    return flatten_system(request.moments, request.effects).compiled is not None


def timed_steps(request: DrivenRequest) -> tuple[int, int]:
    """Number of steps of the first timed part, and factor for the second."""
    first_steps = TIMED_STEPS if request.step is None or request.order > 2 else 4 * TIMED_STEPS
    return first_steps, MORE_COMPILED if is_compiled(request) else MORE_PLAIN


def count_first_steps(request: DrivenRequest, share: float) -> int:
    """Steps of the first part of a motion."""
    from rotor.classical.driven import answer_driven

    return answer_driven(request if share == 1.0 else beginning(request, share)).motion.steps


def first_share(request: DrivenRequest) -> float:
    """The share of the time from which the rest is estimated: a twentieth, or less if that already takes many steps.

    A body with a very small moment about its rotation axis can take 1e13 steps in a time in which others take ten. Therefore parts of
    increasing length are tried, from about a radian (or the time in which a component of L changes by its size), until one takes
    enough steps.
    """
    span, enough, fastest = abs(request.times[-1] - request.times[0]), 5 * ENOUGH_STEPS, _fastest_rate(request)
    share = min(1 / BEGINNINGS, 1.0 / (fastest * span) if fastest > 0.0 else SHORTEST_SHARE)
    while share < 1 / BEGINNINGS and count_first_steps(request, share) < enough:
        share = min(4.0 * share, 1 / BEGINNINGS)  # four times as long, until the steps are many enough for a rate
    return share


def _fastest_rate(request: DrivenRequest) -> float:
    """The largest initial angular velocity about an axis, or relative rate of change of a component of L by a torque."""
    system = flatten_system(np.array([request.moments]), request.effects)
    momentum, attitude, time = np.array([request.momentum]), np.array([request.attitude]), request.times[0]
    with np.errstate(over="ignore", invalid="ignore"):  # absurd torques may overflow: the rate is then limited below
        omega = system.omega(time, momentum, attitude)
        rates = np.abs(omega)
        if system.torques:
            torque = np.broadcast_to(system.torque(time, attitude, omega), momentum.shape)
            change = np.divide(torque, momentum, out=np.zeros_like(momentum), where=momentum != 0.0)
            rates = np.maximum(rates, np.abs(change))  # a torque that changes L quickly also shortens steps
    return float(np.nan_to_num(rates, posinf=np.finfo(float).max).max())


def expected_steps(request: DrivenRequest) -> int:
    """Expected number of steps of a motion: counted if few, otherwise estimated from its first part; see the head of this module."""
    part, (first_steps, more) = first_share(request), timed_steps(request)
    whole = count_first_steps(request, part)
    if whole / part < first_steps * more:
        return count_first_steps(request, 1.0)
    first = count_first_steps(request, part / 2)
    second = whole - first
    if first < ENOUGH_STEPS or second < CLEARLY * first:
        return math.ceil(whole / part)
    # rates r1, r2 in the middles of both halves, at p/4 and 3p/4: ∫ r1 + (r2 - r1)(t - p/4)/(p/2) dt from 0 to 1
    r1, r2 = (2 * count / part for count in (first, second))
    return math.ceil(r1 + (r2 - r1) * (0.5 - part / 4) / (part / 2))
