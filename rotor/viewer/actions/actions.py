"""The actions of a page by name: each takes the state and a message and gives a label and the records that change.

An action has no side effects; `rotor.viewer.service` carries it out as a step that can be undone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from rotor.viewer.actions.line_actions import assign, assign_series, edit, reject, remove
from rotor.viewer.actions.species_actions import add_species, constants, free, refit, remove_species, species
from rotor.viewer.loomis_wood import row_centres
from rotor.viewer.messages import Action, Change, Context, Message, read_number, read_species
from rotor.viewer.records import Series, Settings, State


def series(state: State, message: Message, context: Context) -> Change:
    """Choose the series of the Loomis-Wood rows."""
    chosen: Series | None = None
    if message.get("series") is not None:
        try:
            chosen = msgspec.convert(message["series"], Series)
        except msgspec.ValidationError as error:
            raise ValueError(f"series: {error}") from None
        predicted = None
        if chosen.species is not None:
            _, record = read_species(state, {"species": chosen.species})
            predicted = context.predictions.lines(record)
        row_centres(chosen, context.predictions.band_mhz, predicted)
    return "choose a series", {"settings": msgspec.structs.replace(state.settings, series=chosen)}


def settings(state: State, message: Message, context: Context) -> Change:
    """Change settings: auto_refit, emission, overlaid, background_k, default_error_mhz, least_error_mhz."""
    values: dict[str, Any] = {
        key: bool(message[key]) for key in ("auto_refit", "emission", "overlaid") if key in message
    }
    for key in ("background_k", "default_error_mhz", "least_error_mhz"):
        if key in message:
            values[key] = read_number(message, key, above=0)
    if not values:
        raise ValueError(f"settings: expected one of {', '.join(Settings.__struct_fields__[1:])}")
    return f"change {', '.join(values)}", {"settings": msgspec.structs.replace(state.settings, **values)}


ACTIONS: Mapping[str, Action] = {
    "assign": assign,
    "assign_series": assign_series,
    "remove": remove,
    "reject": reject,
    "edit": edit,
    "constants": constants,
    "free": free,
    "species": species,
    "add_species": add_species,
    "remove_species": remove_species,
    "refit": refit,
    "series": series,
    "settings": settings,
}
REFITTED_AFTER = frozenset({"assign", "assign_series", "remove", "reject", "edit", "free"})  # with auto_refit
