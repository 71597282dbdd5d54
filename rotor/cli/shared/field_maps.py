"""What `rotor stark` and `rotor zeeman` share: grids of fields, and the report of a map of levels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from rotor.cli.shared.inputs import Input
from rotor.cli.shared.output import Files, Table

if TYPE_CHECKING:
    from rotor.quantum.fields.field_map import FieldMap
    from rotor.quantum.fields.stark_request import StarkAnswer
    from rotor.quantum.fields.zeeman_request import ZeemanAnswer

SHOWN = 24  # states on screen


def fields_of(text: str, unit: str, points: int) -> tuple[float, ...]:
    """The fields of a grid in a unit; a range without a count has as many as `points`."""
    from rotor.units import parse_grid

    return tuple(parse_grid(f"{text}:{points}" if text.count(":") == 1 else text, unit).tolist())


def refuse_picture_of_one_field(files: Files, fields: Sequence[float]) -> None:
    """ValueError where a picture is asked for of less than two fields."""
    if "--plot" in files.paths and len(fields) < 2:
        raise ValueError("--plot: a picture of a map needs two fields or more; give --field a range")


def content_of(answer: StarkAnswer | ZeemanAnswer, given: Input, command: str) -> dict[str, Any]:
    """What is printed and more, by the keys of docs/command_line.md."""
    from rotor.reports.top_facts import begin

    return {**begin(command, given.text), **answer.facts()}


def accuracy_fact(content: dict[str, Any]) -> tuple[str, str]:
    """J max, how exact energies are, and the population at the edge, as a line of the report."""
    accuracy = f"J max {content['jmax']}; energies to {content['accuracy_mhz']:.1e} MHz"
    rounding = f"round-off {content['round_off_mhz']:.1e} MHz of it"
    return "accuracy", f"{accuracy}, {rounding}; edge population {content['edge_population']:.1e}"


def table_of_states(states: FieldMap, names: tuple[str, ...], row_of: Callable[[slice], list[str]]) -> Table:
    """The first states by M and block, a row each, made from the rows of its curve in the map."""
    curves = states.curves()
    rows = [row_of(rows_of) for rows_of in curves[:SHOWN]]
    title = f"{len(rows)} of {len(curves)} states" if len(rows) < len(curves) else "all states"
    return Table(f"{title}, by M and block", names, rows, frozenset({"state"}))
