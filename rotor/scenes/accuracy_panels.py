"""From a sweep of knobs to the panels of its picture."""

from __future__ import annotations

from rotor.plots.work_precision import Panel, Point
from rotor.scenes.accuracy_sweep import Row, WorkPrecision


def panels_of(found: WorkPrecision) -> list[Panel]:
    """One panel a knob and error; the orders of a splitting share one.

    >>> from rotor.scenes.accuracy_sweep import work_precision
    >>> from rotor.scenes.scene import LevelsScene
    >>> [(one.title, one.of) for one in panels_of(work_precision(LevelsScene(molecule="CO")))]
    [('effects.distortion', 'energy of a level (MHz)')]
    """
    grouped: dict[tuple[str, str], dict[str, list[Point]]] = {}
    for (knob, error_of, unit), rows in found.curves().items():
        name, _, variant = knob.partition(", ")
        label = f"{error_of} ({unit})" if unit else error_of
        grouped.setdefault((name, label), {})[variant or name] = points_of(rows)
    return [Panel(name, label, curves) for (name, label), curves in grouped.items()]


def points_of(rows: list[Row]) -> list[Point]:
    """The settings of one knob as points."""
    return [Point(row.setting, row.seconds, row.error, row.own) for row in rows]
