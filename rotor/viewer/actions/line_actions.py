"""Actions on assigned lines: assignment to peaks, by series and from files, removal, rejection, changes."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from rotor.table import counted
from rotor.viewer.actions.fits import lines_from
from rotor.viewer.actions.peak_fit import Peak, fit_peak
from rotor.viewer.actions.species_actions import refuse_other_labels
from rotor.viewer.loomis_wood import row_centres
from rotor.viewer.messages import (
    Change,
    Context,
    Message,
    read_comment,
    read_label,
    read_lines,
    read_number,
    read_species,
)
from rotor.viewer.prediction import Model, with_hyperfine
from rotor.viewer.records import Line, Record, State, line_key, species_key

LEAST_RATIO = 5.0  # height over noise of a peak that is assigned by series
MOST_LINES = 100_000


def assign(state: State, message: Message, context: Context) -> Change:
    """Assign lines to a measured frequency; several lines make a blend."""
    frequency = read_number(message, "frequency_mhz", above=0)
    error = max(
        read_number(message, "error_mhz", above=0, default=state.settings.default_error_mhz),
        state.settings.least_error_mhz,
    )
    width = read_number(message, "width_mhz", above=0) if message.get("width_mhz") is not None else None
    targets = message.get("to")
    if not isinstance(targets, list) or not targets or not all(isinstance(target, dict) for target in targets):
        raise ValueError("to: expected a list of lines, each with species, upper and lower")
    _refuse_many(state, len(targets))
    first, blend = state.free_number("line"), free_blend(state)
    changes: dict[str, Record | None] = {}
    texts = []
    for place, target in enumerate(targets):
        number, species = read_species(state, target)
        model = context.predictions.model(species)
        upper, lower = (read_label(target.get(side), side) for side in ("upper", "lower"))
        _refuse_label(model, upper, lower)
        line = Line(
            species=number,
            upper=upper,
            lower=lower,
            frequency_mhz=frequency,
            error_mhz=error,
            blend=blend,
            weight=read_number(target, "weight", above=0, default=1.0),
            width_mhz=width,
            comment=read_comment(message),
        )
        changes |= dict.fromkeys(_assigned_before(state, line))
        changes[line_key(first + place)] = line
        texts.append(" ".join(map(str, upper)))
    return f"assign {frequency:.4f} MHz ({', '.join(texts)})", changes


def _refuse_label(model: Model, upper: tuple[int, ...], lower: tuple[int, ...]) -> None:
    """ValueError for labels of a wrong length and for levels that do not exist."""
    names = model.quanta
    for side in (upper, lower):
        if len(side) != len(names):
            raise ValueError(f"{' '.join(map(str, side))}: {len(names)} quantum numbers; expected {', '.join(names)}")
    if upper == lower:
        raise ValueError(f"{' '.join(map(str, upper))}: upper and lower level are the same; a line joins two levels")
    if not np.isfinite(model.calculated_mhz(np.array([upper]), np.array([lower]))[0]):
        raise ValueError(
            f"{' '.join(map(str, upper))} - {' '.join(map(str, lower))}: there is no such level ({', '.join(names)})"
        )


def _assigned_before(state: State, line: Line) -> list[str]:
    """Keys of lines with this species and these labels; the new assignment replaces them."""
    lines = state.species_lines(line.species)
    return [line_key(n) for n, other in lines.items() if (other.upper, other.lower) == (line.upper, line.lower)]


def free_blend(state: State) -> int:
    """The number of a new blend."""
    return max((line.blend for line in state.lines.values()), default=0) + 1


def _refuse_many(state: State, more: int) -> None:
    """ValueError where a session would have too many lines."""
    if len(state.lines) + more > MOST_LINES:
        raise ValueError(f"{len(state.lines) + more} lines; a session has at most {MOST_LINES}")


def peak_in(context: Context, first_mhz: float, last_mhz: float) -> Peak:
    """The fitted peak of a range, or its highest peak in a list; ValueError for a range without a peak."""
    if context.peaks is None:
        return fit_peak(context.spectrum, first_mhz, last_mhz)
    listed = context.peaks
    inside = np.flatnonzero((listed.frequency_mhz >= first_mhz) & (listed.frequency_mhz <= last_mhz))
    if not len(inside):
        raise ValueError(f"{first_mhz:.4f} to {last_mhz:.4f} MHz: the list has no peak there")
    i = inside[np.argmax(listed.intensity[inside])]
    return Peak(float(listed.frequency_mhz[i]), float(listed.uncertainty_mhz[i]), height=float(listed.intensity[i]))


def assign_series(state: State, message: Message, context: Context) -> Change:
    """Assign the peaks near the expected lines of the chosen series."""
    series = state.settings.series
    if series is None or series.species is None or series.species not in state.species:
        raise ValueError(
            "assign by series: choose a series of a species first; extrapolated rows have no quantum numbers"
        )
    reach = read_number(message, "tolerance_mhz", above=0)
    predictions = context.predictions
    rows = row_centres(series, predictions.band_mhz, predictions.lines(state.species[series.species]))
    changes: dict[str, Record | None] = {}
    number, blend, count = state.free_number("line"), free_blend(state), 0
    for upper, lower, centre in zip(rows.upper.tolist(), rows.lower.tolist(), rows.frequency_mhz.tolist(), strict=True):
        peak = _clear_peak(context, centre, reach)
        if peak is None:
            continue
        error = max(peak.error_mhz, state.settings.least_error_mhz)
        line = Line(
            series.species,
            tuple(upper),
            tuple(lower),
            peak.frequency_mhz,
            error,
            blend + count,
            width_mhz=peak.width_mhz,
        )
        changes |= dict.fromkeys(_assigned_before(state, line))
        changes[line_key(number + count)] = line
        count += 1
    if not count:
        raise ValueError(f"assign by series: no peak within {reach:g} MHz of any of {len(rows.number)} expected lines")
    context.notes.append(f"{count} of {len(rows.number)} rows assigned")
    return f"assign a series ({counted(count, 'line')})", changes


def _clear_peak(context: Context, centre_mhz: float, reach_mhz: float) -> Peak | None:
    """The peak near an expected frequency; None where there is none, or noise could be taken for it."""
    try:
        peak = peak_in(context, centre_mhz - reach_mhz, centre_mhz + reach_mhz)
    except ValueError:
        return None
    clear = abs(peak.height) >= LEAST_RATIO * (peak.height_error or 0.0) and peak.error_mhz <= reach_mhz
    return peak if clear else None


def remove(state: State, message: Message, context: Context) -> Change:
    """Remove assignments."""
    lines = read_lines(state, message)
    return f"remove {len(lines)} assignments", {line_key(number): None for number in lines}


def reject(state: State, message: Message, context: Context) -> Change:
    """Exclude lines from fits, or include them again."""
    rejected = message.get("rejected")
    if not isinstance(rejected, bool):
        raise ValueError(f"rejected: {rejected!r}: expected true or false")
    lines = read_lines(state, message)
    verb = "reject" if rejected else "accept"
    return f"{verb} {len(lines)} lines", {
        line_key(number): msgspec.structs.replace(line, rejected=rejected) for number, line in lines.items()
    }


def edit(state: State, message: Message, context: Context) -> Change:
    """Change error, weight, frequency or comment of lines."""
    values: dict[str, Any] = {
        key: read_number(message, key, above=0) for key in ("error_mhz", "weight", "frequency_mhz") if key in message
    }
    if "comment" in message:
        values["comment"] = read_comment(message)
    if not values:
        raise ValueError("edit: expected error_mhz, weight, frequency_mhz or comment")
    lines = read_lines(state, message)
    return f"change {', '.join(values)} of {len(lines)} lines", {
        line_key(number): msgspec.structs.replace(line, **values) for number, line in lines.items()
    }


def import_lines(state: State, number: int, path: str, context: Context) -> Change:
    """Add the assigned lines of a file to a species; lines that the session has already are left out."""
    from rotor.formats.lines.assigned_lines import names_sums, read_assigned_lines

    record = state.species[number]
    model = context.predictions.model(record)
    if not record.hyperfine and names_sums(path, len(model.quanta)):
        record = with_hyperfine(record, True, context.predictions.top)
        refuse_other_labels(state, number, record, context)
        model = context.predictions.model(record)
    read, remarks = read_assigned_lines(path, model.quanta, model.halves)
    context.notes.extend(remarks)
    file_lines = lines_from(read, number, free_blend(state), state.settings.default_error_mhz)
    known = {(line.upper, line.lower, line.frequency_mhz) for line in state.species_lines(number).values()}
    lines = [line for line in file_lines if (line.upper, line.lower, line.frequency_mhz) not in known]
    if len(lines) < len(file_lines):
        repeated = counted(len(file_lines) - len(lines), "line is", "lines are")
        context.notes.append(f"{path}: {repeated} in the session already")
    _refuse_many(state, len(lines))
    first = state.free_number("line")
    changes: dict[str, Record | None] = {line_key(first + i): line for i, line in enumerate(lines)}
    return f"read {len(lines)} lines", {**changes, species_key(number): record}
