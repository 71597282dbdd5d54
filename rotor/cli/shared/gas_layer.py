"""Options of the gas itself: its vibrational states, and a layer of it with a pressure and a length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotor.cli.shared import inputs
from rotor.cli.shared.options import option

if TYPE_CHECKING:
    from rotor.spectra.request import GasLayer
    from rotor.thermodynamics import VibrationalStates


@dataclass(frozen=True)
class Vibration:
    """Vibrational states of the molecules."""

    vibration: str | None = option(
        None, metavar="LIST", help='Fundamentals (cm⁻¹) whose harmonic factor multiplies Q: "667.4x2,1388,2349".'
    )
    vibrational_states: str | None = option(
        None, metavar="LIST", help="Energies (cm⁻¹) of vibrational states that Q counts, likewise."
    )


@dataclass(frozen=True)
class Layer:
    """A layer of gas, for optical depths."""

    pressure: str | None = option(
        None, metavar="P", help="Pressure of these molecules (bar), for optical depths; with --path."
    )
    path: str | None = option(None, metavar="L", help="Length of the layer of gas (cm); with --pressure.")


def vibrations_of(given: Vibration) -> VibrationalStates | None:
    """The vibrational states that one of the two options gives."""
    fundamentals, states = given.vibration, given.vibrational_states
    if fundamentals is None and states is None:
        return None
    from rotor.thermodynamics import VibrationalStates

    if fundamentals is not None and states is not None:
        raise ValueError("--vibration and --vibrational-states: give one of them, fundamentals or a list of states")
    if fundamentals is not None:
        return inputs.parsed("--vibration", fundamentals, lambda text: VibrationalStates.parse(text, harmonic=True))
    return inputs.parsed("--vibrational-states", str(states), VibrationalStates.parse)


def layer_of(given: Layer) -> GasLayer | None:
    """The layer that both options give together."""
    if given.pressure is None and given.path is None:
        return None
    if given.pressure is None or given.path is None:
        raise ValueError("--pressure and --path: an optical depth needs both, such as --pressure 1mbar --path 1m")
    from rotor.spectra.request import GasLayer

    return GasLayer(inputs.positive("--pressure", given.pressure, "bar"), inputs.positive("--path", given.path, "cm"))
