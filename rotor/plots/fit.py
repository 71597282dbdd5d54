"""Residuals of a fit against frequency, J and Ka (or K), in units of the line errors."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotor.fit.fit import Fit
from rotor.plots.spectrum import BLUE, DPI, GREY, STYLE
from rotor.version import version

RED = "#D55E00"  # of Okabe and Ito's palette
_HEADINGS = {
    "j": "J of the upper state",
    "ka": "Ka of the upper state",
    "k": "K of the upper state",
    "n": "N of the upper state",
    "f": "F of the upper state (rounded up)",
}


def fit_figure(fit: Fit, title: str = "") -> Any:
    """A matplotlib figure of (obs - calc)/error of every line; lines that do not count are crosses."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    panels = [("frequency (GHz)", fit.lines.frequency_mhz / 1e3)]
    panels += [
        (_HEADINGS[name], fit.lines.upper[:, i].astype(float))
        for i, name in enumerate(fit.lines.names)
        if name in _HEADINGS
    ]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 1.6 * len(panels) + 0.6), layout="constrained")
        for (heading, x), axes in zip(panels, figure.subplots(len(panels), 1, squeeze=False).flat, strict=True):
            _draw(axes, fit, x)
            axes.set_xlabel(heading)
        status = "" if fit.converged else ", NOT CONVERGED"
        text = (
            f"{title or fit.lines.source}: weighted rms {fit.weighted_rms:.3g}, {len(fit.groups)} frequencies{status}"
        )
        figure.axes[0].set_title(text.replace("$", r"\$"), loc="left")
    return figure


def plot_fit(
    fit: Fit, path: str | os.PathLike[str], *, title: str = "", provenance: Mapping[str, Any] | None = None
) -> None:
    """Draw `fit_figure` into a .png, .pdf or .svg file, with the provenance in its metadata.

    Raises ValueError for another suffix.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".png", ".pdf", ".svg"):
        raise ValueError(f"{os.fspath(path)}: a picture is .png, .pdf or .svg; the suffix names the format")
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        fit_figure(fit, title).savefig(path, dpi=DPI, metadata=_metadata(suffix, fit, provenance or {}))


def _draw(axes: Any, fit: Fit, x: np.ndarray[Any, Any]) -> None:
    error = np.where(fit.lines.error_mhz > 0, fit.lines.error_mhz, np.nan)
    y = fit.difference_mhz / error
    used = fit.used
    axes.axhspan(-1, 1, color=GREY, alpha=0.12, linewidth=0)
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    axes.plot(x[used], y[used], "o", markersize=2.6, color=BLUE, alpha=0.8, markeredgewidth=0)
    axes.plot(x[~used], y[~used], "x", markersize=4.0, color=RED)
    seen = np.abs(y[used][np.isfinite(y[used])])
    limit = max(3.5, 1.1 * float(seen.max(initial=0.0)))
    axes.set_ylim(-limit, limit)
    axes.set_ylabel("(obs - calc)/error")


def _metadata(suffix: str, fit: Fit, more: Mapping[str, Any]) -> dict[str, Any]:
    """Provenance by the keys that each format has; no date, so that the same picture is the same file."""
    facts = {
        **more,
        "constants": fit.constants.text() if fit.constants else fit.parameters.names,
        "weighted_rms": fit.weighted_rms,
        "converged": fit.converged,
    }
    description = "; ".join(f"{name}: {value}" for name, value in facts.items())
    program = f"rotor {version()}"
    if suffix == ".png":
        return {"Software": program, "Description": description}
    if suffix == ".pdf":
        return {"Creator": program, "Subject": description, "CreationDate": None}
    return {"Creator": program, "Description": description, "Date": None}
