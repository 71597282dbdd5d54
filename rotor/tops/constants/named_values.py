"""Constants of a top, of its spins and of its further states, from one mapping or from texts.

    {"A": "9.4 GHz", "B": 3100, "C": 2500, "chi_aa(14N)": -4.2, "E[1]": "5 GHz", ..., "G_c[0,1]": 450}

A name with spins in round brackets belongs to `SpinConstants`, a name with only states in square brackets to `StateConstants`, others
to `Constants`; numbers are in MHz.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.units import parse_quantity


def constants_from_names(
    values: Mapping[str, float | str], spins: str | None = None
) -> tuple[Constants, dict[str, Any]]:
    """The rotational constants of a mapping, and `spin_constants` and `states`, if present, as fields of a top.

    spins: sizes of spins not named after isotopes, and spins that are coupled first, such as "S=1/2".

    >>> rotational, others = constants_from_names({"A": 9400, "B": 3100, "C": 2500, "chi_aa(14N)": "-4.2 MHz"})
    >>> rotational["A"], dict(others["spin_constants"].values)
    (9400.0, {'chi_aa(14N)': -4.2})
    """
    kinds: dict[str, dict[str, float]] = {"": {}, "(": {}, "[": {}}
    for name, value in values.items():
        kinds[next((mark for mark in "([" if mark in name), "")][name] = parse_quantity(value, "MHz")
    others: dict[str, Any] = {}
    if kinds["("]:
        others["spin_constants"] = SpinConstants.from_values(kinds["("], spins)
    if kinds["["]:
        others["states"] = StateConstants(kinds["["])
    fields: dict[str, Any] = dict(kinds[""])
    return Constants(**fields), others


def parse_fields(fields: Mapping[str, Any], spins: str | None = None) -> dict[str, Any]:
    """Fields of a top, where `spin_constants` and `states` may be texts, or mappings by name in MHz.

    >>> parse_fields({"spin_constants": "chi_aa(14N)=-4.2 MHz"})["spin_constants"].of("14N")
    {'chi_aa': -4.2}
    """
    read = dict(fields)
    spin, states = read.get("spin_constants"), read.get("states")
    if isinstance(spin, str):
        read["spin_constants"] = SpinConstants.parse(spin, spins)
    elif isinstance(spin, Mapping):
        read["spin_constants"] = SpinConstants.from_values(_in_mhz(spin), spins)
    if isinstance(states, str):
        read["states"] = StateConstants.parse(states)
    elif isinstance(states, Mapping):
        read["states"] = StateConstants(_in_mhz(states))
    return read


def _in_mhz(values: Mapping[str, float | str]) -> dict[str, float]:
    return {name: parse_quantity(value, "MHz") for name, value in values.items()}
