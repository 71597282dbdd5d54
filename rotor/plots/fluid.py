"""Picture of a fluid run: temperatures and potential energy against time, and the pair distribution of the molecules."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from rotor.fluids.analysis import PairDistribution
from rotor.fluids.record import FluidRecord
from rotor.plots.picture import BLUE, GREEN, GREY, ORANGE, checked_suffix, new_figure, save, styled
from rotor.plots.view import WHOLE, View, show_part
from rotor.units import KJ_PER_MOL_EV

TIME = "Time (ps)"


def plot_fluid(
    record: FluidRecord,
    shells: PairDistribution | None,
    molecules: int,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    view: View = WHOLE,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw a run.

    Parameters
    ----------
    record, shells, molecules, title :
        As in `fluid_figure`.
    path : path
    view : View
        Range of times (ps) and temperatures, and another title.
    provenance : mapping, optional
        Written into the metadata of the file.

    Raises
    ------
    ValueError
        For a suffix other than .png, .pdf, .svg.
    """
    checked_suffix(path)
    title = title if view.title is None else view.title
    figure = fluid_figure(record, shells, molecules, title=title)
    temperature_axes, energy_axes = (panel for panel in figure.axes if panel.get_xlabel() == TIME)
    show_part(temperature_axes, view)
    show_part(energy_axes, View(horizontal=view.horizontal))
    save(figure, path, title, provenance or {})


def fluid_figure(record: FluidRecord, shells: PairDistribution | None, molecules: int, *, title: str = "") -> Any:
    """A matplotlib figure of a run.

    Parameters
    ----------
    record : FluidRecord
    shells : PairDistribution or None
        g(r) of centres of mass; None draws temperatures and energy only.
    molecules : int
        Number of molecules, which divides the energy.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
        Temperatures and energy over time, g(r) beside them.
    """
    with styled():
        figure = new_figure((7.2, 4.2))
        if shells is None:
            temperature_axes, energy_axes = figure.subplots(2, 1, sharex=True)
        else:
            panels = figure.subplot_mosaic([["temperature", "g"], ["energy", "g"]])
            temperature_axes, energy_axes = panels["temperature"], panels["energy"]
            _draw_shells(panels["g"], shells)
        _draw_temperatures(temperature_axes, record)
        potential = record.potential_ev * KJ_PER_MOL_EV / molecules
        energy_axes.plot(record.time_ps, potential, color=BLUE, linewidth=0.8)
        if shells is None:
            temperature_axes.xaxis.label.set_visible(False)  # the panels share the axis below
        energy_axes.set(xlabel=TIME, ylabel="Potential energy (kJ/mol)")
        figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    return figure


def _draw_temperatures(axes: Any, record: FluidRecord) -> None:
    """Draw the temperature of all degrees of freedom, of translation, and of rotation if there is any."""
    curves = (
        ("translation", record.translation_k, BLUE),
        ("rotation", record.rotation_k, ORANGE),
        ("all", record.temperature_k, "black"),
    )
    for name, kelvin, colour in curves:
        if np.isfinite(kelvin).all():
            axes.plot(record.time_ps, kelvin, color=colour, linewidth=0.8, label=name)
    axes.set(xlabel=TIME, ylabel="Temperature (K)")
    axes.legend(frameon=False, ncols=3, fontsize=7, loc="best")


def _draw_shells(axes: Any, shells: PairDistribution) -> None:
    axes.axhline(1.0, color=GREY, linewidth=0.7)
    axes.plot(shells.r_angstrom, shells.g, color=GREEN, linewidth=1.2)
    axes.set(xlabel="Distance $r$ of centres of mass (Å)", ylabel="Pair distribution $g(r)$")
    axes.set_xlim(0.0, float(shells.r_angstrom[-1]))
    axes.set_ylim(bottom=0.0)
