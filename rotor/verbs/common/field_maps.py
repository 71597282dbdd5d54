"""Facts and table of a map of levels in a static field, and what its verbs have in common."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Table, record_table
from rotor.requests.fill import NamedError
from rotor.table import counted
from rotor.verbs.common.outputs import picture, tables

if TYPE_CHECKING:
    from rotor.quantum.fields.field_map import FieldMap

SHOWN = 24  # states on screen


def field_fact(states: FieldMap, direction: str) -> tuple[str, str]:
    """The fields of a map, as a line of the report."""
    first, last = states.fields[0], states.fields[-1]
    return (
        "field",
        f"{first:g} to {last:g} {states.request.kind.unit} {direction}, {counted(len(states.fields), 'value')}",
    )


def accuracy_fact(states: FieldMap) -> tuple[str, str]:
    """J max, the error of the energies and the population at the edge of the basis, as a line of the report."""
    record = states.provenance
    accuracy = f"J max {record['jmax']}; energies to {record['accuracy_mhz']:.1e} MHz"
    rounding = f"round-off {record['round_off_mhz']:.1e} MHz of it"
    return "numerical error", f"{accuracy}, {rounding}; edge population {record['edge_population']:.1e}"


def refuse_picture_of_one_field(request: Any, outputs: Collection[str], shown: Any) -> None:
    """Refuse a picture of a single field."""
    if "plot" in outputs and len(request.map.fields) < 2:
        raise NamedError("{outputs.plot}: a picture of a map needs two fields or more; give {conditions.field} a range")


def table_of_states(states: FieldMap, unit: str, columns: Mapping[str, Callable[[Any], str]]) -> Table:
    """The first states by M and block: energies at both ends of the map, and further columns from a state's first and last row."""
    curves = [(rows.start, rows.stop - 1) for rows in states.curves()]
    title = f"{SHOWN} of {len(curves)} states" if len(curves) > SHOWN else "all states"
    first, last = (f"E at {field:g} {unit} (MHz)" for field in (states.fields[0], states.fields[-1]))
    cells: dict[str, Callable[[Any], str]] = {
        "state": lambda ends: str(states.label[ends[0]]),
        "M": lambda ends: f"{states.m[ends[0]]:g}",
        first: lambda ends: f"{states.energy_mhz[ends[0]]:z.6f}",
        last: lambda ends: f"{states.energy_mhz[ends[1]]:z.6f}",
    }
    return record_table(f"{title}, by M and block", {**cells, **columns}, curves[:SHOWN], {"state"})


def results_of_map(answer: Any) -> dict[str, Any]:
    """The largest shift of a level between the first and the last field, for a sweep."""
    states = answer.states
    curves = [states.energy_mhz[rows] for rows in states.curves()]
    return {"levels": len(curves), "largest_shift_mhz": max(abs(curve[-1] - curve[0]) for curve in curves)}


MAP: dict[str, Any] = {
    "table": lambda answer: answer.states,
    "results": results_of_map,
    "rows": "states",
    "scaled": False,
    "workers": "blocks of states",
    "check": refuse_picture_of_one_field,
    "sound": False,
    "accuracy": "of the energies",
}  # of verbs with a map
MAP_FILES = (*tables("the map", "out"), picture("Draw the map", "out.png"))
