"""A picture of a catalogue: its lines as sticks, those measured in a laboratory in a colour of their own."""

from __future__ import annotations

import os

import numpy as np

from rotor.formats.spcat.catalogue import Catalogue
from rotor.formats.spcat.compare import in_mhz
from rotor.plots.spectrum import BLUE, DPI, SIZE_INCHES, STYLE

MEASURED = "#D55E00"  # vermilion of Okabe and Ito's palette


def plot_catalogue(lines: Catalogue, path: str | os.PathLike[str], *, title: str = "", command: str = "") -> None:
    """Draw log10 of the intensity against frequency into a .png, .pdf or .svg file.

    Measured lines (a negative tag) stand out. title: above the picture. command: kept in the file's metadata.
    """
    import matplotlib
    from matplotlib.figure import Figure

    frequency, _ = in_mhz(lines)
    bottom = float(lines.lgint.min()) - 0.3
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE_INCHES, layout="constrained")
        axes = figure.add_subplot()
        for seen, colour, name in ((False, BLUE, "predicted"), (True, MEASURED, "measured")):
            chosen = (lines.tag < 0) == seen
            if chosen.any():
                axes.vlines(
                    frequency[chosen] / 1e3, bottom, lines.lgint[chosen], colors=colour, lw=0.7,
                    label=f"{name} ({np.count_nonzero(chosen)})", rasterized=len(lines) > 5000,
                )  # fmt: skip
        axes.set(xlabel="frequency / GHz", ylabel="log₁₀ intensity / nm² MHz", title=title)
        axes.set_ylim(bottom=bottom)
        figure.legend(loc="outside lower right", ncols=2, frameon=False)
        key = {".png": "Description", ".pdf": "Keywords", ".svg": "Description"}[os.path.splitext(path)[1].lower()]
        figure.savefig(path, dpi=DPI, metadata={key: command})
