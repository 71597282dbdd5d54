"""`rotor spectrum case.int`: what SPCAT does with that file and the .var or .par beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.formats.spcat.predict import Prediction

# what the .int and its parameter file say themselves: option of the verb -> field of the files
SAID = {
    "temperature": "TEMP",
    "jmax": "FEND",
    "min_lgint": "STR0 and STR1",
    "range_": "FQLIM",
    "q": "QROT",
    "vibrational_factor": "QROT",
    "vibration": "QROT",
    "vibrational_states": "QROT",
    "tag": "TAG",
    "dipole": "the dipoles",
    "dipole_abc": "the dipoles",
    "isotope": "the constants",
    "spin_weights": "WTPL and WTMN",
    "constants": "the constants",
    "calculator": "the constants",
}


def is_request(source: str | None) -> bool:
    """Whether the source is an .int file."""
    return source is not None and source.lower().endswith(".int")


def prediction_of(context: typer.Context, source: str) -> Prediction:
    """The prediction of an .int file; its notes are said. Options that the files answer themselves are refused."""
    for name, said in SAID.items():
        given = context.get_parameter_source(name)
        if given is not None and given.name != "DEFAULT":
            option = "--" + name.rstrip("_").replace("_", "-")
            raise ValueError(f"{option}: {source} says that itself ({said}); change it there, or give its .var instead")
    from rotor.formats.spcat.predict import predict_file

    prediction = predict_file(source)
    for text in prediction.notes:
        note(text)
    return prediction
