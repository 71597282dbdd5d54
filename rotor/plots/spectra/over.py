"""Pictures of predicted lines over a spectrum: sticks mirrored below its peaks, and Loomis-Wood rows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.assignment.peaks.peak_list import PeakList
from rotor.plots.names import Peak, height_share, name_peaks
from rotor.plots.picture import (
    BLUE,
    GREY,
    WIDTH_INCHES,
    checked_suffix,
    legend_below,
    new_figure,
    save,
    styled,
    top_title,
    without_signs,
)  # fmt: skip
from rotor.plots.spectra.spectrum import thinned
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.labels.quanta import line_text
from rotor.spectra.lines import Lines

MOST_ROWS = 60
WINDOW_MHZ = 5.0  # on either side of a line
MOST_NAMES = 24
NAME_SHARE = 0.32  # part of the vertical axis above the tallest peak, more for a long name
MOST_OF_HEIGHT = 0.6  # part of the vertical axis that a name may take
LEAST_NAMED = 1e-2  # relative to the strongest line in view
BESIDE = 500  # a peak belongs to a line nearer than the width of the picture divided by this
BESIDE_PEAKS = 0.02  # of the band, left and right of the outermost peaks
LEAST_SHOWN = 1e-3  # relative to the strongest line in the band


def over_figure(lines: Lines, heights: Floats, peaks: PeakList, title: str, view: View = WHOLE) -> Any:
    """A matplotlib figure of a spectrum, or of peaks without one, above the axis, and of lines below."""
    with styled():
        figure = new_figure((WIDTH_INCHES, 4.2))
        axes = figure.add_subplot()
        shown = heights > LEAST_SHOWN * heights.max(initial=0.0)
        for number, (frequency, height) in enumerate(peaks.trace):
            axes.plot(*thinned(frequency, height), color=GREY, lw=0.7, label=None if number else "spectrum")
        if not peaks.trace:
            axes.vlines(peaks.frequency_mhz, 0, peaks.intensity, color=GREY, lw=0.7, label="peaks")
        axes.vlines(
            lines.frequency_mhz[shown],
            -heights[shown],
            0,
            color=BLUE,
            lw=0.7,
            label="lines",
        )
        axes.axhline(0, color="black", lw=0.5)
        axes.set_xlabel("Frequency (MHz)")
        axes.set_ylabel("Intensity: measured up, lines down")
        without_signs(axes)
        axes.set_title(title, loc="left")
        legend_below(figure, axes, ncols=2)
        first, last = peaks.band_mhz
        margin = 0.0 if peaks.trace else BESIDE_PEAKS * (last - first)  # the band of a list ends at its outermost peaks
        axes.set_xlim(first - margin, last + margin)
        low, tallest = -1.05 * float(heights.max(initial=0.0)), float(peaks.intensity.max())
        show_part(axes, view)
        named = _named_lines(axes, lines, heights, peaks)
        if view.vertical is None:
            names = [peak.name for peak in sorted(named, key=lambda peak: -peak.y)[:1]]
            share = min(max([NAME_SHARE, *(height_share(axes, name) for name in names)]), MOST_OF_HEIGHT)
            axes.set_ylim(low, (tallest - share * low) / (1 - share))
        curves = [(peaks.frequency_mhz, peaks.intensity), *(thinned(*piece) for piece in peaks.trace)]
        drawn = np.concatenate([np.stack(curve, axis=1) for curve in curves])
        name_peaks(axes, named, drawn, MOST_NAMES)
        return figure


def _named_lines(axes: Any, lines: Lines, heights: Floats, peaks: PeakList) -> list[Peak]:
    """The strongest lines in view with their transitions, above the peaks that stand at them."""
    first, last = sorted(axes.get_xlim())
    inside = (lines.frequency_mhz >= first) & (lines.frequency_mhz <= last)
    rows = np.flatnonzero(inside & (heights > LEAST_NAMED * heights[inside].max(initial=0.0)))
    named = []
    for row in rows[np.argsort(-heights[rows], kind="stable")][: 4 * MOST_NAMES].tolist():
        at = float(lines.frequency_mhz[row])
        near = np.abs(peaks.frequency_mhz - at) < (last - first) / BESIDE
        text = line_text(lines.levels.quanta, int(lines.upper[row]), int(lines.lower[row]), lines.levels.halves)
        named.append(Peak(at, float(peaks.intensity[near].max(initial=0.0)), text, BLUE))
    return named


def series_order(lines: Lines, rows: Ints) -> Ints:
    """Rows ordered by series: equal species, changes of quantum numbers and Ka (or K) together, by rising J (N with spins)."""
    quanta = {
        name: (values[lines.upper[rows]], values[lines.lower[rows]]) for name, values in lines.levels.quanta.items()
    }
    j = lines.levels.rotational[lines.upper[rows]], lines.levels.rotational[lines.lower[rows]]
    keys: list[Any] = [j[0]]
    for name in ("kc", "ka", "k"):
        if name in quanta:
            upper, lower = quanta[name]
            keys += [j[1] - lower - quanta["ka"][1], upper - lower] if name == "kc" else [lower, upper - lower]
    states = [quanta[name][0] for name in ("vt", "species") if name in quanta]
    return np.asarray(rows[np.lexsort([*keys, j[0] - j[1], *states])], dtype=np.int64)


def loomis_wood_figure(lines: Lines, heights: Floats, peaks: PeakList, title: str, view: View = WHOLE) -> Any:
    """A matplotlib figure with a row for each of the strongest lines that shows the peaks near it, ordered by series.

    With correct constants the peaks of a species align at 0; with wrong constants they drift from row to row.
    """
    levels = lines.levels
    with styled():
        rows = np.argsort(-heights, kind="stable")[:MOST_ROWS]
        rows = series_order(lines, rows[heights[rows] > 0])
        figure = new_figure((4.4, 1.2 + 0.14 * len(rows)))
        axes = figure.add_subplot()
        scale = np.log(peaks.intensity / peaks.intensity.min() + 1.0)
        size = 0.15 + 0.75 * scale / scale.max()
        for place, row in enumerate(rows.tolist()):
            off = peaks.frequency_mhz - lines.frequency_mhz[row]
            near = np.abs(off) < WINDOW_MHZ
            axes.vlines(off[near], place - size[near] / 2, place + size[near] / 2, color=BLUE, lw=1.2)
        axes.axvline(0, color="black", lw=0.4)
        axes.set_yticks(
            range(len(rows)),
            [line_text(levels.quanta, lines.upper[row], lines.lower[row], levels.halves) for row in rows.tolist()],
            fontsize=8,
        )
        axes.set_ylim(len(rows) - 0.3, -0.7)
        axes.set_xlim(-WINDOW_MHZ, WINDOW_MHZ)
        axes.set_xlabel("Peak − line (MHz)")
        axes.set_title(title, loc="left")
        show_part(axes, view)
        return figure


# figure by the name of the picture, and what stands between spectrum and molecule in its title
PICTURES = {"over": (over_figure, "and"), "loomis_wood": (loomis_wood_figure, "about lines of")}


def plot_over(
    name: str,
    lines: Lines,
    heights: Floats,
    peaks: PeakList,
    path: str | os.PathLike[str],
    *,
    view: View = WHOLE,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw a picture of `PICTURES`; heights (lines,) in units of the peaks."""
    checked_suffix(path)
    figure, between = PICTURES[name]
    title = view.title or f"{os.path.basename(peaks.source) or 'Spectrum'} {between} {top_title(lines.top)}"
    save(figure(lines, heights, peaks, title, view), path, title, dict(provenance or {}))
