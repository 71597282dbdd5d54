"""A picture of a molecule in its principal axes: atoms and bonds, with the lengths of the bonds and their errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.formats.fits.structure_request import StructureAnswer
from rotor.molecules.molecule import Molecule
from rotor.plots.picture import GREY, WIDTH_INCHES, Picture, formula_text, name_text, new_figure, styled
from rotor.structures.coordinates import bonded
from rotor.structures.substitution import Value

_MARGIN = 0.9  # Å around the atoms
_STANDS, _BESIDE = 0.5, 0.1  # sine of a bond's slope above which its length is written beside it; distance, Å
_OUTSIDE = 0.3  # Å; the length of a bond farther than this from the centre is written on its outer side
SMALLEST_ERROR = 1e-5  # smaller errors are round-off (a fit to exact constants) and are not written


def structure_figure(molecule: Molecule, *, values: Sequence[Value] = (), title: str = "") -> Any:
    """A matplotlib figure of a molecule in its principal axes.

    Parameters
    ----------
    molecule : Molecule
        Positions in the frame of a, b, c (Å); the two axes along which it extends farthest are drawn.
    values : sequence of Value, optional
        Bond lengths with errors, written at the bonds.
    title : str, optional
        By default the formula.

    Returns
    -------
    matplotlib.figure.Figure
        One panel.
    """
    x = molecule.positions_angstrom
    spread = np.ptp(x, axis=0)
    across, up, depth = np.argsort(-spread, kind="stable").tolist()
    width, height = max(spread[across] + 2 * _MARGIN, 2.5), max(spread[up] + 2 * _MARGIN, 2.0)
    scale = min(WIDTH_INCHES / width, 6.0 / height, 1.5)
    with styled():
        figure = new_figure((width * scale, height * scale + 0.5))
        axes = figure.add_subplot()
        _draw_bonds(axes, molecule, values, across, up)
        _draw_atoms(axes, molecule, across, up, depth)
        middle = (x.max(axis=0) + x.min(axis=0)) / 2
        axes.set_xlim(middle[across] - width / 2, middle[across] + width / 2)
        axes.set_ylim(middle[up] - height / 2, middle[up] + height / 2)
        axes.set_aspect("equal")
        axes.set_xlabel(f"Axis ${'abc'[across]}$ (Å)")
        axes.set_ylabel(f"Axis ${'abc'[up]}$ (Å)")
        axes.set_title(title or formula_text(molecule.formula), loc="left")
    return figure


def picture(answer: StructureAnswer, *, title: str | None = None) -> Picture:
    """The picture of the geometry that the last method gave, with its bonds."""
    molecule, values, method = answer.geometry
    title = title or f"{name_text(answer.request.file.family.name)}, {method}"
    places = np.round(molecule.positions_angstrom, 6).tolist()
    atoms = [[symbol, *place] for symbol, place in zip(molecule.symbols, places, strict=True)]
    return Picture(structure_figure(molecule, values=values, title=title), title, {"atoms": atoms})


def _draw_bonds(axes: Any, molecule: Molecule, values: Sequence[Value], across: int, up: int) -> None:
    from rotor.fitting.reports.publication import value_text
    from rotor.structures.coordinates import named

    x = molecule.positions_angstrom
    written: dict[tuple[int, ...], str] = {}
    for value in values:
        if len(value.atoms) == 2:
            seen = np.isfinite(value.error) and value.error > SMALLEST_ERROR
            text = value_text(round(value.value, 6), value.error) if seen else f"{value.value:.4f}"
            for atoms in named(molecule, value.name, value.atoms).alike:
                written.setdefault(tuple(sorted(atoms)), text)
    centre = x[:, [across, up]].mean(axis=0)
    for i, j in bonded(molecule):
        ends = x[[i - 1, j - 1]][:, [across, up]]
        axes.plot(ends[:, 0], ends[:, 1], color=GREY, linewidth=2.5, solid_capstyle="round", zorder=1)
        if (i, j) in written:
            _write_at_bond(axes, ends, [_radius(molecule.symbols[k - 1]) for k in (i, j)], centre, written[i, j])


def _write_at_bond(axes: Any, ends: Floats, radii: Sequence[float], centre: Floats, text: str) -> None:
    """Write a text at the middle of the visible part of a bond: above the circles of both atoms if it is flat, else beside it.

    The side is that away from the centre of the molecule; for bonds towards the centre, the side away from it along the line of the
    text; else the upper one.
    """
    along = (ends[1] - ends[0]) / (np.linalg.norm(ends[1] - ends[0]) or 1.0)
    normal = np.array([-along[1], along[0]])
    middle = (ends[0] + radii[0] * along + ends[1] - radii[1] * along) / 2
    stands = abs(normal[0]) > _STANDS
    off = middle - centre
    outward, sideways = float(off @ normal), float(off[0] * np.sign(normal[0])) if stands else 0.0
    up = normal[1] > 0 or (normal[1] == 0 and normal[0] > 0)
    away = next((distance > 0 for distance in (outward, sideways) if abs(distance) > _OUTSIDE), up)
    normal = normal if away else -normal
    side = "left" if normal[0] > 0 else "right"
    place = middle + normal * (_BESIDE if stands else max(radii) + _BESIDE)
    axes.text(*place, text, ha=side if stands else "center", va="center", fontsize=9, zorder=4)


def _radius(symbol: str) -> float:
    """Radius of the circle drawn for an atom, Å."""
    from ase.data import atomic_numbers, covalent_radii

    return float(0.42 * covalent_radii[atomic_numbers[symbol]])


def _draw_atoms(axes: Any, molecule: Molecule, across: int, up: int, depth: int) -> None:
    from ase.data import atomic_numbers
    from ase.data.colors import jmol_colors
    from matplotlib.patches import Circle

    x = molecule.positions_angstrom
    for atom in np.argsort(x[:, depth], kind="stable").tolist():
        number = atomic_numbers[molecule.symbols[atom]]
        colour = 0.75 * np.asarray(jmol_colors[number]) + 0.25
        place = (x[atom, across], x[atom, up])
        axes.add_patch(
            Circle(place, _radius(molecule.symbols[atom]), facecolor=colour, edgecolor=GREY, linewidth=0.8, zorder=2)
        )
        axes.text(*place, f"{molecule.symbols[atom]}{atom + 1}", ha="center", va="center", fontsize=9, zorder=3)
