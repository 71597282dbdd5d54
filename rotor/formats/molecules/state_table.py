"""The table of further states of a molecule file: constants, names, weights, dipoles; file, table and key stand in every error."""

from __future__ import annotations

from typing import Any

from rotor.formats.molecules.molecule_tables import Table, TableReader, is_number, read_spin_weights, uncertain_number
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants


def read_states(table: TableReader | None, constants: Constants | None) -> StateConstants | None:
    """Further states of a top: constants with the state in brackets, their names, weights and dipoles."""
    if table is None:
        return None
    if constants is None:
        raise ValueError(f"{table.place}: states beyond the one of [constants], which is missing")
    other_keys = ("source", "unverified", "unit", "names", "symmetry", "weights", "dipoles")
    unit, values, errors = table.text("unit", "MHz"), dict[str, float](), dict[str, float]()
    for key in table.content:
        if key not in other_keys:
            values[key], error = uncertain_number(table, key, unit)
            if error is not None:
                errors[key] = error
    weights = {
        _state(table, v): _state_weights(table, weight, constants) for v, weight in _part(table, "weights").items()
    }
    dipoles = {}
    for pair, moment in _part(table, "dipoles").items():
        a, b = sorted(_state(table, part) for part in (pair.split(",") * 2)[:2])
        if not (isinstance(moment, list) and len(moment) == 3 and all(is_number(x) for x in moment)):
            raise table.error("dipoles", f"state {pair}: expected three numbers, along a, b, c in D")
        dipoles[b, a] = (float(moment[0]), float(moment[1]), float(moment[2]))
    try:
        return StateConstants(
            values, table.texts("names"), weights, dipoles, table.text("source"), table.text("symmetry"), errors
        )
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def _part(table: TableReader, key: str) -> Table:
    value = table.content.get(key, {})
    if not isinstance(value, dict):
        raise table.error(key, "expected a table, with the numbers of states as keys")
    return value


def _state(table: TableReader, text: str) -> int:
    if not text.strip().isdigit():
        raise ValueError(f"{table.place}: state {text!r}: expected a number, 0 for the top's own state")
    return int(text)


def _state_weights(table: TableReader, classes: Any, constants: Constants) -> SpinWeights:
    if classes == {}:  # what the rule "none" is written as: all levels of this state alike
        return SpinWeights()
    weights = read_spin_weights(TableReader(f"{table.place}", "weights", classes), constants)
    if weights.to_mapping() != classes:
        raise ValueError(
            f"{table.place}, weights = {classes}: expected numbers without a common divisor, as those of state 0 have"
        )
    return weights
