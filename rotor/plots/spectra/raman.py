"""A picture of rotational Raman lines: cross section against shift, Stokes to the right."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.plots.names import SPACE, Peak, name_peaks
from rotor.plots.picture import BLUE, GREY, MOST_VECTOR_STICKS, Picture, panel, styled, top_title
from rotor.plots.spectra.spectrum import MOST_DECADES, VISIBLE
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.labels.quanta import state_text, without_nuclei
from rotor.spectra.raman.raman import RamanLines
from rotor.spectra.raman.request import RamanAnswer

MOST_TRIED = 100  # lines, from the strongest down, for which a name is tried


def picture(
    thing: RamanLines | RamanAnswer, *, title: str | None = None, view: View = WHOLE, axes: Any = None
) -> Picture:
    """The picture of Raman lines, or of the answer that has them. Lines below 0.4 % of the strongest do not stretch the axis.

    title: by default name, temperature and laser. view: of shifts (cm⁻¹) and cross sections.
    """
    lines = thing.lines if isinstance(thing, RamanAnswer) else thing
    title = title if view.title is None else view.title
    return Picture(raman_figure(lines, title, view, axes), title or _title(lines), _facts(lines))


def raman_figure(lines: RamanLines, title: str | None = None, view: View = WHOLE, axes: Any = None) -> Any:
    """A matplotlib figure of Raman lines as sticks at their shifts, on `axes` if not None; ValueError for no lines."""
    if not len(lines):
        raise ValueError(f"there is no Raman line to draw for {lines.top.name or 'this top'}")
    with styled():
        figure, axes = panel(axes)
        _draw(axes, lines)
        _frame(axes, lines, view)
        _name(axes, lines)
        axes.set_title(title if title is not None else _title(lines), loc="left")
    return figure


def _draw(axes: Any, lines: RamanLines) -> None:
    heights, shifts = lines.cross_section_cm2_per_sr, lines.shift_cm
    seen = np.abs(shifts[heights >= VISIBLE * heights.max()]).max()
    many = len(lines) > MOST_VECTOR_STICKS
    axes.vlines(shifts, 0.0, heights, color=BLUE, linewidth=1.0 if len(lines) < 300 else 0.6, rasterized=many)
    axes.axvline(0.0, color=GREY, linewidth=0.7, linestyle=":")
    axes.set_xlim(-1.05 * seen, 1.05 * seen)
    axes.set_xlabel("Raman shift (cm⁻¹): anti-Stokes below, Stokes above 0")
    axes.set_ylabel("Cross section dσ/dΩ (cm² sr⁻¹)")


def _frame(axes: Any, lines: RamanLines, view: View) -> None:
    """Set the limits of a view; by default from the lines that it shows, at most eight decades of a logarithmic axis."""
    first, last = view.horizontal or axes.get_xlim()
    heights = lines.cross_section_cm2_per_sr[(lines.shift_cm >= first) & (lines.shift_cm <= last)]
    if not len(heights):
        raise ValueError(f"there is no line between {first:g} and {last:g} cm-1 to draw; widen the range")
    tallest = float(heights.max())
    if view.log:
        lowest = max(float(heights[heights > 0].min()), tallest * 10.0**-MOST_DECADES)
        axes.set_ylim(lowest / 2, tallest * (tallest / lowest) ** (SPACE - 1))
    else:
        axes.set_ylim(0.0, SPACE * tallest)
    show_part(axes, view)


def _name(axes: Any, lines: RamanLines) -> None:
    """Names of the strongest lines, the initial level first."""
    heights, shifts, levels = lines.cross_section_cm2_per_sr, lines.shift_cm, lines.levels
    quanta = without_nuclei(levels.quanta)  # splittings by nuclear spins, some 1e-4 cm⁻¹, cannot be seen
    first, last = sorted(axes.get_xlim())
    inside = np.flatnonzero((shifts >= first) & (shifts <= last))
    strongest = inside[np.argsort(-heights[inside], kind="stable")][:MOST_TRIED]
    peaks = [
        Peak(
            float(shifts[row]),
            float(heights[row]),
            " → ".join(state_text(quanta, int(side[row]), levels.halves) for side in (lines.initial, lines.final)),
        )
        for row in strongest.tolist()
    ]
    name_peaks(axes, peaks, np.stack([shifts, heights], axis=1)[heights > 0])


def _title(lines: RamanLines) -> str:
    return f"{top_title(lines.top)}, {lines.temperature_k:g} K, laser at {lines.laser_nm:g} nm"


def _facts(lines: RamanLines) -> dict[str, Any]:
    """Entries of the metadata that describe the lines."""
    top = lines.top
    return {
        "constants": top.constants.text(),
        "polarizability": top.polarizability_abc_angstrom3,
        "temperature_k": lines.temperature_k,
        "laser_nm": lines.laser_nm,
        "q": lines.partition.q,
        "jmax": lines.jmax,
    }
