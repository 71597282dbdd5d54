"""Picture of alignment: pulses above, cosines against time below; the classical gas is dashed."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor import units
from rotor.alignment.align import AlignmentTrace
from rotor.alignment.pulse import RAD_PER_PS_ANGSTROM3_W_PER_CM2, RAD_PER_PS_MHZ, DipolePulse, Kick
from rotor.alignment.request import AlignAnswer
from rotor.arrays import Floats
from rotor.plots.picture import GREY, PALETTE, WIDTH_INCHES, Picture, new_figure, styled, top_title
from rotor.plots.view import WHOLE, View, show_part

SIZE_INCHES = (WIDTH_INCHES, 4.2)
NAMES = {"cos2theta": "⟨cos²θ⟩", "costheta": "⟨cosθ⟩", "cos2theta_2d": "⟨cos²θ$_{2D}$⟩"}
SQUARE = re.compile(r"cos(2?)_([abc][XYZ])")
NARROW = 1 / 100  # of the time range: shorter pulses are drawn as a line
PER_TW = 1e12  # W/cm² in 1 TW/cm²


def alignment_figure(trace: AlignmentTrace, *, classical: Mapping[str, Floats] | None = None, title: str = "") -> Any:
    """A matplotlib figure of cosines against time; `classical` has cosines of a classical gas, by the same names.

    Raises ValueError for a trace with fewer than two times.
    """
    if len(trace.t_ps) < 2:
        raise ValueError("a picture of a trace needs two times or more")
    with styled():
        figure = new_figure(SIZE_INCHES)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 5))
        _pulses(above, trace)
        _cosines(below, trace, classical or {})
        above.set_title(title, loc="left")
    return figure


def picture(
    thing: AlignmentTrace | AlignAnswer,
    *,
    classical: Mapping[str, Floats] | None = None,
    title: str | None = None,
    view: View = WHOLE,
) -> Picture:
    """The picture of a trace, or of the answer that has it.

    classical: cosines of a classical gas at the same times. title: by default name and gas. view: of times (ps) and cosines.
    """
    if isinstance(thing, AlignAnswer):
        classical, thing = classical or thing.classical, thing.trace
    default = ", ".join(filter(None, (top_title(thing.top), thing.gas_text)))
    title = (default if title is None else title) if view.title is None else view.title
    figure = alignment_figure(thing, classical=classical, title=title)
    show_part(figure.axes[1], view)  # the cosines; both panels share the times
    return Picture(figure, title, thing.provenance)


def _pulses(axes: Any, trace: AlignmentTrace) -> None:
    """Draw pulses in TW/cm² or kV/cm; relative to their peaks if they include a kick or both units."""
    name, unit = _scale(trace)
    highest = 0.0
    for pulse in trace.pulses:
        first, last = pulse.window_ps
        times = np.linspace(first, last, 301)
        strength = np.ones(301) if isinstance(pulse, Kick) else pulse.strength(times)
        height = strength / (np.abs(strength).max() if unit is None else unit)
        peak = int(np.abs(height).argmax())
        highest = max(highest, float(np.abs(height[peak])))
        if last - first < NARROW * (trace.t_ps[-1] - trace.t_ps[0]):
            axes.plot([times[peak]] * 2, [0, height[peak]], color=GREY, linewidth=1.2)
        else:
            axes.fill_between(times, height, color=GREY, alpha=0.6, linewidth=0)
    axes.set_yticks([0, highest] if highest else [], ["0", f"{highest:.3g}"] if highest else [])
    axes.set_ylabel(name)


def _scale(trace: AlignmentTrace) -> tuple[str, float | None]:
    """Title of the pulse axis, and its unit in the unit of `pulse.strength`; None for relative heights."""
    pulses = trace.pulses
    if any(isinstance(pulse, Kick) for pulse in pulses) or len({pulse.acts_on for pulse in pulses}) != 1:
        return "Pulses\n(relative)", None
    if isinstance(pulses[0], DipolePulse):
        return "Field\n(kV/cm)", RAD_PER_PS_MHZ * units.MHZ_PER_DEBYE_KV_PER_CM
    return "Intensity\n(TW/cm²)", PER_TW * RAD_PER_PS_ANGSTROM3_W_PER_CM2


def _name(cosine: str) -> str:
    """A cosine as a formula.

    >>> _name("cos2_aX"), _name("costheta")
    ('⟨cos²θ$_{aX}$⟩', '⟨cosθ⟩')
    """
    axes = SQUARE.fullmatch(cosine)
    return f"⟨cos{'²' if axes[1] else ''}θ$_{{{axes[2]}}}$⟩" if axes else NAMES.get(cosine, cosine)


def _cosines(axes: Any, trace: AlignmentTrace, classical: Mapping[str, Floats]) -> None:
    for place, (name, values) in enumerate(trace.cosines.items()):
        colour = PALETTE[place % len(PALETTE)]
        axes.plot(trace.t_ps, values, color=colour, linewidth=1.0, label=_name(name))
        if name in classical:
            label = f"{_name(name)}, classical"
            axes.plot(
                trace.t_ps, classical[name], color=colour, linewidth=1.0, linestyle=(0, (4, 2)), alpha=0.8, label=label
            )
    if len(trace.cosines) == 1 and "cos2theta" in trace.cosines:
        axes.axhline(1 / 3, color=GREY, linewidth=0.6, linestyle=":")
    axes.set_ylabel(", ".join(map(_name, trace.cosines)))
    axes.set_xlabel("Time (ps)")
    # a margin shows a pulse at the first time
    axes.set_xlim(trace.t_ps[0] - 0.01 * (trace.t_ps[-1] - trace.t_ps[0]), trace.t_ps[-1])
    if len(trace.cosines) > 1 or classical:
        axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside lower right", ncols=4, fontsize=9)
