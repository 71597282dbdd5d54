"""A picture of levels in a field: energy against field, a colour for each |M|, and the effective dipoles below."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.plots.picture import GREY, PALETTE, WIDTH_INCHES, Picture, new_figure, styled, top_title
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.effects.stark import StarkAnswer
from rotor.quantum.fields.blocks import BEFORE_J
from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.labels.quanta import as_mathtext
from rotor.spectra.fields.lines import FieldLines
from rotor.units import MHZ_PER_CM, MHZ_PER_DEBYE_KV_PER_CM

NARROW_INCHES = 5.0
HEIGHT, HEIGHT_OF_STATE, HEIGHT_OF_SLOPES = (
    4.1,
    3.0,
    1.9,
)  # inches, of one panel of energies, of each of several, and of slopes
LEAST_DRAWN = 1e-4  # relative to the strongest line
MOST_LABELS = 27  # on the axis of energies; a name takes 1/27 of its height
MOST_CHARACTERS = 40  # of names that share a place
WIDEST = 0.5  # part of the width that names may take
GAP_OF_PANELS = 10.0  # of lines in a field: gap to the next panel, relative to the widest shift
MOST_PANELS = 4
SAME_HEIGHT = 0.1  # part of the height of a name; nearer levels share one


def stark_figure(field_map: FieldMap, title: str = "", unit: str = "kV/cm", view: View = WHOLE) -> Any:
    """A matplotlib figure of a map of levels in a field.

    Parameters
    ----------
    field_map : FieldMap
        A map of at least two fields.
    title : str
        Title of the picture.
    unit : str
        Unit of the field.
    view : View
        Fields and energies (cm⁻¹) shown; its title is not used here.

    Returns
    -------
    matplotlib.figure.Figure
        Energies above, slopes below.

    Raises
    ------
    ValueError
        For a map with fewer than two fields in the view.
    """
    if len(field_map.fields) < 2:
        raise ValueError("a picture of a map needs two fields or more")
    with styled():
        groups = _by_torsional_state(field_map, _curves(field_map, view), view)
        height = HEIGHT if len(groups) == 1 else HEIGHT_OF_STATE
        heights = [*[height] * len(groups), HEIGHT_OF_SLOPES]
        figure = new_figure((WIDTH_INCHES, sum(heights)))
        *panels, below = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        ends = [_energies(axes, field_map, curves, view) for axes, curves in zip(panels, reversed(groups), strict=True)]
        _slopes(below, field_map, unit, view)
        panels[0].set_title(title, loc="left")
        _legend(panels[0], _projections(field_map))
        shown = field_map.field[_curves(field_map, view)[0]]
        fields = (float(shown[0]), float(shown[-1]))
        most = int(MOST_LABELS * height / HEIGHT)
        shares = [_labels(axes, fields, named, most) for axes, named in zip(panels, ends, strict=True)]
        _limit_axis(below, fields, max(shares))
    return figure


def _by_torsional_state(field_map: FieldMap, curves: list[Ints], view: View) -> list[list[Ints]]:
    """Curves in groups of one torsional state, which lie far apart; together where the view sets the energies, or beyond four states."""
    levels = field_map.request.space(field_map.jmax).levels
    if "vt" not in levels.quanta or view.vertical is not None:
        return [curves]
    states: dict[str, list[Ints]] = {}
    for rows in curves:
        states.setdefault(_quanta(field_map, rows)["vt"], []).append(rows)
    groups = [states[vt] for vt in sorted(states, key=int)]
    return groups if len(groups) <= MOST_PANELS else [curves]


def _quanta(field_map: FieldMap, rows: Ints) -> dict[str, str]:
    """The quantum numbers of a curve as texts, in the order of labels."""
    levels = field_map.request.space(field_map.jmax).levels
    first = [name for name in BEFORE_J if name in levels.quanta]
    names = [*first, "j", *(name for name in levels.quanta if name not in first)]
    return dict(zip(names, str(field_map.label[rows[0]]).split(), strict=True))


def picture(
    thing: FieldMap | StarkAnswer | FieldLines, *, title: str | None = None, view: View = WHOLE, **options: Any
) -> Picture:
    """The picture of a map, of the answer that has it, or of lines in a field; options: of `stark_figure`."""
    if isinstance(thing, StarkAnswer):
        title, thing = title or top_title(thing.request.top), thing.states
    title = (title or "") if view.title is None else view.title
    if isinstance(thing, FieldLines):
        return Picture(lobes_figure(thing, title), title, thing.provenance)
    return Picture(stark_figure(thing, title, view=view, **options), title, thing.provenance)


def _energies(axes: Any, field_map: FieldMap, curves: list[Ints], view: View) -> list[tuple[float, str]]:
    """Draw energies against field; the energies at the first field with their names."""
    projections = _projections(field_map)
    ends: list[tuple[float, str]] = []
    for rows in curves:
        energies = field_map.energy_mhz[rows] / MHZ_PER_CM
        axes.plot(field_map.field[rows], energies, color=_colour(float(projections[rows[0]])), linewidth=0.9)
        ends.append((float(energies[0]), as_mathtext(_quanta(field_map, rows))))
    show_part(axes, replace(view, horizontal=None))
    axes.set_ylabel("Energy (cm⁻¹)")
    return ends


def _legend(axes: Any, projections: Floats) -> None:
    """A legend of |M|, none where M is mixed."""
    values = sorted({float(m) for m in projections if m >= 0})
    handles = [axes.plot([], [], color=_colour(m), linewidth=0.9, label=f"|M| = {m:g}")[0] for m in values]
    if handles and axes.figure.get_figwidth() < NARROW_INCHES:  # the title needs the width beside it
        axes.figure.legend(handles=handles, fontsize=9, loc="outside upper right", ncols=len(handles))
    elif handles:
        axes.legend(
            handles=handles, frameon=False, fontsize=9, loc="lower right", bbox_to_anchor=(1, 1), ncols=len(handles)
        )


def _projections(field_map: FieldMap) -> Floats:
    """|M| of each row, -1 where M is mixed. Levels of species E with M and -M are apart and share a colour."""
    good = field_map.request.space(field_map.jmax).m_is_good
    return np.abs(field_map.m) if good else np.full(len(field_map.m), -1.0)


def _curves(field_map: FieldMap, view: View) -> list[Ints]:
    """The rows of each curve at the fields that a view shows."""
    low, high = view.horizontal or (-np.inf, np.inf)
    shown = np.flatnonzero((field_map.fields >= low) & (field_map.fields <= high))
    if len(shown) < 2:
        raise ValueError(
            f"the map has {len(shown)} of its fields from {low:g} to {high:g}; a picture needs at least two"
        )
    return [rows.start + shown for rows in field_map.curves()]


def _colour(m: float) -> str:
    return PALETTE[int(m) % len(PALETTE)] if m >= 0 else PALETTE[0]


def _labels(axes: Any, fields: tuple[float, float], ends: list[tuple[float, str]], most: int) -> float:
    """Write the names of all free levels at the left, moved apart where they would overlap; thin lines lead to the levels.

    most: names that the panel has space for. Returns the part of the width that they take.
    """
    low, high = axes.get_ylim()
    first, end = fields
    height = (high - low) / most
    named = _grouped(sorted({(energy, label) for energy, label in ends if low <= energy <= high}), height, most)
    places = _apart(np.array([energy for energy, _ in named]), height, low, high - height / 2)
    axes.set_xlim(first - 0.045 * (end - first), end + 0.02 * (end - first))
    texts = [
        axes.annotate(
            label, (first, energy), (first - 0.035 * (end - first), place), ha="right", va="center", fontsize=9,
            arrowprops={
                "arrowstyle": "-", "linewidth": 0.4, "color": GREY, "shrinkA": 0.0, "shrinkB": 2.0, "relpos": (1.0, 0.5),
            },
        )
        for (energy, label), place in zip(named, places.tolist(), strict=True)
    ]  # fmt: skip
    axes.figure.canvas.draw()  # computes the layout, so that pixel sizes are valid
    widest = max((text.get_bbox_patch() or text).get_window_extent().width for text in texts)
    return min(float(widest / axes.bbox.width), WIDEST)


def _limit_axis(axes: Any, fields: tuple[float, float], share: float) -> None:
    """Leave a part of the width of all panels to the names at their left."""
    first, end = fields
    axes.set_xticks([tick for tick in axes.get_xticks() if first <= tick <= end])
    end += 0.02 * (end - first)
    axes.set_xlim((first - 0.04 * (end - first) - share * end) / (1.0 - share), end)  # a name keeps its width in pixels


def _grouped(levels: list[tuple[float, str]], height: float, most: int) -> list[tuple[float, str]]:
    """Energies with their names; the nearest levels share a name until all names have space."""
    groups = [([energy], [label]) for energy, label in levels]
    while len(groups) > most or (len(groups) > 1 and min(_gaps(groups)) < SAME_HEIGHT * height):
        near = int(np.argmin(_gaps(groups)))
        energies, labels = groups.pop(near + 1)
        groups[near] = (groups[near][0] + energies, groups[near][1] + labels)
    return [(float(np.mean(energies)), _joined([*dict.fromkeys(labels)])) for energies, labels in groups]


def _joined(labels: list[str]) -> str:
    """Names in one line; of a long list the first, the last and their number."""
    text = ", ".join(labels)
    if len(labels) < 3 or len(re.sub(r"\\[a-z]+|\\;|[${}_\\]", "", text)) <= MOST_CHARACTERS:
        return text
    return f"{labels[0]} … {labels[-1]} ({len(labels)})"


def _gaps(groups: list[tuple[list[float], list[str]]]) -> Floats:
    return np.diff([float(np.mean(energies)) for energies, _ in groups])


def _apart(energies: Floats, height: float, low: float, high: float) -> Floats:
    """Places near the energies (ascending), at least `height` apart and inside the axis: moved up, then down from the top."""
    places = energies.copy()
    for n in range(len(places)):
        places[n] = max(places[n], (places[n - 1] + height) if n else low)
    for n in range(len(places) - 1, -1, -1):
        places[n] = min(places[n], (places[n + 1] - height) if n + 1 < len(places) else high)
    return places


def _slopes(axes: Any, field_map: FieldMap, unit: str, view: View) -> None:
    projections = _projections(field_map)
    for rows in _curves(field_map, view):
        x, y = _with_curve(field_map, rows)
        axes.plot(x, y, color=_colour(float(projections[rows[0]])), linewidth=0.8)
    axes.axhline(0.0, color=GREY, linewidth=0.6, linestyle=":")
    axes.set_xlabel(f"Field ({unit})")
    name = r"Dipole $\mu_{\mathrm{eff}}$ (D)" if field_map.slope_name == "mu_eff_debye" else field_map.slope_name
    axes.set_ylabel(name)


def _with_curve(field_map: FieldMap, rows: Ints) -> tuple[Floats, Floats]:
    """Fields and effective dipoles, with a curve instead of a straight line from zero field to the first field.

    The curve is the slope of the cubic that has the energies and slopes at both fields.
    """
    x, y = field_map.field[rows], field_map.slope[rows]
    if field_map.slope_name != "mu_eff_debye" or x[0] != 0:
        return x, y
    mean = -(field_map.energy_mhz[rows[1]] - field_map.energy_mhz[rows[0]]) / (MHZ_PER_DEBYE_KV_PER_CM * x[1])
    s = np.linspace(0.0, 1.0, 31)[:-1]
    bent = y[0] * (1 - s) * (1 - 3 * s) + y[1] * s * (3 * s - 2) + 6 * mean * s * (1 - s)
    inside = np.clip(bent, min(y[0], y[1]), max(y[0], y[1]))  # the cubic overshoots where the field mixes close pairs
    return np.concatenate([s * x[1], x[1:]]), np.concatenate([inside, y[1:]])


def lobes_figure(lines: FieldLines, title: str = "") -> Any:
    """A matplotlib figure of lines in a field: frequency against field, the width of a curve by its intensity.

    Lines that lie far apart compared with their shifts have a panel each.

    Raises ValueError for lines at one field.
    """
    if len(lines.fields) < 2:
        raise ValueError("a picture of lines in a field needs two fields or more")
    strongest = float(lines.intensity_nm2_mhz.max(initial=0.0)) or 1.0
    shares = [float(lines.intensity_nm2_mhz[rows].max()) / strongest for rows in lines.pairs()]
    drawn = [(rows, share) for rows, share in zip(lines.pairs(), shares, strict=True) if share >= LEAST_DRAWN]
    groups = _line_groups(lines, drawn)
    with styled():
        figure = new_figure((WIDTH_INCHES, 3.0 + 1.6 * len(groups)))
        panels = figure.subplots(len(groups), sharex=True, squeeze=False)[::-1, 0]
        handles: dict[str, Any] = {}
        for axes, group in zip(panels, groups, strict=True):
            for rows, share in group:
                m, style = (
                    int(lines.lower_m[rows.start]),
                    "-" if lines.upper_m[rows.start] == lines.lower_m[rows.start] else "--",
                )
                (curve,) = axes.plot(
                    lines.fields, lines.frequency_mhz[rows], style, color=_colour(m), linewidth=0.5 + 2 * np.sqrt(share)
                )
                handles.setdefault(f"|M″| = {m}", curve)
            axes.ticklabel_format(axis="y", useOffset=False, style="plain")
        panels[0].set_xlabel("Field (kV/cm)")
        figure.supylabel("Frequency (MHz)")
        heading = f"{title}, light {lines.light}: full ΔM = 0, dashed ΔM = ±1".strip(", ")
        figure.suptitle(heading, x=0.01, ha="left", fontsize=9)
        figure.legend(handles.values(), handles, loc="outside lower right", ncols=min(len(handles), 5))
    return figure


def _line_groups(lines: FieldLines, drawn: list[tuple[slice, float]]) -> list[list[tuple[slice, float]]]:
    """Lines by frequency, apart where the gap is ten times the widest group; all together if that makes too many groups."""
    ordered = sorted(drawn, key=lambda line: float(lines.frequency_mhz[line[0]].min()))
    low = [float(lines.frequency_mhz[rows].min()) for rows, _ in ordered]
    high = [float(lines.frequency_mhz[rows].max()) for rows, _ in ordered]
    widest = max((b - a for a, b in zip(low, high, strict=True)), default=0.0)
    groups: list[list[tuple[slice, float]]] = []
    for n, line in enumerate(ordered):
        if n and low[n] - max(high[:n]) < GAP_OF_PANELS * widest:
            groups[-1].append(line)
        else:
            groups.append([line])
    return groups if len(groups) <= MOST_PANELS else [ordered]
