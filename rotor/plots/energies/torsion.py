"""A picture of a torsion: the potential, its levels, and a wave function on each."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor import units
from rotor.plots.picture import GREY, PALETTE, SIZE_INCHES, Picture, new_figure, styled, top_title
from rotor.plots.view import WHOLE, View, show_part
from rotor.thermodynamics.torsion.request import TorsionAnswer
from rotor.version import version

POINTS = 721
AMPLITUDE = 0.55  # greatest amplitude of a wave function, relative to the smallest spacing of levels of different v
MOST_DRAWN = 12


def picture(answer: TorsionAnswer, *, view: View = WHOLE) -> Picture:
    """The picture of a torsion."""
    facts = {"program": "rotor", "version": version(), "bond": answer.request.bond, "potential": answer.source}
    return Picture(torsion_figure(answer, view), view.title or _title(answer), facts)


def torsion_figure(answer: TorsionAnswer, view: View = WHOLE) -> Any:
    """A matplotlib figure of V(α) in cm⁻¹, points of the scan, levels as lines, and their real wave functions coloured by species."""
    levels, torsion = answer.levels, answer.torsion
    drawn = min(len(levels), MOST_DRAWN)
    angles = np.linspace(0, 2 * np.pi, POINTS)
    potential = (torsion.potential.values(angles) - torsion.foot_mhz) / units.MHZ_PER_CM
    waves = answer.wave_functions(angles)[:, :drawn]
    height = AMPLITUDE * _spacing(levels.energy_cm[:drawn], levels.v[:drawn]) / np.abs(waves).max()
    degrees = np.degrees(angles)
    with styled():
        figure = new_figure(SIZE_INCHES)
        axes = figure.subplots()
        axes.plot(degrees, potential, color="black", linewidth=1.4, label="V(α)")
        if answer.scan is not None:
            # the scan has a zero of its own: shift it so that its mean is that of the fitted potential at the same angles
            fitted_mean = (torsion.potential.values(answer.scan.angles).mean() - torsion.foot_mhz) / units.MHZ_PER_CM
            offset = fitted_mean - answer.scan.energies_cm.mean()
            axes.plot(
                np.degrees(answer.scan.angles) % 360,
                answer.scan.energies_cm + offset,
                "o",
                color=GREY,
                markersize=3,
                label="scan",
            )
        in_legend: set[int] = set()
        for row in range(drawn):
            species = int(levels.species[row])
            label = f"σ = {species}" if torsion.fold > 1 and species not in in_legend else None
            in_legend.add(species)
            colour, energy = PALETTE[species % len(PALETTE)], levels.energy_cm[row]
            axes.axhline(energy, color=colour, linewidth=0.5, alpha=0.6)
            axes.plot(degrees, energy + height * waves[:, row], color=colour, linewidth=0.9, label=label)
        axes.set_xlim(0, 360)
        axes.set_xticks(range(0, 361, 60))
        axes.set_xlabel("Torsional angle, 0 in the geometry (degrees)")
        axes.set_ylabel("Energy above the minimum (cm⁻¹)")
        axes.set_title(_title(answer) if view.title is None else view.title, loc="left")
        axes.legend(frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        show_part(axes, view)
    return figure


def _spacing(energies: Any, v: Any) -> float:
    """Smallest mean distance between the levels of neighbouring v, cm⁻¹."""
    means = np.array([energies[v == state].mean() for state in np.unique(v)])
    apart = np.abs(np.diff(means))
    wide = apart[apart > 0.1 * apart.max(initial=0.0)]
    return float(wide.min()) if len(wide) else max(float(energies.max()), 1.0)


def _title(answer: TorsionAnswer) -> str:
    return f"{top_title(answer.request.top)}: rotation about the bond {answer.request.bond}"
