"""A picture of levels in a magnetic field: the shifts of the components of each free level, a colour for each M."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.plots.picture import Picture, new_figure, styled, top_title
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.effects.zeeman import ZeemanAnswer
from rotor.quantum.fields.field_map import FieldMap

PANELS = 9  # at most; further levels are left out
PANEL_INCHES = (2.6, 2.3)


def zeeman_figure(field_map: FieldMap, title: str = "", spins: int = 0, view: View = WHOLE) -> Any:
    """A matplotlib figure of a map of levels in a magnetic field.

    field_map: a map of at least two fields. title: title of the picture. spins: number of spins, whose quantum numbers end each label.
    view: fields (T) and shifts (MHz) shown in every panel; its title is not used here.
    Returns: one panel for each level of the free top without its spins.
    Raises ValueError for a map of one field.
    """
    if len(field_map.fields) < 2:
        raise ValueError("a picture of a map needs two fields or more")
    levels = _levels(field_map, spins)
    columns = min(2, len(levels))  # two panels and their titles fill a column of 8.5 cm
    rows = -(-len(levels) // columns)
    with styled():
        figure = new_figure((0.8 + PANEL_INCHES[0] * columns, 0.8 + PANEL_INCHES[1] * rows))
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, (label, curves) in zip(panels.ravel(), levels.items(), strict=False):
            _panel(axes, field_map, label, curves)
            show_part(axes, view)
        for place, axes in enumerate(panels.ravel()):
            axes.set_visible(place < len(levels))
            axes.tick_params(labelbottom=place + columns >= len(levels))  # the lowest panel of each column
        figure.supxlabel("Magnetic field (T); blue: M < 0, red: M > 0", fontsize=9)
        figure.supylabel("Shift from the level (MHz)", fontsize=9)
        figure.suptitle(title, x=0.02, ha="left", fontsize=10)
    return figure


def picture(answer: ZeemanAnswer, *, title: str | None = None, view: View = WHOLE) -> Picture:
    """The picture of an answer."""
    title = (title or top_title(answer.request.top)) if view.title is None else view.title
    states = answer.states
    return Picture(zeeman_figure(states, title, len(answer.request.spin_g), view), title, states.provenance)


def _levels(field_map: FieldMap, spins: int) -> dict[str, list[slice]]:
    """The lowest levels with their curves, in order of energy."""
    by_level: dict[str, list[slice]] = {}
    curves = sorted(field_map.curves(), key=lambda rows: float(field_map.free_mhz[rows.start]))
    for rows in curves:
        words = str(field_map.label[rows.start]).split()
        by_level.setdefault(" ".join(words[: len(words) - spins]), []).append(rows)
    return dict(list(by_level.items())[:PANELS])


def _panel(axes: Any, field_map: FieldMap, label: str, curves: list[slice]) -> None:
    """Draw energies relative to the mean of the free level, weighted by the number of coinciding states."""
    from matplotlib import colormaps

    free = np.array([field_map.free_mhz[rows.start] for rows in curves])
    copies = np.array([field_map.copies[rows.start] for rows in curves], dtype=float)
    centre = float(np.average(free, weights=copies))
    largest = max(1e-12, *(abs(float(field_map.m[rows.start])) for rows in curves))
    for rows in curves:
        m = float(field_map.m[rows.start])
        shade = colormaps["coolwarm"](0.5 + 0.5 * m / largest) if m else (0.2, 0.2, 0.2, 1.0)
        axes.plot(field_map.field[rows], field_map.energy_mhz[rows] - centre, color=shade, linewidth=0.9)
    name = f"{largest:.0f}" if float(largest).is_integer() else f"{largest:g}"
    level = f"J = {label}" if label.isdecimal() else label
    axes.set_title(
        f"{level},  M = -{name} ... {name}" if largest >= 0.5 else f"{level},  M = 0", fontsize=9, loc="left"
    )
    axes.ticklabel_format(useOffset=False)
