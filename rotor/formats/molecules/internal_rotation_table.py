"""The table of an internal rotor of a molecule file: its frame, constants, and how its levels are computed.

[internal_rotation]
frame = "RAM"                       # z along rho, A beside F (p - rho Pa)^2; [constants] are those of this frame then
unit = "cm-1"
F = 7.5670818
rho = 0.328632673
V3 = { value = 407.59768, uncertainty = 0.0002 }
Dab = 0.122669
vt_max = 1                          # the highest torsional state of the levels
functions = 9                       # torsional functions retained for each K
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.formats.molecules.molecule_tables import TableReader, uncertain_number
from rotor.formats.molecules.spin_table import uncertain_entry
from rotor.tops.constants.constants import Constants
from rotor.tops.internal_rotation import BARE, InternalRotationConstants

SETTINGS = ("vt_max", "functions")
KEYS = ("source", "unverified", "unit", "frame", "names", "exchanged", "spin_states", *SETTINGS)


def read_internal_rotation(table: TableReader | None, constants: Constants | None) -> InternalRotationConstants | None:
    """The constants of an internal rotor; ValueError, with file and table, for unknown names and a frame that is not stated."""
    if table is None:
        return None
    if constants is None:
        raise ValueError(f"{table.place}: needs the rotational constants of the same frame, [constants]")
    unit, values, errors = table.text("unit", "MHz"), dict[str, float](), dict[str, float]()
    for key in table.content:
        if key not in KEYS:
            values[key], error = uncertain_number(table, key, "MHz" if key in BARE else unit)
            if error is not None:
                errors[key] = error
    settings = {key: number for key in SETTINGS if (number := table.whole(key)) is not None}
    names, exchanged = table.text("names", "K"), table.content.get("exchanged", [])
    if not _are_whole(exchanged):
        raise table.error("exchanged", "expected a list of whole numbers, 2I + 1 of each exchanged pair, such as [2]")
    states = table.content.get("spin_states", 2)
    if not _are_whole([states] if type(states) is int else states):
        raise table.error(
            "spin_states", "expected 2I + 1 of the nuclei of all tops, such as 2, or of each top, such as [2, 3]"
        )
    try:
        return InternalRotationConstants(
            values,
            table.text("frame"),
            **settings,
            names=names,
            exchanged=tuple(exchanged),
            spin_states=states if type(states) is int else tuple(states),
            uncertainties=errors,
            source=table.text("source"),
        )
    except ValueError as reason:
        raise ValueError(f"{table.place}: {reason}") from None


def _are_whole(numbers: object) -> bool:
    """Whether these are a list of whole numbers."""
    return isinstance(numbers, list) and all(type(number) is int for number in numbers)


def internal_rotation_table(constants: InternalRotationConstants | None) -> Mapping[str, Any]:
    """The table of an internal rotor for a file, in MHz."""
    if constants is None:
        return {}
    values = {
        name: uncertain_entry(value, constants.uncertainties.get(name)) for name, value in constants.values.items()
    }
    settings = {key: getattr(constants, key) for key in SETTINGS}
    states = constants.spin_states
    settings["spin_states"] = states if isinstance(states, int) else list(states)
    return {"frame": constants.frame, "unit": "MHz", **values, **settings, "names": constants.names} | (
        {"exchanged": list(constants.exchanged)} if constants.exchanged else {}
    )
