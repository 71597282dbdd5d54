"""Work-precision pictures: error of a calculation against its processor time, one panel for each parameter, settings named at the points.

A line joins four settings or more; fewer (such as three methods) are marks alone. Names of settings that would lie on another name or a
mark are left out.
"""

from __future__ import annotations

import math
import os
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rotor.plots.picture import BLUE, GREY, ORANGE, PALETTE, checked_suffix, name_text, new_figure, save, styled

PANEL_INCHES = (2.75, 2.6)  # of two in a row: letters of 8.5 pt have 5.2 pt at the width of a journal column (8.5 cm)
SINGLE_INCHES = (4.8, 3.4)
TITLE_LETTERS = 34  # that fit above one of two panels
MOST_CURVES = 2  # of a panel beside another; panels with more have the whole width
NAME_POINTS = 8.5  # size of the settings at the points, and of the legend
LEAST_DRAWN = 1e-17  # an error of 0 is drawn as an open point below all others
PLACES = (
    (6.0, 2.0, "left"),
    (6.0, -8.0, "left"),
    (-6.0, -8.0, "right"),
    (-6.0, 2.0, "right"),
    (0.0, 8.0, "center"),
)  # offset (points) of a name from its mark, and its alignment
MARK_PIXELS = 3.0  # half of a mark
GAP_PIXELS = 4.0  # around a name, at 200 pixels an inch
LEAST_JOINED = 4  # settings; fewer are not joined by a line
MARKERS = "osD^vP*X"  # one more than colours, so that no two curves are alike


@dataclass(frozen=True)
class Point:
    """One setting. error: 0 if too small to be seen. own: the setting of the scene itself, drawn with a ring."""

    setting: str
    seconds: float
    error: float
    own: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves by name that share one unit of error. of: quantity of the error, with its unit. joined: False for methods, not a series."""

    title: str
    of: str
    curves: Mapping[str, Sequence[Point]]
    joined: bool = True


def work_precision_figure(panels: Sequence[Panel], title: str = "") -> Any:
    """A matplotlib figure of panels, two in a row, or below each other where a panel has more than two curves.

    Raises ValueError where there is no point to draw.
    """
    if not any(points for panel in panels for points in panel.curves.values()):
        raise ValueError("a work-precision picture needs a setting that was measured; there is none")
    across = 1 if any(len(panel.curves) > MOST_CURVES for panel in panels) else min(len(panels), 2)
    down = math.ceil(len(panels) / across)
    wide, high = PANEL_INCHES if across > 1 else SINGLE_INCHES
    with styled():
        figure = new_figure((across * wide, high * down + 0.3))
        all_axes = figure.subplots(down, across, squeeze=False).ravel()
        letters = TITLE_LETTERS if across > 1 else 2 * TITLE_LETTERS
        drawn = [_draw(axes, panel, letters) for axes, panel in zip(all_axes, panels, strict=False)]
        for axes in all_axes[len(panels) :]:
            axes.set_axis_off()
        if title:
            figure.suptitle(title, x=0.01, ha="left")
        figure.canvas.draw()  # places the axes, so that names can be placed in pixels
        for axes, curves in zip(all_axes, drawn, strict=False):
            _name_settings(axes, curves)
    return figure


def plot_work_precision(
    panels: Sequence[Panel], path: str | os.PathLike[str], *, title: str = "", facts: Mapping[str, Any] | None = None
) -> None:
    """Draw `work_precision_figure` into a .png, .pdf or .svg file.

    panels: panels, at least one with a point. path: its suffix chooses the format. title: title of the picture. facts: entries of the
    metadata.
    Raises ValueError where there is no point to draw, and for a suffix other than .png, .pdf, .svg.
    """
    checked_suffix(path)
    save(work_precision_figure(panels, title), path, title or "work and precision", facts or {})


Places = list[tuple[Point, float]]  # settings of a curve, with the errors as drawn


def _draw(axes: Any, panel: Panel, letters: int) -> list[Places]:
    """Draw the curves of a panel; their settings with the errors as drawn. letters: width of the titles."""
    points = [point for curve in panel.curves.values() for point in curve]
    floor = max(min((point.error for point in points if point.error > 0.0), default=0.0) / 10.0, LEAST_DRAWN)
    few = len(panel.curves) == 1
    drawn: list[Places] = []
    for number, (name, curve) in enumerate(panel.curves.items()):
        colour, marker = (BLUE, "o") if few else (PALETTE[number % len(PALETTE)], MARKERS[number % len(MARKERS)])
        errors = _curve(axes, curve, floor, (colour, marker, name), panel.joined)
        drawn.append(list(zip(curve, errors, strict=True)))
    axes.set(
        xscale="log", yscale="log", xlabel="Processor time (s)", ylabel=textwrap.fill(f"Error of {panel.of}", letters)
    )
    axes.margins(x=0.25, y=0.15)
    _scale(axes)
    if any(point.error == 0.0 for point in points):
        axes.text(
            0.99, 0.01, "open points: error 0", transform=axes.transAxes, ha="right", fontsize=NAME_POINTS, color=GREY
        )
    axes.set_title(textwrap.fill(panel.title[:1].upper() + panel.title[1:], letters), loc="left", fontsize=9.0)
    axes.grid(alpha=0.25)
    if not few:
        _legend_above(axes, [name_text(name) for name in panel.curves])
    return drawn


def _legend_above(axes: Any, names: Sequence[str]) -> None:
    """The names of the curves between title and axes, where no mark lies, in as many columns as fit."""
    widest = max(map(len, names)) * 0.5 * NAME_POINTS / 72 + 0.35  # inches: half a font size a letter, and the mark
    columns = max(1, min(len(names), int(0.8 * axes.figure.get_figwidth() / axes.get_gridspec().ncols / widest)))
    axes.legend(
        fontsize=NAME_POINTS,
        ncols=columns,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
        handletextpad=0.2,
        columnspacing=1.0,
    )
    rows = math.ceil(len(names) / columns)
    axes.set_title(axes.get_title(loc="left"), loc="left", fontsize=9.0, pad=6 + 1.55 * NAME_POINTS * rows)


def _scale(axes: Any) -> None:
    """Let the time axis span a factor of ten at least, so that similar times look similar."""
    low, high = axes.get_xlim()
    if high < 10.0 * low:
        middle = math.sqrt(low * high)
        axes.set_xlim(middle / math.sqrt(10.0), middle * math.sqrt(10.0))
    _label(axes.xaxis, axes.get_xlim())
    _label(axes.yaxis, axes.get_ylim())


def _label(axis: Any, limits: tuple[float, float]) -> None:
    """Label powers of ten, and 2 and 5 times these where the axis spans less than two decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    short = limits[1] < 100.0 * limits[0]
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,), numticks=8))
    if short:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _curve(axes: Any, curve: Sequence[Point], floor: float, look: tuple[str, str, str], joined: bool) -> list[float]:
    """Draw one curve; return the errors as drawn (0 is raised to `floor`)."""
    colour, marker, name = look
    times, errors = [point.seconds for point in curve], [max(point.error, floor) for point in curve]
    if joined and len(curve) >= LEAST_JOINED:
        axes.plot(times, errors, color=colour, linewidth=0.8, alpha=0.6)
    for point, error in zip(curve, errors, strict=True):
        axes.plot(
            point.seconds,
            error,
            marker,
            color=colour,
            markersize=4.5,
            fillstyle="full" if point.error > 0.0 else "none",
        )
        if point.own:
            axes.plot(point.seconds, error, "o", color=ORANGE, markersize=10, fillstyle="none")
    axes.plot([], [], marker, color=colour, markersize=4.5, label=name_text(name))
    return errors


