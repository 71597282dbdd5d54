"""Work-precision pictures: the error of a calculation against its processor time, one panel a knob, its settings named at the points."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rotor.plots.picture import BLUE, GREY, ORANGE, PALETTE, checked_suffix, new_figure, save, styled

PANEL_INCHES = (3.6, 2.8)
LEAST_DRAWN = 1e-17  # an error of 0 is drawn as an open point below all others
MARKERS = "osD^vP*"  # one more than colours, so that no two curves are alike


@dataclass(frozen=True)
class Point:
    """One setting. error: 0 where it cannot be seen. own: drawn with a ring."""

    setting: str
    seconds: float
    error: float
    own: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves by name that share one unit of error. of: what the error is of, with its unit."""

    title: str
    of: str
    curves: Mapping[str, Sequence[Point]]


def work_precision_figure(panels: Sequence[Panel], title: str = "") -> Any:
    """A matplotlib figure of panels side by side, two in a row.

    Raises ValueError where there is no point to draw.
    """
    if not any(points for panel in panels for points in panel.curves.values()):
        raise ValueError("a work-precision picture needs a setting that was measured; there is none")
    across = min(len(panels), 2)
    down = math.ceil(len(panels) / across)
    wide, high = PANEL_INCHES
    with styled():
        figure = new_figure(
            (2 * wide if across == 1 else across * wide, (1.3 if across == 1 else 1.0) * high * down + 0.3)
        )
        every = figure.subplots(down, across, squeeze=False).ravel()
        for axes, panel in zip(every, panels, strict=False):
            _draw(axes, panel)
        for axes in every[len(panels) :]:
            axes.set_axis_off()
        if title:
            figure.suptitle(title, x=0.01, ha="left")
    return figure


def plot_work_precision(
    panels: Sequence[Panel], path: str | os.PathLike[str], *, title: str = "", facts: Mapping[str, Any] | None = None
) -> None:
    """Draw `work_precision_figure` into a .png, .pdf or .svg file.

    Parameters
    ----------
    panels : sequence of Panel
        At least one of them with a point.
    path : path
        Its suffix chooses the format.
    title : str
        Above the picture.
    facts : mapping, optional
        For the metadata.

    Raises
    ------
    ValueError
        Where there is no point to draw, and for a suffix that is no picture.
    """
    checked_suffix(path)
    save(work_precision_figure(panels, title), path, title or "work and precision", facts or {})


def _draw(axes: Any, panel: Panel) -> None:
    points = [point for curve in panel.curves.values() for point in curve]
    floor = max(min((one.error for one in points if one.error > 0.0), default=0.0) / 10.0, LEAST_DRAWN)
    few = len(panel.curves) == 1
    for number, (name, curve) in enumerate(panel.curves.items()):
        colour, marker = (BLUE, "o") if few else (PALETTE[number % len(PALETTE)], MARKERS[number % len(MARKERS)])
        errors = _curve(axes, curve, floor, (colour, marker, name))
        if few:
            _name(axes, curve, errors)
        else:
            _name(axes, [curve[0], curve[-1]], [errors[0], errors[-1]])
    axes.set(xscale="log", yscale="log", xlabel="processor time (s)", ylabel=panel.of)
    axes.margins(x=0.25, y=0.1)
    _at_least_a_decade(axes)
    if any(one.error == 0.0 for one in points):
        axes.text(0.99, 0.01, "open points: error 0", transform=axes.transAxes, ha="right", fontsize=6.5, color=GREY)
    axes.set_title(panel.title, loc="left")
    axes.grid(alpha=0.25)
    if not few:
        axes.legend(frameon=False, fontsize=7)


def _at_least_a_decade(axes: Any) -> None:
    """Times that are alike stay alike: the axis of time spans a factor of ten at least, with labels at powers of ten and few others."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axes.get_xlim()
    if high < 10.0 * low:
        middle = math.sqrt(low * high)
        axes.set_xlim(middle / math.sqrt(10.0), middle * math.sqrt(10.0))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=8))
        axis.set_minor_formatter(NullFormatter())


def _curve(axes: Any, curve: Sequence[Point], floor: float, look: tuple[str, str, str]) -> list[float]:
    """Draw one curve; the errors as they are drawn."""
    colour, marker, name = look
    times, errors = [one.seconds for one in curve], [max(one.error, floor) for one in curve]
    axes.plot(times, errors, color=colour, linewidth=0.8, alpha=0.6)
    for one, error in zip(curve, errors, strict=True):
        axes.plot(
            one.seconds, error, marker, color=colour, markersize=4.5, fillstyle="full" if one.error > 0.0 else "none"
        )
        if one.own:
            axes.plot(one.seconds, error, "o", color=ORANGE, markersize=10, fillstyle="none")
    axes.plot([], [], marker, color=colour, markersize=4.5, label=name)
    return errors


def _name(axes: Any, curve: Sequence[Point], errors: Sequence[float]) -> None:
    """The setting beside each point, once where points coincide."""
    spread = math.log10(max(errors) / min(errors)) or 1.0
    last = math.inf
    for one, error in zip(curve, errors, strict=True):
        if abs(math.log10(error) - last) < 0.03 * spread:
            continue
        last = math.log10(error)
        axes.annotate(
            one.setting, (one.seconds, error), xytext=(6, 2), textcoords="offset points", fontsize=6.5, color=GREY
        )
