"""Picture of a catalogue: lines as sticks, measured lines in another colour."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

from rotor.formats.spcat.compare import in_mhz
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.plots.picture import BLUE, MOST_VECTOR_STICKS, ORANGE, checked_suffix, legend_below, panel, save, styled
from rotor.plots.view import WHOLE, View, show_part

MEASURED = ORANGE


def plot_catalogue(
    lines: Catalogue, path: str | os.PathLike[str], *, title: str = "", view: View = WHOLE, command: str = ""
) -> None:
    """Draw log10 of the intensity against frequency, with measured lines (negative tags) in another colour.

    Parameters
    ----------
    lines : Catalogue
        Lines to draw.
    path : path
        A .png, .pdf or .svg file.
    title : str, optional
        Title of the picture.
    view : View
        Range of frequencies (MHz) and log10 of intensities, and another title.
    command : str, optional
        Written into the file's metadata.

    Raises
    ------
    ValueError
        For another suffix.
    """
    checked_suffix(path)
    title = title if view.title is None else view.title
    figure = catalogue_figure(lines, title=title, least=math.inf if view.vertical is None else view.vertical[0])
    show_part(figure.axes[0], view, scale=1e-3)
    save(figure, path, title, {"command": command})


def catalogue_figure(lines: Catalogue, *, title: str = "", least: float = math.inf, axes: Any = None) -> Any:
    """A matplotlib figure of log10 of the intensity against frequency, with measured lines in another colour.

    Sticks start below the weakest line, or at `least` if that is lower. axes: drawn on instead of a new figure.
    """
    frequency, _ = in_mhz(lines)
    bottom = min(float(lines.lgint.min()) - 0.3, least)
    with styled():
        figure, axes = panel(axes)
        for seen, colour, name in ((False, BLUE, "predicted"), (True, MEASURED, "measured")):
            chosen = (lines.tag < 0) == seen
            if chosen.any():
                axes.vlines(
                    frequency[chosen] / 1e3, bottom, lines.lgint[chosen], colors=colour, lw=0.7,
                    label=f"{name} ({np.count_nonzero(chosen)})", rasterized=len(lines) > MOST_VECTOR_STICKS,
                )  # fmt: skip
        axes.set(xlabel="Frequency (GHz)", ylabel="log₁₀ intensity (nm² MHz)", title=title)
        axes.set_ylim(bottom=bottom)
        legend_below(figure, axes, ncols=2)
    return figure
