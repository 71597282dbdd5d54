"""What a page can do to a session: each action takes the state and a message and gives a label and the records that change.

An action has no side effects; `rotor.viewer.service` carries it out as one step that can be undone. ACTIONS is the table of all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from rotor.assignment.peaks import PeakList
from rotor.observed.spectrum import ObservedSpectrum
from rotor.table import counted
from rotor.viewer.fits import lines_from
from rotor.viewer.joint_fits import refits
from rotor.viewer.loomis_wood import centres_of
from rotor.viewer.peak_fit import Peak, fit_peak
from rotor.viewer.prediction import MOST_J, Predictions, changed, species_of_source, with_hyperfine
from rotor.viewer.records import (
    COLOURS,
    Line,
    Record,
    Series,
    Settings,
    Species,
    State,
    line_key,
    species_key,
)

Message = Mapping[str, Any]
SEEN = 5.0  # times the noise: height of a peak that a series assigns
MOST_LINES = 100_000
MOST_SPECIES = 30


@dataclass(frozen=True)
class Context:
    """What actions need beside the state. notes: takes remarks for the user. peaks: of a list, in place of a spectrum."""

    spectrum: ObservedSpectrum
    predictions: Predictions
    notes: list[str]
    peaks: PeakList | None = None


Action = Callable[[State, Message, Context], tuple[str, dict[str, Record | None]]]


def number_of(message: Message, key: str, *, above: float | None = None, default: float | None = None) -> float:
    """A finite number of a message; ValueError with its name for anything else."""
    value = message.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{key}: {value!r}: expected a finite number")
    if above is not None and not value > above:
        raise ValueError(f"{key}: {value!r}: expected a number above {above:g}")
    return float(value)


def species_of(state: State, message: Message) -> tuple[int, Species]:
    """The species that a message names by its number."""
    number = message.get("species")
    if not isinstance(number, int) or number not in state.species:
        raise ValueError(
            f"species: {number!r}: expected one of {', '.join(map(str, state.species)) or 'none; add one'}"
        )
    return number, state.species[number]


def lines_named(state: State, message: Message) -> dict[int, Line]:
    """The lines that a message names by their numbers."""
    numbers = message.get("lines")
    lines = state.lines
    if not isinstance(numbers, list) or not numbers:
        raise ValueError("lines: expected a list of numbers of lines")
    missing = [number for number in numbers if not isinstance(number, int) or number not in lines]
    if missing:
        raise ValueError(f"lines: there is no line {missing[0]!r}")
    return {number: lines[number] for number in numbers}


def _label(values: Any, key: str) -> tuple[int, ...]:
    if not isinstance(values, list) or not all(type(value) is int for value in values) or not 0 < len(values) <= 10:
        raise ValueError(f"{key}: {values!r}: expected one to ten whole numbers")
    return tuple(values)


def assign(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Lines assigned to one measured frequency: a blend where there are several."""
    frequency = number_of(message, "frequency_mhz", above=0)
    error = max(
        number_of(message, "error_mhz", above=0, default=state.settings.default_error_mhz),
        state.settings.least_error_mhz,
    )
    width = number_of(message, "width_mhz", above=0) if message.get("width_mhz") is not None else None
    targets = message.get("to")
    if not isinstance(targets, list) or not targets or not all(isinstance(target, dict) for target in targets):
        raise ValueError("to: expected a list of lines, each with species, upper and lower")
    _refuse_many(state, len(targets))
    first, blend = state.free_number("line"), free_blend(state)
    changes: dict[str, Record | None] = {}
    texts = []
    for place, target in enumerate(targets):
        number, species = species_of(state, target)
        model = context.predictions.model(species)
        upper, lower = (_label(target.get(side), side) for side in ("upper", "lower"))
        _refuse_label(model, upper, lower)
        line = Line(
            species=number,
            upper=upper,
            lower=lower,
            frequency_mhz=frequency,
            error_mhz=error,
            blend=blend,
            weight=number_of(target, "weight", above=0, default=1.0),
            width_mhz=width,
            comment=str(message.get("comment", ""))[:200],
        )
        for key in _same_labels(state, line):
            changes[key] = None
        changes[line_key(first + place)] = line
        texts.append(" ".join(map(str, upper)))
    return f"assign {frequency:.4f} MHz ({', '.join(texts)})", changes


