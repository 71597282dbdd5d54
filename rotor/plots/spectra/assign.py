"""Picture of an assignment: peaks above, mirrored predictions of each species below, unexplained peaks at the bottom."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from rotor.assignment.answer import AssignAnswer, AssignedSpecies
from rotor.plots.picture import GREY, PALETTE, WIDTH_INCHES, Picture, new_figure, styled, without_signs
from rotor.plots.view import WHOLE, View, show_part


def picture(answer: AssignAnswer, *, title: str | None = None, view: View = WHOLE) -> Picture:
    """The picture of an assignment; view: of frequencies (MHz) and intensities."""
    figure = assignment_figure(answer, view.title or title or "", view)
    return Picture(figure, figure.axes[0].get_title("left"))


def assignment_figure(answer: AssignAnswer, title: str = "", view: View = WHOLE) -> Any:
    """A matplotlib figure of peaks and mirrored predictions, with unexplained peaks below."""
    with styled():
        figure = new_figure((WIDTH_INCHES, 5.0))
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
        peaks = answer.request.peaks
        upper.vlines(peaks.frequency_mhz, 0, peaks.intensity, color=GREY, lw=0.7, label="peaks")
        for number, species in enumerate(answer.species):
            colour = PALETTE[number % len(PALETTE)]
            f, height = predicted_sticks(species, peaks.band_mhz)
            upper.vlines(f, -height, 0, color=colour, lw=0.7, label=_label(species))
            rows = np.unique(species.peak)
            upper.vlines(peaks.frequency_mhz[rows], 0, peaks.intensity[rows], color=colour, lw=0.7)
        for number, linear in enumerate(answer.progressions, len(answer.species)):
            colour, f = PALETTE[number % len(PALETTE)], linear.lines.frequency_mhz
            label = f"linear top, B = {linear.constants_mhz[0]:.2f} MHz"
            upper.vlines(f, 0, peaks.intensity[linear.peak], color=colour, lw=1.2, label=label)
        left = np.setdiff1d(
            np.flatnonzero(answer.unexplained), [row for linear in answer.progressions for row in linear.peak]
        )
        lower.vlines(peaks.frequency_mhz[left], 0, peaks.intensity[left], color=GREY, lw=0.7)
        upper.axhline(0, color="black", lw=0.5)
        upper.set_ylabel("Intensity: peaks up, predictions down")
        without_signs(upper)
        lower.set_ylabel("Unexplained")
        lower.set_xlabel("Frequency (MHz)")
        count = f"{os.path.basename(answer.request.peaks.source) or 'Spectrum'}: {len(answer.species) + len(answer.progressions)} species"
        upper.set_title(title or count, loc="left")
        figure.legend(*upper.get_legend_handles_labels(), fontsize=9, loc="outside lower right", ncols=2)
        show_part(upper, view)
        if view.horizontal is not None:
            lower.set_xlim(*view.horizontal)
        return figure


def predicted_sticks(species: AssignedSpecies, band_mhz: tuple[float, float]) -> tuple[Any, Any]:
    """Frequencies and heights of the lines of a species in a band, scaled to the fitted strength."""
    from rotor.spectra.lines import line_list

    lines = line_list(
        species.top, temperature_k=species.grown.temperature_k, jmax=40, range_mhz=band_mhz, untrusted=True
    )
    intensity = 10 ** lines.columns["lgint"]
    height = species.strength * intensity / intensity.max(initial=1e-300)
    seen = height > 0.003 * species.strength
    return lines.frequency_mhz[seen], height[seen]


def _label(species: AssignedSpecies) -> str:
    a, b, c = species.refined.values[:3]
    name = species.isotopologue or f"{species.kind}-type"
    return f"{a:.1f}, {b:.1f}, {c:.1f} MHz, {name}, {species.word}"
