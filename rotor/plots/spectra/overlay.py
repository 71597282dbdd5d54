"""Pages of panels: an observed spectrum with a model, names of modelled lines, marks for blends and unidentified lines."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.model.model import Component, Sight
from rotor.observed.overlay_table import line_table, modelled
from rotor.observed.spectrum import ABSORBANCE, KELVIN, ObservedSpectrum
from rotor.plots.names import SPACE, Peak, write_names
from rotor.plots.picture import BLUE, GREY, ORANGE, PALETTE, WIDTH_INCHES, checked_suffix, new_figure, save, styled

PANELS = 6  # on a page
CHANNELS = 1500  # default number in a panel
_MOST_NAMES = 14
_GAP = 20.0  # channels
POINTS_PER_LETTER = 5.5  # mean width of a letter of 9 points
PAGE_INCHES = (8.3, 11.7)
FEW_PANELS = 2  # these have the width of other pictures, more have that of a page


def plot_overlay(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    path: str | os.PathLike[str],
    *,
    sight: Sight | None = None,
    unidentified_mhz: Sequence[float] = (),
    panels: int | None = None,
    title: str = "",
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw an observed spectrum with a model; a .pdf has as many pages as needed, .png and .svg one long page.

    components: the model; empty for the spectrum alone. unidentified_mhz: marked with triangles. panels: number of panels; by default one
    for every 1500 channels. provenance: written into the metadata of the file.
    Raises ValueError for another suffix.
    """
    suffix = checked_suffix(path)
    requested = panels or max(1, round(len(spectrum) / CHANNELS))
    count = len(panel_ranges(spectrum, requested))
    pages = (
        [list(range(count))]
        if suffix != ".pdf"
        else [list(range(i, min(i + PANELS, count))) for i in range(0, count, PANELS)]
    )
    arguments = (spectrum, components, sight or Sight(), tuple(unidentified_mhz), requested)
    text = title or os.path.basename(spectrum.source) or "spectrum"
    if len(pages) == 1:
        save(overlay_figure(*arguments, pages[0], title=text), path, text, provenance or {})
        return
    from matplotlib.backends.backend_pdf import PdfPages

    from rotor.formats.atomic_write import atomic_path

    with atomic_path(path) as unfinished, PdfPages(unfinished, metadata={"Title": text, "CreationDate": None}) as book:
        for number, page in enumerate(pages, start=1):
            book.savefig(overlay_figure(*arguments, page, title=f"{text}, page {number} of {len(pages)}"))


def overlay_figure(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    sight: Sight,
    unidentified_mhz: Sequence[float],
    count: int,
    page: Sequence[int],
    *,
    title: str = "",
) -> Any:
    """A matplotlib figure of the panels `page` out of `count` panels of a spectrum."""
    edges = panel_ranges(spectrum, count)
    brightness = modelled(spectrum, components, sight) if components else np.zeros(len(spectrum))
    lines = line_table(spectrum, components, sight).columns
    names = list(dict.fromkeys(component.species.name for component in components))
    with styled():
        size = (
            WIDTH_INCHES if count <= FEW_PANELS else PAGE_INCHES[0],
            min(PAGE_INCHES[1], 1.2 + 2.6 * len(page)) if len(page) <= PANELS else 1.2 + 1.9 * len(page),
        )
        figure = new_figure(size)
        panels = [figure.add_subplot(len(page), 1, place) for place in range(1, len(page) + 1)]
        for axes, number in zip(panels, page, strict=True):
            _panel(axes, spectrum, brightness, edges[number], unidentified_mhz)
        panels[-1].set_xlabel("Frequency (GHz)")
        handles = {
            name: handle for each in panels for handle, name in zip(*each.get_legend_handles_labels(), strict=True)
        }
        figure.legend(handles.values(), handles, loc="outside lower right", ncols=len(handles))
        titles = {KELVIN: "Brightness temperature (K)", ABSORBANCE: "Absorbance"}
        figure.supylabel(titles.get(spectrum.unit, f"Intensity ({spectrum.unit})"), fontsize=9)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10)
        # once for the page, since the layout of all panels takes some tenths of a second: sizes in pixels, then the final limits
        figure.draw_without_rendering()
        peaks = [_peaks(axes, lines, names) for axes in panels]
        for axes, named in zip(panels, peaks, strict=True):
            _leave_space(axes, named)
        figure.draw_without_rendering()
        for axes, named in zip(panels, peaks, strict=True):
            write_names(axes, named, _drawn(axes, spectrum, brightness), _MOST_NAMES)
        figure.set_layout_engine("none")  # names change no layout
    return figure


