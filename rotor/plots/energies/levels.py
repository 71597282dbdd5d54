"""Term diagram: energy levels as steps, with the ladder of each K in its column."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import require_choice
from rotor.plots.picture import (
    BLUE,
    GREEN,
    GREY,
    MOST_VECTOR_STICKS,
    ORANGE,
    PALETTE,
    WIDTH_INCHES,
    Picture,
    legend_below,
    panel,
    styled,
    top_title,
)
from rotor.plots.view import WHOLE, View, show_part
from rotor.quantum.labels.quanta import heading, merged_text, rotational_quanta
from rotor.quantum.levels import Levels
from rotor.quantum.request import LevelsAnswer, SelectedLevels
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

UNITS = {"MHz": "energy_mhz", "cm-1": "energy_cm", "K": "energy_k"}
SIZE_INCHES = (WIDTH_INCHES, 5.4)
HALF_WIDTH = 0.26  # of a step, in columns: a label fits before the next column
NARROW, NARROWEST = 0.18, 0.1  # the same if labels also have the vibrational state, or species and torsional state
MOST_LABELS = 160
MOST_OF_WIDTH = 0.5  # wider names do not move the end of the axis
MOST_WEIGHTS = 4
_STATES = {"v", "vt", "species"}  # quantum numbers beside those of the rotation


@dataclass(frozen=True)
class _Species:
    """Levels of one nuclear-spin weight: rows, colour and line style of their steps, name in the legend."""

    rows: NDArray[np.bool_]
    colour: str
    style: str
    name: str


def picture(
    thing: Levels | SelectedLevels | LevelsAnswer,
    top: Top | None = None,
    *,
    title: str | None = None,
    view: View = WHOLE,
    **options: Any,
) -> Picture:
    """The term diagram of levels, or of the answer that has them; options: of `levels_figure`."""
    if isinstance(thing, LevelsAnswer):
        top, thing = top or thing.request.top, thing.table
    table = SelectedLevels(thing, np.arange(len(thing))) if isinstance(thing, Levels) else thing
    title = title if view.title is None else view.title
    figure = levels_figure(table, top, title=title, view=view, **options)
    return Picture(figure, title or ("" if top is None else top_title(top)))


def levels_figure(
    table: SelectedLevels,
    top: Top | None = None,
    *,
    unit: str = "cm-1",
    title: str | None = None,
    view: View = WHOLE,
    axes: Any = None,
) -> Any:
    """A matplotlib figure of a term diagram: columns of Ka (asymmetric top; Kc if nearer to oblate), of |K| (symmetric top), or of J.

    table: levels to draw. top: top of the levels; without it an asymmetric top has columns of Ka. unit: unit of the energies. title:
    instead of the name of the top. view: range of columns and energies. axes: drawn on instead of a new figure.
    Returns: one panel.
    Raises ValueError for an unknown unit, and for a table without levels in the view.
    """
    require_choice("unit", unit, UNITS)
    if not len(table):
        raise ValueError("no level to draw; widen the range of J or K, or raise the limit of energy")
    name, column = ladders(table, top)
    table, column = _in_view(table, column, np.asarray(getattr(table, UNITS[unit])), view)
    energy = np.asarray(getattr(table, UNITS[unit]))
    with styled():
        figure, axes = panel(axes, SIZE_INCHES)
        half_width = _half_width(table.levels)
        _draw(axes, column, energy, _species(table, top), half_width)
        show_part(axes, View(vertical=view.vertical))
        axes.set_xlabel({"Ka": "$K_a$", "Kc": "$K_c$"}.get(name, f"${name}$"))
        axes.set_ylabel(f"Energy ({unit.replace('cm-1', 'cm⁻¹')})")
        heading_text = f"{table.levels.kind} top" if top is None else top_title(top)
        axes.set_title(title if title is not None else heading_text, loc="left")
        if axes.get_legend_handles_labels()[0]:
            legend_below(figure, axes, ncols=3, fontsize=9)
        _label(figure, axes, table, column, energy, half_width)
    return figure


def _half_width(levels: Levels) -> float:
    """Half the width of a step, in columns; steps are shorter where labels are longer."""
    if "species" in levels.quanta:
        return NARROWEST
    return NARROW if "v" in levels.quanta else HALF_WIDTH


def _in_view(table: SelectedLevels, column: Ints, energy: Floats, view: View) -> tuple[SelectedLevels, Ints]:
    """The levels inside a view, and their columns."""
    shown = np.ones(len(column), dtype=bool)
    for values, limits in ((column, view.horizontal), (energy, view.vertical)):
        if limits is not None:
            shown &= (values >= limits[0]) & (values <= limits[1])
    if not shown.any():
        raise ValueError("no level inside the limits of the picture; widen them")
    return replace(table, rows=table.rows[shown]), column[shown]


def ladders(table: SelectedLevels, top: Top | None) -> tuple[str, Ints]:
    """Heading and values of the quantum number of the columns."""
    quanta, rows = table.levels.quanta, table.rows
    if "k" in quanta:
        return "|K|", np.abs(quanta["k"][rows])
    if "kc" in quanta:
        kappa = top.kappa if top is not None else None
        oblate = table.levels.kind == "oblate" or (table.levels.kind == "asymmetric" and (kappa or 0.0) > 0)
        name = "kc" if oblate else "ka"
        return heading(name), np.asarray(quanta[name][rows])
    name = "n" if "n" in quanta else "j"
    return heading(name), np.asarray(quanta[name][rows])


def _species(table: SelectedLevels, top: Top | None) -> list[_Species]:
    """Groups of levels by nuclear-spin species, and levels without a spin state."""
    weight = table.levels.weight_per_component[table.rows]
    missing = _Species(weight == 0, GREY, ":", "missing (spin weight 0)")
    rule = "" if top is None else top.spin_weights.rule
    if top is not None and rule == "K" and "k" in table.levels.quanta:
        return [*_by_k(np.abs(table.levels.quanta["k"][table.rows]), weight > 0, top.spin_weights), missing]
    if len(torsional := _by_torsional_species(table, weight > 0)) > 1:
        return [*torsional, missing]
    weights = np.unique(weight[weight > 0])
    if not 2 <= len(weights) <= MOST_WEIGHTS:
        return [_Species(weight > 0, BLUE, "-", "existing" if missing.rows.any() else ""), missing]
    words = ("para, ", "ortho, ") if top is not None and _is_ortho_and_para(top.spin_weights) else ("",) * len(weights)
    means = ["" if value.is_integer() else "mean " for value in weights.tolist()]  # over the representations of a level
    kinds = zip(weights.tolist(), (BLUE, ORANGE, GREEN, PALETTE[3]), words, means, strict=False)
    return [
        *(_Species(weight == w, colour, "-", f"{word}{mean}spin weight {w:.4g}") for w, colour, word, mean in kinds),
        missing,
    ]


def _by_torsional_species(table: SelectedLevels, exists: NDArray[np.bool_]) -> list[_Species]:
    """Groups of levels by species of internal rotation, A and E of a methyl group; none where there are more than colours."""
    if "species" not in table.levels.quanta:
        return []
    species = np.asarray(table.levels.quanta["species"])[table.rows]
    names = list(dict.fromkeys(species[exists].tolist()))
    if len(names) > len(PALETTE):
        return []
    return [
        _Species(exists & (species == name), colour, "-", f"species {name}")
        for name, colour in zip(names, PALETTE, strict=False)
    ]


def _by_k(k: Ints, exists: NDArray[np.bool_], weights: SpinWeights) -> list[_Species]:
    """Groups of levels of a symmetric top by K; ortho and para for three equivalent nuclei of spin 1/2, with weights 2 : 1."""
    value = dict(zip(weights.classes, weights.values, strict=True))
    period = max(int(name) for name in value if name.isdecimal()) + 1
    zero = value.get("0", (value.get("0even", 0) + value.get("0odd", 0)) / 2)
    if period == 3:
        names = ("ortho, ", "para, ") if zero == 2 * value["1"] else ("A, ", "E, ")
    else:
        names = ("", "")
    whole = k % period == 0
    return [
        _Species(exists & whole, ORANGE, "-", f"{names[0]}K = {period}n"),
        _Species(exists & ~whole, BLUE, "-", f"{names[1]}other K"),
    ]


def _is_ortho_and_para(weights: SpinWeights) -> bool:
    """Whether the classes of levels have two weights, equally often: ortho has the larger one, para the smaller one."""
    values = [value for value in weights.values if value]
    shares = [values.count(value) for value in sorted(set(values))]
    return len(shares) == 2 and shares[0] == shares[1]


def _draw(axes: Any, column: Ints, energy: Floats, species: list[_Species], half_width: float) -> None:
    """Draw steps in the colour of their spin species; levels without a spin state are dotted."""
    many = len(energy) > MOST_VECTOR_STICKS
    for kind in species:
        if kind.rows.any():
            left, right = column[kind.rows] - half_width, column[kind.rows] + half_width
            axes.hlines(
                energy[kind.rows], left, right, colors=kind.colour, linestyles=kind.style, linewidth=1.1, rasterized=many,
                label=kind.name or None,
            )  # fmt: skip
    first, last = int(column.min()), int(column.max())
    axes.set_xlim(first - 0.6, last + 0.8)
    axes.set_xticks(range(first, last + 1, max(1, (last - first) // 12)))
    margin = 0.04 * float(energy.max() - energy.min()) or 0.04 * float(abs(energy).max()) or 1.0
    axes.set_ylim(float(energy.min()) - margin, float(energy.max()) + margin)


def _label(figure: Any, axes: Any, table: SelectedLevels, column: Ints, energy: Floats, half_width: float) -> None:
    """Label levels with quantum numbers to the right of their steps, from the lowest up, where no other label is in the way.

    States and spin components of one rotational level share a label if their steps overlap; it lists all values of v or F.
    """
    if len(table) > 20 * MOST_LABELS:
        return
    figure.canvas.draw()  # computes the layout, so that pixel sizes are valid
    last: dict[int, float] = {}
    pixels = axes.transData.transform(np.stack([column, energy], axis=1))[:, 1]
    height = 8.7 * figure.dpi / 72.0  # of a label with letters of 9 points
    names: list[Any] = []
    level_of_row = _rotational_levels(table)
    unnamed = np.ones(len(table), dtype=bool)
    for row in np.argsort(energy, kind="stable").tolist():
        ladder = int(column[row])
        if len(names) == MOST_LABELS or pixels[row] - last.get(ladder, -np.inf) < height:
            continue
        last[ladder] = float(pixels[row])
        merged = np.flatnonzero(unnamed & (level_of_row == level_of_row[row]) & (np.abs(pixels - pixels[row]) < height))
        unnamed[merged] = False
        text = merged_text(table.levels.quanta, table.rows[merged], table.levels.halves)
        names.append(
            axes.text(ladder + half_width + 0.03, energy[row], text, fontsize=9, color=GREY, va="center", clip_on=True)
        )
    _widen(axes, names)


def _widen(axes: Any, names: Sequence[Any]) -> None:
    """Move the right end of the axis until all names stand inside."""
    first, last = axes.get_xlim()
    for name in names:  # a name keeps its width in pixels: place + width (last - first) / pixels = last
        share = name.get_window_extent().width / axes.bbox.width
        if share < MOST_OF_WIDTH:
            last = max(last, (name.get_position()[0] - first * share) / (1.0 - share))
    axes.set_xlim(first, last)


def _rotational_levels(table: SelectedLevels) -> Ints:
    """Number of the rotational level for each row, shared by all its vibrational states and spin components."""
    quanta = rotational_quanta(table.levels.quanta)
    numbers = np.stack([column[table.rows] for name, column in quanta.items() if name not in _STATES], axis=1)
    return np.asarray(np.unique(numbers, axis=0, return_inverse=True)[1]).ravel()
