"""Pictures of fits of observed spectra: rotational diagrams of several species, draws of a sample in pairs."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.observed.diagram import plot_rotational_diagram
from rotor.plots.picture import BLUE, checked_suffix, new_figure, save, styled

if TYPE_CHECKING:
    from rotor.observed.diagrams import SpeciesDiagrams
    from rotor.observed.sampling import SourceSample

SYMBOLS = {
    "column_per_cm2": r"$\log_{10} N$ (cm$^{-2}$)",
    "excitation_k": r"$T_\mathrm{ex}$ (K)",
    "velocity_km_s": "$v$ (km/s)",
    "fwhm_km_s": r"$\Delta v$ (km/s)",
    "size_arcsec": r"$\theta_s$ (″)",
}  # by the end of a parameter's name
_COLUMNS = 3
_PANEL_INCHES = (3.6, 3.0)


def plot_diagrams(
    diagrams: SpeciesDiagrams, path: str | os.PathLike[str], provenance: Mapping[str, Any] | None = None
) -> None:
    """Draw all diagrams; ValueError without any, and for another suffix."""
    checked_suffix(path)
    count = len(diagrams.diagrams)
    if not count:
        raise ValueError(f"{os.fspath(path)}: no species has a rotational diagram: {'; '.join(diagrams.notes)}")
    columns = min(count, _COLUMNS)
    rows = -(-count // columns)
    with styled():
        figure = new_figure((columns * _PANEL_INCHES[0], rows * _PANEL_INCHES[1]))
        for place, (name, diagram) in enumerate(zip(diagrams.names, diagrams.diagrams, strict=True), start=1):
            axes = figure.add_subplot(rows, columns, place)
            plot_rotational_diagram(diagram, axes)
            axes.set_title(name, fontsize=9)
    save(figure, path, "rotational diagrams", provenance or {})


def plot_corner(
    sample: SourceSample, path: str | os.PathLike[str], provenance: Mapping[str, Any] | None = None
) -> None:
    """Draw every pair of parameters of a sample (extra `sampling`); medians and 68 % intervals stand above the diagonal."""
    from rotor.observed.sampling import load_corner

    checked_suffix(path)
    draws = sample.draws.copy()
    columns = [i for i, name in enumerate(sample.names) if name.endswith("column_per_cm2")]
    draws[:, columns] = np.log10(draws[:, columns])
    count = len(sample.names)
    species = {name.rpartition(" ")[0] for name in sample.names}
    common = species.pop() if len(species) == 1 else ""
    labels = [parameter_text(name.removeprefix(f"{common} ")) for name in sample.names]
    with styled():
        figure = new_figure((2.0 + 1.3 * count, 2.0 + 1.3 * count), layout=None)  # corner places its panels
        load_corner().corner(
            draws, fig=figure, labels=labels, max_n_ticks=3, labelpad=0.2,
            color=BLUE, quantiles=(0.1587, 0.5, 0.8413), plot_datapoints=False,
        )  # fmt: skip
        figure.subplots_adjust(left=0.17, bottom=0.17, right=0.97, top=0.93)
        figure.suptitle(common, x=0.01, ha="left")
        for i, axes in enumerate(figure.axes[:: count + 1]):
            low, middle, high = np.quantile(draws[:, i], (0.1587, 0.5, 0.8413))
            places = max(0, 1 - math.floor(math.log10(min(middle - low, high - middle))))
            bounds = f"_{{-{middle - low:.{places}f}}}^{{+{high - middle:.{places}f}}}"
            axes.set_title(f"${middle:.{places}f}{bounds}$", loc="center")
    save(figure, path, "sample of a fit", provenance or {})


def parameter_text(name: str) -> str:
    """A parameter of a fit as an axis names it: the species above its symbol with the unit.

    >>> parameter_text("acetonitrile velocity_km_s")
    'acetonitrile\\n$v$ (km/s)'
    """
    species, _, quantity = name.rpartition(" ")
    return "\n".join(filter(None, (species, SYMBOLS.get(quantity, quantity.replace("_", " ")))))