def panel_ranges(spectrum: ObservedSpectrum, count: int) -> list[tuple[float, float]]:
    """First and last frequency of about `count` panels, at least one for each stretch without a gap."""
    gaps = np.flatnonzero(np.diff(spectrum.frequency_mhz) > _GAP * spectrum.channel_mhz) + 1
    share = len(spectrum) / count
    out = []
    for stretch in np.split(spectrum.frequency_mhz, gaps):
        pieces = np.array_split(stretch, max(1, round(len(stretch) / share)))
        out += [(float(piece[0]), float(piece[-1])) for piece in pieces if len(piece) > 1]
    return out


def _panel(
    axes: Any, spectrum: ObservedSpectrum, brightness: Floats, edges: tuple[float, float], unidentified: Sequence[float]
) -> None:
    inside = (spectrum.frequency_mhz >= edges[0]) & (spectrum.frequency_mhz <= edges[1])
    x, y, m = spectrum.frequency_mhz[inside] / 1e3, spectrum.intensity[inside], brightness[inside]
    axes.step(x, y, where="mid", color=GREY, linewidth=0.5, label="observed")
    axes.plot(x, m, color=ORANGE, linewidth=0.7, label="model")
    top = float(max(y.max(initial=0.0), m.max(initial=0.0), 5 * np.median(spectrum.noise)))
    bottom = float(min(y.min(initial=0.0), m.min(initial=0.0)))
    axes.set_xlim(edges[0] / 1e3, edges[1] / 1e3)
    axes.locator_params(axis="x", nbins=6)  # frequencies in full, such as 233.8255, without an offset
    axes.ticklabel_format(axis="x", useOffset=False, useMathText=False)  # parsing takes 10 ms a label
    axes.set_ylim(1.05 * bottom, SPACE * top + 0.15 * top)
    marked = [at / 1e3 for at in unidentified if edges[0] <= at <= edges[1]]
    if marked:
        axes.plot(
            marked,
            np.interp(marked, x, y) + 0.04 * top,
            linestyle="",
            marker="v",
            markersize=3,
            color=BLUE,
            label="unidentified",
        )


def _peaks(axes: Any, lines: Mapping[str, Any], names: Sequence[str]) -> list[Peak]:
    """Modelled lines of a panel in the colour of their species; a star marks a blend."""
    first, last = (1e3 * edge for edge in axes.get_xlim())
    # brightness has its unit in the name
    total, observed = (lines[name] if name in lines else lines[f"{name}_k"] for name in ("total", "observed"))
    rows = np.flatnonzero([first <= at <= last for at in lines["observed_mhz"].tolist()])
    return [
        Peak(
            float(lines["observed_mhz"][i]) / 1e3,
            max(float(total[i]), float(observed[i])),
            str(lines["species"][i]) + (" *" if lines["blend"][i] else ""),
            PALETTE[names.index(str(lines["species"][i])) % len(PALETTE)],
        )
        for i in rows
    ]


def _drawn(axes: Any, spectrum: ObservedSpectrum, brightness: Floats) -> Floats:
    """Tips of the spectrum and the model in a panel (n, 2)."""
    first, last = (1e3 * edge for edge in axes.get_xlim())
    inside = (spectrum.frequency_mhz >= first) & (spectrum.frequency_mhz <= last)
    return np.stack([spectrum.frequency_mhz[inside] / 1e3, np.maximum(spectrum.intensity, brightness)[inside]], axis=1)


def _leave_space(axes: Any, peaks: Sequence[Peak]) -> None:
    """Raise the upper limit until an upright name stands inside above the tallest peak."""
    if not peaks:
        return
    low, high = axes.get_ylim()
    letters = max(len(peak.name) for peak in peaks)
    share = min((POINTS_PER_LETTER * letters + 8.0) / 72.0 * axes.figure.dpi / axes.bbox.height, 0.6)
    axes.set_ylim(low, max(high, low + (max(peak.y for peak in peaks) - low) / (1.0 - share)))
