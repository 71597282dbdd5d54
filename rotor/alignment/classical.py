"""A classical gas of the same top under the same pulses: bodies sampled at the temperature and propagated by Euler's equations.

Units: ps, rad/ps for energies and ħ for angular momenta, so that I = ħ/(4π B) is 1/(2B) with B in rad/ps. During a pulse the motion is
integrated with its torque; between pulses it is exact. The classical gas has no revivals: it dephases once, like the quantum gas at
first, and retains its mean alignment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.alignment.acting import acted_on, spread
from rotor.alignment.observables import figure_axis
from rotor.alignment.propagation.timeline import Channel, Window, timeline
from rotor.alignment.pulse import RAD_PER_PS_MHZ, Kick, Pulse
from rotor.arrays import Floats, Ints
from rotor.classical.effect import Torque
from rotor.classical.effects.dipole_in_field import PulsedDipole, PulsedPolarizability
from rotor.classical.free.free_motion import free_motion
from rotor.classical.gas.ensembles import thermal_momenta
from rotor.classical.integrators.method import integrate
from rotor.classical.integrators.splitting import SymmetricTopSplitting
from rotor.geometry.rotations import rotate, uniform

if TYPE_CHECKING:
    from rotor.tops.top import Top

STEPS_PER_WINDOW = 400  # at least
STEP_RAD = 0.25  # of the fastest libration or rotation in a step
PIECE = 5000  # bodies propagated together


def classical_trace(
    top: Top,
    pulses: Sequence[Pulse],
    times_ps: ArrayLike,
    *,
    temperature_k: float,
    molecules: int = 10_000,
    observables: Sequence[str] = ("cos2theta",),
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """Cosines (t,) by name of a classical gas under pulses.

    Parameters
    ----------
    top : Top
        With the property that the pulses act on.
    pulses : sequence of Pulse
        As for `rotor.alignment.align.align`.
    times_ps : (t,) increasing
    temperature_k : float
        Temperature of the gas; 0 for bodies at rest.
    molecules : int
        Number of bodies; the cosines scatter by about 0.3/√molecules.
    observables : names
        costheta, cos2theta, cos2theta_2d, cos_aZ, cos2_aZ, ...
    rng : Generator
        Source of randomness.

    Returns
    -------
    dict of (t,) arrays

    Raises
    ------
    ValueError
        As in the quantum calculation, and for less than one molecule.
    """
    times = np.asarray(times_ps, dtype=np.float64)
    if molecules < 1:
        raise ValueError(f"{molecules} molecules: 1 or more are expected")
    moments = scaled_moments(top)
    momentum = np.zeros((molecules, 3))
    if temperature_k:
        momentum = thermal_momenta(moments, RAD_PER_PS_MHZ * units.MHZ_PER_K * temperature_k, molecules, rng=rng)
    attitude = uniform(molecules, rng=rng)
    measures = [_measure(name, top) for name in observables]
    out = np.zeros((len(measures), len(times)))
    for first in range(0, molecules, PIECE):
        part = slice(first, first + PIECE)
        out += _summed(top, timeline(pulses), times, moments, momentum[part], attitude[part], measures)
    return dict(zip(observables, out / molecules, strict=True))


def scaled_moments(top: Top) -> Floats:
    """Principal moments along a, b, c in ħ² per rad/ps·ħ, 1/(2B); 0 for the axis of a linear top."""
    # ħ/(4π B) in rad/ps; 0 for the axis of a linear molecule
    return np.array([0.0 if math.isinf(x) else 1 / (2 * RAD_PER_PS_MHZ * x) for x in top.rotational_constants_mhz])


Measure = Callable[[Floats], Floats]  # attitudes (n, 4) -> values (n,)


def _measure(name: str, top: Top) -> Measure:
    body, space = figure_axis(top), 2
    if name.startswith(("cos_", "cos2_")):
        body, space = "abc".index(name[-2]), "XYZ".index(name[-1])
    axis = np.eye(3)[body]
    if name.startswith("cos2theta_2d"):
        return lambda attitude: np.abs(rotate(attitude, axis)[..., space])
    power = 2 if name.startswith("cos2") else 1
    return lambda attitude: rotate(attitude, axis)[..., space] ** power


def _summed(
    top: Top,
    windows: Sequence[Window],
    times: Floats,
    moments: Floats,
    momentum: Floats,
    attitude: Floats,
    measures: Sequence[Measure],
) -> Floats:
    """Sums of the measures over a batch of bodies, (measures, t)."""
    out = np.zeros((len(measures), len(times)))
    now = min(float(times[0]), windows[0].start_ps)
    for window in windows:
        here = _between(times, now, window.start_ps)
        listed = np.append(times[here], window.start_ps) - now
        momentum, attitude = _freely(moments, momentum, attitude, listed, measures, out, here)
        momentum, attitude = _through(top, window, times, moments, momentum, attitude, measures, out)
        # a linear top has no angular momentum about its axis, except for round-off
        momentum = np.where(moments > 0, momentum, 0.0)
        now = window.stop_ps
    here = _between(times, now, np.inf)
    _freely(moments, momentum, attitude, times[here] - now, measures, out, here)
    return out


def _freely(
    moments: Floats,
    momentum: Floats,
    attitude: Floats,
    later: Floats,
    measures: Sequence[Measure],
    out: Floats,
    places: Ints,
) -> tuple[Floats, Floats]:
    """Free motion to the last of the times `later`; writes the measures into `out` at `places`.

    Both methods are exact: symmetric tops are rotated from each time to the next, others follow from elliptic functions.
    """
    axial = len(np.unique(moments)) < 3
    motion = None if axial else free_motion(moments, momentum, attitude)
    now = 0.0
    for number, time in enumerate(later.tolist()):
        if motion is not None:
            momentum, attitude = motion.at(time)
        elif time > now:
            moved = integrate(SymmetricTopSplitting(time - now), moments, momentum, [now, time], attitude)
            momentum, attitude, now = moved.momentum[:, -1], moved.attitude[:, -1], time
        if number < len(places):
            out[:, places[number]] = [measure(attitude).sum() for measure in measures]
    return momentum, attitude


def _between(times: Floats, first: float, last: float) -> Ints:
    return np.flatnonzero((times >= first) & (times <= last))


def _through(
    top: Top,
    window: Window,
    times: Floats,
    moments: Floats,
    momentum: Floats,
    attitude: Floats,
    measures: Sequence[Measure],
    out: Floats,
) -> tuple[Floats, Floats]:
    """The bodies after a window; writes the measures at times inside it into `out`."""
    if window.is_kick:
        kick = window.channels[0].pulses[0]
        area = kick.area if isinstance(kick, Kick) else 0.0
        push = _torque(top, window.channels[0], lambda _: area)
        return momentum + push.torque(0.0, attitude, np.zeros_like(momentum)), attitude
    inside = np.flatnonzero((times > window.start_ps) & (times < window.stop_ps))
    listed = np.concatenate([[window.start_ps], times[inside], [window.stop_ps]])
    effects = [_torque(top, channel, _history(channel)) for channel in window.channels]
    method = SymmetricTopSplitting(_step_ps(top, window, moments, momentum))
    motion = integrate(method, moments, momentum, listed, attitude, effects)
    for place, turned in zip(inside.tolist(), np.moveaxis(motion.attitude, 1, 0)[1:-1], strict=True):
        out[:, place] = [measure(turned).sum() for measure in measures]
    return motion.momentum[:, -1], motion.attitude[:, -1]


def _step_ps(top: Top, window: Window, moments: Floats, momentum: Floats) -> float:
    """Step of a window: a part of it that is also short for libration in the field, ω² = 2 U0/I, and for rotation in the gas.

    Rotation about the figure axis of an axial top changes no energy and is not counted.
    """
    moving = np.delete(np.arange(3), figure_axis(top)) if top.kind != "asymmetric" else np.arange(3)
    times = np.linspace(window.start_ps, window.stop_ps, STEPS_PER_WINDOW + 1)
    depth = sum(spread(acted_on(top, channel.acts_on)) * np.abs(channel.strength(times)) for channel in window.channels)
    libration = 2.0 * np.max(depth) / moments[moving].min()
    rotation = np.mean((momentum[:, moving] / moments[moving]) ** 2, axis=0).max()
    length: float = window.stop_ps - window.start_ps
    return min(length / STEPS_PER_WINDOW, STEP_RAD / math.sqrt(libration + rotation)) if libration else length


def _history(channel: Channel) -> Callable[[float], float]:
    return lambda time: float(channel.strength(np.array([time]))[0])


def _torque(top: Top, channel: Channel, history: Callable[[float], float]) -> Torque:
    body = acted_on(top, channel.acts_on)
    if channel.acts_on == "dipole":
        return PulsedDipole(body, channel.space, history)
    return PulsedPolarizability(body, channel.space, history)