def _refuse_label(model: Any, upper: tuple[int, ...], lower: tuple[int, ...]) -> None:
    """ValueError for labels of another length, and levels that do not exist."""
    names = model.quanta
    for side in (upper, lower):
        if len(side) != len(names):
            raise ValueError(f"{' '.join(map(str, side))}: {len(names)} quantum numbers are needed: {', '.join(names)}")
    if upper == lower:
        raise ValueError(f"{' '.join(map(str, upper))}: upper and lower level are the same; a line joins two levels")
    if not np.isfinite(model.calculated_mhz(np.array([upper]), np.array([lower]))[0]):
        raise ValueError(
            f"{' '.join(map(str, upper))} - {' '.join(map(str, lower))}: there is no such level ({', '.join(names)})"
        )


def _same_labels(state: State, line: Line) -> list[str]:
    """Keys of lines of the same species and labels, which a new assignment replaces."""
    same = (line.species, line.upper, line.lower)
    return [line_key(n) for n, other in state.lines.items() if (other.species, other.upper, other.lower) == same]


def free_blend(state: State) -> int:
    """A number that no blend has."""
    return max((line.blend for line in state.lines.values()), default=0) + 1


def _refuse_many(state: State, more: int) -> None:
    if len(state.lines) + more > MOST_LINES:
        raise ValueError(f"{len(state.lines) + more} lines; a session has at most {MOST_LINES}")


def peak_in(context: Context, first_mhz: float, last_mhz: float) -> Peak:
    """The fitted peak of a range; of a list of peaks the highest one that stands there. ValueError where there is none."""
    if context.peaks is None:
        return fit_peak(context.spectrum, first_mhz, last_mhz)
    listed = context.peaks
    inside = np.flatnonzero((listed.frequency_mhz >= first_mhz) & (listed.frequency_mhz <= last_mhz))
    if not len(inside):
        raise ValueError(f"{first_mhz:.4f} to {last_mhz:.4f} MHz: the list has no peak there")
    i = inside[np.argmax(listed.intensity[inside])]
    return Peak(float(listed.frequency_mhz[i]), float(listed.uncertainty_mhz[i]), height=float(listed.intensity[i]))


