"""Search of a spectrum for unknown molecules by `rotor assign`; species and lines as records of a session."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.assignment.peaks.peak_finding import pick_peaks
from rotor.assignment.peaks.peak_list import PeakList
from rotor.assignment.request import AssignRequest
from rotor.observed.spectrum import ObservedSpectrum
from rotor.viewer.actions.fits import lines_from
from rotor.viewer.actions.line_actions import free_blend
from rotor.viewer.messages import read_number
from rotor.viewer.records import COLOURS, Record, Species, State, line_key, species_key

MOST_SPECIES = 5
USUAL_SECONDS, MOST_SECONDS = 20.0, 600.0


def search(spectrum: ObservedSpectrum, message: Mapping[str, Any], peaks: PeakList | None = None) -> Any:
    """Run `rotor assign` on the peaks of a spectrum. The message has species (1 to 5), seconds, temperature_k."""
    from rotor.assignment.assign import answer_assign

    count = int(read_number(message, "species", above=0, default=1))
    seconds = min(read_number(message, "seconds", above=0, default=USUAL_SECONDS), MOST_SECONDS)
    temperature = read_number(message, "temperature_k", above=0) if message.get("temperature_k") is not None else None
    if peaks is None:
        peaks = pick_peaks(spectrum.frequency_mhz, spectrum.intensity, spectrum.source)
    return answer_assign(
        AssignRequest(peaks, species=min(count, MOST_SPECIES), seconds=seconds, temperature_k=temperature)
    )


def search_records(answer: Any, state: State) -> tuple[str, dict[str, Record | None], list[str]]:
    """Label, records and remarks from an answer of `rotor assign`; ValueError for an answer without species."""
    if not answer.species:
        raise ValueError("rotor assign: no species is significant in this spectrum; nothing is assigned")
    changes: dict[str, Record | None] = {}
    remarks = []
    number, line_number, blend = state.free_number("species"), state.free_number("line"), free_blend(state)
    for place, assigned in enumerate(answer.species):
        constants = assigned.constants
        record = Species(
            name=f"species {number + place}",
            source="",
            constants=dict(constants.values),
            errors=dict(constants.uncertainties),
            free=tuple(name for name in constants.values if name not in assigned.refined.open_constants),
            temperature_k=float(assigned.grown.temperature_k),
            dipole_abc_debye=tuple(assigned.dipole_ratio.tolist()),
            colour=(number + place - 1) % COLOURS,
            reduction=constants.reduction or "",
            representation=constants.representation or "",
        )
        lines = lines_from(assigned.lines, number + place, blend, state.settings.default_error_mhz)
        changes[species_key(number + place)] = record
        changes |= {line_key(line_number + i): line for i, line in enumerate(lines)}
        line_number, blend = line_number + len(lines), max((line.blend for line in lines), default=blend) + 1
        remarks.append(
            f"species {number + place}: {assigned.word} (p = {assigned.probability:.4f}), {len(lines)} lines"
        )
    return f"rotor assign ({len(answer.species)} species)", changes, remarks
