"""Rotational diagrams of several species, one panel for each."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rotor.observed.diagram import plot_rotational_diagram
from rotor.plots.picture import checked_suffix, new_figure, save, styled

if TYPE_CHECKING:
    from rotor.observed.diagrams import SpeciesDiagrams

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
