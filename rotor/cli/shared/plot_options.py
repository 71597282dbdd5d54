"""Options of the picture of --plot: title, unit, range and scale of its axes, style."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from rotor.checks import require_one_of
from rotor.plots.view import Limits, View

if TYPE_CHECKING:
    from rotor.verbs.verb import Verb

SCALES = {"linear": False, "log": True}
UNITS = ("MHz", "GHz", "THz", "cm-1")
AXES = ("plot_unit", "plot_title", "plot_range", "plot_vertical", "plot_scale")
PLOT_NAMES = (*AXES, "style")


def _refuse_without_plot(named: Sequence[str], drawn: bool) -> None:
    if named and not drawn:
        raise ValueError(f"--{named[0].replace('_', '-')}: expected with --plot, the file of the picture")


def _limits(name: str, text: str, unit: str) -> Limits:
    from rotor.units import parse_range

    try:
        return parse_range(text, unit)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def picture_settings(verb: Verb, typed: Mapping[str, Any], drawn: bool) -> Any:
    """The view of a verb's picture from what was typed; drawn: whether there is a picture. Settings by name of a spectrum."""
    _refuse_without_plot([name for name in PLOT_NAMES if name in typed], drawn)
    texts = {name: text for name, text in typed.items() if name in AXES}
    unit, range_ = ("MHz", "range_mhz") if verb.spectral else (verb.drawn or "", "horizontal")
    readers: dict[str, tuple[str, Callable[[str], Any]]] = {
        "plot_unit": ("unit", lambda text: require_one_of("--plot-unit", text, UNITS)),
        "plot_title": ("title", lambda text: text.replace("$", r"\$")),  # matplotlib takes dollar signs for formulas
        "plot_range": (range_, lambda text: _limits("--plot-range", text, unit)),
        "plot_vertical": ("vertical", lambda text: _limits("--plot-vertical", text, "")),
        "plot_scale": ("log", lambda text: SCALES[require_one_of("--plot-scale", text, SCALES)]),
    }
    settings = {readers[name][0]: readers[name][1](text) for name, text in texts.items()}
    return settings if verb.spectral else View(**settings)


@contextmanager
def picture_style(typed: Mapping[str, Any]) -> Iterator[None]:
    """Inside, pictures have the style that --style names; ValueError where there is none of that name. Without it, no matplotlib."""
    with ExitStack() as stack:
        if "style" in typed:
            from rotor.plots.picture import users_style

            try:
                stack.enter_context(users_style(typed["style"]))
            except ValueError as error:
                raise ValueError(f"--{error}") from None
        yield