def _name_settings(axes: Any, curves: Sequence[Places]) -> None:
    """Write the setting beside each point, the ends of curves first, unless it would lie on another name or a mark."""
    marks = axes.transData.transform([(point.seconds, error) for curve in curves for point, error in curve])
    boxes: list[Any] = []
    ends = [place for curve in curves for place in (curve[0], curve[-1])[: len(curve)]]
    inner = [place for curve in curves for place in curve[1:-1]]
    for point, error in ends + inner:
        if not point.setting:
            continue
        text = axes.annotate(
            setting_text(point.setting),
            (point.seconds, error),
            xytext=(0, 0),
            textcoords="offset points",
            fontsize=NAME_POINTS,
            color=GREY,
        )
        text.set_in_layout(False)
        if not any(_fits_at(text, axes, offset, boxes, marks) for offset in PLACES):
            text.remove()


def setting_text(setting: str) -> str:
    """A setting for matplotlib, powers written as such.

    >>> setting_text("1e-06"), setting_text("J^10"), setting_text("0.001"), setting_text("N-diagonal")
    ('$10^{-6}$', '$J^{10}$', '0.001', 'N-diagonal')
    """
    if power := re.fullmatch(r"1e([+-]?\d+)", setting):
        return f"$10^{{{int(power[1])}}}$"
    if power := re.fullmatch(r"(.*)\b([A-Z])\^(\d+)", setting):
        return f"{power[1]}${power[2]}^{{{power[3]}}}$"
    return setting.replace("$", r"\$")


def _fits_at(text: Any, axes: Any, place: tuple[float, float, str], boxes: list[Any], marks: Any) -> bool:
    """Move a name to a place beside its point; whether it is free there. If so, its box is added to `boxes`."""
    across, up, side = place
    text.set_position((across, up))
    text.set_horizontalalignment(side)
    box = text.get_window_extent().padded(GAP_PIXELS)
    around = box.padded(MARK_PIXELS)
    x, y = marks[:, 0], marks[:, 1]
    covered = ((x > around.x0) & (x < around.x1) & (y > around.y0) & (y < around.y1)).any()
    inside = axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1 and axes.bbox.y0 <= box.y0 and box.y1 <= axes.bbox.y1
    if not inside or covered or any(box.overlaps(other) for other in boxes):
        return False
    boxes.append(box)
    return True
