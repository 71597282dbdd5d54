"""Panels of the work-precision picture from a sweep of knobs."""

from __future__ import annotations

from rotor.plots.work_precision import Panel, Point
from rotor.scenes.accuracy_sweep import Row, WorkPrecision


def panels_of(table: WorkPrecision) -> list[Panel]:
    """One panel for each knob and error, titled in words; orders of one splitting share a panel.

    >>> from rotor.scenes.accuracy_sweep import work_precision
    >>> from rotor.scenes.scene import LevelsScene
    >>> [(panel.title, panel.of) for panel in panels_of(work_precision(LevelsScene(molecule="CO")))]
    [('order of centrifugal distortion', 'energy of a level (MHz)')]
    """
    grouped: dict[tuple[str, str], dict[str, list[Point]]] = {}
    for (knob, error_of, unit), rows in table.curves().items():
        name, _, variant = knob.partition(", ")
        label = f"{error_of} ({unit})" if unit else error_of
        grouped.setdefault((name, label), {})[variant or name] = points_of(rows)
    return [
        Panel(table.titles.get(name, name), label, curves, joined=name not in table.methods)
        for (name, label), curves in grouped.items()
    ]


def points_of(rows: list[Row]) -> list[Point]:
    """The settings of one knob as points."""
    return [Point(row.setting, row.seconds, row.error, row.own) for row in rows]
