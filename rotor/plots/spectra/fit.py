"""Residuals of a fit against frequency, J and Ka (or K), in units of the line errors."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from rotor.fitting.result import Fit
from rotor.formats.fits.fit_request import FitAnswer
from rotor.plots.picture import BLUE, GREY, ORANGE, WIDTH_INCHES, Picture, new_figure, styled
from rotor.table import counted

_HEADINGS = {
    "j": "J of the upper state",
    "ka": "Ka of the upper state",
    "k": "K of the upper state",
    "n": "N of the upper state",
    "f": "F of the upper state",
}


def fit_figure(fit: Fit, title: str = "") -> Any:
    """A matplotlib figure of (obs - calc)/error of all lines; excluded lines are crosses."""
    halves = fit.lines.halves
    panels = [("Frequency (GHz)", fit.lines.frequency_mhz / 1e3)]
    panels += [
        (_heading(name, halves), fit.lines.upper[:, i] / (2.0 if name in halves else 1.0))
        for i, name in enumerate(fit.lines.names)
        if name in _HEADINGS
    ]
    with styled():
        figure = new_figure((WIDTH_INCHES, 1.6 * len(panels) + 0.6))
        for place, (heading, x) in enumerate(panels, 1):
            axes = figure.add_subplot(len(panels), 1, place)
            _draw(axes, fit, x)
            axes.set_xlabel(heading)
            if place > 1:  # quantum numbers: ticks at whole numbers only
                axes.xaxis.get_major_locator().set_params(integer=True)
        figure.axes[0].set_title(_title(fit, title).replace("$", r"\$"), loc="left")
    return figure


def _heading(name: str, halves: Collection[str]) -> str:
    """Title of an axis; SPFIT files round half-integer F up."""
    return _HEADINGS[name] + (" (rounded up)" if name == "f" and name not in halves else "")


def _title(fit: Fit, title: str) -> str:
    status = "" if fit.converged else ", NOT CONVERGED"
    count = counted(len(fit.groups), "frequency", "frequencies")
    return f"{title or fit.lines.source}: weighted rms {fit.weighted_rms:.3g}, {count}{status}"


def picture(thing: Fit | FitAnswer, *, title: str | None = None) -> Picture:
    """The picture of a finished fit, or of the answer that has it."""
    if isinstance(thing, FitAnswer):
        title, thing = title or thing.request.title, thing.fit
    names = thing.constants.text() if thing.constants else thing.parameters.names
    facts = {"constants": names, "weighted_rms": thing.weighted_rms, "converged": thing.converged}
    return Picture(fit_figure(thing, title or ""), _title(thing, title or ""), facts)


def _draw(axes: Any, fit: Fit, x: np.ndarray[Any, Any]) -> None:
    error = np.where(fit.line_errors_mhz > 0, fit.line_errors_mhz, np.nan)
    y = fit.difference_mhz / error
    used = fit.used
    axes.axhspan(-1, 1, color=GREY, alpha=0.12, linewidth=0)
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    axes.plot(x[used], y[used], "o", markersize=2.6, color=BLUE, alpha=0.8, markeredgewidth=0)
    axes.plot(x[~used], y[~used], "x", markersize=4.0, color=ORANGE)
    seen = np.abs(y[used][np.isfinite(y[used])])
    limit = max(3.5, 1.1 * float(seen.max(initial=0.0)))
    axes.set_ylim(-limit, limit)
    axes.set_ylabel("(Obs. − calc.) / error")
