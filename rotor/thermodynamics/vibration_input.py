"""Input of vibrational states for verbs: fundamentals or a list of states."""

from __future__ import annotations

from typing import Any

from rotor.frozen import dataclass
from rotor.requests.field import declared, part
from rotor.requests.readers import Custom
from rotor.thermodynamics.vibration import VibrationalStates

SCENE_TYPE = str | list[list[float]]


def _reader(harmonic: bool) -> Custom:
    """A reader for energies in cm⁻¹ with degeneracies, as text or as pairs."""

    def read(value: Any) -> VibrationalStates:
        if isinstance(value, VibrationalStates):
            return value
        if isinstance(value, str):
            return VibrationalStates.parse(value, harmonic=harmonic)
        if any(len(pair) != 2 for pair in value):
            raise ValueError("expected pairs of an energy and its degeneracy")
        return VibrationalStates(tuple(pair[0] for pair in value), tuple(int(pair[1]) for pair in value), harmonic)

    def write(states: VibrationalStates) -> list[list[float]]:
        return [[e, float(g)] for e, g in zip(states.energies_cm, states.degeneracies, strict=True)]

    return Custom(read, write, "LIST", SCENE_TYPE)


@dataclass(frozen=True)
class VibrationInput:
    """Vibrational states in the partition function; exactly one of the two fields."""

    fundamentals: VibrationalStates | None = declared(
        None, _reader(True), 'Fundamentals (cm⁻¹) whose harmonic factor multiplies Q: "667.4x2,1388,2349"', "vibration.fundamentals",
        option="--vibration", example="667.4x2,1388,2349",
    )  # fmt: skip
    states: VibrationalStates | None = declared(
        None, _reader(False), "Energies (cm⁻¹) of vibrational states that Q counts, likewise", "vibration.states",
        option="--vibrational-states", example="859,520x2",
    )  # fmt: skip


def vibrations_field() -> Any:
    """The field `vibrations` of a request."""
    why = "give one of them, fundamentals or a list of states"
    return part(VibrationInput, lambda value, _: value.fundamentals or value.states, _split, single=True, why=why)


def _split(states: VibrationalStates | None, _: Any) -> VibrationInput | None:
    if states is None:
        return None
    return VibrationInput(fundamentals=states) if states.harmonic else VibrationInput(states=states)
