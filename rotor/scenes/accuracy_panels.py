"""Panels of the work-precision picture from a sweep of knobs."""

from __future__ import annotations

from rotor.plots.work_precision import Panel, Point
from rotor.scenes.accuracy_sweep import Row, WorkPrecision

TITLES = {
    "effects.distortion": "order of centrifugal distortion", "effects.hyperfine_method": "method of hyperfine structure",
    "numerics.jmax": "highest J of the basis", "numerics.relative_error": "relative error of the sums",
    "numerics.step": "length of a step", "numerics.molecules": "number of molecules", "numerics.iterations": "iterations of the search",
    "numerics.ewald_tolerance": "tolerance of Ewald's sum", "numerics.cutoff": "cutoff of the forces (Å)",
    "observables.min_lgint": "least intensity in the list, log10(nm² MHz)",
    "observables.min_relative": "weakest line in the list, relative to the strongest",
    "observables.least_depth": "least optical depth of a line", "observables.classical_molecules": "molecules of the classical gas",
}  # fmt: skip


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
        Panel(title_of(name), label, curves, joined=name != "effects.hyperfine_method")
        for (name, label), curves in grouped.items()
    ]


def title_of(knob: str) -> str:
    """A knob in words; for unlisted knobs, the last part of the key.

    >>> title_of("numerics.jmax"), title_of("numerics.grid_points")
    ('highest J of the basis', 'grid points')
    """
    return TITLES.get(knob, knob.rpartition(".")[2].replace("_", " "))


def points_of(rows: list[Row]) -> list[Point]:
    """The settings of one knob as points."""
    return [Point(row.setting, row.seconds, row.error, row.own) for row in rows]
