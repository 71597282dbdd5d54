"""A picture of alignment: the pulses above, cosines against time below, the classical gas dashed beside the quantum one."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor.alignment.align import AlignmentTrace
from rotor.alignment.pulse import Kick
from rotor.arrays import Floats
from rotor.plots.picture import checked_suffix, joined, new_figure, save_described, styled
from rotor.plots.stark import COLOURS
from rotor.plots.view import WHOLE, View, show_part

SIZE_INCHES = (7.2, 4.6)
NAMES = {"cos2theta": "⟨cos²θ⟩", "costheta": "⟨cosθ⟩", "cos2theta_2d": "⟨cos²θ₂D⟩"}


def alignment_figure(trace: AlignmentTrace, *, classical: Mapping[str, Floats] | None = None, title: str = "") -> Any:
    """A matplotlib figure of cosines against time, of two times or more; `classical` are those of a gas, by the same names.

    Raises ValueError for a trace of one time.
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


def plot_alignment(
    trace: AlignmentTrace,
    path: str | os.PathLike[str],
    *,
    classical: Mapping[str, Floats] | None = None,
    title: str = "",
    view: View = WHOLE,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw `alignment_figure` into a .png, .pdf or .svg file.

    Parameters
    ----------
    trace : AlignmentTrace
        Of two times or more.
    path : path
        Its suffix chooses the format.
    classical : mapping, optional
        Cosines of a classical gas at the same times, by the same names.
    title : str
        Above the picture.
    view : View
        Times (ps) and cosines shown, and another title.
    provenance : mapping, optional
        Further facts for the metadata.

    Raises
    ------
    ValueError
        For a trace of one time, and for a suffix that is no picture.
    """
    checked_suffix(path)
    title = title if view.title is None else view.title
    figure = alignment_figure(trace, classical=classical, title=title)
    show_part(figure.axes[1], view)  # the cosines; times of both panels go together
    save_described(figure, path, title, joined(provenance, trace.provenance))


def _pulses(axes: Any, trace: AlignmentTrace) -> None:
    for pulse in trace.pulses:
        first, last = pulse.window_ps
        if isinstance(pulse, Kick):
            axes.plot([first, first], [0, 1], color="#555555", linewidth=1.2)
            continue
        times = np.linspace(first, last, 301)
        strength = pulse.strength(times)
        axes.fill_between(times, strength / np.abs(strength).max(), color="#999999", linewidth=0)
    axes.set_yticks([])
    axes.set_ylabel("field")
    axes.spines["left"].set_visible(False)


def _cosines(axes: Any, trace: AlignmentTrace, classical: Mapping[str, Floats]) -> None:
    for place, (name, values) in enumerate(trace.cosines.items()):
        colour = COLOURS[place % len(COLOURS)]
        axes.plot(trace.t_ps, values, color=colour, linewidth=1.0, label=NAMES.get(name, name))
        if name in classical:
            label = f"{NAMES.get(name, name)}, classical"
            axes.plot(
                trace.t_ps, classical[name], color=colour, linewidth=1.0, linestyle=(0, (4, 2)), alpha=0.8, label=label
            )
    if len(trace.cosines) == 1 and "cos2theta" in trace.cosines:
        axes.axhline(1 / 3, color="#555555", linewidth=0.6, linestyle=":")
        axes.set_ylabel(NAMES["cos2theta"])
    axes.set_xlabel("time (ps)")
    axes.set_xlim(trace.t_ps[0], trace.t_ps[-1])
    if len(trace.cosines) > 1 or classical:
        axes.legend(frameon=False, fontsize=8)
