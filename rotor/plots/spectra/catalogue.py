"""Picture of a catalogue: lines as sticks, measured lines in another colour."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.formats.spcat.compare import in_mhz
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.plots.picture import BLUE, MOST_VECTOR_STICKS, ORANGE, Picture, legend_below, panel, styled
from rotor.plots.view import WHOLE, View, show_part

MEASURED = ORANGE


def picture(lines: Catalogue, *, title: str | None = None, view: View = WHOLE, **options: Any) -> Picture:
    """The picture of a catalogue; view: of frequencies (MHz) and log10 of intensities. options: of `catalogue_figure`."""
    title = (title or "") if view.title is None else view.title
    least = math.inf if view.vertical is None else view.vertical[0]
    figure = catalogue_figure(lines, **{"title": title, "least": least, **options})
    show_part(options["axes"] if options.get("axes") else figure.axes[0], view, scale=1e-3)
    return Picture(figure, title)


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
        axes.set(xlabel="Frequency (GHz)", ylabel="Intensity, log₁₀ (nm² MHz)", title=title)
        axes.set_ylim(bottom=bottom)
        legend_below(figure, axes, ncols=2)
    return figure
