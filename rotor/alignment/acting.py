"""The tensor that a pulse acts on (polarizability or dipole), the highest J that is reached, and the revival period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.alignment.propagation.timeline import Channel, Window
from rotor.alignment.pulse import RAD_PER_PS_ANGSTROM3_W_PER_CM2, RAD_PER_PS_MHZ, GaussianPulse, Kick, Pulse
from rotor.arrays import Floats
from rotor.quantum.fields.blocks import Contraction

if TYPE_CHECKING:
    from rotor.tops.top import Top

_DIAGONAL = (np.arange(3), np.arange(3))
ISOTROPIC = 1e-14  # relative to the polarizability: a smaller anisotropy is round-off


def acted_on(top: Top, acts_on: str) -> Floats:
    """The property that a channel acts on: the traceless polarizability (3, 3) in Å³, or the dipole (3,) in D.

    Raises ValueError if it is unknown or has no effect.
    """
    name = top.name or "this top"
    if top.kind == "spherical":
        raise ValueError(
            f"{name} is a spherical top: its polarizability is isotropic and it has no dipole, so no pulse turns it"
        )
    if acts_on == "dipole":
        dipole = np.array(top.dipole_abc_debye if top.dipole_abc_debye is not None else (0.0, 0.0, 0.0), dtype=float)
        if not dipole.any():
            raise ValueError(f"{name} has no dipole, or an unknown one; a field needs a dipole to act on")
        return dipole
    if top.polarizability_abc_angstrom3 is None:
        raise ValueError(f"the polarizability of {name} is not known: give one, in principal axes (Å³)")
    whole = np.array(top.polarizability_abc_angstrom3, dtype=float)
    tensor = _traceless(whole)
    # the rounding of an isotropic tensor is no anisotropy
    if not np.abs(tensor).max() > ISOTROPIC * np.abs(whole).max():
        raise ValueError(f"the polarizability of {name} is isotropic: no light turns it")
    return tensor


def _traceless(tensor: Floats) -> Floats:
    out = tensor.copy()
    out[_DIAGONAL] -= out[_DIAGONAL].sum() / 3
    return out


def channel_contraction(top: Top, channel: Channel) -> Contraction:
    body, space = acted_on(top, channel.acts_on), np.array(channel.space)
    return Contraction(body, _traceless(space) if space.ndim == 2 else space)


def window_contractions(top: Top, windows: Sequence[Window]) -> tuple[tuple[Contraction, ...], ...]:
    return tuple(tuple(channel_contraction(top, channel) for channel in window.channels) for window in windows)


def guessed_jmax(top: Top, pulses: Sequence[Pulse], highest: int, tolerance: float) -> int:
    """Estimate of the highest J that a gas reaches from J = `highest`, with a margin for the tail.

    Each pulse adds min(P, √(J² + U0/B) - J), with P = ∫U0 dt/ħ and the well depth U0.

    Parameters
    ----------
    top : Top
        With the property that the pulses act on.
    pulses : sequence of Pulse
        In order of time.
    highest : int
        The highest populated J before the first pulse.
    tolerance : float
        Tolerance of the populations; determines the margin.

    Returns
    -------
    int
        Initial J max.

    Notes
    -----
    The population of the highest J must be checked after the propagation.
    """
    # a linear molecule has an infinite A
    smallest = RAD_PER_PS_MHZ * min(x for x in top.rotational_constants_mhz if math.isfinite(x))
    reached = float(highest)
    for pulse in pulses:
        size = spread(acted_on(top, pulse.acts_on))
        if isinstance(pulse, Kick):
            reached += size * pulse.area
            continue
        strength, area = _peak_and_area(pulse)
        # J grows by the area of a short pulse, at most to where rotation balances a long one
        reached += min(size * area, math.sqrt(reached**2 + size * strength / smallest) - reached)
    return int(reached + max(6.0, 6 - 1.5 * math.log10(tolerance) - highest / 5))


def spread(body: Floats) -> float:
    """Largest change of the energy with orientation, for strength 1."""
    if body.ndim == 1:
        return 2 * float(np.linalg.norm(body))
    values = np.linalg.eigvalsh(body)
    return float(values[-1] - values[0])


def _peak_and_area(pulse: Pulse) -> tuple[float, float]:
    if isinstance(pulse, GaussianPulse):
        peak = RAD_PER_PS_ANGSTROM3_W_PER_CM2 * pulse.peak_w_per_cm2
        # ∫ of a Gaussian with this full width at half maximum
        return peak, peak * pulse.fwhm_ps * math.sqrt(math.pi / (4 * math.log(2)))
    first, last = pulse.window_ps
    times = np.linspace(first, last, 1001)  # a plain sum over a fine grid: an estimate needs no more
    strength = np.abs(pulse.strength(times))
    return float(strength.max()), float(strength.sum() * (times[1] - times[0]))


def revival_period_ps(top: Top) -> float:
    """The revival period 1/(2Bc) of a rigid linear or symmetric top (B: the constant across its axis).

    >>> from rotor.tops.top import Top
    >>> round(revival_period_ps(Top.from_constants("B=6081.492 MHz")), 3)  # OCS
    82.217
    """
    a, b, _ = top.rotational_constants_mhz
    across = a if top.kind == "oblate" else b
    return 1e6 / (2 * across)
