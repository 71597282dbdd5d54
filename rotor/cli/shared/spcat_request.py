"""`rotor spectrum case.int`: what SPCAT computes from that file and the .var or .par beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.formats.spcat.predict import Prediction
    from rotor.spectra.request import SpectrumAnswer

# what the .int and its parameter file say themselves: option of the verb -> field of the files
FIELDS = {
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
    "spin_constants": "the constants",
    "spins": "SPIND",
    "state_constants": "the constants",
    "state_dipoles": "the dipoles",
    "state_weights": "EWT",
    "state_symmetry": "the constants",
    "state_names": "the constants",
    "hyperfine": "SPIND",
    "hyperfine_method": "SPIND",
    "hyperfine_tolerance": "SPIND",
    "constants": "the constants",
    "calculator": "the constants",
}


def is_request(source: str | None) -> bool:
    """Whether the source is an .int file."""
    return source is not None and source.lower().endswith(".int")


def prediction_asked(context: typer.Context, source: str | None, as_spcat: bool, full_basis: bool) -> Prediction | None:
    """The prediction of an .int file, None for any other source."""
    if is_request(source):
        return prediction_of(context, str(source), as_spcat, full_basis)
    if as_spcat or full_basis:
        option = "--as-spcat" if as_spcat else "--full-basis"
        raise ValueError(f"{option}: expected with an .int file, which SPCAT reads with the .var beside it")
    return None


def prediction_of(context: typer.Context, source: str, as_spcat: bool, full_basis: bool) -> Prediction:
    """The prediction of an .int file; its notes go to standard error. Options that the files answer themselves are refused."""
    for name, field in FIELDS.items():
        given = context.get_parameter_source(name)
        if given is not None and given.name != "DEFAULT":
            option = "--" + name.rstrip("_").replace("_", "-")
            raise ValueError(
                f"{option}: {source} says that itself ({field}); change it there, or give its .var instead"
            )
    from rotor.formats.spcat.predict import predict_file

    prediction = predict_file(source, as_spcat=as_spcat, full_basis=full_basis)
    for text in prediction.notes:
        note(text)
    return with_names(prediction, Path(source))


def with_names(prediction: Prediction, source: Path) -> Prediction:
    """The prediction with the named constants of its files, their spins and states, where all have names; else as it is."""
    from rotor.formats.read_write import read_spcat_top
    from rotor.quantum.effects.of_top import effects_of

    lines = prediction.lines
    if lines.levels.of_named_constants:
        return prediction
    try:
        top = read_spcat_top(source)
        effects = effects_of(top, top.spin_constants is not None)
    except ValueError:
        return prediction
    levels = replace(lines.levels, effects=effects)
    return replace(prediction, lines=replace(lines, top=top, levels=levels))


def answer_of(prediction: Prediction, shape: dict[str, Any]) -> SpectrumAnswer:
    """The lines of a prediction as the answer to the request that its files make; shape: profile, width and layer."""
    from rotor.spectra.request import SpectrumAnswer, SpectrumRequest

    asked, lines = prediction.request, prediction.lines
    request = SpectrumRequest(
        lines.top,
        temperature_k=asked.temperature_k,
        jmax=asked.fend,
        min_lgint=asked.str0,
        range_mhz=lines.range_mhz,
        q=prediction.q,
        **shape,
    )
    return SpectrumAnswer(request, lines)
