"""Picture of emission: brightness temperature of each molecule in its colour, and of all together."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.plots.names import SPACE, Peak, name_peaks
from rotor.plots.picture import GREY, PALETTE, Picture, legend_below, panel, styled, top_title
from rotor.plots.spectra.spectrum import UNITS, thinned
from rotor.plots.view import Limits, View, show_part
from rotor.quantum.labels.quanta import line_text
from rotor.spectra.emission.request import EmissionAnswer
from rotor.tops.top import Top

LEAST_NAMED = 0.01  # relative to the brightest line; weaker lines are invisible on a linear axis
MOST_TRIED = 100  # lines, from the brightest down, for which a name is tried


def picture(answer: EmissionAnswer, **options: Any) -> Picture:
    """The picture of an answer; options: of `emission_figure`."""
    return Picture(emission_figure(answer, **options), options.get("title") or _title(answer))


def emission_figure(
    answer: EmissionAnswer,
    *,
    title: str | None = None,
    unit: str | None = None,
    range_mhz: tuple[float, float] | None = None,
    log: bool | None = None,
    vertical: Limits | None = None,
    axes: Any = None,
) -> Any:
    """A matplotlib figure of T_B against the observed frequency.

    answer: one curve for each molecule; several molecules also have a grey curve of their sum. title: instead of the names and the
    source. unit: unit of the frequency axis, by default GHz. range_mhz (2,): range of frequencies; by default that of the request. log:
    whether the T_B axis is logarithmic. vertical (2,): range of T_B in K. axes: drawn on instead of a new figure.
    Returns: one panel.
    Raises ValueError for a logarithmic axis that starts at 0 or less.
    """
    mhz = UNITS[unit or "GHz"]
    first, last = range_mhz or answer.request.range_mhz
    names = [
        top_title(molecule) + name.removeprefix(molecule.name) if isinstance(molecule, Top) and molecule.name else name
        for molecule, name in zip(answer.request.molecules, answer.request.names, strict=True)
    ]
    with styled():
        figure, axes = panel(axes)
        if len(names) > 1:
            x, y = thinned(answer.spectrum.frequency_mhz / mhz, answer.spectrum.brightness_k)
            axes.plot(x, y, color=GREY, linewidth=2.0, alpha=0.4, label="together")
        for number, (part, name) in enumerate(zip(answer.parts, names, strict=True)):
            x, y = thinned(part.frequency_mhz / mhz, part.brightness_k)
            axes.plot(x, y, color=PALETTE[number % len(PALETTE)], linewidth=0.8, label=name)
        axes.set_xlim(first / mhz, last / mhz)
        peak = answer.spectrum.brightness_k
        if log:
            axes.set_yscale("log")
            axes.set_ylim(1e-5 * float(peak.max()), 30 * float(peak.max()))
        elif peak.max() > 0:
            axes.set_ylim(min(1.1 * float(peak.min()), 0.0), SPACE * float(peak.max()))
        show_part(axes, View(vertical=vertical))
        axes.set_xlabel("Wavenumber (cm⁻¹)" if unit == "cm-1" else f"Frequency ({unit or 'GHz'})")
        axes.set_ylabel("Brightness temperature (K)")
        axes.set_title(_title(answer) if title is None else title, loc="left")
        legend_below(figure, axes, ncols=3, fontsize=9)
        _name(axes, answer, mhz)
    return figure


def _name(axes: Any, answer: EmissionAnswer, mhz: float) -> None:
    """Name the brightest lines by their quantum numbers, in the colour of their molecule if there are several."""
    lines, spectrum = answer.lines, answer.spectrum
    heights = np.interp(lines.observed_mhz, spectrum.frequency_mhz, spectrum.brightness_k)
    several = len(answer.request.molecules) > 1
    seen = 0.0 if axes.get_yscale() == "log" else LEAST_NAMED * float(spectrum.brightness_k.max(initial=0.0))
    peaks = [
        Peak(
            float(lines.observed_mhz[row]) / mhz,
            float(heights[row]),
            _line_name(answer, row),
            PALETTE[int(lines.molecule[row]) % len(PALETTE)] if several else GREY,
        )
        for row in np.argsort(-lines.brightness_k, kind="stable")[:MOST_TRIED].tolist()
        if heights[row] > seen
    ]
    x, y = thinned(spectrum.frequency_mhz / mhz, spectrum.brightness_k)
    name_peaks(axes, peaks, np.stack([x, y], axis=1)[y > 0])


def _line_name(answer: EmissionAnswer, row: int) -> str:
    """Name of a line as in other pictures: rotational quantum numbers first, then those with spins."""
    lines = answer.lines
    names, values = (
        answer.emitted[int(lines.molecule[row])].quanta,
        (lines.upper[row].split(), lines.lower[row].split()),
    )
    if any(len(numbers) != len(names) for numbers in values):
        return f"{lines.upper[row]} – {lines.lower[row]}"
    return line_text({name: np.array(pair) for name, *pair in zip(names, *values, strict=True)}, 0, 1)


def _title(answer: EmissionAnswer) -> str:
    """Excitation, width and velocity, with common values once."""
    sources = answer.request.sources

    def values(name: str) -> str:
        return ", ".join(f"{value:g}" for value in dict.fromkeys(getattr(source, name) for source in sources))

    text = f"Excitation {values('excitation_k')} K, width {values('fwhm_km_s')} km/s"
    moving = any(source.velocity_km_s for source in sources)
    text += f", velocity {values('velocity_km_s')} km/s" if moving else ""
    return text + (f", z = {sources[0].redshift:g}" if sources[0].redshift else "")
