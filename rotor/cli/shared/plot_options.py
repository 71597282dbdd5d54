"""Options of the picture of --plot: title, unit, range and scale of its axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
class ViewOptions:
    """How the picture of another verb looks."""

    plot_title: str | None = option(None, metavar="TEXT", help="Of the picture of --plot, instead of its own.")
    plot_range: str | None = option(None, metavar="A:B", help="Of its horizontal axis, in the unit of the axis.")
    plot_vertical: str | None = option(None, metavar="A:B", help="Of its vertical axis, in the unit of the axis.")
    plot_scale: str | None = option(None, metavar="NAME", help="linear or log.")


def view_of(given: ViewOptions, files: Files, unit: str = "") -> View:
    """Title, limits and scale from the texts of the options, the horizontal limits in `unit`; refused without --plot."""
    _refuse_without_plot(vars(given), "--plot" in files.paths)
    scale = given.plot_scale
    return View(
        title=None if given.plot_title is None else _title(given.plot_title),
        horizontal=_limits("--plot-range", given.plot_range, unit),
        vertical=_limits("--plot-vertical", given.plot_vertical, ""),
        log=None if scale is None else SCALES[require_one_of("--plot-scale", scale, SCALES)],
    )


def _refuse_without_plot(texts: Mapping[str, Any], drawn: bool) -> None:
    named = [name for name, text in texts.items() if text is not None]
    if named and not drawn:
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
    if not verb.spectral:
        return view_of(ViewOptions(**texts), Files({"--plot": Path()} if drawn else {}), verb.drawn or "")
    _refuse_without_plot(texts, drawn)
    readers: dict[str, tuple[str, Callable[[str], Any]]] = {
        "plot_unit": ("unit", lambda text: require_one_of("--plot-unit", text, UNITS)),
        "plot_title": ("title", _title),
        "plot_range": ("range_mhz", lambda text: _limits("--plot-range", text, "MHz")),
        "plot_vertical": ("vertical", lambda text: _limits("--plot-vertical", text, "")),
        "plot_scale": ("log", lambda text: SCALES[require_one_of("--plot-scale", text, SCALES)]),
    }
    return {readers[name][0]: readers[name][1](text) for name, text in texts.items()}
