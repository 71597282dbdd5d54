"""Pictures of heat capacities: the quantum sum, the classical limit, and published values as points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.plots.picture import PALETTE, SIZE_INCHES, WIDTH_INCHES, Picture, new_figure, styled, top_title
from rotor.plots.view import WHOLE, View, show_part
from rotor.thermodynamics.functions import ThermoFunctions
from rotor.thermodynamics.request import ThermoAnswer, answer_thermo
from rotor.version import version

GREY = "#777777"
LOG_FROM = 30.0  # ratio of the last to the first temperature above which the axis is logarithmic
CURVE_POINTS = 300


@dataclass(frozen=True)
class Points:
    """Published values: their label, temperatures in K, and C_v/R without translation."""

    label: str
    temperature_k: NDArray[np.float64]
    cv_over_r: NDArray[np.float64]


@dataclass(frozen=True)
class Panel:
    """One panel: functions by curve name, and published points, drawn in the colour of the curve with the same name."""

    title: str
    curves: Mapping[str, ThermoFunctions]
    points: Sequence[Points] = field(default=())


def heat_capacity_figure(panels: Sequence[Panel], columns: int = 2, view: View = WHOLE) -> Any:
    """A matplotlib figure of C_v/R of rotation, and of vibration if given, against temperature.

    Solid lines: quantum sums; thick grey: classical limit; dotted: classical limit with first corrections, for the first curve;
    dashed: with vibrational states. The `log` of a view refers to the temperature axis.
    """
    if not panels or not all(panel.curves for panel in panels):
        raise ValueError("a picture of heat capacities needs a panel, and a curve in each")
    rows = -(-len(panels) // columns)
    across = min(columns, len(panels))
    size = SIZE_INCHES if len(panels) == 1 else (max(WIDTH_INCHES, 3.0 * across), 3.4 * rows)
    with styled():
        figure = new_figure(size)
        for panel, axes in zip(panels, figure.subplots(rows, across, squeeze=False).flat, strict=False):
            _draw(axes, panel)
            _frame(axes, view)
    return figure


def picture(
    thing: ThermoAnswer | ThermoFunctions | Sequence[Panel],
    *,
    title: str | None = None,
    view: View = WHOLE,
    columns: int = 2,
) -> Picture:
    """The picture of heat capacities by panel, of functions, or of an answer, whose curve is computed at more temperatures."""
    if isinstance(thing, ThermoAnswer):
        grid = tuple(curve_temperatures(thing.functions.temperature_k).tolist())
        thing = answer_thermo(replace(thing.request, temperatures_k=grid, pressure_bar=None)).functions
    title = title if view.title is None else view.title
    if isinstance(thing, ThermoFunctions):
        label = "quantum" if thing.species == "equilibrium" else f"quantum, {thing.species}"
        thing = [Panel(top_title(thing.top) if title is None else title, {label: thing})]
    curves = {panel.title: list(panel.curves) for panel in thing}
    facts = {"program": "rotor", "version": version(), "curves": curves}
    return Picture(heat_capacity_figure(thing, columns, view), title or "heat capacity", facts)


def curve_temperatures(temperatures_k: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Temperatures between the lowest and highest given ones, dense enough for a smooth curve; (300,) or (1,)."""
    low, high = float(np.min(temperatures_k)), float(np.max(temperatures_k))
    if low == high:
        return np.array([low])
    return np.geomspace(low, high, CURVE_POINTS) if high > LOG_FROM * low else np.linspace(low, high, CURVE_POINTS)


def _draw(axes: Any, panel: Panel) -> None:
    first = next(iter(panel.curves.values()))
    t = np.sort(first.temperature_k)
    classical = float(first.cv_over_r_classical[0])
    axes.axhline(classical, color=GREY, linewidth=2.5, alpha=0.5, label="classical")
    if np.isfinite(first.cv_over_r_corrected).any():
        _line(
            axes,
            first,
            first.cv_over_r_corrected,
            color="black",
            linestyle=":",
            linewidth=1.1,
            label="expansion",
        )
    colour = dict(zip(panel.curves, PALETTE * len(panel.curves), strict=False))
    for label, functions in panel.curves.items():
        _line(axes, functions, functions.cv_over_r, color=colour[label], linewidth=1.5, label=label)
        if functions.cv_vib_over_r is not None:
            total = functions.cv_over_r + functions.cv_vib_over_r
            _line(axes, functions, total, color=colour[label], linewidth=1.1, linestyle="--", label="with vibration")
    for points in panel.points:
        edge = colour.get(points.label, "black")
        name = None if points.label in colour else points.label
        axes.plot(
            points.temperature_k, points.cv_over_r, "o", markersize=4, markerfacecolor="white", markeredgecolor=edge,
            markeredgewidth=0.9, label=name, zorder=5,
        )  # fmt: skip
    if t[-1] > LOG_FROM * t[0]:
        _make_logarithmic(axes)
    rows = -(-len(axes.get_legend_handles_labels()[0]) // 2)
    # the legend stands above all curves
    axes.set_ylim(bottom=0.0, top=_highest(panel, classical) * (1.0 + 0.12 * rows))
    axes.set_xlabel("Temperature (K)")
    axes.set_ylabel("Heat capacity $C_v/R$, no translation")
    axes.set_title(panel.title, loc="left")
    axes.legend(loc="upper left", ncols=2, handlelength=1.2, columnspacing=0.8, handletextpad=0.5, borderaxespad=0.0)


def _frame(axes: Any, view: View) -> None:
    """Apply a view; its `log` refers to the temperature axis."""
    if view.log:
        _make_logarithmic(axes)
    elif view.log is not None:
        axes.set_xscale("linear")
    if view.horizontal is not None and view.horizontal[0] <= 0 and axes.get_xscale() == "log":
        raise ValueError(
            f"temperatures from {view.horizontal[0]:g} K: a logarithmic axis needs temperatures above 0; raise the first"
        )
    show_part(axes, replace(view, log=None))


def _make_logarithmic(axes: Any) -> None:
    """Make the temperature axis logarithmic, with ticks such as 10, 30, 100."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_xscale("log")
    lowest, highest = axes.dataLim.intervalx
    few = highest <= 1e4 * lowest  # over more decades ticks at 3 would overlap
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if few else (1.0,)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _line(axes: Any, functions: ThermoFunctions, values: NDArray[np.float64], **style: Any) -> None:
    order = np.argsort(functions.temperature_k)
    marker = "." if len(order) < 3 else None  # too few points for a line
    axes.plot(functions.temperature_k[order], values[order], marker=marker, **style)


def _highest(panel: Panel, classical: float) -> float:
    """Upper end of the axis: above all curves and points, ignoring a diverging correction."""
    values = [classical]
    for functions in panel.curves.values():
        vibration = 0.0 if functions.cv_vib_over_r is None else functions.cv_vib_over_r
        values.append(float(np.max(functions.cv_over_r + vibration)))
    values += [float(points.cv_over_r.max()) for points in panel.points if len(points.cv_over_r)]
    return 1.12 * max(values)
