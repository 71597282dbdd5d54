"""Options of the picture of --plot: title, unit, range and scale of its axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import require_one_of
from rotor.cli.shared import inputs
from rotor.cli.shared.options import option
from rotor.cli.shared.output import Files
from rotor.plots.view import Limits, View

if TYPE_CHECKING:
    from rotor.verbs.verb import Verb

SCALES = {"linear": False, "log": True}
UNITS = ("MHz", "GHz", "THz", "cm-1")


@dataclass(frozen=True)
class PlotOptions:
    """How the picture of a spectrum looks."""

    plot_unit: str | None = option(None, metavar="UNIT", help="Of the picture's frequency axis: MHz, GHz, THz or cm-1.")
    plot_title: str | None = option(None, metavar="TEXT", help="Of the picture, instead of name and temperature.")
    plot_range: str | None = option(None, metavar="A:B", help="Frequencies that the picture shows (MHz).")
    plot_vertical: str | None = option(None, metavar="A:B", help="Of its vertical axis, in the unit of the axis.")
    plot_scale: str | None = option(None, metavar="NAME", help="Of the picture's intensities: linear or log.")


@dataclass(frozen=True)
class ViewOptions:
    """How the picture of another verb looks."""

    plot_title: str | None = option(None, metavar="TEXT", help="Of the picture of --plot, instead of its own.")
    plot_range: str | None = option(None, metavar="A:B", help="Of its horizontal axis, in the unit of the axis.")
    plot_vertical: str | None = option(None, metavar="A:B", help="Of its vertical axis, in the unit of the axis.")
    plot_scale: str | None = option(None, metavar="NAME", help="linear or log.")


def view_of(given: ViewOptions, files: Files, unit: str = "") -> View:
    """Title, limits and scale from the texts of the options, the horizontal limits in `unit`; refused without --plot."""
    _refuse_without_plot(given, files)
    scale = given.plot_scale
    return View(
        title=None if given.plot_title is None else _title(given.plot_title),
        horizontal=_limits("--plot-range", given.plot_range, unit),
        vertical=_limits("--plot-vertical", given.plot_vertical, ""),
        log=None if scale is None else SCALES[require_one_of("--plot-scale", scale, SCALES)],
    )


def settings_of(given: PlotOptions, files: Files) -> dict[str, Any]:
    """What `spectrum_figure` and `emission_figure` take, from the texts of the options; refused without --plot."""
    _refuse_without_plot(given, files)
    settings: dict[str, Any] = {}
    if given.plot_unit is not None:
        settings["unit"] = require_one_of("--plot-unit", given.plot_unit, UNITS)
    if given.plot_title is not None:
        settings["title"] = _title(given.plot_title)
    if given.plot_range is not None:
        settings["range_mhz"] = _limits("--plot-range", given.plot_range, "MHz")
    if given.plot_vertical is not None:
        settings["vertical"] = _limits("--plot-vertical", given.plot_vertical, "")
    if given.plot_scale is not None:
        settings["log"] = SCALES[require_one_of("--plot-scale", given.plot_scale, SCALES)]
    return settings


def _refuse_without_plot(given: PlotOptions | ViewOptions, files: Files) -> None:
    named = [name for name, text in vars(given).items() if text is not None]
    if named and "--plot" not in files.paths:
        raise ValueError(f"--{named[0].replace('_', '-')}: expected with --plot, the file of the picture")


def _title(text: str) -> str:
    """A title as it is: matplotlib takes dollar signs for formulas."""
    return text.replace("$", r"\$")


def _limits(name: str, text: str | None, unit: str) -> Limits | None:
    from rotor.units import parse_range

    return None if text is None else inputs.parsed(name, text, lambda value: parse_range(value, unit))


PLOT_NAMES = ("plot_unit", "plot_title", "plot_range", "plot_vertical", "plot_scale")


def picture_settings(verb: Verb, typed: Mapping[str, Any], drawn: bool) -> Any:
    """The view of a verb's picture from what was typed; drawn: whether there is a picture. Settings by name of a spectrum."""
    texts = {name: typed[name] for name in PLOT_NAMES if name in typed}
    files = Files({"--plot": Path()} if drawn else {})
    if verb.spectral:
        return settings_of(PlotOptions(**texts), files)
    return view_of(ViewOptions(**texts), files, verb.drawn or "")
