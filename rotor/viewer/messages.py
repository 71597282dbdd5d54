"""Checked values of the messages of a page, and the context of an action."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rotor.assignment.peaks.peak_list import PeakList
from rotor.observed.spectrum import ObservedSpectrum
from rotor.viewer.prediction import Predictions
from rotor.viewer.records import Line, Record, Species, State

Message = Mapping[str, Any]
Change = tuple[str, dict[str, Record | None]]  # label of an action, and the records that it changes, by key
MOST_QUANTA = 10  # quantum numbers of a level


@dataclass(frozen=True)
class Context:
    """Spectrum, predictions and remarks for the user. peaks: a list of peaks in place of a spectrum."""

    spectrum: ObservedSpectrum
    predictions: Predictions
    notes: list[str]
    peaks: PeakList | None = None


Action = Callable[[State, Message, Context], Change]


def read_number(message: Message, key: str, *, above: float | None = None, default: float | None = None) -> float:
    """A finite number of a message; ValueError with its name for any other value."""
    value = message.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{key}: {value!r}: expected a finite number")
    if above is not None and not value > above:
        raise ValueError(f"{key}: {value!r}: expected a number above {above:g}")
    return float(value)


def read_species(state: State, message: Message) -> tuple[int, Species]:
    """The species that a message names by its number."""
    number = message.get("species")
    if not isinstance(number, int) or number not in state.species:
        raise ValueError(
            f"species: {number!r}: expected one of {', '.join(map(str, state.species)) or 'none; add one'}"
        )
    return number, state.species[number]


def read_lines(state: State, message: Message) -> dict[int, Line]:
    """The lines that a message names by their numbers."""
    numbers = message.get("lines")
    lines = state.lines
    if not isinstance(numbers, list) or not numbers:
        raise ValueError("lines: expected a list of numbers of lines")
    missing = [number for number in numbers if not isinstance(number, int) or number not in lines]
    if missing:
        raise ValueError(f"lines: there is no line {missing[0]!r}")
    return {number: lines[number] for number in numbers}


def read_label(values: Any, key: str) -> tuple[int, ...]:
    """The quantum numbers of a level."""
    whole = isinstance(values, list) and all(type(value) is int for value in values)
    if not whole or not 0 < len(values) <= MOST_QUANTA:
        raise ValueError(f"{key}: {values!r}: expected one to ten whole numbers")
    return tuple(values)


def read_constants(message: Message) -> dict[str, float]:
    """The constants of a message by name, MHz."""
    values = message.get("constants")
    if not isinstance(values, dict) or not values:
        raise ValueError("constants: expected a table of names and numbers (MHz)")
    return {str(name): read_number(values, name) for name in values}


def read_comment(message: Message) -> str:
    """The comment of a message, cut at 200 characters."""
    return str(message.get("comment", ""))[:200]
