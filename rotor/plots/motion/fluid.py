"""Picture of a fluid run: temperatures and potential energy against time, and the pair distribution of the molecules."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.fluids.analysis import PairDistribution, pair_distribution
from rotor.fluids.record import FluidRecord
from rotor.fluids.request import FluidAnswer
from rotor.plots.picture import BLUE, GREEN, GREY, ORANGE, WIDTH_INCHES, Picture, new_figure, styled
from rotor.plots.view import WHOLE, View, show_part
from rotor.units import KJ_PER_MOL_EV

TIME = "Time (ps)"
ENSEMBLES = {"nve": "constant energy", "langevin": "Langevin thermostat", "nose-hoover": "Nosé-Hoover thermostat"}


def picture(answer: FluidAnswer, *, title: str | None = None, view: View = WHOLE) -> Picture:
    """The picture of a run; view: of times (ps) and temperatures. With its centres, a periodic box also has its pair distribution."""
    settings, centres, molecules = (
        answer.request.settings,
        answer.centres,
        len(np.unique(answer.atoms.arrays["molecule"])),
    )
    shells = None if centres is None else _shells(answer.atoms, centres)
    engine = "" if answer.request.engine == "rotor" else f", {answer.request.engine}"
    default = f"{molecules} molecules, {settings.model}, {ENSEMBLES[settings.ensemble]}{engine}"
    if shells is not None:
        default += f"; g(r) of {len(centres)} frame{'s' if len(centres) > 1 else ''}"
    title = (default if title is None else title) if view.title is None else view.title
    figure = fluid_figure(answer.record, shells, molecules, title=title)
    temperature_axes, energy_axes = (panel for panel in figure.axes if panel.get_xlabel() == TIME)
    show_part(temperature_axes, view)
    show_part(energy_axes, View(horizontal=view.horizontal))
    return Picture(figure, title)


def _shells(atoms: Any, centres: Any) -> PairDistribution | None:
    """The pair distribution of the centres; None without a right-angled periodic box, or for a single molecule."""
    if not (atoms.pbc.all() and atoms.cell.orthorhombic and centres.shape[1] > 1):
        return None
    edges = atoms.cell.lengths()
    return pair_distribution(centres, edges, float(edges.min()) / 2, 120)


def fluid_figure(record: FluidRecord, shells: PairDistribution | None, molecules: int, *, title: str = "") -> Any:
    """A matplotlib figure of a run.

    shells: g(r) of centres of mass; None draws temperatures and energy only. molecules: number of molecules, which divides the energy.
    Returns: temperatures and energy over time, g(r) beside them.
    """
    with styled():
        figure = new_figure((WIDTH_INCHES, 4.2))
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
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0, ncols=3, handlelength=1.0, columnspacing=1.0
    )


def _draw_shells(axes: Any, shells: PairDistribution) -> None:
    axes.axhline(1.0, color=GREY, linewidth=0.7)
    axes.plot(shells.r_angstrom, shells.g, color=GREEN, linewidth=1.2)
    axes.set(xlabel="Distance $r$ of centres of mass (Å)", ylabel="Pair distribution $g(r)$")
    axes.set_xlim(0.0, float(shells.r_angstrom[-1]))
    axes.set_ylim(bottom=0.0)
