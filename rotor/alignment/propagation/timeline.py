"""Pulses in order of time: windows with fields, kicks, and free intervals between them.

Overlapping windows are merged; a kick divides the window that contains it. Inside a window, pulses of the same polarization act
through the same operator and add up. Outside the windows nothing is integrated: the phases of free rotation are exact there, so no
solver can skip a pulse.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotor.alignment.pulse import Kick, Pulse
from rotor.arrays import Floats

SAME_AXIS = 1e-12  # largest difference of polarization tensors that are the same


@dataclass(frozen=True)
class Channel:
    """Pulses that act through one operator: on the polarizability or the dipole, with one space tensor."""

    acts_on: str
    space: Floats
    pulses: tuple[Pulse, ...]

    def strength(self, times_ps: Floats) -> Floats:
        """Sum over the pulses, each zero outside its own window; rad/ps for 1 Å³ or 1 D."""
        total = np.zeros(len(times_ps))
        for pulse in self.pulses:
            first, last = pulse.window_ps
            inside = (times_ps >= first) & (times_ps <= last)
            total[inside] += pulse.strength(times_ps[inside])
        return total


@dataclass(frozen=True)
class Window:
    """An interval from `start_ps` to `stop_ps` with active channels; breaks : times at which they are not smooth."""

    start_ps: float
    stop_ps: float
    channels: tuple[Channel, ...]
    breaks_ps: tuple[float, ...] = ()

    @property
    def is_kick(self) -> bool:
        """Whether it has no duration."""
        return self.start_ps == self.stop_ps


def pulse_channels(pulses: Sequence[Pulse]) -> tuple[Channel, ...]:
    """Pulses grouped by the operator through which they act."""
    out: list[Channel] = []
    for pulse in pulses:
        space = pulse.space_tensor
        for place, channel in enumerate(out):
            if channel.acts_on == pulse.acts_on and np.abs(channel.space - space).max() <= SAME_AXIS:
                out[place] = Channel(channel.acts_on, channel.space, (*channel.pulses, pulse))
                break
        else:
            out.append(Channel(pulse.acts_on, space, (pulse,)))
    return tuple(out)


def timeline(pulses: Sequence[Pulse]) -> tuple[Window, ...]:
    """The windows of pulses in order of time.

    >>> from rotor.alignment.pulse import GaussianPulse
    >>> [window.start_ps for window in timeline([GaussianPulse(1e12, 1.0, 20.0), GaussianPulse(1e12, 1.0)])]
    [-3.5, 16.5]
    """
    lasting = sorted((pulse for pulse in pulses if not isinstance(pulse, Kick)), key=lambda pulse: pulse.window_ps)
    kicks = sorted((pulse for pulse in pulses if isinstance(pulse, Kick)), key=lambda pulse: pulse.time_ps)
    merged: list[list[Pulse]] = []
    end = -np.inf
    for pulse in lasting:
        first, last = pulse.window_ps
        if first < end:
            merged[-1].append(pulse)
        else:
            merged.append([pulse])
        end = max(end, last)

    windows = [piece for group in merged for piece in _cut(group, [kick.time_ps for kick in kicks])]
    windows += [Window(kick.time_ps, kick.time_ps, pulse_channels([kick])) for kick in kicks]
    return tuple(sorted(windows, key=lambda window: (window.start_ps, window.stop_ps)))


def _cut(group: Sequence[Pulse], kicks: Sequence[float]) -> list[Window]:
    """The window of overlapping pulses, divided at the kicks inside it."""
    start, stop = min(pulse.window_ps[0] for pulse in group), max(pulse.window_ps[1] for pulse in group)
    edges = {time for pulse in group for time in (*pulse.window_ps, *pulse.breaks_ps)}
    times = [start, *sorted({time for time in kicks if start < time < stop}), stop]
    out = []
    for first, last in itertools.pairwise(times):
        here = [pulse for pulse in group if pulse.window_ps[0] < last and pulse.window_ps[1] > first]
        breaks = tuple(sorted(time for time in edges if first < time < last))
        out.append(Window(first, last, pulse_channels(here), breaks))
    return out
