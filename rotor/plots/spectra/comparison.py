"""Mirror plot of two line lists: one above the axis, the other below, with differences of matched lines underneath."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.formats.spcat.compare import Comparison
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.plots.picture import (
    BLUE,
    GREY,
    MOST_VECTOR_STICKS,
    ORANGE,
    WIDTH_INCHES,
    Picture,
    name_text,
    new_figure,
    styled,
)
from rotor.plots.view import WHOLE, View, show_part

UNPAIRED = ORANGE
_DIFFERENCES = ((1e-1, 1e3, "kHz"), (1e2, 1.0, "MHz"), (np.inf, 1e-3, "GHz"))  # largest in MHz, factor, name


def picture(comparison: Comparison, *, names: tuple[str, str] = ("", ""), view: View = WHOLE) -> Picture:
    """The picture of a comparison; view: of frequencies (MHz); the lists fix the vertical limits."""
    figure = comparison_figure(comparison, names=names)
    show_part(figure.axes[0], View(horizontal=view.horizontal), scale=1e-3)
    if view.title is not None:
        figure.axes[0].set_title(view.title, loc="left")
    return Picture(figure, view.title or " and ".join(filter(None, names)))


def comparison_figure(comparison: Comparison, *, names: tuple[str, str] = ("", "")) -> Any:
    """A matplotlib figure of two lists and the differences of their matched lines.

    comparison: the reference is drawn upwards, the other list downwards, as log10 of intensity; unmatched lines in another colour. names
    (2,): names of the reference and the other list.
    Raises ValueError if both lists are empty.
    """
    if not len(comparison.reference) and not len(comparison.ours):
        raise ValueError("neither list has a line to draw; widen the range or lower the cut")
    with styled():
        figure = new_figure((WIDTH_INCHES, 4.8))
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        _draw_mirror(above, comparison, names)
        _draw_differences(below, comparison)
        below.set_xlabel("Frequency (GHz)")
        figure.align_ylabels()
    return figure


def _draw_mirror(axes: Any, comparison: Comparison, names: tuple[str, str]) -> None:
    both = np.concatenate([comparison.reference.lgint, comparison.ours.lgint])
    bottom = float(np.floor(both[np.isfinite(both)].min())) - 0.3
    sides = (
        (comparison.reference, comparison.reference_rows, comparison.missing, 1.0, name_text(names[0]) or "first list"),
        (comparison.ours, comparison.our_rows, comparison.extra, -1.0, name_text(names[1]) or "second list"),
    )
    for lines, matched, alone, sign, name in sides:
        label = f"{name}: {len(matched)} matched" if len(matched) else name
        _sticks(axes, lines, matched, (sign, bottom, BLUE), label)
        _sticks(axes, lines, alone, (sign, bottom, UNPAIRED), f"{len(alone)} only in {name}")
    axes.axhline(0.0, color="black", linewidth=0.7)
    height = float(both.max()) - bottom
    axes.set_ylim(-1.2 * height, 1.2 * height)  # space for the names
    step = max(1, round(height / 4))
    ticks = np.arange(np.floor(both.max()), bottom + 0.3 * step, -step)
    axes.set_yticks(np.concatenate([-(ticks - bottom), ticks - bottom]), [f"{x:.0f}" for x in (*ticks, *ticks)])
    axes.set_ylabel("Intensity, log₁₀ (nm² MHz)")
    for name, place, va in ((names[0], 0.98, "top"), (names[1], 0.02, "bottom")):
        axes.text(0.005, place, name_text(name), transform=axes.transAxes, va=va, ha="left", color=GREY)
    axes.figure.legend(loc="outside upper right", ncols=2, frameon=False, fontsize=9)


def _sticks(axes: Any, lines: Catalogue, rows: Ints, drawn: tuple[float, float, str], label: str) -> None:
    """Draw sticks from the middle axis, upwards or downwards by sign; nothing, without a legend entry, for no lines."""
    sign, bottom, colour = drawn
    if not len(rows):
        return
    heights = sign * (lines.lgint[rows] - bottom)
    many = len(rows) > MOST_VECTOR_STICKS
    axes.vlines(
        lines.frequency_mhz[rows] / 1e3, 0.0, heights, colors=colour, lw=0.7, label=label, rasterized=many
    )  # fmt: skip


def _draw_differences(axes: Any, comparison: Comparison) -> None:
    """Draw the other list minus the reference for matched lines, with errors where the reference is measured."""
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    off = comparison.differences("frequency_mhz")
    factor, unit = next((f, name) for most, f, name in _DIFFERENCES if np.abs(off).max(initial=0.0) <= most)
    ghz = comparison.reference.frequency_mhz[comparison.reference_rows] / 1e3
    seen = comparison.measured
    errors: Floats = comparison.reference.error_mhz[comparison.reference_rows]
    if (~seen).any():
        axes.plot(
            ghz[~seen], factor * off[~seen], ".", color=BLUE, markersize=3, rasterized=len(off) > MOST_VECTOR_STICKS
        )
    if seen.any():
        axes.errorbar(
            ghz[seen], factor * off[seen], factor * errors[seen], fmt=".", color=ORANGE, markersize=3, lw=0.7,
            label=f"measured ({np.count_nonzero(seen)})",
        )  # fmt: skip
        axes.legend(frameon=False, fontsize=9)
    axes.set_ylabel(f"Difference ({unit})")
    if not len(off):
        axes.text(0.5, 0.5, "no line in common", transform=axes.transAxes, ha="center", va="center", color=GREY)
