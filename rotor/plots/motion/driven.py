"""Picture of a motion under effects: ω in the body, L in space and the energy over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.classical.driven import DrivenAnswer
from rotor.geometry.rotations import rotate
from rotor.plots.motion.sphere import LARGE, MIDDLE, MOTION, SMALL
from rotor.plots.picture import WIDTH_INCHES, Picture, new_figure, styled
from rotor.version import version

SIZE_INCHES = (WIDTH_INCHES, 5.4)
COLOURS = (SMALL, MIDDLE, LARGE)
CONSERVED = 1e-6  # relative change of an energy that is drawn as constant


def picture(answer: DrivenAnswer, title: str = "") -> Picture:
    """The picture of the motion of an answer, at its times."""
    motion, request = answer.motion, answer.request
    units = request.units
    space = rotate(motion.attitude, motion.momentum)
    with styled():
        figure = new_figure(SIZE_INCHES)
        above, middle, below = figure.subplots(3, 1, sharex=True)
        for k, colour in enumerate(COLOURS):
            above.plot(motion.times, motion.omega[:, k], color=colour, label=f"$ω_{{\\mathrm{{{request.axes[k]}}}}}$")
            middle.plot(motion.times, space[:, k], color=colour, label=f"$L_{'XYZ'[k]}$")
        below.plot(motion.times, motion.energy, color=MOTION)
        if (
            np.ptp(motion.energy) < CONSERVED * np.abs(motion.energy).max()
        ):  # an axis of round-off would show it as a change
            below.set_ylim(*sorted(motion.energy[0] * np.array([0.9, 1.1])))
        above.set_ylabel("ω in the body" + _bracket(f"rad/{units.time}" if units.time else ""))
        middle.set_ylabel("L in space" + _bracket(units.angular_momentum))
        below.set(ylabel="Energy" + _bracket(units.energy), xlabel="Time" + (f" ({units.time})" if units.time else ""))
        _legend(above)
        _legend(middle)
        if title:
            figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    return Picture(figure, title or "motion under effects", {"program": "rotor", "version": version()})


def _legend(axes: Any) -> None:
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)


def _bracket(unit: str) -> str:
    return f"\n({unit})" if unit else ""
