"""The polhode picture: the momentum sphere with polhodes, separatrix and the motion, and L in the body over time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.classical.free.free_motion import FreeMotion
from rotor.classical.tumble import PERIODS, TumbleAnswer
from rotor.plots.motion.sphere import (
    LARGE,
    MIDDLE,
    MOTION,
    SMALL,
    clear_view,
    draw_axes,
    draw_curve,
    draw_family,
    draw_sphere,
)
from rotor.plots.picture import WIDTH_INCHES, Picture, new_figure, styled
from rotor.version import version

SIZE_INCHES = (WIDTH_INCHES, 3.4)
POINTS = 1500  # per curve
MOST_PERIODS = 12  # in the diagram over time; more would be a solid band


def polhode_figure(
    motion: FreeMotion,
    times: ArrayLike,
    *,
    axis_names: tuple[str, str, str] = ("1", "2", "3"),
    time_label: str = "Time",
    time_factor: float = 1.0,
    title: str = "",
) -> Any:
    """A matplotlib figure of one free motion: the path of L in the body, and its components over time.

    Left: the sphere of directions of L in principal axes, with polhodes about the axes of smallest (blue) and largest
    moment (green), the separatrix (black) and the path of L from the first to the last time (orange; the dot is the
    start). Filled axis ends are stable, open ones unstable. Right: the components of L/|L| over time.

    Parameters
    ----------
    motion : FreeMotion
        Motion of one body, in any units.
    times : (n,) array
        Times in the units of the motion; only the first and last count.
    axis_names : (str, str, str), optional
        Names of the principal axes.
    time_label : str, optional
        Label of the time axis.
    time_factor : float, optional
        Factor that converts the times to the unit of the label.
    title : str, optional
        Title of the picture.

    Returns
    -------
    matplotlib.figure.Figure
        Two panels.

    Raises
    ------
    ValueError
        For a body at rest, for more than one body, and for no times.
    """
    times = np.asarray(times, dtype=np.float64)
    size = np.linalg.norm(motion.momentum0, axis=-1)
    if motion.moments.shape != (3,) or not size > 0.0 or not times.size:
        raise ValueError("a polhode picture needs one body with an angular momentum, and at least one time")
    with styled():
        figure = new_figure(SIZE_INCHES)
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
        span, cut = _shown(motion, times)
        drawn = np.linspace(*span, POINTS)
        path = motion.at(drawn)[0] / size
        _draw_left(left, motion, path, axis_names)
        _draw_right(right, motion.moments, drawn * time_factor, path, axis_names)
        _mark_period(right, drawn[0] * time_factor, drawn[-1] * time_factor, float(motion.period) * time_factor)
        right.set(
            xlabel=time_label + (f" (the first {MOST_PERIODS} periods)" if cut else ""),
            ylabel="Angular momentum $L_i/|L|$",
        )
        if title:
            figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    return figure


def picture(thing: FreeMotion | TumbleAnswer, times: ArrayLike | None = None, **options: Any) -> Picture:
    """The picture of a free motion, by default over the periods that an answer has, or of an answer; options: of `polhode_figure`."""
    if isinstance(thing, TumbleAnswer):
        units = thing.request.units
        times = thing.table.times / units.time_factor if times is None else times
        label = f"Time ({units.time})" if units.time else "Time"
        options = {"axis_names": thing.request.axes, "time_label": label, "time_factor": units.time_factor, **options}
        thing = thing.motion
    if times is None:
        period = float(thing.period)
        times = [0.0, PERIODS * period if math.isfinite(period) else 20 * math.pi / float(thing.turning_rate)]
    figure = polhode_figure(thing, times, **options)
    return Picture(figure, options.get("title") or "polhodes", {"program": "rotor", "version": version()})


def _shown(motion: FreeMotion, times: Floats) -> tuple[tuple[float, float], bool]:
    """First and last time of the diagrams; a long motion is shown for its first periods."""
    first, last = float(times.min()), float(times.max())
    rhythm = float(motion.period) if np.isfinite(motion.period) else math.inf
    cut = last - first > MOST_PERIODS * rhythm
    return (first, first + MOST_PERIODS * rhythm if cut else last), cut


def _draw_left(axes: Any, motion: FreeMotion, path: Floats, names: tuple[str, str, str]) -> None:
    view = clear_view(motion.moments, path[0])
    draw_sphere(axes)
    draw_family(axes, view, motion.moments)
    draw_curve(axes, view, path, color=MOTION, linewidth=2.2, label="this motion")
    _draw_direction(axes, view, path)
    draw_axes(axes, view, motion.moments, names)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.09), ncols=2, frameon=False, handlelength=1.6)


def _draw_direction(axes: Any, view: Any, path: Floats) -> None:
    """A dot at the start, and an arrow on the visible part of the path nearest to the eye."""
    x, y = view.flat(path[0])
    hidden = view.depth(path[0]) < 0.0
    axes.plot(x, y, "o", ms=5, mfc=MOTION, mec="white", mew=0.8, alpha=0.4 if hidden else 1.0, zorder=8)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    if steps.max() < 1e-9:
        return
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    expected = min(0.45, 0.4 * travelled[-1])
    arrow = int(np.clip(np.searchsorted(travelled, expected), 1, len(path) - 1))
    if view.depth(path[arrow]) > 0.0:
        axes.annotate(
            "", view.flat(path[arrow]), view.flat(path[arrow - 1]), zorder=8,
            arrowprops={"arrowstyle": "-|>,head_width=0.28,head_length=0.5", "color": MOTION, "lw": 1.2,
                        "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


def _mark_period(axes: Any, first: float, last: float, period: float) -> None:
    if last - first > period:
        axes.axvline(first + period, color="0.6", linewidth=0.8, linestyle="--", zorder=0)
        axes.text(first + period, -1.24, " period", fontsize=9, color="0.4", ha="left", va="bottom")


def _draw_right(axes: Any, moments: Floats, times: Floats, path: Floats, names: tuple[str, str, str]) -> None:
    rank = np.argsort(np.argsort(moments, kind="stable"))
    for axis, name in enumerate(names):
        colour = (SMALL, MIDDLE, LARGE)[rank[axis]]
        axes.plot(times, path[:, axis], color=colour, linewidth=1.3, label=rf"$L_{{\mathrm{{{name}}}}}$")
    axes.set(ylim=(-1.28, 1.12), yticks=(-1, -0.5, 0, 0.5, 1))
    if times[-1] > times[0]:
        axes.set_xlim(times[0], times[-1])
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
