"""Pictures of a classical gas: equipartition by degree, correlation functions, and a band over its quantum lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rotor.classical.gas.ensembles import Correlations
from rotor.plots.picture import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SIZE_INCHES,
    WIDTH_INCHES,
    Picture,
    name_text,
    new_figure,
    styled,
    top_title,
)
from rotor.plots.view import WHOLE, View, show_part
from rotor.spectra.spectrum import Spectrum
from rotor.statistics.equipartition import Equipartition
from rotor.thermodynamics.gas.classical_gas import GasAnswer
from rotor.units import MHZ_PER_CM


def equipartition_figure(tests: Mapping[str, Equipartition], columns: int = 2) -> Any:
    """A matplotlib figure of the mean of 2E/kT by degree for each gas, with bands of 1 and 3 expected standard deviations."""
    figure, axes = _panels(len(tests), columns, 2.6)
    for panel, (name, test) in zip(axes, tests.items(), strict=False):
        _draw_test(panel, test, name_text(name))
    return figure


def correlation_figure(curves: Mapping[str, Correlations], columns: int = 2) -> Any:
    """A matplotlib figure of C1 and C2 against time in ps, one panel for each gas, with bands of three standard errors."""
    figure, axes = _panels(len(curves), columns, 3.0)
    for panel, (name, curve) in zip(axes, curves.items(), strict=False):
        _draw_curves(panel, curve, name, None)
    return figure


def band_figure(pairs: Sequence[tuple[str, Mapping[str, Spectrum], Spectrum]], columns: int = 2) -> Any:
    """A matplotlib figure of classical bands over quantum ones; each pair: (title, classical bands by name, quantum band)."""
    figure, axes = _panels(len(pairs), columns, 3.0)
    for panel, (title, classical, quantum) in zip(axes, pairs, strict=False):
        cm = quantum.frequency_mhz / MHZ_PER_CM
        panel.fill_between(cm, quantum.intensity, color=BLUE, alpha=0.25, linewidth=0.0)
        panel.plot(cm, quantum.intensity, color=BLUE, linewidth=1.2, label="quantum lines")
        for (name, spectrum), colour in zip(classical.items(), (ORANGE, GREEN, "black", GREY), strict=False):
            panel.plot(cm, spectrum.intensity, color=colour, linewidth=1.2, label=f"classical, {name}")
        panel.set(xlabel="Wavenumber (cm⁻¹)", ylabel="Cross section (nm²)", xlim=(0, cm[-1]))
        panel.set_ylim(bottom=0.0)
        panel.ticklabel_format(axis="y", style="sci", scilimits=(0, 0))
        panel.set_title(title, loc="left")
        panel.legend(frameon=False, loc="upper right", handlelength=1.2)
    return figure


def picture(
    thing: GasAnswer | Correlations | Equipartition, *, title: str | None = None, view: View = WHOLE
) -> Picture:
    """The test of equipartition and the correlation functions of a gas, or one of them; view: of times (ps) and correlations."""
    title = title if view.title is None else view.title
    if isinstance(thing, GasAnswer):
        request = thing.request
        title = title or f"{top_title(request.top)}, {request.temperature_k:g} K, {request.molecules:,} molecules"
        return Picture(_gas_figure(thing, title, view), title)
    title = title or ""
    if isinstance(thing, Correlations):
        return Picture(correlation_figure({title: thing}), title)
    return Picture(equipartition_figure({title: thing}), title)


def _gas_figure(gas: GasAnswer, title: str, view: View) -> Any:
    test, curves = gas.test, gas.correlations
    figure, axes = _panels(1 if curves is None else 2, 2, SIZE_INCHES[1])
    with styled():
        verdict = "accepted" if test.accepted else "rejected"
        _draw_test(axes[0], test, f"Equipartition {verdict}, p = {test.p_value:.2g}")
        if curves is not None:
            _draw_curves(axes[1], curves, "Correlation of orientation", gas.facts()["c1_plateau"])
            show_part(axes[1], view)
        figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    return figure


def _panels(count: int, columns: int, height: float) -> tuple[Any, list[Any]]:
    """A figure and its panels, in rows."""
    if not count:
        raise ValueError("there is nothing to draw")
    across = min(columns, count)
    rows = -(-count // across)
    with styled():
        figure = new_figure((max(WIDTH_INCHES, 3.0 * across), height * rows))
        axes = list(figure.subplots(rows, across, squeeze=False).flat)
    for empty in axes[count:]:
        empty.set_visible(False)
    return figure, axes[:count]


def _draw_test(axes: Any, test: Equipartition, title: str) -> None:
    names = [degree.name.replace("translation", "trans.").replace("rotation", "rot.") for degree in test.degrees]
    places = np.arange(len(names))
    spread = np.array([degree.mean_spread for degree in test.degrees])
    for factor, shade in ((3.0, 0.12), (1.0, 0.25)):
        axes.bar(
            places, 2 * factor * spread, bottom=1.0 - factor * spread, width=0.8, color=GREY, alpha=shade, linewidth=0
        )
    axes.axhline(1.0, color=GREY, linewidth=0.7)
    colours = [ORANGE if degree.name in test.failing else BLUE for degree in test.degrees]
    axes.scatter(places, [degree.mean for degree in test.degrees], c=colours, s=18, zorder=3)
    axes.set_xticks(places, names, rotation=40, ha="right")
    axes.set_ylabel("Mean of 2E/kT")
    axes.set_title(title, loc="left")


def _draw_curves(axes: Any, curves: Correlations, title: str, plateau: float | None) -> None:
    for name, values, error, colour in (
        ("$C_1$", curves.c1, curves.c1_error, BLUE),
        ("$C_2$", curves.c2, curves.c2_error, ORANGE),
    ):
        if values is not None and error is not None:
            order = np.argsort(curves.times)
            t, mean, band = curves.times[order], values[order], 3.0 * error[order]
            axes.fill_between(t, mean - band, mean + band, color=colour, alpha=0.2, linewidth=0.0)
            axes.plot(t, mean, color=colour, linewidth=1.2, label=name)
    if plateau is not None:
        axes.axhline(plateau, color=BLUE, linewidth=0.7, linestyle=":", label="$C_1$ at $t → ∞$")
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    axes.set_xlabel("Time (ps)")
    axes.set_ylabel("Correlation function")
    axes.set_title(title, loc="left")
    axes.legend(frameon=False)