def assign_series(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Every row of the chosen series with a peak near its centre assigned to it."""
    series = state.settings.series
    if series is None or series.species is None or series.species not in state.species:
        raise ValueError(
            "assign by series: choose a series of a species first; extrapolated rows have no quantum numbers"
        )
    reach = number_of(message, "tolerance_mhz", above=0)
    predicted = context.predictions.lines(state.species[series.species])
    spectrum = context.spectrum
    band = (float(spectrum.frequency_mhz[0]), float(spectrum.frequency_mhz[-1]))
    centres = centres_of(series, band, predicted)
    changes: dict[str, Record | None] = {}
    number, blend = state.free_number("line"), free_blend(state)
    for upper, lower, centre in zip(
        centres.upper.tolist(), centres.lower.tolist(), centres.frequency_mhz.tolist(), strict=True
    ):
        try:
            peak = peak_in(context, centre - reach, centre + reach)
        except ValueError:
            continue  # no peak in this row
        if abs(peak.height) < SEEN * (peak.height_error or 0.0) or peak.error_mhz > reach:
            continue
        line = Line(
            series.species,
            tuple(upper),
            tuple(lower),
            peak.frequency_mhz,
            max(peak.error_mhz, state.settings.least_error_mhz),
            blend,
            width_mhz=peak.width_mhz,
        )
        changes |= dict.fromkeys(_same_labels(state, line))
        changes[line_key(number)] = line
        number, blend = number + 1, blend + 1
    if not changes:
        raise ValueError(
            f"assign by series: no peak within {reach:g} MHz of any of {len(centres.number)} expected lines"
        )
    count = sum(record is not None for record in changes.values())
    context.notes.append(f"{count} of {len(centres.number)} rows assigned")
    return f"assign a series ({counted(count, 'line')})", changes


def remove(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Assignments taken away."""
    lines = lines_named(state, message)
    return f"remove {len(lines)} assignments", {line_key(number): None for number in lines}


def reject(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Lines that stay in the list but do not count in the fit, or count again."""
    rejected = message.get("rejected")
    if not isinstance(rejected, bool):
        raise ValueError(f"rejected: {rejected!r}: expected true or false")
    lines = lines_named(state, message)
    verb = "reject" if rejected else "accept"
    return f"{verb} {len(lines)} lines", {
        line_key(number): msgspec.structs.replace(line, rejected=rejected) for number, line in lines.items()
    }


def edit(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Error, weight, frequency or comment of lines."""
    values: dict[str, Any] = {
        key: number_of(message, key, above=0) for key in ("error_mhz", "weight", "frequency_mhz") if key in message
    }
    if "comment" in message:
        values["comment"] = str(message["comment"])[:200]
    if not values:
        raise ValueError("edit: expected error_mhz, weight, frequency_mhz or comment")
    lines = lines_named(state, message)
    return f"change {', '.join(values)} of {len(lines)} lines", {
        line_key(number): msgspec.structs.replace(line, **values) for number, line in lines.items()
    }


def constants(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Constants moved by hand."""
    number, species = species_of(state, message)
    record = changed(species, constants_in(message))
    context.predictions.model(record)  # refuses sets that are none
    names = ", ".join(constants_in(message))
    return f"set {names} of {species.name}", {species_key(number): msgspec.structs.replace(record, fit=None)}


def constants_in(message: Message) -> dict[str, float]:
    """The constants of a message by name, MHz."""
    values = message.get("constants")
    if not isinstance(values, dict) or not values:
        raise ValueError("constants: expected a table of names and numbers (MHz)")
    return {str(name): number_of(values, name) for name in values}


def free(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Which constants a refit varies; a constant that the species lacks is added at 0."""
    number, species = species_of(state, message)
    names = message.get("free")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError("free: expected a list of names of constants")
    model = context.predictions.model(species)
    names_of_species = list(dict.fromkeys(model.constants.own_name(name) for name in names))
    added = {name: 0.0 for name in names_of_species if name not in species.constants}
    record = msgspec.structs.replace(species, constants={**species.constants, **added}, free=tuple(names_of_species))
    context.predictions.model(record)
    return f"free {', '.join(names_of_species) or 'no constant'} of {species.name}", {species_key(number): record}


_NUMBERS = {
    "temperature_k": 0.0,
    "scale": 0.0,
    "column_per_cm2": 0.0,
    "fwhm_km_s": 0.0,
    "velocity_km_s": None,
}  # fields of a species, and what they are above


def species(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Temperature, dipole, scale, colour, name or visibility of a species."""
    number, record = species_of(state, message)
    values: dict[str, Any] = {
        key: number_of(message, key, above=least) for key, least in _NUMBERS.items() if key in message
    }
    if "visible" in message:
        values["visible"] = bool(message["visible"])
    if "colour" in message:
        values["colour"] = int(number_of(message, "colour")) % COLOURS
    if "name" in message:
        values["name"] = " ".join(str(message["name"]).split())[:80] or record.name
    if "dipole_abc_debye" in message:
        dipole = message["dipole_abc_debye"]
        if not isinstance(dipole, list) or len(dipole) != 3:
            raise ValueError(f"dipole_abc_debye: {dipole!r}: expected three numbers")
        values["dipole_abc_debye"] = tuple(
            number_of({"dipole_abc_debye": component}, "dipole_abc_debye") for component in dipole
        )
    if not values and "hyperfine" not in message:
        raise ValueError(
            f"species: expected {', '.join(_NUMBERS)}, visible, colour, name, hyperfine or dipole_abc_debye"
        )
    made = msgspec.structs.replace(record, **values)
    if "hyperfine" in message:
        made = with_hyperfine(made, bool(message["hyperfine"]), context.predictions.top)
        _refuse_other_labels(state, number, made, context)
        values["hyperfine"] = made.hyperfine
    context.predictions.lines(made)  # refuses a temperature or a dipole that cannot be
    return f"change {', '.join(values)} of {record.name}", {species_key(number): made}


def _refuse_other_labels(state: State, number: int, record: Species, context: Context) -> None:
    """ValueError where lines are assigned with other quantum numbers than the changed species has."""
    names, lines = context.predictions.model(record).quanta, state.lines_of(number)
    before = context.predictions.model(state.species[number]).quanta
    if lines and names != before:
        those = counted(len(lines), "line is", "lines are")
        raise ValueError(
            f"{record.name}: {those} assigned by {', '.join(before)}, not by {', '.join(names)}; remove such lines first"
        )


def add_species(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """A species by a name of the library, a file or SMILES:..."""
    source = message.get("source")
    if not isinstance(source, str) or not source.strip() or len(source) > 1000:
        raise ValueError("source: expected a molecule: a name, a file, or SMILES:...")
    if len(state.species) >= MOST_SPECIES:
        raise ValueError(f"a session has at most {MOST_SPECIES} species; remove one first")
    temperature = number_of(message, "temperature_k", above=0, default=300.0)
    number = state.free_number("species")
    record, remark = species_of_source(
        context.predictions.stored(source.strip()), (number - 1) % COLOURS, temperature, context.predictions.top
    )
    reached = context.predictions.lines(record).lines.jmax
    if remark:
        context.notes.append(remark)
    if reached >= MOST_J:
        context.notes.append(
            f"{record.name}: lines up to J = {MOST_J}; at {temperature:g} K weaker ones of higher J exist"
        )
    return f"add {record.name}", {species_key(number): record}


def remove_species(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """A species with its lines taken away."""
    number, record = species_of(state, message)
    changes: dict[str, Record | None] = {line_key(n): None for n in state.lines_of(number)}
    changes[species_key(number)] = None
    series = state.settings.series
    if series is not None and series.species == number:
        changes["settings"] = msgspec.structs.replace(state.settings, series=None)
    return f"remove {record.name}", changes


def refit(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """The constants of a species fitted to its lines, or of all that have lines; species that share a blend are fitted together."""
    if "species" in message:
        numbers = {species_of(state, message)[0]}
    else:
        numbers = {line.species for line in state.lines.values()}
    if not numbers:
        raise ValueError("refit: no line is assigned; assign lines first")
    records, failures = refits(state, numbers, context.predictions.model)
    if not records:
        raise ValueError("; ".join(failures))
    context.notes.extend(f"not refitted: {text}" for text in failures)
    names = ", ".join(record.name for record in records.values())
    return f"refit {names}", {species_key(number): record for number, record in records.items()}


def series(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """The series of the Loomis-Wood rows."""
    made: Series | None = None
    if message.get("series") is not None:
        try:
            made = msgspec.convert(message["series"], Series)
        except msgspec.ValidationError as error:
            raise ValueError(f"series: {error}") from None
        predicted = None
        if made.species is not None:
            _, record = species_of(state, {"species": made.species})
            predicted = context.predictions.lines(record)
        centres_of(made, context.predictions.band_mhz, predicted)
    return "choose a series", {"settings": msgspec.structs.replace(state.settings, series=made)}


def settings(state: State, message: Message, context: Context) -> tuple[str, dict[str, Record | None]]:
    """Settings of the page: auto_refit, emission, overlaid, background_k, default_error_mhz."""
    values: dict[str, Any] = {
        key: bool(message[key]) for key in ("auto_refit", "emission", "overlaid") if key in message
    }
    for key in ("background_k", "default_error_mhz", "least_error_mhz"):
        if key in message:
            values[key] = number_of(message, key, above=0)
    if not values:
        raise ValueError(f"settings: expected one of {', '.join(Settings.__struct_fields__[1:])}")
    return f"change {', '.join(values)}", {"settings": msgspec.structs.replace(state.settings, **values)}


def import_lines(
    state: State, species_number: int, path: str, context: Context
) -> tuple[str, dict[str, Record | None]]:
    """The assigned lines of a file for a species. ValueError as the reader gives it."""
    from rotor.formats.assigned_lines import names_sums, read_assigned_lines

    _, before = species_of(state, {"species": species_number})
    model = context.predictions.model(before)
    record = before
    if not before.hyperfine and names_sums(path, len(model.quanta)):
        record = with_hyperfine(before, True, context.predictions.top)
        _refuse_other_labels(state, species_number, record, context)
        model = context.predictions.model(record)
    read, remarks = read_assigned_lines(path, model.quanta, model.halves)
    context.notes.extend(remarks)
    file_lines = lines_from(read, species_number, free_blend(state), state.settings.default_error_mhz)
    known = {(line.upper, line.lower, line.frequency_mhz) for line in state.lines_of(species_number).values()}
    lines = [line for line in file_lines if (line.upper, line.lower, line.frequency_mhz) not in known]
    if len(lines) < len(file_lines):  # the same file, named again when the session is resumed
        context.notes.append(
            f"{path}: {counted(len(file_lines) - len(lines), 'line is', 'lines are')} in the session already"
        )
    _refuse_many(state, len(lines))
    first = state.free_number("line")
    changes: dict[str, Record | None] = {line_key(first + place): line for place, line in enumerate(lines)}
    return f"read {len(lines)} lines", {**changes, species_key(species_number): record}


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
