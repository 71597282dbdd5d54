"""Facts and table of a map of levels in a static field."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Table

if TYPE_CHECKING:
    from rotor.quantum.fields.field_map import FieldMap

SHOWN = 24  # states on screen


def accuracy_fact(content: Mapping[str, Any]) -> tuple[str, str]:
    """J max, the error of the energies and the population at the edge of the basis, as a line of the report."""
    accuracy = f"J max {content['jmax']}; energies to {content['accuracy_mhz']:.1e} MHz"
    rounding = f"round-off {content['round_off_mhz']:.1e} MHz of it"
    return "numerical error", f"{accuracy}, {rounding}; edge population {content['edge_population']:.1e}"


def table_of_states(states: FieldMap, names: tuple[str, ...], row_of: Callable[[slice], list[str]]) -> Table:
    """The first states by M and block, one row each; `row_of` formats the rows that a state has in the map."""
    curves = states.curves()
    rows = [row_of(rows_of) for rows_of in curves[:SHOWN]]
    title = f"{len(rows)} of {len(curves)} states" if len(rows) < len(curves) else "all states"
    return Table(f"{title}, by M and block", names, rows, frozenset({"state"}))


def results_of_map(answer: Any) -> dict[str, Any]:
    """The largest shift of a level between the first and the last field, for a sweep."""
    states = answer.states
    curves = [states.energy_mhz[rows] for rows in states.curves()]
    return {"levels": len(curves), "largest_shift_mhz": max(abs(curve[-1] - curve[0]) for curve in curves)}
