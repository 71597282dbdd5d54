"""Actions on species: constants, temperature, dipole and appearance, new species, refits."""

from __future__ import annotations

from typing import Any

import msgspec

from rotor.table import counted
from rotor.viewer.actions.joint_fits import refits
from rotor.viewer.messages import Change, Context, Message, read_constants, read_number, read_species
from rotor.viewer.prediction import MOST_J, changed, species_record, with_hyperfine
from rotor.viewer.records import COLOURS, Record, Species, State, line_key, species_key

MOST_SPECIES = 30
NUMBERS = {"temperature_k": 0.0, "scale": 0.0, "column_per_cm2": 0.0, "fwhm_km_s": 0.0, "velocity_km_s": None}
"""Numbers of a species, each with the bound that it must exceed."""


def constants(state: State, message: Message, context: Context) -> Change:
    """Set constants (MHz); the last fit is no longer that of the constants."""
    number, species = read_species(state, message)
    record = changed(species, read_constants(message))
    context.predictions.model(record)  # refuses an impossible set
    names = ", ".join(read_constants(message))
    return f"set {names} of {species.name}", {species_key(number): msgspec.structs.replace(record, fit=None)}


def free(state: State, message: Message, context: Context) -> Change:
    """Choose the constants that a refit varies; a constant that the species lacks is added with the value 0."""
    number, species = read_species(state, message)
    names = message.get("free")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError("free: expected a list of names of constants")
    model = context.predictions.model(species)
    chosen = list(dict.fromkeys(model.constants.spelling(name) for name in names))
    added = {name: 0.0 for name in chosen if name not in species.constants}
    record = msgspec.structs.replace(species, constants={**species.constants, **added}, free=tuple(chosen))
    context.predictions.model(record)  # refuses an unknown name
    return f"free {', '.join(chosen) or 'no constant'} of {species.name}", {species_key(number): record}


def species(state: State, message: Message, context: Context) -> Change:
    """Change temperature, dipole, scale, colour, name, visibility or nuclear spins of a species."""
    number, record = read_species(state, message)
    values = _changed_fields(message, record.name)
    if not values and "hyperfine" not in message:
        raise ValueError(
            f"species: expected {', '.join(NUMBERS)}, visible, colour, name, hyperfine or dipole_abc_debye"
        )
    after = msgspec.structs.replace(record, **values)
    if "hyperfine" in message:
        after = with_hyperfine(after, bool(message["hyperfine"]), context.predictions.top)
        refuse_other_labels(state, number, after, context)
        values["hyperfine"] = after.hyperfine
    context.predictions.lines(after)  # refuses an impossible temperature or dipole
    return f"change {', '.join(values)} of {record.name}", {species_key(number): after}


def _changed_fields(message: Message, name: str) -> dict[str, Any]:
    """The fields of a species that a message changes. name: of the species before."""
    values: dict[str, Any] = {
        key: read_number(message, key, above=bound) for key, bound in NUMBERS.items() if key in message
    }
    if "visible" in message:
        values["visible"] = bool(message["visible"])
    if "colour" in message:
        values["colour"] = int(read_number(message, "colour")) % COLOURS
    if "name" in message:
        values["name"] = " ".join(str(message["name"]).split())[:80] or name
    if "dipole_abc_debye" in message:
        dipole = message["dipole_abc_debye"]
        if not isinstance(dipole, list) or len(dipole) != 3:
            raise ValueError(f"dipole_abc_debye: {dipole!r}: expected three numbers")
        key = "dipole_abc_debye"
        values[key] = tuple(read_number({key: component}, key) for component in dipole)
    return values


def refuse_other_labels(state: State, number: int, record: Species, context: Context) -> None:
    """ValueError where assigned lines have other quantum numbers than the changed species."""
    names, lines = context.predictions.model(record).quanta, state.species_lines(number)
    before = context.predictions.model(state.species[number]).quanta
    if lines and names != before:
        count = counted(len(lines), "line is", "lines are")
        raise ValueError(
            f"{record.name}: {count} assigned by {', '.join(before)}, not by {', '.join(names)}; remove such lines first"
        )


def add_species(state: State, message: Message, context: Context) -> Change:
    """Add a species: a name of the library, a file, SMILES:... or constants."""
    source = message.get("source")
    if not isinstance(source, str) or not source.strip() or len(source) > 1000:
        raise ValueError("source: expected a molecule: a name, a file, or SMILES:...")
    if len(state.species) >= MOST_SPECIES:
        raise ValueError(f"a session has at most {MOST_SPECIES} species; remove one first")
    temperature = read_number(message, "temperature_k", above=0, default=300.0)
    number = state.free_number("species")
    record, remark = species_record(
        context.predictions.stored(source.strip()), (number - 1) % COLOURS, temperature, context.predictions.top
    )
    reached = context.predictions.lines(record).lines.jmax
    if remark:
        context.notes.append(remark)
    if reached >= MOST_J:
        context.notes.append(
            f"{record.name}: lines up to J = {MOST_J}; at {temperature:g} K there are weaker lines of higher J"
        )
    return f"add {record.name}", {species_key(number): record}


def remove_species(state: State, message: Message, context: Context) -> Change:
    """Remove a species and its lines."""
    number, record = read_species(state, message)
    changes: dict[str, Record | None] = {line_key(n): None for n in state.species_lines(number)}
    changes[species_key(number)] = None
    series = state.settings.series
    if series is not None and series.species == number:
        changes["settings"] = msgspec.structs.replace(state.settings, series=None)
    return f"remove {record.name}", changes


def refit(state: State, message: Message, context: Context) -> Change:
    """Fit the constants of a species, or of all species with lines; species that share a blend are fitted together."""
    if "species" in message:
        numbers = {read_species(state, message)[0]}
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
