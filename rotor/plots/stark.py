"""A picture of levels in a field: energy against field, a colour for each |M|, and the effective dipoles below."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rotor.arrays import Ints
from rotor.plots.picture import checked_suffix, joined, new_figure, save_described, styled
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.fields.field_map import FieldMap
from rotor.spectra.fields.lines import FieldLines
from rotor.units import MHZ_PER_CM

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito
SIZE_INCHES = (7.2, 6.4)
LEAST_DRAWN = 1e-4  # of the strongest line


def stark_figure(field_map: FieldMap, title: str = "", unit: str = "kV/cm", view: View = WHOLE) -> Any:
    """A matplotlib figure of a map of levels in a field.

    Parameters
    ----------
    field_map : FieldMap
        Of two fields or more.
    title : str
        Above the picture.
    unit : str
        Of the field.
    view : View
        Fields and energies (cm⁻¹) shown; its title is not used here.

    Returns
    -------
    matplotlib.figure.Figure
        Energies above, slopes below.

    Raises
    ------
    ValueError
        For a map of one field, or with less than two in the view.
    """
    if len(field_map.fields) < 2:
        raise ValueError("a picture of a map needs two fields or more")
    with styled():
        figure = new_figure(SIZE_INCHES)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.4))
        _energies(above, field_map, view)
        _slopes(below, field_map, unit, view)
        above.set_title(title, loc="left")
    return figure


def plot_stark(
    field_map: FieldMap,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    unit: str = "kV/cm",
    view: View = WHOLE,
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw `stark_figure` into a .png, .pdf or .svg file.

    Parameters
    ----------
    field_map : FieldMap
        Of two fields or more.
    path : path
        Its suffix chooses the format.
    title : str
        Above the picture.
    unit : str
        Of the field.
    view : View
        Fields and energies (cm⁻¹) shown, and another title.
    provenance : mapping, optional
        Further facts for the metadata.

    Raises
    ------
    ValueError
        For a map of one field, and for a suffix that is no picture.
    """
    checked_suffix(path)
    title = title if view.title is None else view.title
    figure = stark_figure(field_map, title, unit, view)
    save_described(figure, path, title, joined(provenance, field_map.provenance))


def _energies(axes: Any, field_map: FieldMap, view: View) -> None:
    seen: set[float] = set()
    ends: list[tuple[float, str]] = []
    for rows in _curves(field_map, view):
        m = float(field_map.m[rows[0]])
        energies = field_map.energy_mhz[rows] / MHZ_PER_CM
        label = None if m in seen else ("M mixed" if m < 0 else f"|M| = {m:g}")
        axes.plot(field_map.field[rows], energies, color=_colour(m), linewidth=0.9, label=label)
        seen.add(m)
        ends.append((float(energies[0]), str(field_map.label[rows[0]])))
    show_part(axes, replace(view, horizontal=None))
    fields = field_map.field[_curves(field_map, view)[0]]
    _labels(axes, (float(fields[0]), float(fields[-1])), ends)
    axes.set_ylabel("E/hc (cm⁻¹)")
    if seen != {-1}:
        axes.legend(frameon=False, fontsize=8, loc="lower right", bbox_to_anchor=(1, 1), ncols=len(seen))


def _curves(field_map: FieldMap, view: View) -> list[Ints]:
    """The rows of each curve at the fields that a view shows."""
    low, high = view.horizontal or (-np.inf, np.inf)
    shown = np.flatnonzero((field_map.fields >= low) & (field_map.fields <= high))
    if len(shown) < 2:
        raise ValueError(
            f"the map has {len(shown)} of its fields from {low:g} to {high:g}; a picture needs two or more"
        )
    return [rows.start + shown for rows in field_map.curves()]


def _colour(m: float) -> str:
    return COLOURS[int(m) % len(COLOURS)] if m >= 0 else COLOURS[0]


def _labels(axes: Any, fields: tuple[float, float], ends: list[tuple[float, str]]) -> None:
    """Names of the free levels at the left, those that would stand on each other left out."""
    low, high = axes.get_ylim()
    first, end = fields
    axes.set_xlim(first - 0.09 * (end - first), end + 0.02 * (end - first))
    last = -np.inf
    for energy, label in sorted(set(ends)):
        if energy - last > (high - low) / 40:
            axes.annotate(
                label,
                (first, energy),
                (-4, 0),
                textcoords="offset points",
                ha="right",
                va="center",
                fontsize=7,
            )
            last = energy


def _slopes(axes: Any, field_map: FieldMap, unit: str, view: View) -> None:
    for rows in _curves(field_map, view):
        axes.plot(
            field_map.field[rows], field_map.slope[rows], color=_colour(float(field_map.m[rows[0]])), linewidth=0.8
        )
    axes.axhline(0.0, color="#555555", linewidth=0.6, linestyle=":")
    axes.set_xlabel(f"field ({unit})")
    name = r"$\mu_{\mathrm{eff}}$ (D)" if field_map.slope_name == "mu_eff_debye" else field_map.slope_name
    axes.set_ylabel(name)


def lobes_figure(lines: FieldLines, title: str = "") -> Any:
    """A matplotlib figure of lines in a field: frequency against field, the width of a curve by its intensity.

    Raises ValueError for lines at one field.
    """
    if len(lines.fields) < 2:
        raise ValueError("a picture of lines in a field needs two fields or more")
    with styled():
        figure = new_figure(SIZE_INCHES)
        axes = figure.subplots()
        strongest = float(lines.intensity_nm2_mhz.max(initial=0.0)) or 1.0
        seen: set[int] = set()
        for rows in lines.pairs():
            m, share = int(lines.lower_m[rows.start]), float(lines.intensity_nm2_mhz[rows].max()) / strongest
            if share < LEAST_DRAWN:
                continue
            label = None if m in seen else f"|M″| = {m}"
            axes.plot(
                lines.fields,
                lines.frequency_mhz[rows],
                color=_colour(m),
                linewidth=0.5 + 2 * np.sqrt(share),
                linestyle="-" if lines.upper_m[rows.start] == m else "--",
                label=label,
            )
            seen.add(m)
        axes.set_xlabel("field (kV/cm)")
        axes.set_ylabel("frequency (MHz)")
        axes.set_title(f"{title}, light {lines.light}: full ΔM = 0, dashed ΔM = ±1".strip(", "), loc="left", fontsize=9)
        axes.legend(frameon=False, fontsize=8)
    return figure


def plot_lobes(
    lines: FieldLines,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Draw `lobes_figure` into a .png, .pdf or .svg file.

    Parameters
    ----------
    lines : FieldLines
        At two fields or more.
    path : path
        Its suffix chooses the format.
    title : str
        Above the picture.
    provenance : mapping, optional
        Further facts for the metadata.

    Raises
    ------
    ValueError
        For lines at one field, and for a suffix that is no picture.
    """
    checked_suffix(path)
    figure = lobes_figure(lines, title)
    save_described(figure, path, title, joined(provenance, lines.provenance))
