"""Options of the picture of a spectrum: unit, title, range and scale of its axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rotor.checks import require_one_of
from rotor.cli.shared import inputs
from rotor.cli.shared.options import option
from rotor.cli.shared.output import Files

SCALES = {"linear": False, "log": True}
UNITS = ("MHz", "GHz", "THz", "cm-1")


@dataclass(frozen=True)
class PlotOptions:
    """How the picture of --plot looks."""

    plot_unit: str | None = option(None, metavar="UNIT", help="Of the picture's frequency axis: MHz, GHz, THz or cm-1.")
    plot_title: str | None = option(None, metavar="TEXT", help="Of the picture, instead of name and temperature.")
    plot_range: str | None = option(None, metavar="A:B", help="Frequencies that the picture shows (MHz).")
    plot_scale: str | None = option(None, metavar="NAME", help="Of the picture's intensities: linear or log.")


def settings_of(given: PlotOptions, files: Files) -> dict[str, Any]:
    """What `spectrum_figure` takes, from the texts of the options; refused without --plot."""
    texts = {"--plot-unit": given.plot_unit, "--plot-title": given.plot_title, "--plot-range": given.plot_range}
    named = [name for name, text in {**texts, "--plot-scale": given.plot_scale}.items() if text is not None]
    if named and "--plot" not in files.paths:
        raise ValueError(f"{named[0]}: expected with --plot, the file of the picture")
    settings: dict[str, Any] = {}
    if given.plot_unit is not None:
        settings["unit"] = require_one_of("--plot-unit", given.plot_unit, UNITS)
    if given.plot_title is not None:
        settings["title"] = given.plot_title.replace("$", r"\$")
    if given.plot_range is not None:
        from rotor.units import parse_range

        settings["range_mhz"] = inputs.parsed("--plot-range", given.plot_range, lambda text: parse_range(text, "MHz"))
    if given.plot_scale is not None:
        settings["log"] = SCALES[require_one_of("--plot-scale", given.plot_scale, SCALES)]
    return settings
