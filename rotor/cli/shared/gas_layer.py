"""Options of the gas itself: its vibrational states, and a layer of it with a pressure and a length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs

if TYPE_CHECKING:
    from rotor.spectra.lines import Lines
    from rotor.thermo import VibrationalStates

VIBRATION = typer.Option(
    None, metavar="LIST", help='Fundamentals (cm⁻¹) whose harmonic factor multiplies Q: "667.4x2,1388,2349".'
)
VIBRATIONAL_STATES = typer.Option(
    None, metavar="LIST", help="Energies (cm⁻¹) of vibrational states that Q counts, likewise."
)
PRESSURE = typer.Option(None, metavar="P", help="Pressure of these molecules (bar), for optical depths; with --path.")
PATH = typer.Option(None, metavar="L", help="Length of the layer of gas (cm); with --pressure.")


@dataclass(frozen=True)
class Layer:
    """A layer of gas: partial pressure and length."""

    pressure_bar: float
    path_cm: float


def vibrations(fundamentals: str | None, states: str | None) -> VibrationalStates | None:
    """The vibrational states that one of the two options gives."""
    from rotor.thermo import VibrationalStates

    if fundamentals is not None and states is not None:
        raise ValueError("--vibration and --vibrational-states: give one of them, fundamentals or a list of states")
    if fundamentals is not None:
        return inputs.option("--vibration", fundamentals, lambda text: VibrationalStates.parse(text, harmonic=True))
    if states is not None:
        return inputs.option("--vibrational-states", states, VibrationalStates.parse)
    return None


def layer(pressure: str | None, path: str | None) -> Layer | None:
    """The layer that both options give together."""
    if pressure is None and path is None:
        return None
    if pressure is None or path is None:
        raise ValueError("--pressure and --path: an optical depth needs both, such as --pressure 1mbar --path 1m")
    return Layer(inputs.positive("--pressure", pressure, "bar"), inputs.positive("--path", path, "cm"))


def depths(lines: Lines, gas: Layer | None, profile: str, fwhm_mhz: float | None) -> dict[str, Any]:
    """What the report says of the layer, by the keys of docs/command_line.md."""
    if gas is None:
        return {"pressure_bar": None, "path_cm": None, "column_per_cm2": None, "optical_depth": None}
    from rotor.spectra.opacity import column_density_per_cm2, line_optical_depth

    return {
        "pressure_bar": gas.pressure_bar,
        "path_cm": gas.path_cm,
        "column_per_cm2": column_density_per_cm2(gas.pressure_bar, gas.path_cm, lines.temperature_k),
        "optical_depth": line_optical_depth(lines, gas.pressure_bar, gas.path_cm, profile=profile, fwhm_mhz=fwhm_mhz),
    }
