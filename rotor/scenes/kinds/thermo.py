"""Scenes of thermodynamic functions of rotation."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of
from rotor.scenes.scene import ThermoScene, molecule_of
from rotor.scenes.sections import MoleculeSection, ThermoConditions, ThermoNumerics, ThermoObservables
from rotor.thermodynamics.functions import ThermoFunctions
from rotor.thermodynamics.request import TEMPERATURES_K, ThermoAnswer, ThermoRequest, answer_thermo

_NAMES = {
    "temperatures_k": "conditions.temperature", "pressure_bar": "conditions.pressure",
    "species": "observables.species", "relative_error": "numerics.relative_error",
}  # fmt: skip


def request(scene: ThermoScene, folder: Where = ".") -> ThermoRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top, gas = top_of(molecule, folder), scene.conditions
    temperatures = kind.grid("conditions.temperature", gas.temperature, "K")
    pressure = None if gas.pressure is None else kind.quantity("conditions.pressure", gas.pressure, "bar")
    with kind.fields(**_NAMES):
        return ThermoRequest(
            top,
            TEMPERATURES_K if temperatures is None else temperatures,
            species=scene.observables.species,
            vibrations=kind.vibrations(scene.vibration),
            pressure_bar=pressure,
            relative_error=scene.numerics.relative_error,
            effects=kind.effects_of(top, scene.effects, molecule),
        )


def answer(asked: ThermoRequest, scene: ThermoScene, out: Where, executor: Executor | None) -> ThermoAnswer:
    """The functions.

    Parameters
    ----------
    asked : ThermoRequest
        The scene as the library takes it, checked.
    scene : ThermoScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Not used.

    Returns
    -------
    ThermoAnswer
        Thermodynamic functions by temperature.
    """
    return answer_thermo(asked)


def table(found: ThermoAnswer) -> ThermoFunctions:
    """The functions by temperature."""
    return found.functions


def writers(found: ThermoAnswer, scene: ThermoScene) -> Mapping[str, Writer]:
    """The picture of the heat capacity."""

    def plot(path: Path) -> None:
        from rotor.plots.show import plot as draw

        draw(found.functions, path)

    return {"plot": plot}


def saved(asked: ThermoRequest, molecule: MoleculeSection | None) -> ThermoScene:
    """The scene of a request."""
    assert molecule is not None
    return ThermoScene(
        molecule=molecule,
        effects=kind.saved_effects(asked.effects, asked.top),
        conditions=ThermoConditions(
            temperature=list(asked.temperatures_k),
            pressure=None if asked.pressure_bar is None else f"{asked.pressure_bar!r} bar",
        ),
        observables=ThermoObservables(species=asked.species),
        vibration=kind.saved_vibrations(asked.vibrations),
        numerics=ThermoNumerics(relative_error=asked.relative_error),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
